"""A calibration with fewer parameters: fitted again to what the file has measured.

A program that knows only biases and scales errs less with those that fit best on their own than
with the diagonal of a full matrix. The fit is the one that made the calibration, of the holds,
rotations and field means in its file.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import msgspec
import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.readings import Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.accelerometer import BASE, accelerometer_experiment
from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.gauge import symmetric
from imucal_wizard.estimate.gyroscope_fit import gyroscope_minimum
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.measurement.holds import Hold, Rotation
from imucal_wizard.model.effect import Effect
from imucal_wizard.model.rows.source import Parameters
from imucal_wizard.model.terms import Term
from imucal_wizard.report.calibration_file import Calibration, SavedEffect, Sensor
from imucal_wizard.report.calibration_record import sensor_record
from imucal_wizard.report.measured import RotationIncrements

SAMPLES_PER_INTERVAL = 4
"""Of a rotation that is made of its increments again."""


def _no_effect(_one: SavedEffect) -> bool:
    """Of a program without effects."""
    return False


@dataclass(frozen=True)
class Kept:
    """What a program knows of a sensor.

    Attributes:
        base: terms of the base model that accelerometer and gyroscope share.
        takes: which effects it corrects.
    """

    base: tuple[str, ...] = BASE
    takes: Callable[[SavedEffect], bool] = _no_effect

    def lost_base(self, sensor: Sensor) -> list[str]:
        """Terms of the base model that the program does not have."""
        return [term for term in sensor.model if term in BASE and term not in self.base]

    def lost_effects(self, sensor: Sensor) -> list[str]:
        """Effects that the program does not correct."""
        return [one.term for one in sensor.effects if not self.takes(one)]


def reduced(
    calibration: Calibration, keeps: Mapping[str, Kept], effects: Sequence[Effect] = ()
) -> tuple[Calibration, list[str], list[str]]:
    """What a program can hold of a calibration.

    Args:
        calibration: the whole one.
        keeps: what the program knows of each sensor.
        effects: the user's own that the calibration may have.

    Returns:
        The calibration of it, what of the sensors and effects is lost, and which models were fitted
        again, in words.

    Raises:
        DataError: the data do not determine the smaller model.
        UsageError: nothing is left, or the file has no measurements to fit the smaller model to.
    """
    sensors, lost, again = {}, [], []
    for name, sensor in calibration.sensors.items():
        kept = keeps.get(name)
        if kept is None:
            lost.append(f"the {name}")
            continue
        sensors[name] = sensor
        if not (kept.lost_base(sensor) or kept.lost_effects(sensor)):
            continue
        fewer = sensors[name] = sensor_record(_fitted_again(calibration, name, kept, effects))
        gone = [one.term for one in sensor.effects if one.term not in fewer.model]
        lost += [f"{term} of the {name}" for term in gone]
        without = ", ".join(kept.lost_base(sensor) + gone)
        turned = "misalignment" in fewer.model
        how = "; its rotation to the accelerometer is kept" if turned else ""
        again.append(f"{name}: fitted again without {without}{how}")
    if not sensors:
        wanted = " or ".join(keeps)
        raise UsageError(
            f"there is nothing to export: the program takes {wanted}, and this calibration has "
            f"none of that"
        )
    return msgspec.structs.replace(calibration, sensors=sensors), lost, again


def _fitted_again(
    calibration: Calibration, name: str, kept: Kept, effects: Sequence[Effect]
) -> SensorFit:
    """The fit of a sensor's smaller model."""
    sensor = calibration[name]
    base = [term for term in kept.base if term in sensor.model]
    terms = [one.known(effects) for one in sensor.effects if kept.takes(one)]
    return _AGAIN[name](calibration, base, terms, effects)


def _accelerometer(
    calibration: Calibration, base: list[str], terms: list[Term], effects: Sequence[Effect]
) -> SensorFit:
    del effects  # those of it are among its terms
    _check(bool(calibration.hold_means))
    holds = [one.hold() for one in calibration.hold_means]
    unit = calibration["accelerometer"].bias_unit
    return fit(accelerometer_experiment(holds, calibration.gravity.value, unit), terms, base)


def _gyroscope(
    calibration: Calibration, base: list[str], terms: list[Term], effects: Sequence[Effect]
) -> SensorFit:
    """Under gravity as the whole model of the accelerometer sees it, or by a rate table alone."""
    if calibration.table_means:
        return _on_table(calibration, base, terms)
    _check(bool(calibration.rotation_increments))
    every = [one.known(effects) for one in calibration["accelerometer"].effects]
    accelerometer = _accelerometer(calibration, list(BASE), every, effects)
    holds = [one.hold() for one in calibration.hold_means]
    rotations = [_rotation_of(one, holds) for one in calibration.rotation_increments]
    unit = calibration["gyroscope"].bias_unit
    near = np.array(calibration["gyroscope"].matrix)
    found = gyroscope_minimum(holds, rotations, accelerometer, unit, near=near)
    return fit(found.experiment, terms, base)


def _on_table(calibration: Calibration, base: list[str], terms: list[Term]) -> SensorFit:
    from imucal_wizard.estimate.rate_table import fit_rate_table
    from imucal_wizard.estimate.table_steps import TableData

    sensor, every = calibration["gyroscope"], [one.turned() for one in calibration.table_means]
    near = Parameters(np.array(sensor.matrix), np.array(sensor.bias))
    rests = tuple(one.hold for one in every if one.hold is not None and not one.angle)
    data = TableData(rests, tuple(one for one in every if one.angle), near)
    time, means = np.array([one.start for one in every]), np.array([one.mean for one in every])
    found = fit_rate_table(data, Series(time, means, sensor.bias_unit))
    assert found.experiment is not None  # noqa: S101 (narrows the type)
    return fit(found.experiment, terms, base)


def _magnetometer(
    calibration: Calibration, base: list[str], terms: list[Term], effects: Sequence[Effect]
) -> SensorFit:
    """In its own frame, turned as the whole model is; without any of its effects."""
    from imucal_wizard.estimate.magnetometer.fit import fit_magnetometer

    del base, terms, effects
    _check(bool(calibration.field_means))
    sensor, means = calibration["magnetometer"], calibration.field_means
    series = Series(
        np.array([one.time for one in means]),
        np.array([one.reading for one in means]),
        sensor.bias_unit,
    )
    known = None if "field" in sensor.parameters else _field(calibration)
    found = fit_magnetometer(series, known).fit
    if sensor.frame == found.frame:
        return found
    matrix = np.array(sensor.matrix)
    # the fit gives a positive matrix; where axes are mirrored, the turn mirrors all of them
    turn = symmetric(matrix)[0] * np.sign(np.linalg.det(matrix))
    model = (*found.model, "misalignment")
    return replace(found, matrix=turn @ found.matrix, frame=sensor.frame, model=model)


_AGAIN = {
    "accelerometer": _accelerometer,
    "gyroscope": _gyroscope,
    "magnetometer": _magnetometer,
}


def _field(calibration: Calibration) -> float:
    """Mean magnitude that the calibration gives."""
    means = calibration.field_means
    sensor = calibration["magnetometer"]
    readings = np.array([one.reading for one in means])
    size = np.linalg.norm((readings - sensor.bias) @ np.array(sensor.matrix).T, axis=1)
    return float(np.mean(size + [one.shortened for one in means]))


def _check(there: bool) -> None:
    """Refuse a file without measurements.

    Raises:
        UsageError: they are not there.
    """
    if not there:
        raise UsageError(
            "this program holds a smaller model, which must be fitted again, and the calibration "
            "file lacks the measurements: an older version wrote it, or the accelerometer was not "
            "saved. Fit the recording again and save"
        )


def _rotation_of(one: RotationIncrements, holds: list[Hold]) -> Rotation:
    """A rotation whose samples have the increments of the file.

    The rate is the derivative of a cubic spline through the integrated reading.
    """
    from scipy.interpolate import CubicSpline  # imported when it is needed

    edges = np.array(one.edges)
    whole = np.vstack([np.zeros(3), np.cumsum(one.gyroscope, axis=0)])
    parts = SAMPLES_PER_INTERVAL * (len(edges) - 1)
    place = np.arange(parts + 1) / SAMPLES_PER_INTERVAL
    time = np.interp(place, np.arange(len(edges)), edges)
    rate = CubicSpline(edges, whole).derivative()(time)
    return Rotation(holds[one.before], holds[one.after], time, rate, one.axis)
