"""The whole fit: holds and rotations in, a report out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.fitting.at_the_end import clipped_axes
from imucal_wizard.fitting.checks import (
    accelerometer_warnings,
    gyroscope_warnings,
    rotation_warnings,
)
from imucal_wizard.fitting.choice import find_holds
from imucal_wizard.fitting.gyroscope import GyroscopeReport, fit_gyroscope
from imucal_wizard.fitting.magnetometer import with_magnetometer
from imucal_wizard.fitting.rounded import rounding_warnings, steps_in, with_rounding
from imucal_wizard.fitting.second_stage import with_second_stage
from imucal_wizard.fitting.verdict import verdict
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.procedure.poses import DIRECTIONS, POSE_TOLERANCE_DEG, nearest
from imucal_wizard.procedure.rotations import Rotation
from imucal_wizard.procedure.segmentation import rotations_between
from imucal_wizard.procedure.state import Collected
from imucal_wizard.readings import Readings
from imucal_wizard.solver.accelerometer import AccelerometerFit, fit_accelerometer
from imucal_wizard.solver.result import FitReport, SensorFit
from imucal_wizard.units import STANDARD_GRAVITY


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


def fit_readings(readings: Readings, options: FitOptions | None = None) -> FitReport:
    """Find the holds and rotations of a recording and fit every sensor.

    Raises:
        DataError: the recording does not carry a calibration.
    """
    options = options or FitOptions()
    if readings.magnetometer is None:
        return _inertial(readings, options)
    report = with_magnetometer(
        lambda: _inertial(readings, options),
        readings.magnetometer,
        options.field,
        options.magnetometer_method,
        options.gravity,
        readings.warnings,
    )
    report = with_second_stage(report, readings)
    return replace(report, verdict=verdict(report))


def _inertial(readings: Readings, options: FitOptions) -> FitReport:
    """Accelerometer and gyroscope.

    Raises:
        DataError: the recording does not carry an accelerometer's calibration.
    """
    if not len(readings):
        raise DataError("the recording has no accelerometer")
    holds, steps = find_holds(readings, options.gravity)
    rotations: list[Rotation] = []
    if readings.gyroscope is not None and len(readings.gyroscope):
        rotations = rotations_between(holds, readings.gyroscope, readings.accelerometer)
    rates = {"accelerometer": readings.accelerometer.rate}
    if readings.gyroscope is not None:
        rates["gyroscope"] = readings.gyroscope.rate
    units = _units(readings)
    warnings = (*readings.warnings, *rounding_warnings(holds, steps, units))
    return _fit(with_rounding(holds, steps), rotations, rates, units, options, (), warnings)


def fit_collected(
    collected: Collected,
    units: dict[str, str],
    rate: float,
    options: FitOptions | None = None,
    warnings: tuple[str, ...] = (),
) -> FitReport:
    """Fit what the wizard has collected.

    Args:
        collected: holds and rotations.
        units: unit of the readings by sensor; a sensor that is not there is left out.
        rate: samples per second.
        options: gravity and methods.
        warnings: what the stream's reader noticed.

    Raises:
        DataError: the holds do not carry a calibration.
    """
    rates = dict.fromkeys(units, rate)
    steps = steps_in(collected.rotations)
    return _fit(
        with_rounding(collected.holds, steps),
        collected.rotations,
        rates,
        units,
        options or FitOptions(),
        collected.validation,
        (
            *warnings,
            *clipped_axes(collected.holds, steps[0]),
            *rounding_warnings(collected.holds, steps, units),
        ),
    )


def _units(readings: Readings) -> dict[str, str]:
    units = {"accelerometer": readings.accelerometer.unit}
    if readings.gyroscope is not None:
        units["gyroscope"] = readings.gyroscope.unit
    return units


def _fit(
    holds: Sequence[Hold],
    rotations: Sequence[Rotation],
    rates: dict[str, float],
    units: dict[str, str],
    options: FitOptions,
    validation: Sequence[Hold],
    warnings: tuple[str, ...],
) -> FitReport:
    accelerometer = fit_accelerometer(
        holds, options.gravity, units["accelerometer"], options.method
    )
    named = _with_poses(holds, accelerometer)
    rotations = [_between(rotation, named) for rotation in rotations]
    sensors = {"accelerometer": _validated(accelerometer.fit, validation, options.gravity)}
    notes = [*warnings, *accelerometer_warnings(accelerometer, named)]
    gyroscope: GyroscopeReport | None = None
    if "gyroscope" in units:
        gyroscope = fit_gyroscope(
            named, rotations, accelerometer, units["gyroscope"], options.gyroscope_method
        )
        rotations = list(gyroscope.rotations)
        notes += rotation_warnings(rotations)
        if gyroscope.fit is not None:
            sensors["gyroscope"] = gyroscope.fit
            notes += gyroscope_warnings(gyroscope, units["gyroscope"])
        notes += gyroscope.warnings
    report = FitReport(
        gravity=options.gravity,
        rates=rates,
        holds=tuple(named),
        rotations=tuple(rotations),
        sensors=sensors,
        comparison=() if gyroscope is None else gyroscope.comparison,
        angles=() if gyroscope is None else gyroscope.angles,
        warnings=tuple(dict.fromkeys(note for note in notes if note)),
    )
    return replace(report, verdict=verdict(report))


def _with_poses(holds: Sequence[Hold], accelerometer: AccelerometerFit) -> list[Hold]:
    """The holds with the pose each was in, by the calibrated direction."""
    return [
        replace(hold, pose=nearest(up, DIRECTIONS, POSE_TOLERANCE_DEG))
        for hold, up in zip(holds, accelerometer.up, strict=True)
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
    rms = float(np.sqrt(np.mean(errors**2)))
    return replace(fit, validation_rms=rms, validation=tuple(errors.tolist()))
