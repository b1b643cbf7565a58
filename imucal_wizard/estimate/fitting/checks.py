"""What a finished fit says about the recording: wrong unit or rate, swapped or compensated axes."""

import re
from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.quantities import times_in_words
from imucal_wizard.core.units import COUNT, STANDARD_GRAVITY
from imucal_wizard.estimate.fitting.compensated import noticed
from imucal_wizard.estimate.gyroscope_report import GyroscopeReport
from imucal_wizard.estimate.outliers import Outlier
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.measurement.holds import Hold, Rotation

FACTORS = (
    (2.0, "the sampling rate is claimed twice too high"),
    (0.5, "the sampling rate is claimed twice too low"),
    (np.pi / 180.0, "the gyroscope's readings are in deg/s, not rad/s"),
    (180.0 / np.pi, "the gyroscope's readings are in rad/s, not deg/s"),
    (1e-3, "the gyroscope's readings are in thousandths of the unit given"),
    (1e3, "the gyroscope's unit is a thousand times too small"),
)
"""Scale factors that point to a mistake, and to which. A rate claimed twice too high halves the
time between samples, so the fit doubles the scale."""
NEAR = 0.08


def accelerometer_warnings(fit: SensorFit, holds: Sequence[Hold]) -> list[str]:
    """Warnings about the accelerometer's unit and hand-held holds."""
    notes = list(fit.warnings)
    if fit.bias_unit != COUNT:
        notes += _unit_notes(float(np.mean(np.abs(np.diag(fit.matrix)))))
    notes.append(noticed(fit))
    if fit.outlier is not None:
        hold = holds[fit.outlier.index]
        pose = f" ({hold.pose})" if hold.pose else ""
        place = f"the hold from {hold.start:.1f} to {hold.end:.1f} s{pose}"
        notes.append(_stands_out(place, fit.outlier))
    count = sum(hold.hand_held for hold in holds)
    if count:
        notes.append(f"{count} of {len(holds)} holds were taken hand-held and weigh less")
    return notes


UNITS = (
    ("g", 1.0 / STANDARD_GRAVITY),
    ("mg", 1e3 / STANDARD_GRAVITY),
    ("m/s^2", STANDARD_GRAVITY),
)
"""What gravity reads, over what it is, when the accelerations are in this unit and were taken for
another: g or mg for m/s², m/s² for g."""
FAR = 0.3
"""No sensor is wrong by 30 %; its unit is."""


def _unit_notes(scale: float) -> list[str]:
    reads = f"gravity reads {STANDARD_GRAVITY / scale:.4g} m/s²"
    for unit, size in UNITS:
        if abs(np.log(scale * size)) < NEAR:
            return [f"{reads}: the accelerations are in {unit}; give {unit} as their unit"]
    if abs(np.log(scale)) > FAR:
        return [f"{reads}: give the unit of the accelerations"]
    return []


def _stands_out(place: str, outlier: Outlier) -> str:
    return (
        f"{place} does not fit with the others: its error is {outlier.ratio:.0f} times theirs. "
        "Measure it again"
    )


def gyroscope_warnings(report: GyroscopeReport, unit: str) -> list[str]:
    """Warnings about rate, unit and axis order that the gyroscope's matrix shows."""
    notes: list[str] = []
    fit = report.fit
    if fit is None:
        return notes
    if report.outlier is not None:
        bad = report.rotations[report.outlier.index]
        place = f"the rotation from {bad.time[0]:.1f} to {bad.time[-1]:.1f} s"
        notes.append(_stands_out(place, report.outlier))
    notes.append(noticed(fit))
    matrix = fit.matrix / (np.linalg.norm(fit.matrix) / np.sqrt(3.0))
    best = np.abs(matrix).argmax(axis=1)
    if sorted(best.tolist()) == [0, 1, 2]:
        wrong = [
            f"{'-' if matrix[i, j] < 0 else '+'}{'xyz'[j]}" for i, j in enumerate(best.tolist())
        ]
        if wrong != ["+x", "+y", "+z"]:
            notes.append(
                "the gyroscope's axes are not the accelerometer's: its "
                f"x, y, z must be taken from {', '.join(wrong)}. Check the wiring or the columns"
            )
    if unit != COUNT:
        scale = float(np.linalg.norm(fit.matrix) / np.sqrt(3.0))
        for factor, meaning in FACTORS:
            if abs(np.log(scale / factor)) < NEAR:
                notes.append(
                    f"the gyroscope's scale comes out as {scale:.3g}: probably {meaning}. Give the "
                    "true sampling rate, or the unit of the rates, and fit again"
                )
    return notes


def rotation_warnings(rotations: Sequence[Rotation]) -> list[str]:
    """How many rotations could not be used, and why, without what would have been advised then."""
    reasons: dict[str, list[str]] = {}
    for rotation in rotations:
        if rotation.problem:
            reason = rotation.problem.partition(":")[0]
            reasons.setdefault(re.sub(r"[+−]?\d+(\.\d+)?", "#", reason), []).append(reason)
    if not reasons:
        return []
    count = sum(map(len, reasons.values()))
    each = ", ".join(f"{texts[0]} ({times_in_words(len(texts))})" for texts in reasons.values())
    return [f"{count} of {len(rotations)} rotations are not used: {each}"]
