"""The errors of any correction on what a calibration file has measured.

Accelerometer: the error of the magnitude of gravity over the holds. Gyroscope: the angle between
carried and measured gravity over the rotations, or the error of the angle of each step where a rate
table alone calibrated it. Magnetometer: the error of the field's magnitude. A correction is any
function of readings, so that the one of another program is judged as the calibration itself is.

``contradiction`` compares what a file states several times: parameters and matrices, errors and
measurements, figures and grades.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.errors import DataError, UsageError
from imucal_wizard.core.quantities import number, or_nan, quantity
from imucal_wizard.core.readings import FloatArray, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import root_mean_square
from imucal_wizard.core.units import SI_UNIT
from imucal_wizard.estimate.gauge import symmetric
from imucal_wizard.estimate.parameters import base_parameters, unit_of
from imucal_wizard.estimate.result import beyond_limit
from imucal_wizard.model.effect import Circumstances, Effect
from imucal_wizard.report.measured import RotationIncrements

if TYPE_CHECKING:  # that module asks for contradictions
    from imucal_wizard.report.calibration_file import Calibration, SavedRung, Sensor

ERROR_UNITS = {"accelerometer": "m/s^2", "gyroscope": "rad"}
"""Of an error that the readings in a file give; methods of the papers may have another one."""
SAME_FIGURE = 1e-6
"""Relative difference up to which two figures are the same: they are written with all digits."""
SAME_ERROR = 0.05
"""The same of an error and the one that the readings in the file give: usually 0.02 % at most,
since a rotation is kept as increments; 0.5 % for older files, whose increments miss up to
0.0005°."""
SAME_ANGLE = 1e-4
"""What these increments may change in the error of a gyroscope besides, rad: 0.003° where the
effects of force are large."""
BASE_PARAMETERS = ("bias_", "sensitivity_", "theta_", "cross_")
"""How the names of the parameters begin that matrix and bias of an inertial sensor give."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Readings of a sensor and all that a correction may ask for.

    Attributes:
        reading: in the sensor's ``bias_unit``, shape (n, 3).
        where: circumstances; the force is that of the holds or carried gravity.
        accelerometer: what the accelerometer reads beside, its ``bias_unit``, shape (n, 3).
    """

    reading: FloatArray
    where: Circumstances
    accelerometer: FloatArray


Correction = Callable[[Samples], FloatArray]
"""Readings to corrected ones: m/s², rad/s, µT; shape (n, 3)."""


def own(calibration: "Calibration", effects: Sequence[Effect] = ()) -> dict[str, Correction]:
    """The corrections of the calibration itself, which may have effects of the user's own."""
    return {
        name: lambda samples, sensor=sensor: sensor.apply(samples.reading, samples.where, effects)  # type: ignore[misc] # a default binds the sensor of this turn
        for name, sensor in calibration.sensors.items()
    }


def nominal(calibration: "Calibration") -> dict[str, Correction]:
    """Readings as they are, of sensors that do not send counts."""
    return {
        name: lambda samples: samples.reading
        for name, sensor in calibration.sensors.items()
        if sensor.bias_unit == SI_UNIT[name]
    }


class Proof:
    """What a calibration file has measured, ready for any correction.

    Args:
        calibration: with its measurements.
        effects: the user's own that it may have.
    """

    def __init__(self, calibration: "Calibration", effects: Sequence[Effect] = ()) -> None:
        self._calibration, self._own = calibration, own(calibration, effects)
        self._samples: dict[str, Samples] = {}
        if calibration.hold_means and "accelerometer" in calibration.sensors:
            where = calibration.circumstances()
            assert where is not None  # noqa: S101 (narrows the type)
            self._samples["accelerometer"] = Samples(
                calibration.means(), where, calibration.means()
            )
            self._up = unit_vectors(self._own["accelerometer"](self._samples["accelerometer"]))
            if calibration.rotation_increments and "gyroscope" in calibration.sensors:
                self._samples["gyroscope"] = self._turning()
        if calibration.table_means and "gyroscope" in calibration.sensors:
            self._samples["gyroscope"] = self._table_samples()
        if calibration.field_means and "magnetometer" in calibration.sensors:
            self._samples["magnetometer"] = self._field_samples()

    def samples(self, sensor: str) -> Samples | None:
        """Readings of a sensor; None where the file has none."""
        return self._samples.get(sensor)

    def errors(self, corrections: Mapping[str, Correction], *, frame: bool) -> dict[str, float]:
        """Rms error of each sensor that the file can judge, in the sensor's ``unit``.

        Args:
            corrections: by sensor.
            frame: as of ``residuals``.
        """
        found = self.residuals(corrections, frame=frame)
        return {name: root_mean_square(each) for name, each in found.items()}

    def residuals(
        self, corrections: Mapping[str, Correction], *, frame: bool
    ) -> dict[str, FloatArray]:
        """Error of each hold, rotation and row of the field, in the sensor's ``unit``.

        Args:
            corrections: by sensor.
            frame: gravity's direction is that of the accelerometer so corrected, and not that of
                the calibration: for a program with another body frame.
        """
        found: dict[str, FloatArray] = {}
        corrected = {
            name: corrections[name](samples)
            for name, samples in self._samples.items()
            if name in corrections
        }
        if "accelerometer" in corrected:
            size = np.linalg.norm(corrected["accelerometer"], axis=1)
            found["accelerometer"] = size - self._calibration.gravity.value
        if "gyroscope" in corrected and self._calibration.table_means:
            found["gyroscope"] = self._table_errors(corrected["gyroscope"])
        elif "gyroscope" in corrected:
            there = frame and "accelerometer" in corrected
            up = unit_vectors(corrected["accelerometer"]) if there else self._up
            found["gyroscope"] = self._closing(corrected["gyroscope"], up)
        if "magnetometer" in corrected:
            found["magnetometer"] = self._field_errors(corrected["magnetometer"])
        return found

    @property
    def _rotations(self) -> Sequence[RotationIncrements]:
        return self._calibration.rotation_increments

    def _closing(self, rates: FloatArray, up: FloatArray) -> FloatArray:
        """Angle between carried and measured gravity in each rotation, rad."""
        ends = np.cumsum([len(one.gyroscope) for one in self._rotations])[:-1]
        each = zip(self._rotations, np.split(rates, ends), strict=True)
        chords = [
            np.linalg.norm(one.attitudes(own)[-1].T @ up[one.before] - up[one.after])
            for one, own in each
        ]
        return np.asarray(2.0 * np.arcsin(np.minimum(0.5 * np.array(chords), 1.0)))

    def _turning(self) -> Samples:
        """Intervals of all rotations, with gravity carried by the calibration without effects."""
        calibration = self._calibration
        sensor, holds = calibration["gyroscope"], calibration.hold_means
        matrix, bias = np.array(sensor.matrix), np.array(sensor.bias)
        origin = 0.5 * (holds[0].start + holds[0].end) - (holds[0].time or 0.0)
        reading, force, time = [], [], []
        temperature: list[float] = []
        seconds = []
        for one in self._rotations:
            y = one.readings()
            rate, edges = (y - bias) @ matrix.T, np.array(one.edges)
            carried = self._up[one.before] @ one.attitudes(rate)[:-1]
            force.append(carried - np.cross(0.5 * rate * np.diff(edges)[:, None], carried))
            reading.append(y)
            if calibration.splits_holds:
                edges = one.moments(holds[one.before], holds[one.after])
            time += (0.5 * (edges[1:] + edges[:-1]) - origin).tolist()
            seconds += (calibration.splits_holds * np.diff(edges)).tolist()
            warm = [holds[k].temperature for k in (one.before, one.after)]
            known = [value for value in warm if value is not None]
            mean = float(np.mean(known)) if known else np.nan
            temperature += one.temperature or [mean] * len(y)
        forces, count = calibration.gravity.value * np.concatenate(force), len(time)
        nothing = np.zeros((count, 3))
        where = Circumstances(
            force=forces,
            rate=nothing,
            temperature=np.array(temperature, np.float64),
            time=np.array(time),
            previous=np.full((count, 3), np.nan),
            vibration=np.zeros(count),
            seconds=np.array(seconds),
            gravity=calibration.gravity.value,
        )
        return Samples(np.concatenate(reading), where, self._read(forces))

    def _read(self, forces: FloatArray) -> FloatArray:
        """What the accelerometer reads of forces, by its matrix and bias."""
        sensor = self._calibration["accelerometer"]
        return np.asarray(forces @ np.linalg.inv(sensor.matrix).T + sensor.bias)

    def _table_samples(self) -> Samples:
        """The pieces of all steps and turns; the force on them is not known."""
        every = self._calibration.table_means
        steps = [one for one in every if one.angle]
        reading = np.concatenate([one.gyroscope for one in steps])
        first = min(one.start for one in every)  # as an older file has it
        time = np.concatenate([one.times(first) for one in steps])
        warm = [one.temperature or [None] * len(one.seconds) for one in steps]
        nothing = np.zeros((len(time), 3))
        where = Circumstances(
            force=nothing,
            rate=nothing,
            temperature=np.concatenate([np.array(one, np.float64) for one in warm]),
            time=time,
            previous=np.full((len(time), 3), np.nan),
            vibration=np.zeros(len(time)),
            seconds=self._calibration.splits_holds * np.concatenate([one.seconds for one in steps]),
        )
        return Samples(reading, where, nothing)

    def _table_errors(self, rates: FloatArray) -> FloatArray:
        """By how much the angle of each step is not the table's."""
        steps = [one for one in self._calibration.table_means if one.angle]
        seconds = np.concatenate([one.seconds for one in steps])
        first = np.cumsum([0, *(len(one.seconds) for one in steps[:-1])])
        turned = np.add.reduceat(rates * seconds[:, None], first, axis=0)
        return np.asarray(np.linalg.norm(turned, axis=1) - [one.angle for one in steps])

    def _field_samples(self) -> Samples:
        means = self._calibration.field_means
        reading, count = np.array([one.reading for one in means]), len(means)
        nothing = np.zeros((count, 3))
        where = Circumstances(
            force=nothing,
            rate=nothing,
            temperature=np.array([or_nan(one.temperature) for one in means]),
            time=np.array(
                [
                    one.time - means[0].time if one.session_time is None else one.session_time
                    for one in means
                ]
            ),
            previous=np.full((count, 3), np.nan),
            vibration=np.zeros(count),
            magnetic=nothing,
            current=np.array([or_nan(one.current) for one in means]),
        )
        return Samples(reading, replace(where, current=np.nan_to_num(where.current)), reading)

    def _field_errors(self, corrected: FloatArray) -> FloatArray:
        """Magnitude of each row of the fit less the known field, else less their mean."""
        size = self._magnitudes(corrected)
        sensor = self._calibration["magnetometer"]
        if "field" in sensor.parameters or sensor.unit != SI_UNIT["magnetometer"]:
            return np.asarray(size - size.mean())
        # the file does not hold the field; it is what the calibration itself gives in the mean
        own = self._magnitudes(self._own["magnetometer"](self._samples["magnetometer"]))
        return np.asarray(size - own.mean())

    def _magnitudes(self, corrected: FloatArray) -> FloatArray:
        means = self._calibration.field_means
        size = np.linalg.norm(corrected, axis=1) + [one.shortened for one in means]
        # in an older file each mean is a row
        groups = np.array([k if one.group is None else one.group for k, one in enumerate(means)])
        rows = np.searchsorted(distinct(groups), groups)
        samples = np.array([one.samples for one in means])
        return np.asarray(np.bincount(rows, samples * size) / np.bincount(rows, samples))


def contradiction(calibration: "Calibration") -> str:
    """What of a calibration contradicts the rest of it, in words; "" if nothing does."""
    first = calibration.sensors.get("accelerometer")
    settled = first is not None or "accelerometer" not in calibration.ladders
    # a method of the papers has no interval; the ladder is that of the default methods
    settled = settled and (first is None or first.held_out_interval is not None)
    try:
        for name, sensor in calibration.sensors.items():
            ladder = calibration.ladders.get(name, []) if settled else []
            for text in _contradictions(name, sensor, ladder):
                return f"the {name}'s {text}"
        with np.errstate(over="ignore", invalid="ignore"):  # of numbers that it refuses
            return _unproven(calibration)
    except (DataError, np.linalg.LinAlgError) as error:
        return f"its numbers are none of a calibration ({error})"


def _contradictions(name: str, sensor: "Sensor", ladder: "Sequence[SavedRung]") -> Iterator[str]:
    """What of a sensor contradicts the rest of it, without the readings."""
    parameters = sensor.parameters
    for parameter, value in _by_matrices(sensor).items():
        listed = parameters.get(parameter)
        if listed is None:
            continue
        unit = unit_of(parameter, sensor.bias_unit, SI_UNIT[name])
        # effects and the magnetometer's soft iron have units of their own
        if name in ERROR_UNITS and parameter.startswith(BASE_PARAMETERS) and listed.unit != unit:
            yield f"{parameter} is in {listed.unit!r} in the list, and in {unit} by its matrix"
        if not _same(listed.value, value, at_least=1e-3):
            yield (
                f"{parameter} is {number(listed.value, 6)} in the list and {number(value, 6)} by "
                "its matrix, bias and effects"
            )
    joint = sensor.parameter_covariance
    for place, (parameter, one) in enumerate(parameters.items()):
        if joint is None or one.standard_error is None:
            continue
        error = math.sqrt(max(joint[place][place], 0.0))
        if not _same(one.standard_error, error):
            yield (
                f"{parameter} has the standard error {number(one.standard_error, 6)} in the list "
                f"and {number(error, 6)} by its covariance"
            )
    interval, held_out = sensor.held_out_interval, sensor.rms_held_out
    # new data have the errors of the fit of all, and those left out the errors of the fit of fewer
    if interval is not None and held_out is not None and held_out < interval[0]:
        words = quantity(held_out, sensor.unit, 6), quantity(interval[0], sensor.unit, 6)
        yield f"rms_held_out is {words[0]}, below its own 90 % interval, which begins at {words[1]}"
    for rung in ladder if sensor.held_out_interval is not None else ():
        for kind in ("rms_fitted", "rms_held_out", "floor"):
            here, there = getattr(sensor, kind), getattr(rung, kind)
            if rung.model == sensor.model and None not in (here, there) and not _same(here, there):
                words = quantity(here, sensor.unit, 6), quantity(there, sensor.unit, 6)
                yield f"{kind} is {words[0]}, and {words[1]} among the models compared"
    yield from _wrong_grade(name, sensor)


def _wrong_grade(name: str, sensor: "Sensor") -> Iterator[str]:
    """That the grade is not the one of the figures beside it."""
    worse = bool(sensor.unusable(name))
    if sensor.usable is worse:
        words = "usable" if sensor.usable else "not usable"
        yield f"errors contradict that it is {words}"
    if sensor.grade not in (None, "good", "doubtful", "not-usable"):
        yield f"grade is {sensor.grade!r}, which is no grade"
    if sensor.grade is None or sensor.limit is None:
        return
    beyond = beyond_limit(sensor.error_as_left, sensor.could_be, sensor.limit, sensor.unit)
    complete = sensor.verdict == "complete"
    why = "it is worse than no calibration" if worse else beyond
    if not (why or complete):
        why = f"the verdict is {sensor.verdict}"
    if sensor.grade == "good" and why:
        yield f"grade is good, but {why}"
    if (sensor.grade == "not-usable") is not worse:
        yield f"grade is {sensor.grade}, which its errors contradict"


def _by_matrices(sensor: "Sensor") -> dict[str, float]:
    """The parameters that matrix, bias and effects give."""
    matrix, bias = np.array(sensor.matrix), np.array(sensor.bias)
    if "soft_iron_xx" in sensor.parameters:
        soft = symmetric(matrix)[1]
        # of an unknown field the parameters have its size, and the matrix has determinant 1
        size = float(np.cbrt(np.linalg.det(soft))) if "field" in sensor.parameters else 1.0
        found = {f"bias_{axis}": float(bias[i]) for i, axis in enumerate("xyz")}
        for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
            found[f"soft_iron_{'xyz'[i]}{'xyz'[j]}"] = float(soft[i, j]) / size
    else:
        own_frame = sensor.frame == "own"
        found = base_parameters(matrix, bias, sensor.bias_unit, own_frame=own_frame)
    for one in sensor.effects:
        pairs = zip(one.parameters, one.sizes, strict=True)
        found |= {f"{one.term}_{parameter}": size for parameter, size in pairs}
    return found


def _same(here: float, there: float, at_least: float = 0.0) -> bool:
    return abs(here - there) <= SAME_FIGURE * max(abs(there), at_least)


def lacks_temperature(calibration: "Calibration") -> bool:
    """Whether an effect follows the temperature on a rate table, which the file does not hold."""
    if all(one.temperature is not None for one in calibration.table_means):
        return False
    sensor = calibration.sensors.get("gyroscope")
    try:
        terms = [] if sensor is None else [one.known() for one in sensor.effects]
    except UsageError:  # an effect of the user's own is in no file
        return False
    of_temperature = {"temperature", "thermal-lag"}  # a lag is drawn over the time
    return any(of_temperature & {term.effect.against, term.name} for term in terms)


def _unproven(calibration: "Calibration") -> str:
    """That a sensor does not leave the error on its own readings that the file states."""
    try:
        errors = Proof(calibration).errors(own(calibration), frame=False)
    except UsageError:  # an effect of the user's own is in no file
        return ""
    rounding = SAME_FIGURE * calibration.gravity.value
    for name, slack in (("accelerometer", rounding), ("gyroscope", SAME_ANGLE)):
        if name not in errors or calibration[name].unit != ERROR_UNITS[name]:
            continue
        error, unit, stated = errors[name], calibration[name].unit, calibration[name].rms_fitted
        if not abs(error - stated) <= SAME_ERROR * stated + slack:  # nor infinite
            return (
                f"the {name}'s error on the measurements in the file is {quantity(error, unit)} "
                f"instead of {quantity(stated, unit)}"
            )
    return ""
