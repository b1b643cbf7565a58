"""The whole fit: holds and rotations in, a report out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.fitting.checks import (
    accelerometer_warnings,
    gyroscope_warnings,
    rotation_warnings,
)
from imucal_wizard.fitting.gyroscope import GyroscopeReport, fit_gyroscope
from imucal_wizard.fitting.magnetometer import with_magnetometer
from imucal_wizard.fitting.second_stage import with_second_stage
from imucal_wizard.fitting.verdict import verdict
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.procedure.poses import DIRECTIONS, POSE_TOLERANCE_DEG, nearest
from imucal_wizard.procedure.rotations import Rotation
from imucal_wizard.procedure.segmentation import candidates, reduce, rotations_between
from imucal_wizard.procedure.state import Collected
from imucal_wizard.readings import FloatArray, Readings
from imucal_wizard.solver.accelerometer import AccelerometerFit, fit_accelerometer
from imucal_wizard.solver.judging import disturbed, judge
from imucal_wizard.solver.result import FitReport, SensorFit
from imucal_wizard.units import STANDARD_GRAVITY

EQUAL = 1.1
"""Expected errors that differ by less say nothing: each comes from about thirty residuals, which
know a spread to 13 % at best."""


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
    holds = _find_holds(readings, options)
    rotations: list[Rotation] = []
    if readings.gyroscope is not None and len(readings.gyroscope):
        rotations = rotations_between(holds, readings.gyroscope, readings.accelerometer)
    rates = {"accelerometer": readings.accelerometer.rate}
    if readings.gyroscope is not None:
        rates["gyroscope"] = readings.gyroscope.rate
    units = _units(readings)
    return _fit(holds, rotations, rates, units, options, (), readings.warnings)


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
    return _fit(
        collected.holds,
        collected.rotations,
        rates,
        units,
        options or FitOptions(),
        collected.validation,
        warnings,
    )


def _units(readings: Readings) -> dict[str, str]:
    units = {"accelerometer": readings.accelerometer.unit}
    if readings.gyroscope is not None:
        units["gyroscope"] = readings.gyroscope.unit
    return units


def _find_holds(readings: Readings, options: FitOptions) -> list[Hold]:
    """The holds under the stillness limit from which the best calibration follows."""
    stream = reduce(readings)
    if stream is None:
        raise DataError(
            "the recording is too short: at least two seconds of rest and six still positions are "
            "needed"
        )
    found = [holds for _, holds in candidates(stream)]
    best = _best(found, [judge(holds, options.gravity) for holds in found])
    odd = disturbed(best, options.gravity)
    if odd is None:
        return best
    # a hold that was disturbed is so under every limit and must not decide between them
    others = [_without(holds, best[odd]) for holds in found]
    return _best(found, [judge(holds, options.gravity) for holds in others])


def _best(found: Sequence[list[Hold]], errors: Sequence[float]) -> list[Hold]:
    """Of those that are about as good as the best, the one with the longest holds.

    A limit that is too strict breaks holds to pieces, one too loose adds slow moments of turns.
    """
    least = min(errors)
    if not np.isfinite(least):
        return max(found, key=_directions)
    equal = [one for one, error in zip(found, errors, strict=True) if error <= EQUAL * least]
    return max(equal, key=lambda holds: sum(one.end - one.start for one in holds) / len(holds))


def _without(holds: Sequence[Hold], odd: Hold) -> list[Hold]:
    """The holds at other times."""
    return [hold for hold in holds if hold.end <= odd.start or hold.start >= odd.end]


def _directions(holds: Sequence[Hold]) -> tuple[int, float]:
    """How many clearly different readings there are, and for how long in all."""
    means = np.array([hold.accelerometer for hold in holds]).reshape(-1, 3)
    leaders: list[FloatArray] = []
    reach = 0.2 * float(np.ptp(means, axis=0).max()) if len(means) else 0.0
    for mean in means:
        if all(np.linalg.norm(mean - leader) > reach for leader in leaders):
            leaders.append(mean)
    return len(leaders), sum(hold.end - hold.start for hold in holds)


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
