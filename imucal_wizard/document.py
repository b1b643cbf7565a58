"""The JSON of ``fit --json``, as those who script the program read it."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from imucal_wizard.calibration import sensor_record
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.second_stage_text import second_stage_document
from imucal_wizard.solver.magnetometer.report import MagnetometerFit
from imucal_wizard.solver.result import FitReport

SCHEMA = "imucal-wizard/fit/1"


def fit_document(report: FitReport) -> dict[str, Any]:
    """A report as the document of the contract; lists and numbers only.

    The angle of a rotation is null where no gyroscope could be fitted to tell it.
    """
    angles = report.angles or (None,) * len(report.rotations)
    return {
        "schema": SCHEMA,
        "rate": report.rates,
        "gravity": report.gravity,
        "warnings": list(report.warnings),
        "verdict": list(report.verdict),
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
        "sensors": {name: sensor_record(fit) for name, fit in report.sensors.items()},
        **({} if report.magnetic is None else {"magnetometer": _magnetic(report.magnetic)}),
        **(
            {}
            if report.second_stage is None
            else {"second_stage": second_stage_document(report.second_stage)}
        ),
        "comparison": [
            {name: getattr(row, name) for name in row.__dataclass_fields__}
            for row in report.comparison
        ],
    }


def _magnetic(found: MagnetometerFit) -> dict[str, Any]:
    """What belongs to a magnetometer alone: the field's size, N's figure, what was left out."""
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


def failure_document(reason: str, warnings: Sequence[str]) -> dict[str, Any]:
    """What ``--json`` says when the data do not carry a fit."""
    return {
        "schema": SCHEMA,
        "error": reason,
        "rate": {},
        "warnings": [*warnings, reason],
        "holds": [],
        "rotations": [],
        "sensors": {},
    }


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
