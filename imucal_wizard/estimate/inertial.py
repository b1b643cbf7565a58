"""Accelerometer and gyroscope: holds and rotations in, a report of these two out.

The second half says what a finished fit shows of the recording: wrong unit or rate, exchanged axes.
"""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.poses import DIRECTIONS, POSE_TOLERANCE_DEG, nearest_pose
from imucal_wizard.core.quantities import times_in_words
from imucal_wizard.core.readings import FloatArray, Readings
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import root_mean_square
from imucal_wizard.core.units import COUNT, STANDARD_GRAVITY
from imucal_wizard.estimate.accelerometer import fit_accelerometer
from imucal_wizard.estimate.compensated import noticed
from imucal_wizard.estimate.gyroscope_report import GyroscopeReport, fit_gyroscope
from imucal_wizard.estimate.outliers import Outlier
from imucal_wizard.estimate.result import FitReport, SensorFit
from imucal_wizard.measurement.holds import Hold, Rotation


@dataclass(frozen=True)
class FitOptions:
    """What the user may choose about a fit.

    Attributes:
        gravity: local gravity, m/s².
        method: the accelerometer's method.
        gyroscope_method: ``vector``, ``static``, ``dynamic`` or ``offset``; which is the result.
        magnetometer_method: ``orthogonal``, ``algebraic``, ``two-step`` or ``numeric``.
        field: magnitude of the local magnetic field, µT, or None when it is not known.
    """

    gravity: float = STANDARD_GRAVITY
    method: str = "least_squares"
    gyroscope_method: str = "vector"
    magnetometer_method: str = "orthogonal"
    field: float | None = None


def fit_holds(
    holds: Sequence[Hold],
    rotations: Sequence[Rotation],
    rates: dict[str, float],
    units: dict[str, str],
    options: FitOptions,
    validation: Sequence[Hold],
    warnings: tuple[str, ...],
    readings: Readings | None = None,
) -> FitReport:
    """Fit accelerometer and gyroscope.

    Args:
        holds: still periods, in the order of time.
        rotations: motions between neighbouring ones.
        rates: samples per second of each sensor.
        units: of the readings by sensor; a sensor that is not there is left out.
        options: gravity and methods.
        validation: holds that the fit must not see.
        warnings: what is known already.
        readings: what the holds were found in, where it is at hand.

    Raises:
        DataError: the holds do not carry a calibration.
    """
    accelerometer = fit_accelerometer(
        holds, options.gravity, units["accelerometer"], options.method, readings
    )
    assert accelerometer.reference is not None  # noqa: S101 (narrows the type)
    named = _with_poses(holds, accelerometer.reference.up)
    rotations = [_between(rotation, named) for rotation in rotations]
    odd: dict[str, str] = {}
    if accelerometer.outlier is not None:
        hold = named[accelerometer.outlier.index]
        pose = f" ({hold.pose})" if hold.pose else ""
        place = f"the hold from {hold.start:.1f} to {hold.end:.1f} s{pose}"
        odd["accelerometer"] = _stands_out(place, accelerometer.outlier)
    sensors = {"accelerometer": _validated(accelerometer, validation, options.gravity)}
    notes = [*warnings, *accelerometer_warnings(accelerometer, named)]
    gyroscope: GyroscopeReport | None = None
    if "gyroscope" in units:
        gyroscope = fit_gyroscope(
            named, rotations, accelerometer, units["gyroscope"], options.gyroscope_method, readings
        )
        rotations = list(gyroscope.rotations)
        notes += rotation_warnings(rotations)
        if gyroscope.fit is not None:
            sensors["gyroscope"] = gyroscope.fit
            notes += gyroscope_warnings(gyroscope, units["gyroscope"])
        notes += gyroscope.warnings
        if gyroscope.outlier is not None:
            bad = rotations[gyroscope.outlier.index]
            place = f"the rotation from {bad.time[0]:.1f} to {bad.time[-1]:.1f} s"
            odd["gyroscope"] = _stands_out(place, gyroscope.outlier)
    return FitReport(
        gravity=options.gravity,
        rates=rates,
        holds=tuple(named),
        rotations=tuple(rotations),
        sensors=sensors,
        comparison=() if gyroscope is None else gyroscope.comparison,
        angles=() if gyroscope is None else gyroscope.angles,
        warnings=tuple(dict.fromkeys(note for note in notes if note)),
        outlier_notes=odd,
    )


def _with_poses(holds: Sequence[Hold], directions: FloatArray) -> list[Hold]:
    """The holds with the pose each was in, by the calibrated direction."""
    return [
        replace(hold, pose=nearest_pose(up, DIRECTIONS, POSE_TOLERANCE_DEG))
        for hold, up in zip(holds, directions, strict=True)
    ]


def _between(rotation: Rotation, holds: Sequence[Hold]) -> Rotation:
    """The rotation with its holds replaced by the named ones of the same times."""
    places = {(hold.start, hold.end): hold for hold in holds}
    before = places.get((rotation.before.start, rotation.before.end))
    after = places.get((rotation.after.start, rotation.after.end))
    if before is None or after is None:
        return replace(rotation, problem=rotation.problem or "a hold at its end was not kept")
    return replace(rotation, before=before, after=after)


def _validated(fit: SensorFit, holds: Sequence[Hold], gravity: float) -> SensorFit:
    """The fit with its error on holds that it has not seen."""
    if not holds:
        return fit
    readings = np.array([hold.accelerometer for hold in holds])
    errors = np.linalg.norm((readings - fit.bias) @ fit.matrix.T, axis=1) - gravity
    return replace(fit, validation_rms=root_mean_square(errors), validation=tuple(errors.tolist()))


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
    count = sum(hold.hand_held for hold in holds)
    if count:
        notes.append(f"{count} of {len(holds)} holds were taken hand-held and weigh less")
    return notes


MISTAKEN_UNITS = (
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
    for unit, size in MISTAKEN_UNITS:
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
