"""Sessions, devices and the history of a device, as text and as JSON documents."""

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from imucal_wizard.core.dates import SECONDS_PER_DAY, date_text, day_text, iso_date
from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.output import sanitise
from imucal_wizard.core.quantities import (
    finite_or_none,
    fixed,
    number,
    plural,
    plus_minus,
    quantity,
    readable,
    with_unit,
)
from imucal_wizard.core.records import fields_of
from imucal_wizard.diagnose.grade import Grade
from imucal_wizard.estimate.result import uncalibrated
from imucal_wizard.guide.kinds import TITLES, StepKind
from imucal_wizard.report.plot import scatter
from imucal_wizard.report.tables import fitting_widths, table_row
from imucal_wizard.report.text import TEXT_COLUMNS
from imucal_wizard.sessions import SUFFIX, SessionInfo
from imucal_wizard.sessions.drift import Drift, parameter_course, parameter_drifts, temperature_note
from imucal_wizard.sessions.history import DeviceHistory, KnownDevice

SESSIONS_SCHEMA = "imucal-wizard/sessions/1"
DEVICES_SCHEMA = "imucal-wizard/devices/1"
MARKED = 0.01
"""Probability by chance below which a drift is marked."""
_SESSION_WIDTHS = (-19, -16, -9, -5, -10, -16)
_WORST_FIRST = (Grade.NOT_USABLE, Grade.DOUBTFUL, Grade.GOOD)


def verdict_word(grades: Mapping[str, str]) -> str:
    """The grade of the worst sensor in capitals; ``saved`` where a sensor has none, else "".

    Args:
        grades: by sensor.
    """
    for grade in _WORST_FIRST:
        if grade in grades.values():
            return grade.word
    return "saved" if grades else ""


def session_state(session: SessionInfo) -> str:
    """The verdict of a session, or why it has none."""
    if session.problem:
        return "in use" if session.busy else "damaged"
    outcome = session.recheck.upper() or verdict_word(session.grades)
    if outcome or not session.finished:
        return outcome or "unfinished"
    return "not kept" if session.step == StepKind.VERDICT else "not saved"


def session_table(sessions: Sequence[SessionInfo], folder: Path) -> str:
    """The sessions as text, one row each, and why some cannot be opened."""
    if not sessions:
        return f"no sessions in {folder}"
    heads = ("SESSION", "DATE", "STEP", "HOLDS", "VERDICT", "DEVICE")
    rows = [table_row(heads, _SESSION_WIDTHS)]
    problems = []
    for one in sessions:
        name = sanitise(one.path.name.removesuffix(SUFFIX))
        step, holds = TITLES.get(one.step, one.step), str(one.holds)
        device = one.description.named or one.source
        cells = (name, date_text(one.created), step, holds, session_state(one), device)
        rows.append(table_row(cells, _SESSION_WIDTHS))
        if one.problem and not one.busy:
            problems.append(f"▲ {one.problem}")
    return "\n".join([*rows, "", *problems, f"{plural(len(sessions), 'session')} in {folder}"])


def sessions_document(
    sessions: Sequence[SessionInfo], folder: Path, notes: Sequence[str]
) -> dict[str, Any]:
    """The sessions as a document."""
    return {
        "schema": SESSIONS_SCHEMA,
        "folder": str(folder),
        "sessions": [
            {
                "path": str(one.path),
                "created": iso_date(one.created),
                "device": one.description.device or None,
                "serial": one.description.serial or None,
                "source": one.source,
                "step": one.step,
                "seconds": finite_or_none(one.seconds),
                "holds": one.holds,
                "finished": one.finished,
                "grades": dict(one.grades),
                "recheck": one.recheck or None,
                "problem": one.problem or None,
            }
            for one in sessions
        ],
        "notes": list(notes),
    }


_DEVICE_WIDTHS = (-22, -16, -12, -8, -8)
_CALIBRATION_WIDTHS = (-11, -13, -10, -10, -10)
_RECHECK_WIDTHS = (-16, -12)


def device_table(devices: Sequence[KnownDevice], folder: Path) -> str:
    """The devices as text, one row each."""
    if not devices:
        return f"no devices in {folder}: name the device when you save a calibration"
    heads = ("DEVICE", "SERIAL", "CALIBRATIONS", "RECHECKS", "SESSIONS")
    rows = [table_row((*heads, "LAST"), _DEVICE_WIDTHS)]
    for one in devices:
        counts = (str(one.calibrations), str(one.rechecks), str(one.sessions))
        cells = (one.name, one.serial, *counts, day_text(one.last))
        rows.append(table_row(cells, _DEVICE_WIDTHS))
    return "\n".join([*rows, "", f"{plural(len(devices), 'device')} in {folder}"])


def devices_document(devices: Sequence[KnownDevice], notes: Sequence[str]) -> dict[str, Any]:
    """The devices as a document."""
    rows = [_device(one) for one in devices]
    return {"schema": DEVICES_SCHEMA, "devices": rows, "notes": list(notes)}


def _device(one: KnownDevice) -> dict[str, Any]:
    return {
        "name": one.name,
        "serial": one.serial or None,
        "chip": one.chip or None,
        "format": one.format or None,
        "calibrations": one.calibrations,
        "rechecks": one.rechecks,
        "sessions": one.sessions,
        "last": iso_date(one.last),
    }


def history_text(history: DeviceHistory, columns: int = TEXT_COLUMNS) -> str:
    """The history of a device: as found, as left, drift of each parameter, rechecks, sessions.

    Args:
        history: of the device.
        columns: at which sentences are wrapped.
    """
    device = history.device
    about = [device.name, f"serial {device.serial}" if device.serial else "", device.chip]
    blocks = ["   ".join(one for one in (*about, device.format) if one)]
    if history.calibrations:
        blocks += [_calibration_rows(history), _parameter_rows(history)]
    if history.rechecks:
        rows = [table_row(("RECHECK", "VERDICT"), _RECHECK_WIDTHS)]
        indent = sum(map(abs, _RECHECK_WIDTHS)) + len(_RECHECK_WIDTHS)
        for one in history.rechecks:
            says = str(one.document.get("says") or "").splitlines()
            text, room = says[0] if says else "", columns - indent
            first, *others = textwrap.wrap(text, room, break_on_hyphens=False) or [""]
            cells = (date_text(one.checked), one.verdict.upper(), first)
            rows.append(table_row(cells, _RECHECK_WIDTHS))
            rows += [f"{'':{indent}}{text}" for text in others]
        blocks.append("\n".join(rows))
    if history.sessions:
        blocks.append(session_table(history.sessions[::-1], history.sessions[0].path.parent))
    return "\n\n".join(blocks)


def _calibration_rows(history: DeviceHistory) -> str:
    heads = ("CALIBRATED", "SENSOR", "AS FOUND", "AS LEFT", "VERDICT")
    rows = [table_row((*heads, "TEMPERATURE"), _CALIBRATION_WIDTHS)]
    for one in history.calibrations:
        date, warm = day_text(one.measured), ""
        if one.temperature is not None:
            warm = f"{' to '.join(dict.fromkeys(fixed(t, 0) for t in one.temperature))} °C"
        for name, sensor in one.sensors.items():
            errors = (quantity(e, sensor.unit) for e in (sensor.as_found, sensor.error))
            verdict = verdict_word({name: sensor.grade} if sensor.grade else {})
            rows.append(table_row((date, name, *errors, verdict, warm), _CALIBRATION_WIDTHS))
            date = warm = ""
        about = "  ".join(text for text in (one.place, one.operator, one.note) if text)
        if about:
            rows.append(f"{'':12}{about}")
    return "\n".join([*rows, *textwrap.wrap(as_found_note(history), TEXT_COLUMNS - 2)])


def as_found_note(history: DeviceHistory) -> str:
    """What the errors as found refer to."""
    ways = {
        uncalibrated(sensor.bias_unit)  # the same for all units but counts
        for one in history.calibrations
        for sensor in one.sensors.values()
        if sensor.as_found is not None and not sensor.as_found_by
    }
    first = " or ".join(sorted(ways, reverse=True))
    by = f"; of the first, with {first}" if first else ""
    return f"As found: error of the readings of that date with the calibration before it{by}"


def _parameter_rows(history: DeviceHistory) -> str:
    found = parameter_drifts(history)
    table = [("PARAMETER", "NEWEST", "DRIFT PER MONTH", "SPREAD", "P")]
    for sensor, parameters in found.items():
        table.append((sensor, "", "", "", ""))
        for name, one in parameters.items():
            factor, sign = readable(one.unit)
            newest = plus_minus(one.newest * factor, _times(one.newest_error, factor))
            mark = "▸" if one.p is not None and one.p < MARKED else " "
            label = f"{mark} {name}{f' [{sign}]' if sign else ''}"
            table.append((label, newest, *drift_cells(one)))
    widths = fitting_widths(table, texts=len(table[0]))
    rows = [table_row(cells, widths) for cells in table]
    return "\n".join([*rows, *drift_notes(history, found)])


def _times(error: float | None, factor: float) -> float | None:
    return None if error is None else error * factor


def drift_cells(one: Drift) -> tuple[str, str, str]:
    """Drift per month with its standard error, spread and p, in the readable unit."""
    factor = readable(one.unit)[0]
    slope = "–"
    if one.per_month is not None:
        slope = plus_minus(one.per_month * factor, _times(one.standard_error, factor))
    spread = "–" if one.spread is None else number(one.spread * factor, 2)
    return slope, spread, "–" if one.p is None else number(one.p, 2)


def drift_notes(
    history: DeviceHistory, found: Mapping[str, Mapping[str, Drift]], *, marked: bool = True
) -> tuple[str, ...]:
    """What to know of the drifts, in sentences.

    Args:
        history: of the device.
        found: its drifts.
        marked: with the meaning of the marks of a table.
    """
    each = [one for parameters in found.values() for one in parameters.values()]
    dates, notes = max((one.dates for one in each), default=0), []
    if any(one.per_month is not None for one in each):
        if dates == 2:
            notes.append("two dates only: the difference may be turn-on spread as well as drift")
        elif marked:
            notes.append(f"▸ p < {MARKED:g}; spread: from date to date, beyond the standard errors")
    elif dates:
        notes.append("no drift yet: a drift needs calibrations on two days")
    warm = temperature_note(history)
    return (*notes, warm) if warm else tuple(notes)


def parameter_named(history: DeviceHistory, name: str) -> tuple[str, str]:
    """Sensor and name of a parameter: ``gyroscope/bias_x``, or ``bias_x`` of the first sensor.

    Raises:
        UsageError: the calibrations of this device have no such parameter.
    """
    known = [
        (sensor, parameter)
        for one in reversed(history.calibrations)
        for sensor, record in one.sensors.items()
        for parameter in record.parameters
    ]
    for sensor, parameter in known:
        if name in (parameter, f"{sensor}/{parameter}"):
            return sensor, parameter
    names = ", ".join(dict.fromkeys(f"{sensor}/{parameter}" for sensor, parameter in known))
    raise UsageError(f"{history.device.name} has no parameter {name!r}; known: {names or 'none'}")


def course_plot(
    history: DeviceHistory, sensor: str, parameter: str, width: int, height: int, over: str = "date"
) -> list[str]:
    """A parameter over dates or temperature, with its standard errors, as rows of text."""
    course = parameter_course(history, sensor, parameter)
    if over == "temperature":
        course = [row for row in course if row[2] is not None]
    title = f"{sensor} {parameter}"
    if not course:
        return [title, f"no calibration determines it at a known {over}"]
    factor, sign = readable(course[-1][1].unit)
    values = np.array([one.value for _, one, _ in course]) * factor
    errors = np.array([one.standard_error or 0.0 for _, one, _ in course]) * factor
    middle = float(values.mean())
    if over == "temperature":
        x, label = np.array([warm for _, _, warm in course], np.float64), "°C"
    else:
        x = np.array([time for time, _, _ in course])
        x, label = (x - x[0]) / SECONDS_PER_DAY, f"days since {day_text(course[0][0])}"
    mean = with_unit(number(middle, 5), sign)
    head = f"{title} less {mean}{f', in {sign}' if sign else ''}; │ one standard error"
    size = width, height - 1
    return [head, *scatter(x, values - middle, *size, x_label=label, error=errors, band=False)]


def history_document(history: DeviceHistory, notes: Sequence[str]) -> dict[str, Any]:
    """The history of a device as a document."""
    found = parameter_drifts(history)
    return {
        "schema": DEVICES_SCHEMA,
        "device": _device(history.device),
        "calibrations": [
            {
                "path": str(one.path),
                "measured": iso_date(one.measured),
                "saved": iso_date(one.saved),
                "session": one.session or None,
                "temperature": one.temperature,
                "place": one.place or None,
                "operator": one.operator or None,
                "note": one.note or None,
                "sensors": {
                    name: {
                        "model": sensor.model,
                        "grade": sensor.grade or None,
                        "verdict": sensor.verdict or None,
                        "as_found": sensor.as_found,
                        "as_found_by": sensor.as_found_by or None,
                        "as_left": sensor.error,
                        "unit": sensor.unit,
                        "parameters": {
                            parameter: {
                                "value": value.value,
                                "standard_error": value.standard_error,
                                "unit": value.unit,
                                "determined": value.determined,
                            }
                            for parameter, value in sensor.parameters.items()
                        },
                    }
                    for name, sensor in one.sensors.items()
                },
            }
            for one in history.calibrations
        ],
        "drift": {
            sensor: {name: fields_of(one) for name, one in parameters.items()}
            for sensor, parameters in found.items()
        },
        "rechecks": [one.document for one in history.rechecks],
        "sessions": [str(one.path) for one in history.sessions],
        "notes": [*drift_notes(history, found), *notes],
    }
