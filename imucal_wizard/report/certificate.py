"""The calibration report: one HTML file for a quality manager, that prints on A4.

It says what reports after ISO/IEC 17025 say (7.8.2 and 7.8.4), without claiming accreditation.
Expanded uncertainties are Student's quantile times the standard errors of the calibration file
(JCGM 100, annex G). All but the history of the item comes from that file, so that a report can be
made again years later. The prose stands in the template beside this file.
"""

import hashlib
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from imucal_wizard.core import VERSION
from imucal_wizard.core.dates import date_text, seconds_of
from imucal_wizard.core.description import Location
from imucal_wizard.core.gravity import GRAVITY_ANOMALY, NORMAL_GRAVITY_SOURCE
from imucal_wizard.core.quantities import (
    as_sentence,
    fixed,
    limits_text,
    listed,
    number,
    plural,
    quantity,
    readable,
    true_minus,
    unit_sign,
    value_and_error,
)
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.diagnose.grade import Grade
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.distributions import quantile
from imucal_wizard.estimate.methods import methods_of
from imucal_wizard.estimate.result import beyond_limit, uncalibrated
from imucal_wizard.model.effect import Effect
from imucal_wizard.report.calibration_file import Calibration, SavedRung, Sensor, Value
from imucal_wizard.report.certificate_history import item_history
from imucal_wizard.report.figures import Figure, allan_figure, residual_figure
from imucal_wizard.report.noise_report import (
    LONGEST_SHARE,
    MAX_SHOWN_ERROR,
    coefficient_rows,
    usual_units,
)
from imucal_wizard.report.proof import Proof, own
from imucal_wizard.report.text import correction_formula, why_nominal
from imucal_wizard.sessions.history import DeviceHistory

REPORT_MARK = b'<meta name="generator" content="imucal-wizard report">'
"""In the first 4 KiB of every report."""
REPORT_SCHEMA = "imucal-wizard/report/1"
COVERAGE = 0.95
USUAL_FACTOR = 2.0
"""Coverage factor where the file gives no degrees of freedom."""
CORRELATED = 0.7
"""Correlation coefficients from here on are listed: those parameters must not be used as
independent."""
MAX_CORRELATIONS = 8
MAX_DEGREES = 1000
"""Degrees of freedom beyond which the coverage factor is the normal one within 0.1 %."""
SAME_GRAVITY = 1e-7
"""Relative difference of two gravities from the same place: the digits in which it is stated."""
_NOT_STATED = "not stated"
_ANOMALIES = f"Gravity anomalies are within {fixed(GRAVITY_ANOMALY, 3)} m/s² nearly everywhere"


def certificate(
    calibration: Calibration,
    path: Path,
    *,
    issued: str,
    location: Location | None = None,
    noise: Mapping[str, Any] | None = None,
    history: DeviceHistory | None = None,
    effects: Sequence[Effect] = (),
) -> str:
    """The report as HTML.

    Args:
        calibration: what the file holds.
        path: the file, for its name and fingerprint.
        issued: date of issue, ISO 8601.
        location: of the measurement, to compare gravity with; the one in the file where left out.
        noise: a document of ``noise``, or None.
        history: of the device, or None.
        effects: the user's own that the calibration may have.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("imucal_wizard", "report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
    )
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    sensors = [_sensor(name, calibration) for name in calibration.sensors]
    figures = _figures(calibration, effects)
    for one in sensors:
        one["figure"] = figures.get(one["name"])
    place = location or _location(calibration)
    return environment.get_template("certificate.html.jinja").render(
        number=digest[:12].upper(),
        issued=_date(issued),
        item=_item(calibration),
        measurement=_measurement(calibration),
        gravity_note=_gravity_note(calibration, place),
        sensors=sensors,
        summary=[_summary_row(name, one) for name, one in calibration.sensors.items()],
        summary_notes=_summary_notes(calibration),
        lacking=[name for name in calibration.sensors if name not in figures],
        noise=[] if noise is None else _noise(noise),
        history=item_history(history, calibration),
        **_method(calibration),
        gravity_share=None if place is None else number(1e6 * GRAVITY_ANOMALY / place.gravity, 2),
        warnings=calibration.warnings,
        identification=_identification(calibration, path, digest),
        operator=calibration.operator or "",
    )


def report_document(calibration: Calibration, path: Path) -> dict[str, Any]:
    """The document of ``report`` for scripts (report/1).

    Args:
        calibration: what was reported.
        path: the report.
    """
    sensors = {
        name: {
            "grade": one.grade,
            "verdict": one.verdict,
            "as_found": one.error_as_found,
            "as_left": one.error_as_left,
            "unit": one.unit,
            "expanded_uncertainty": {
                parameter: expanded(value, one) for parameter, value in one.parameters.items()
            },
        }
        for name, one in calibration.sensors.items()
    }
    return {"schema": REPORT_SCHEMA, "path": str(path), "sensors": sensors}


def expanded(value: Value, sensor: Sensor) -> float | None:
    """Expanded uncertainty of a parameter for a coverage of 95 %, in its unit.

    None where the file has no standard error, or the data do not determine the parameter.
    """
    error = value.standard_error
    if error is None or not value.carried or not math.isfinite(error):
        return None
    return _coverage_factor(sensor) * error


def _coverage_factor(sensor: Sensor) -> float:
    """Factor k for a coverage of 95 %: Student's quantile (JCGM 100, table G.2)."""
    freedom = sensor.degrees_of_freedom
    return quantile(COVERAGE, min(freedom, MAX_DEGREES)) if freedom else USUAL_FACTOR


def _date(text: str | None) -> str:
    seconds = seconds_of(text) if text else None
    return _NOT_STATED if seconds is None else date_text(seconds)


def _item(calibration: Calibration) -> list[tuple[str, str]]:
    device = calibration.device
    statements = {
        "Device": device and device.name,
        "Serial number": device and device.serial,
        "Kind of chip": device and device.chip,
        "Format of the readings": device and device.format,
    }
    ranges = device.ranges if device else {}
    return [
        *((name, text or _NOT_STATED) for name, text in statements.items()),
        *((f"Readings of the {name}", text) for name, text in ranges.items()),
        ("Sensors", ", ".join(calibration.sensors)),
    ]


def _location(calibration: Calibration) -> Location | None:
    place = calibration.place
    try:
        found = Location(float(place["latitude"]), float(place.get("height", "0")))
    except (KeyError, ValueError):
        return None
    return found if abs(found.latitude) <= 90.0 and math.isfinite(found.height) else None


def _measurement(calibration: Calibration) -> list[tuple[str, str]]:
    warm = calibration.temperature
    place = _location(calibration)  # not one that was stated later, to compare gravity with
    temperature = (
        "not measured"
        if warm is None
        else f"{fixed(warm[0], 1)} to {fixed(warm[1], 1)} °C, by the thermometer of the device"
    )
    when = _date(calibration.measured)
    if calibration.measured is None:
        when = f"{_NOT_STATED}; the result was saved {_date(calibration.created)}"
    sources = {
        "standard": "standard gravity (CGPM 1901), not that of the place",
        "given": "stated by the operator",
        "normal": f"from {place}" if place else "from latitude and height",
    }
    source = sources.get(calibration.place.get("gravity", ""), "source not stated")
    return [
        ("Date of measurement", when),
        ("Place", calibration.place.get("name") or _NOT_STATED),
        ("Measured by", calibration.operator or _NOT_STATED),
        ("Temperature", temperature),
        ("Other conditions", "not measured"),
        ("Gravity used", f"{fixed(calibration.gravity.value, 6)} m/s²: {source}"),
        ("Source of the readings", calibration.source),
        ("Note", calibration.note or "none"),
    ]


def _gravity_note(calibration: Calibration, place: Location | None) -> str:
    """How the gravity used compares with that of the place; "" where nothing is to be said."""
    used = calibration.gravity.value
    if place is None:
        note = (
            "Local gravity differs from standard gravity by up to 0.5 %; it adds the same relative "
            "error to all sensitivities of the accelerometer."
        )
        return note if used == STANDARD_GRAVITY else ""
    share = used / place.gravity - 1.0
    if abs(share) < SAME_GRAVITY:
        return f"Formula: {NORMAL_GRAVITY_SOURCE}. {_ANOMALIES}."
    adds = ", which adds to all sensitivities of the accelerometer"
    return (
        f"Normal gravity at {place} is {fixed(place.gravity, 6)} m/s² ({NORMAL_GRAVITY_SOURCE}). "
        f"{_ANOMALIES}. The gravity used differs from it by {number(1e6 * share, 2)} × 10⁻⁶"
        f"{adds if abs(share * used) > GRAVITY_ANOMALY else ''}."
    )


def _summary_row(name: str, sensor: Sensor) -> list[str]:
    floor = sensor.floor_fitted if sensor.rms_held_out is None else sensor.floor
    interval = sensor.held_out_interval
    return [
        name,
        quantity(sensor.error_as_found, sensor.unit),
        quantity(sensor.error_as_left, sensor.unit),
        limits_text(interval, sensor.unit) or "–",
        quantity(floor, sensor.unit),
        quantity(sensor.could_be, sensor.unit),
        quantity(sensor.limit, sensor.unit, 2),
    ]


def _summary_notes(calibration: Calibration) -> list[str]:
    """What the errors as found and as left refer to, by sensor."""
    notes: dict[str, list[str]] = {}
    for name, sensor in calibration.sensors.items():
        before = sensor.as_found
        by = uncalibrated(sensor.bias_unit)
        if before is not None:
            by = f"the calibration {before.by} of {_date(before.created)}"
        notes.setdefault(f"As found: these readings corrected by {by}", []).append(name)
        if sensor.rms_held_out is None:
            notes.setdefault("As left: on the data fitted, none held out", []).append(name)
    return [f"{text} ({', '.join(names)})." for text, names in notes.items()]


def _sensor(name: str, calibration: Calibration) -> dict[str, Any]:
    """What the report says of one sensor."""
    sensor = calibration[name]
    freedom, factor = sensor.degrees_of_freedom, _coverage_factor(sensor)
    degrees = "normal distribution: the file states no degrees of freedom"
    if freedom:
        count = plural(min(freedom, MAX_DEGREES), "degree")
        more = "more than " if freedom > MAX_DEGREES else ""
        degrees = f"Student's t, {more}{count} of freedom"
    nominal = why_nominal(name, sensor.method)
    rows = [_parameter_row(p, v, sensor, nominal) for p, v in sensor.parameters.items()]
    if not any(row[-1] for row in rows):
        rows = [row[:-1] for row in rows]
    missing = ", ".join(sensor.not_determined)
    repeats = sensor.repeatability
    extra = [
        ("Error on new poses", quantity(sensor.rms_validation, sensor.unit))
        if sensor.rms_validation is not None
        else None,
        (
            "Repeatability of a pose",
            f"{quantity(repeats, sensor.repeatability_unit or sensor.unit)} rms"
            if repeats is not None
            else "not measured",
        ),
        ("Method of the fit", f"{sensor.method}; {', '.join(sensor.model)}"),
    ]
    return {
        "name": name,
        "title": name.capitalize(),
        **_graded(sensor),
        "says": [calibration.says[name]] if calibration.says.get(name) else [],
        "parameters": rows,
        "remark": ["remark"] * (len(rows[0]) > 4) if rows else [],
        "uncertainty": f"U: expanded uncertainty, coverage factor k = {fixed(factor, 2)} for a "
        f"coverage probability of about 95 % ({degrees}).",
        "correlated": _correlations(sensor),
        "not_determined": f"Nominal, without a stated uncertainty: {missing} ({nominal})."
        if missing
        else "These data determine all parameters of the model.",
        "formula": correction_formula([one.term for one in sensor.effects])
        + f"; readings in {unit_sign(sensor.bias_unit)}, frame: "
        + {"own": "the sensor's own", "accelerometer": "that of the accelerometer"}.get(
            sensor.frame, sensor.frame
        ),
        "matrix": [
            [axis, *(true_minus(f"{value:.7g}") for value in row)]
            for axis, row in zip("xyz", sensor.matrix, strict=True)
        ],
        "bias": "b = ("
        + ", ".join(true_minus(f"{value:.7g}") for value in sensor.bias)
        + f") {unit_sign(sensor.bias_unit)}",
        "effects": [
            (
                one.term,
                one.equation or "–",
                "–"
                if one.reference_temperature is None
                else f"{fixed(one.reference_temperature, 1)} °C",
            )
            for one in sensor.effects
        ],
        "ladder": [_rung_row(one, sensor) for one in calibration.ladders.get(name, ())],
        "extra": [one for one in extra if one is not None],
        "warnings": sensor.warnings,
    }


def _graded(sensor: Sensor) -> dict[str, str]:
    """Grade and statement of conformity."""
    if sensor.grade not in list(Grade):
        return {"grade": "NOT JUDGED", "grade_class": "", "why": "The file states no verdict."}
    grade = Grade(sensor.grade)
    words = "The verdict on the model is not stated."
    if sensor.verdict:
        words = f"The verdict on the model is “{sensor.verdict}”."
    if sensor.limit is not None:
        limits = sensor.error_as_left, sensor.could_be, sensor.limit, sensor.unit
        beyond = beyond_limit(*limits)
        words += f" {as_sentence(beyond or 'the error is within the limit of use')}"
        if grade is Grade.DOUBTFUL and sensor.verdict == Verdict.COMPLETE and not beyond:
            words += " The remarks say why it is doubtful all the same."
    return {"grade": grade.word, "grade_class": str(grade), "why": words}


def _parameter_row(name: str, value: Value, sensor: Sensor, nominal: str) -> list[str]:
    factor, sign = readable(value.unit)
    uncertainty = expanded(value, sensor)
    label = name.replace("_", " ")
    if uncertainty is None or uncertainty <= 0.0:
        remark = f"nominal: {nominal}" if not value.carried else "no uncertainty known"
        return [label, true_minus(f"{value.value * factor:.7g}"), "–", sign, remark]
    texts = value_and_error(value.value * factor, uncertainty * factor)
    return [label, *texts, sign, ""]


def _correlations(sensor: Sensor) -> str:
    """The strongest correlations, in a sentence; "" without any."""
    if sensor.parameter_covariance is None:
        return ""
    covariance, names = np.array(sensor.parameter_covariance), list(sensor.parameters)
    scale = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale[scale == 0.0] = np.inf
    found = covariance / np.outer(scale, scale)
    pairs = [
        (abs(found[i, j]), f"{names[i]}, {names[j]}: {fixed(float(found[i, j]), 2)}")
        for i in range(len(names))
        for j in range(i)
        if abs(found[i, j]) >= CORRELATED
    ]
    texts = [text.replace("_", " ") for _, text in sorted(pairs, reverse=True)]
    more = f" and {len(texts) - MAX_CORRELATIONS} more" if len(texts) > MAX_CORRELATIONS else ""
    if not texts:
        return ""
    return f"Correlation coefficients: {'; '.join(texts[:MAX_CORRELATIONS])}{more}."


def _rung_row(one: SavedRung, sensor: Sensor) -> list[str]:
    remark = {True: "confirmed by data held out", False: "not confirmed by data held out"}
    return [
        f"+ {one.added}" if one.added else ", ".join(one.model) or "nothing",
        *(quantity(e, sensor.unit) for e in (one.rms_fitted, one.rms_held_out, one.floor)),
        remark[one.confirmed] if one.confirmed is not None else "",
    ]


def _figures(calibration: Calibration, effects: Sequence[Effect]) -> dict[str, Figure]:
    """Errors of what the file has measured, by sensor."""
    proof = Proof(calibration, effects)
    residuals = proof.residuals(own(calibration, effects), frame=False)
    holds = calibration.hold_means
    rotations = calibration.rotation_increments
    steps = [one for one in calibration.table_means if one.angle]
    about = {
        "accelerometer": (
            "Error of the magnitude of gravity in each hold",
            [f"hold {k + 1}{f' ({h.pose})' if h.pose else ''}" for k, h in enumerate(holds)],
            "number of the hold",
        ),
        "gyroscope": (
            "Error of the angle of each step of the rate table",
            [f"step {k + 1}" for k in range(len(steps))],
            "number of the step",
        )
        if steps
        else (
            "Angle by which each rotation does not close against gravity",
            [
                f"rotation {k + 1}{f' about {r.axis}' if r.axis else ''}"
                for k, r in enumerate(rotations)
            ],
            "number of the rotation",
        ),
        "magnetometer": (
            "Error of the magnitude of the field in each group of readings",
            [f"group {k + 1}" for k in range(len(calibration.field_means))],
            "number of the group",
        ),
    }
    found = {}
    for name, values in residuals.items():
        sensor = calibration[name]
        factor, sign = readable(sensor.unit)
        title, names, label = about[name]
        limit = None if sensor.limit is None else sensor.limit * factor
        found[name] = residual_figure(
            f"residuals-{name}", title, values * factor, names, sign, limit, label
        )
    return found


def _noise(document: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Coefficients and Allan deviation of each sensor."""
    found = []
    for name, sensor in document["sensors"].items():
        factor, unit = usual_units(sensor["units"]["deviation"]).deviation
        taus = np.array(sensor["tau"])
        curves = {}
        for axis, values in sensor["deviation"].items():
            deviation = np.array(values, np.float64)
            errors = sensor.get("deviation_standard_error", {}).get(axis)
            if errors is not None:
                error = np.array([math.nan if e is None else e for e in errors])
                known = (error > 0.0) & (error < MAX_SHOWN_ERROR * deviation)
                deviation = np.where(known, deviation, np.nan)
            if (deviation > 0.0).any():
                curves[axis] = deviation * factor
        title = f"Allan deviation of the {name}"
        longest = LONGEST_SHARE * sensor.get("seconds_at_rest", math.inf)
        label = f"allan-{name}"
        figure = allan_figure(label, title, taus, curves, unit, longest) if curves else None
        rows = coefficient_rows(sensor) if sensor["axes"] else []
        found.append({"title": name.capitalize(), "rows": rows, "figure": figure})
    return found


@dataclass(frozen=True)
class _Basis:
    """By what a sensor was calibrated, what its scale rests on, and what its error is."""

    references: list[str]
    traced: list[str]
    error: str


def _method(calibration: Calibration) -> dict[str, Any]:
    """The method as far as the file shows it, which decides what sentences are printed."""
    sensors = calibration.sensors
    published = {n: one.method for n, one in sensors.items() if one.method in methods_of(n)}
    basis = {name: _BASIS[name](one) for name, one in sensors.items()}
    references = {name: " and ".join(one.references) for name, one in basis.items()}
    return {
        "measured": _measured(calibration),
        "references": {name: text for name, text in references.items() if text},
        "traced": listed(
            list(dict.fromkeys(text for one in basis.values() for text in one.traced))
        ),
        "published": published,
        "fitted": listed([f"the {name}" for name in sensors if name not in published]),
        "errors": {name: one.error for name, one in basis.items()},
        "held_out": any(one.rms_held_out is not None for one in sensors.values()),
        "could_be": any(one.could_be is not None for one in sensors.values()),
        "verdicts": any(one.verdict for one in sensors.values()),
        "grades": any(one.grade in list(Grade) for one in sensors.values()),
        "slow_noise": {
            name: one.slow_noise_measured
            for name, one in sensors.items()
            if one.slow_noise_measured is not None
        },
    }


def _by_gravity(sensor: Sensor) -> _Basis:
    del sensor  # all methods of an accelerometer have one reference
    reference = "The magnitude of gravity at the place"
    return _Basis([reference], ["the stated gravity"], "that of the magnitude of gravity")


def _by_field(sensor: Sensor) -> _Basis:
    """The size of a field that nobody has stated is among the parameters."""
    error = "that of the magnitude of the field"
    if "field" in sensor.parameters or not sensor.parameters:
        return _Basis(["The magnitude of the field, the same in all orientations,"], [], error)
    stated = "the stated magnitude of the field"
    return _Basis([stated.capitalize()], [stated], error)


def _by_rotations(sensor: Sensor) -> _Basis:
    """Of a published method only the error is known."""
    error = "the angle by which a rotation does not close against gravity"
    if sensor.unit == "rad/s":
        error = "that of the rates at rest"
    elif sensor.frame == "own":
        error = "that of the angle of each step of the rate table"
    if sensor.method in methods_of("gyroscope"):
        return _Basis([], ["the clock"], error)
    found, traced = [], ["the clock"]
    if sensor.frame != "own":
        found.append("the direction of gravity before and after a rotation")
    if sensor.method.endswith("+ field"):
        found.append("that of the Earth’s field")
    if sensor.method.endswith("table"):
        found.append("the stated rate or angle of each step of the rate table")
        traced.insert(0, "the stated rates or angles of the rate table")
    return _Basis([found[0][0].upper() + found[0][1:], *found[1:]], traced, error)


_BASIS = {"accelerometer": _by_gravity, "gyroscope": _by_rotations, "magnetometer": _by_field}


def _measured(calibration: Calibration) -> str:
    """What was measured, counted."""
    counts = {
        "orientations at rest": calibration.holds,
        "rotations between them": calibration.rotations if calibration.holds else 0,
        "steps or turns of a rate table": sum(bool(one.angle) for one in calibration.table_means),
        "means of readings of the magnetic field kept in the file": len(calibration.field_means),
    }
    counted = [f"{count} {what}" for what, count in counts.items() if count]
    return ", ".join(counted) or "the recording named above"


def _identification(calibration: Calibration, path: Path, digest: str) -> list[tuple[str, str]]:
    return [
        ("Calibration file", path.name),
        ("Its SHA-256", digest),
        ("Session", calibration.session or calibration.source),
        ("Fingerprint of the session", calibration.fingerprint or "not kept in this file"),
        ("Calibrated by", f"imucal-wizard {calibration.program}, {_date(calibration.created)}"),
        ("Report made by", f"imucal-wizard {VERSION}"),
    ]
