"""The JSON documents of ``fit`` (fit/1) and ``compare`` (compare/1)."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from imucal_wizard.core.quantities import finite_or_none
from imucal_wizard.core.records import fields_of
from imucal_wizard.estimate.comparison import MethodRow
from imucal_wizard.estimate.magnetometer.fit import MagnetometerFit
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.estimate.second_stage.found import SecondStage
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.report.calibration_file import Sensor
from imucal_wizard.report.calibration_record import sensor_record

FIT_SCHEMA = "imucal-wizard/fit/1"
COMPARE_SCHEMA = "imucal-wizard/compare/1"


def fit_document(
    report: FitReport, sensors: Mapping[str, Sensor] | None = None, says: Sequence[str] = ()
) -> dict[str, Any]:
    """A report as a document of lists and numbers.

    The angle of a rotation is null if no gyroscope was fitted.

    Args:
        report: the fit.
        sensors: records of the sensors with their verdicts; without verdicts when left out.
        says: the verdicts in sentences.
    """
    angles = report.angles or (None,) * len(report.rotations)
    return {
        "schema": FIT_SCHEMA,
        "rate": report.rates,
        "gravity": report.gravity,
        "warnings": list(report.notes(judged=bool(says))),
        "verdict": list(says),
        "holds": [_hold(hold, report) for hold in report.holds],
        "rotations": [
            {
                "start": rotation.before.end,
                "end": rotation.after.start,
                "axis": rotation.axis,
                "angle": angle,
                "problem": rotation.problem,
            }
            for rotation, angle in zip(report.rotations, angles, strict=True)
        ],
        **_table(report),
        "sensors": sensors or {name: sensor_record(fit) for name, fit in report.sensors.items()},
        **({} if report.magnetic is None else {"magnetometer": _magnetic(report.magnetic)}),
        **(
            {}
            if report.second_stage is None
            else {"second_stage": _second_stage_document(report.second_stage)}
        ),
        "comparison": [fields_of(row) for row in report.comparison],
    }


def _magnetic(found: MagnetometerFit) -> dict[str, Any]:
    """Figures of the magnetometer alone: field, N's figure of merit, what was left out."""
    return {
        "field": found.magnitude,
        "unit": found.fit.unit,
        "relative_error": found.relative_error,
        "relative_error_held_out": found.relative_error_held_out,
        "samples": int(found.kept.sum()),
        "left_out": [
            {
                "start": run.start,
                "end": run.end,
                "samples": run.samples,
                "size": run.size,
                "single": run.single,
            }
            for run in found.left_out
        ],
        "covered": int((found.filled > 0).sum()),
        "directions": found.filled.astype(int).tolist(),
    }


def _table(report: FitReport) -> dict[str, Any]:
    """The steps of a rate table, where one turned the device."""
    fits = [fit for fit in report.sensors.values() if fit.of_table]
    if not fits:
        return {}
    from imucal_wizard.report.table_document import table_document

    return {"rate_table": table_document(fits[0])}


def _hold(hold: Hold, report: FitReport) -> dict[str, Any]:
    accelerometer = report.sensors["accelerometer"]
    vector = accelerometer.matrix @ (hold.accelerometer - accelerometer.bias)
    direction = vector / np.linalg.norm(vector)
    return {
        "start": hold.start,
        "end": hold.end,
        "direction": direction.tolist(),
        "pose": hold.pose,
        "mean_accelerometer": hold.accelerometer.tolist(),
        "mean_gyroscope": None if hold.gyroscope is None else hold.gyroscope.tolist(),
        "temperature": hold.temperature,
        "hand_held": hold.hand_held,
    }


def _second_stage_document(stage: SecondStage) -> dict[str, Any]:
    """The second stage, in rad and s."""
    alignment, added, headings = stage.alignment, stage.added, stage.headings
    return {
        "rotation": alignment.rotation.tolist(),
        "axes": alignment.axes or None,
        "rotation_covariance": alignment.covariance.tolist(),
        "dip": alignment.dip,
        "dip_standard_error": alignment.dip_error,
        "dip_rms": alignment.rms,
        "positions": int(alignment.used.sum()),
        "clock_offset": None
        if stage.clock is None
        else {"seconds": stage.clock.seconds, "standard_error": stage.clock.standard_error},
        "gyroscope": None if added is None else fields_of(added),
        "headings": [
            {
                "hold": int(hold),
                "before": finite_or_none(b),
                "after": finite_or_none(a),
                "error": finite_or_none(e),
            }
            for hold, b, a, e in zip(
                headings.hold, headings.before, headings.after, headings.error, strict=True
            )
        ],
        "notes": list(stage.notes),
    }


def methods_document(report: FitReport, rows: Sequence[MethodRow]) -> dict[str, Any]:
    """The comparison of methods: a list per sensor, each with its whole result."""
    sensors: dict[str, list[dict[str, Any]]] = {}
    for row in rows:
        sensors.setdefault(row.sensor, []).append(
            {
                "method": row.method,
                "paper": row.paper or None,
                "result": None if row.fit is None else sensor_record(row.fit),
                "relative_error": row.relative_error,
                "relative_error_held_out": row.relative_error_held_out,
                "why": row.why or None,
            }
        )
    return {
        "schema": COMPARE_SCHEMA,
        "rate": report.rates,
        "warnings": list(report.warnings),
        "sensors": sensors,
    }


def failure_document(command: str, reason: str, warnings: Sequence[str]) -> dict[str, Any]:
    """The document of a command whose data do not determine a result.

    Args:
        command: ``fit``, ``compare`` or ``bench``.
        reason: why there is no result.
        warnings: noticed before.
    """
    found: dict[str, Any] = {"holds": [], "rotations": []} if command == "fit" else {}
    return {
        "schema": f"imucal-wizard/{command}/1",
        "error": reason,
        "rate": {},
        "warnings": [*warnings, reason],
        **found,
        "sensors": {},
    }
