"""The history of the item in its calibration report: calibrations, rechecks and drift."""

from collections.abc import Mapping
from typing import Any

from imucal_wizard.core.dates import day_text
from imucal_wizard.core.quantities import quantity, readable
from imucal_wizard.report.calibration_file import Calibration
from imucal_wizard.report.device_history import own_key
from imucal_wizard.report.history_text import as_found_note, drift_cells, drift_notes, verdict_word
from imucal_wizard.sessions.drift import Drift, parameter_drifts
from imucal_wizard.sessions.history import DeviceHistory

THIS_REPORT = "this report"


def item_history(history: DeviceHistory | None, calibration: Calibration) -> dict[str, Any] | None:
    """The item's history; None where it has only the calibration of the report.

    Args:
        history: of the device, or None.
        calibration: of the report.
    """
    if history is None or (len(history.calibrations) < 2 and not history.rechecks):
        return None
    drifts = parameter_drifts(history)
    return {
        "calibrations": _calibration_rows(history, calibration),
        "as_found": as_found_note(history),
        "rechecks": [_recheck_row(one.checked, one.document) for one in history.rechecks],
        "drifts": [
            [sensor, *_drift_row(name, one)]
            for sensor, parameters in drifts.items()
            for name, one in parameters.items()
            if one.per_month is not None
        ],
        "notes": drift_notes(history, drifts, marked=False),
    }


def _calibration_rows(history: DeviceHistory, calibration: Calibration) -> list[list[str]]:
    own = own_key(calibration)
    rows = []
    for one in history.calibrations:
        date, file = day_text(one.measured), one.path.name
        if one.measurement == own:
            file = THIS_REPORT
        for name, sensor in one.sensors.items():
            found, left = (quantity(e, sensor.unit) for e in (sensor.as_found, sensor.error))
            word = verdict_word({name: sensor.grade} if sensor.grade else {})
            rows.append([date, name, found, left, word or "not judged", file])
            date = file = ""
    return rows


def _recheck_row(checked: float, document: Mapping[str, Any]) -> list[str]:
    verdict = str(document.get("verdict") or "").upper()
    return [day_text(checked), verdict, str(document.get("says") or "")]


def _drift_row(name: str, one: Drift) -> list[str]:
    slope, spread, chance = drift_cells(one)
    return [name.replace("_", " "), str(one.dates), slope, spread, readable(one.unit)[1], chance]
