"""Accelerometer and gyroscope: holds and rotations in, a report of these two out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.core.poses import DIRECTIONS, POSE_TOLERANCE_DEG, nearest_pose
from imucal_wizard.core.readings import FloatArray, Readings
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.estimate.accelerometer import fit_accelerometer
from imucal_wizard.estimate.fitting.checks import (
    accelerometer_warnings,
    gyroscope_warnings,
    rotation_warnings,
)
from imucal_wizard.estimate.gyroscope_report import GyroscopeReport, fit_gyroscope
from imucal_wizard.estimate.result import FitReport, SensorFit
from imucal_wizard.estimate.rms import root_mean_square
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
    return FitReport(
        gravity=options.gravity,
        rates=rates,
        holds=tuple(named),
        rotations=tuple(rotations),
        sensors=sensors,
        comparison=() if gyroscope is None else gyroscope.comparison,
        angles=() if gyroscope is None else gyroscope.angles,
        warnings=tuple(dict.fromkeys(note for note in notes if note)),
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
