"""A sensor as its calibration left it, and the rows of a recheck that begin there."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.limits import drift as limits
from imucal_wizard.core.limits.drift import UsualDrift
from imucal_wizard.core.limits.use import IMPLAUSIBLE_SCALE, USUAL_ROTATION_SECONDS
from imucal_wizard.core.poses import AXES, DIRECTIONS, POSE_SETS
from imucal_wizard.core.readings import FloatArray, Readings
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import COUNT
from imucal_wizard.estimate.accelerometer import (
    BASE,
    ENTRY_OF,
    AccelerometerExperiment,
)
from imucal_wizard.estimate.experiment import Experiment
from imucal_wizard.estimate.fit import Minimum
from imucal_wizard.estimate.fit_warnings import scale_notes
from imucal_wizard.estimate.gyroscope import GyroscopeExperiment
from imucal_wizard.estimate.noise import hold_noise
from imucal_wizard.estimate.parameters import base_parameters
from imucal_wizard.estimate.rate_table import RateTableExperiment
from imucal_wizard.estimate.rest_spectrum import rest_spectrum, with_quiet_noise
from imucal_wizard.estimate.result import GravityReference
from imucal_wizard.estimate.rotation_set import RotationSet, examined, rotation_set
from imucal_wizard.estimate.settling import common_settling
from imucal_wizard.estimate.split import principal_steps
from imucal_wizard.estimate.table_steps import TableData
from imucal_wizard.measurement.blocks import rest_in_words
from imucal_wizard.measurement.holds import Hold, Rotation
from imucal_wizard.model.effect import ACCELEROMETER, GYROSCOPE, Circumstances
from imucal_wizard.model.identifiability import ANGLES, Identifiable
from imucal_wizard.model.nominal_gains import CROSS_PRIOR, SCALE_PRIOR, nominal_of
from imucal_wizard.model.rows.source import BIAS, ENTRIES, Parameters
from imucal_wizard.model.terms import Term, Terms, corrected

EVERYTHING = Identifiable(np.eye(9), tuple(range(9)), BASE, (), "", 0)
"""The calibration determines what a few holds do not."""
PLANNED_FORCE = 3e-4
"""Noise of a hold of two seconds in units of gravity, while the next pose is chosen."""
PLANNED_RATE = np.radians(0.01)
"""The same of a mean rate, rad/s."""
PLANNED_CLOSURE = np.radians(0.1)
"""The same of a rotation, rad."""
LEAST_TURN = 0.1
"""Sine of the smallest rotation that shows a scale."""


@dataclass(frozen=True, eq=False)
class RecheckData:
    """What was measured.

    Attributes:
        holds: still periods, in the order of time.
        rotations: between them.
        seconds: duration, s.
        readings: the recording, where it is at hand.
        table: what a rate table did in it, or None.
    """

    holds: Sequence[Hold]
    rotations: Sequence[Rotation]
    seconds: float
    readings: Readings | None = None
    table: TableData | None = None


@dataclass(frozen=True, eq=False)
class DriftCovariance:
    """Covariance of M and b by the drift of an unchanged sensor, shape (12, 12) each.

    Attributes:
        whole: of everything together.
        by_temperature: part of it by the difference of temperature.
        by_age: part of it by ageing.
    """

    whole: FloatArray
    by_temperature: FloatArray
    by_age: FloatArray


@dataclass(frozen=True, eq=False)
class CalibratedSensor(ABC):
    """A sensor as its calibration left it.

    Attributes:
        calibration: M, b and the sizes of the effects.
        unit: of the readings.
        covariance: of M by rows and b, shape (12, 12).
        terms: the effects.
        reference_temperature: of the effects, °C, or NaN.
        reference_time: of a drift, s, or NaN.
        temperature: of the calibration, °C, or None.
        coefficient: standard error of the known temperature coefficient of each bias, SI/°C, shape
            (3,); None where none is known.
        scale_coefficient: whether that of the scales is known.
        years: since the calibration.
        seat: variance by which holds scatter beyond their noise, SI².
        limit: of use, in the unit of the error.
        sensor: ``accelerometer`` or ``gyroscope``.
        error_unit: of the errors of a recheck.
        limit_seconds: what the sensor's limit of use in other commands is divided by, s or 1.
        entries: which of the twelve entries the covariance of a calibration file is of, in order.
        advice: what shows an axis.
        zeroes: devices zero the bias at their start.
        own_frame: M is upper triangular.
    """

    calibration: Parameters
    unit: str
    covariance: FloatArray
    terms: tuple[Term, ...]
    reference_temperature: float
    reference_time: float
    temperature: float | None
    coefficient: FloatArray | None
    scale_coefficient: bool
    years: float
    seat: float
    limit: float

    sensor = ""
    error_unit = ""
    limit_seconds = 1.0
    entries: tuple[int, ...] = tuple(range(ENTRIES))
    advice = ""
    zeroes = False
    own_frame = True

    @abstractmethod
    def experiment(
        self, measured: RecheckData, gravity: float, reference: GravityReference | None
    ) -> Experiment:
        """The rows of a recheck, from the calibration on.

        Args:
            measured: holds and rotations.
            gravity: m/s².
            reference: up in each hold, for sensors that are judged by it.

        Raises:
            DataError: there is no row.
        """

    @abstractmethod
    def error_rows(self, gravity: float) -> FloatArray:
        """L: the error of corrected readings by a change of M and b, shape (k, 12).

        Args:
            gravity: m/s².
        """

    @property
    def angles(self) -> dict[int, str]:
        """Name of each entry of M that is an angle between axes."""
        if self.own_frame:
            return {ENTRY_OF[place]: name for place, name in ANGLES.items()}
        nominal = nominal_of(self.calibration.matrix, self.unit != COUNT)
        return {k: nominal.parameter(k) for k in range(9) if k not in nominal.scales}

    def named(self, entries: FloatArray) -> dict[str, float]:
        """The parameters that people speak of, by M's entries and b, shape (12,)."""
        matrix, bias = entries[:9].reshape(3, 3), entries[9:]
        return base_parameters(matrix, bias, self.unit, own_frame=self.own_frame)

    @abstractmethod
    def planned(
        self, before: FloatArray, after: FloatArray, gravity: float
    ) -> tuple[FloatArray, FloatArray]:
        """Rows of a hold that is taken by the shortest rotation, by M and b, and their variances.

        Args:
            before: up in the hold before, unit vector.
            after: up in the hold.
            gravity: m/s².

        Returns:
            Rows, shape (n, 12), and variances, shape (n,).
        """

    def reference(
        self, experiment: Experiment, found: Minimum[Experiment], covariance: FloatArray
    ) -> GravityReference | None:
        """Up in each hold by the sensor as it is today; None of one that does not show it.

        Args:
            experiment: its rows.
            found: the estimate.
            covariance: of M and b, shape (12, 12).
        """
        del experiment, found, covariance
        return None

    def misread(self, found: Parameters) -> str:
        """That the scale has changed as no sensor's does, and what explains it; or "".

        Args:
            found: the parameters of today.
        """
        del found
        return ""

    def drift(self, usual: UsualDrift, warmer: float | None) -> DriftCovariance:
        """Covariance of M and b by the drift of an unchanged sensor.

        Args:
            usual: of its grade.
            warmer: temperature above that of the calibration, °C; None where it is not known.
        """
        apart = limits.UNKNOWN_TEMPERATURE if warmer is None else abs(warmer)
        unknown = np.full(3, usual.bias_per_degree)
        per_degree = unknown if self.coefficient is None else self.coefficient
        scale = 0.0 if self.scale_coefficient else (usual.scale_per_degree * apart) ** 2
        warm = self.spread((per_degree * apart) ** 2, scale, 0.0)
        bias, scale = np.full(3, usual.bias_per_year**2), usual.scale_per_year**2
        aged = self.spread(bias * self.years, scale * self.years, 0.0)
        start = self.spread(np.full(3, usual.bias**2), usual.scale**2, usual.angle**2)
        return DriftCovariance(start + aged + warm, warm, aged)

    def spread(self, bias: FloatArray, scale: float, angle: float) -> FloatArray:
        """Covariance of M and b for variances of the biases (SI), scales and angles, (12, 12)."""
        steps = [math.sqrt(bias[axis]) * self.bias_step(axis) for axis in range(3)]
        steps += [math.sqrt(scale) * self.scale_step(axis) for axis in range(3)]
        out = np.array(steps).T @ np.array(steps)
        for entry in self.angles:
            out[entry, entry] += angle * self.size**2
        return np.asarray(out)

    def turned(self, angle: float) -> FloatArray:
        """Covariance of M and b of a sensor that may have turned on its board, shape (12, 12).

        Args:
            angle: standard deviation about each axis, rad.
        """
        matrix = self.calibration.matrix
        about = np.cross(np.eye(3)[:, None, :], matrix.T[None, :, :]).transpose(0, 2, 1)
        steps = angle * np.hstack([about.reshape(3, 9), np.zeros((3, 3))])
        return np.asarray(steps.T @ steps)

    def left_out(self, names: Sequence[str]) -> FloatArray:
        """Covariance of M and b for parameters that were left at their nominal value, (12, 12).

        Args:
            names: of these parameters.
        """
        scales = {f"sensitivity_{axis}": self.scale_step(i) for i, axis in enumerate(AXES)}
        steps = [SCALE_PRIOR * scales[name] for name in names if name in scales]
        out = np.zeros((ENTRIES, ENTRIES))
        for step in steps:
            out += np.outer(step, step)
        for entry, name in self.angles.items():
            out[entry, entry] += (CROSS_PRIOR * self.size) ** 2 * (name in names)
        return out

    @property
    def size(self) -> float:
        """Largest gain of M."""
        return float(np.linalg.norm(self.calibration.matrix, 2))

    def bias_step(self, axis: int) -> FloatArray:
        """Change of M and b when the bias that acts on an axis grows by 1 SI unit, shape (12,)."""
        step = np.zeros(ENTRIES)
        step[BIAS] = np.linalg.inv(self.calibration.matrix)[:, axis]
        return step

    def scale_step(self, axis: int) -> FloatArray:
        """Change of M and b when the sensitivity of a sensor axis grows by its own size, (12,)."""
        matrix = np.zeros((3, 3))
        matrix[:, axis] = -self.calibration.matrix[:, axis]
        return np.concatenate([matrix.ravel(), np.zeros(3)])

    def vector_errors(self, true: FloatArray) -> FloatArray:
        """Error of corrected readings of true inputs by a change of M and b, shape (n, 3, 12)."""
        vectors = np.zeros((len(true), 3, ENTRIES))
        for axis in range(3):
            part = slice(3 * axis, 3 * axis + 3)
            vectors[:, axis, part] = -true @ np.linalg.inv(self.calibration.matrix).T
        vectors[:, :, BIAS] = self.calibration.matrix
        return vectors

    def without_effects(self, readings: FloatArray, where: Circumstances) -> FloatArray:
        """Readings that the sensor would give without its known effects, shape (n, 3).

        Args:
            readings: shape (n, 3).
            where: the circumstances of each.
        """
        matrix, bias = self.calibration.matrix, self.calibration.bias
        where = replace(
            where,
            reference_temperature=self.reference_temperature,
            reference_time=self.reference_time,
        )
        terms = Terms(self.sensor, self.terms)
        true = corrected((matrix, bias), terms, self.calibration.sizes, readings, where)
        return np.asarray(true @ np.linalg.inv(matrix).T + bias)


class CalibratedAccelerometer(CalibratedSensor):
    """Its error is that of the magnitude of gravity, in the faces and edges."""

    sensor, error_unit, entries = ACCELEROMETER, "m/s^2", ENTRY_OF
    advice = "hold the device still with that axis up and down"

    def error_rows(self, gravity: float) -> FloatArray:
        """See ``CalibratedSensor``."""
        up = np.array([DIRECTIONS[name] for name in POSE_SETS["18"]])
        return np.asarray(np.einsum("ni,nip->np", up, self.vector_errors(gravity * up)))

    def planned(
        self, before: FloatArray, after: FloatArray, gravity: float
    ) -> tuple[FloatArray, FloatArray]:
        """See ``CalibratedSensor``."""
        del before
        row = after @ self.vector_errors(gravity * after[None, :])[0]
        return row[None, :], np.array([(PLANNED_FORCE * gravity) ** 2])

    def experiment(
        self, measured: RecheckData, gravity: float, reference: GravityReference | None
    ) -> AccelerometerExperiment:
        """See ``CalibratedSensor``."""
        del reference
        holds = list(measured.holds)
        if not holds:
            rate = 0.0 if measured.readings is None else measured.readings.accelerometer.rate
            rest = rest_in_words(rate)
            raise DataError(f"no hold was found; hold the device still for {rest} in each pose")

        def made(holds: Sequence[Hold]) -> AccelerometerExperiment:
            args = holds, gravity, self.unit, self.calibration, EVERYTHING, hold_noise(holds)
            found = AccelerometerExperiment(*args, measured.readings)
            force = (found.source.reading - self.calibration.bias) @ self.calibration.matrix.T
            error = np.linalg.norm(force, axis=1) - gravity
            settling = common_settling(holds, found.up, found.gain, error)
            if settling is not None:
                found = AccelerometerExperiment(*args, measured.readings, settling=settling)
            found.source = replace(found.source, noise=found.source.noise + self.seat)
            found.sources = (found.source,)
            return found

        experiment = made(holds)
        if not self.terms:
            return experiment
        means = np.array([hold.accelerometer for hold in holds])
        plain = self.without_effects(means, experiment.circumstances)
        return made([replace(h, accelerometer=m) for h, m in zip(holds, plain, strict=True)])

    def reference(
        self, experiment: Experiment, found: Minimum[Experiment], covariance: FloatArray
    ) -> GravityReference | None:
        """See ``CalibratedSensor``."""
        own = cast("AccelerometerExperiment", experiment)
        rows = own.source.at(found.calibration, Terms(ACCELEROMETER, ()))
        doubt = rows.up_columns() @ principal_steps(covariance)
        return own.referred(rows.direction, doubt, 0.0, np.eye(9))


class CalibratedGyroscope(CalibratedSensor):
    """Its error is that of each component, at rest and at the usual rate about each axis."""

    sensor, error_unit = GYROSCOPE, "rad/s"
    limit_seconds = USUAL_ROTATION_SECONDS
    advice = "turn the device about that axis between two holds"
    zeroes = True
    own_frame = False

    def misread(self, found: Parameters) -> str:
        """See ``CalibratedSensor``."""
        shares = np.linalg.svd(found.matrix @ np.linalg.inv(self.calibration.matrix))[1]
        if shares[-1] < np.exp(-IMPLAUSIBLE_SCALE) * shares[0]:
            return ""  # a unit or range changes all axes alike; this is a fault of one axis
        return "; ".join(scale_notes(float(np.cbrt(shares.prod())), 0.0))

    def error_rows(self, gravity: float) -> FloatArray:
        """See ``CalibratedSensor``."""
        del gravity
        true = limits.USUAL_RATE * np.vstack([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
        return self.vector_errors(true).reshape(-1, ENTRIES)

    def planned(
        self, before: FloatArray, after: FloatArray, gravity: float
    ) -> tuple[FloatArray, FloatArray]:
        """See ``CalibratedSensor``: the rates at rest, and the angle about the rotation's axis."""
        del gravity
        rest = self.vector_errors(np.zeros((1, 3)))[0]
        turn = np.cross(after, before)  # up turns the other way in the body
        angle = float(np.arctan2(np.linalg.norm(turn), before @ after))
        if not np.linalg.norm(turn) > LEAST_TURN:
            return rest, np.full(3, PLANNED_RATE**2)
        axis = turn / np.linalg.norm(turn)
        row = axis @ self.vector_errors(angle * axis[None, :])[0]
        row[BIAS] = 0.0  # the rests tell the bias far better
        variance = np.array([*np.full(3, PLANNED_RATE**2), PLANNED_CLOSURE**2])
        return np.vstack([rest, row]), variance

    def experiment(
        self, measured: RecheckData, gravity: float, reference: GravityReference | None
    ) -> Experiment:
        """See ``CalibratedSensor``."""
        del gravity
        if reference is None:
            raise DataError("there is no calibrated accelerometer to tell gravity by")
        spectrum = rest_spectrum(measured.readings, measured.holds)
        holds = with_quiet_noise(measured.holds, spectrum)
        of, plain = reference, self.calibration
        turned = rotation_set(holds, examined(measured.rotations), plain)
        nominal = nominal_of(plain.matrix, self.unit != COUNT)

        def made(holds: Sequence[Hold], turned: RotationSet) -> GyroscopeExperiment:
            args = holds, turned, of, self.unit, plain, nominal
            found = GyroscopeExperiment(*args, readings=measured.readings, spectrum=spectrum)
            found.rest = replace(found.rest, noise=found.rest.noise + self.seat)
            found.sources = (found.rest, *found.sources[1:])
            return found

        experiment = made(holds, turned)
        if not self.terms:
            return experiment
        samples, recorded = turned.samples, experiment.recorded
        moving = experiment.closure.at(plain, Terms(GYROSCOPE, ())).motion.select(recorded)
        reading = self.without_effects(samples.reading, moving)
        still = np.array([hold.gyroscope for hold in experiment.resting])
        means = iter(self.without_effects(still, experiment.circumstances))
        resting = {id(hold) for hold in experiment.resting}
        holds = [replace(h, gyroscope=next(means)) if id(h) in resting else h for h in holds]
        return made(holds, replace(turned, samples=replace(samples, reading=reading)))


class TableGyroscope(CalibratedGyroscope):
    """One that a rate table alone has calibrated: M is upper triangular, its frame is its own."""

    advice = "let the table turn in both senses with each face and each edge along its axis"
    own_frame = True

    def experiment(
        self, measured: RecheckData, gravity: float, reference: GravityReference | None
    ) -> Experiment:
        """See ``CalibratedSensor``."""
        del gravity, reference
        readings = measured.readings
        if measured.table is None or readings is None or readings.gyroscope is None:
            raise DataError("a rate table alone has calibrated it, and gravity does not show it")
        if self.terms:
            names = ", ".join(term.name for term in self.terms)
            raise DataError(
                f"its effects ({names}) cannot be distinguished from a change on a rate table"
            )
        args = measured.table, self.unit, self.calibration, ENTRY_OF, readings.gyroscope
        return RateTableExperiment(*args, readings)


def plain_forces(accelerometer: CalibratedSensor, holds: Sequence[Hold]) -> FloatArray:
    """Mean force in each hold by a calibration without its effects, m/s², shape (n, 3)."""
    means = np.array([hold.accelerometer for hold in holds]).reshape(-1, 3)
    plain = accelerometer.calibration
    return np.asarray((means - plain.bias) @ plain.matrix.T)


CALIBRATED_SENSORS: Mapping[str, type[CalibratedSensor]] = {
    one.sensor: one for one in (CalibratedAccelerometer, CalibratedGyroscope)
}
"""In the order in which they are judged."""
