"""The result of a recheck: as text, as JSON, and in the history of the device."""

import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from imucal_wizard.core.dates import iso_date
from imucal_wizard.core.description import Description
from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.limits import drift
from imucal_wizard.core.quantities import (
    finite_or_none,
    number,
    plus_minus,
    quantity,
    readable,
    with_unit,
)
from imucal_wizard.core.records import fields_of
from imucal_wizard.diagnose.recheck import MovedParameter, Recheck, SensorRecheck
from imucal_wizard.report.calibrated_device import CalibratedDevice
from imucal_wizard.report.calibration_file import Calibration
from imucal_wizard.report.text import TEXT_COLUMNS
from imucal_wizard.sessions import SessionInfo

RECHECK_SCHEMA = "imucal-wizard/recheck/1"


def recheck_document(
    found: Recheck, calibration: str, session: SessionInfo | None = None, date: str | None = None
) -> dict[str, Any]:
    """The result for scripts (recheck/1).

    Args:
        found: the recheck.
        calibration: name of the calibration file.
        session: what was measured, so that its verdict is kept once; None for a recording.
        date: of a recording, ISO 8601; None for now.
    """
    about = {}
    if session is not None:
        about, date = {"session": session.path.name}, iso_date(session.created + found.seconds)
    if date is not None:
        about["created"] = date
    return {
        "schema": RECHECK_SCHEMA,
        **about,
        "calibration": calibration,
        "verdict": str(found.verdict),
        "seconds": found.seconds,
        "sensors": {
            name: {
                "verdict": str(one.verdict),
                "error": finite_or_none(one.error),
                "limit": one.limit,
                "floor": finite_or_none(one.floor),
                "unit": one.unit,
                "moved": [fields_of(moved) for moved in one.moved],
                "seen": [fields_of(seen) for seen in one.seen],
                "says": one.says,
            }
            for name, one in found.sensors.items()
        },
        "says": found.says,
    }


def recheck_text(found: Recheck, calibration: Calibration) -> str:
    """The result for a reader.

    Args:
        found: the recheck.
        calibration: whose.
    """
    date = calibration.date[:10]
    lines = [f"{found.verdict.word}  {checked_text(found, calibration)}", ""]
    for name, one in found.sensors.items():
        words = f"{quantity(one.error, one.unit):>12}, limit {quantity(one.limit, one.unit)}"
        lines.append(f"  {one.verdict.word:12} {name:14}{words}")
        lines += [
            f"{'':13}{moved.parameter} {change_text(moved)} since {date}" for moved in one.moved
        ]
        lines += [f"{'':13}{text}" for text in seen_text(one)]
    says = textwrap.fill(found.says, TEXT_COLUMNS, break_on_hyphens=False)
    return "\n".join([*lines, "", says])


def checked_text(found: Recheck, calibration: Calibration) -> str:
    """How long the samples last, and against which calibration they are checked."""
    named = calibration.device_name
    whose = f"of {named}, " if named else "of "
    date = calibration.date[:10]
    return f"{found.seconds:.0f} s of samples, against the calibration {whose}{date}"


def change_text(moved: MovedParameter) -> str:
    """A change with its standard error and in units of it: ``+0.06 ± 0.02 °/s (3.0 σ)``."""
    factor, sign = readable(moved.unit)
    error = None if moved.standard_error is None else factor * moved.standard_error
    text = plus_minus(factor * moved.by, error)
    text = with_unit(text if text.startswith("−") else f"+{text}", sign)
    if not moved.standard_error:
        return text
    return f"{text} ({number(abs(moved.by) / moved.standard_error, 2)} σ)"


def seen_text(one: SensorRecheck) -> list[str]:
    """The least changes seen over the usual drift, in a line; none of a sensor without a row."""
    if not one.seen:
        return []
    bias = max(seen.smallest for seen in one.seen if seen.parameter == "bias")
    scale = max(seen.smallest for seen in one.seen if seen.parameter == "scale")
    text = "every change of scale" if scale <= 0.0 else f"scale from {number(100.0 * scale, 2)} %"
    if scale > 1.0:
        text = "no change of scale"
    least = quantity(bias, one.unit, 2)
    power = f"{100.0 * drift.POWER:.0f} %"
    return [f"seen over usual drift ({power}): bias from {least}, {text}"]


def kept_recheck(
    known: CalibratedDevice,
    found: Recheck,
    document: Mapping[str, object],
    folder: Path,
    checked: Description | None = None,
) -> list[str]:
    """Keep a verdict in the history of its device, if the calibration names one.

    What is not a verdict on that device is not kept: that of another device, and readings in which
    nothing could be judged.

    Args:
        known: the calibration.
        found: the recheck.
        document: of it.
        folder: of the sessions.
        checked: the device that was checked, as far as it is known.

    Returns:
        The text for the user, in lines; a folder that cannot be written takes no verdict away.
    """
    device, named = known.calibration.device, known.calibration.device_name
    if device is None or not named:
        return ["not kept in a history: the calibration names no device"]
    if checked is not None and not known.is_of(checked):
        other = ", ".join(filter(None, (checked.device, checked.serial)))
        return [f"not kept in the history of {named}: another device was checked, {other}"]
    if not found.judged:
        return [f"not kept in the history of {named}: nothing could be judged"]
    from imucal_wizard.sessions.catalogue import Catalogue

    with Catalogue(folder) as catalogue:
        try:
            kept = catalogue.add_recheck({"name": device.name, "serial": device.serial}, document)
        except UsageError as error:
            return [f"not kept in the history of {named}: {error}"]
        return [*catalogue.notes, f"kept in the history of {named}: {kept}"]
