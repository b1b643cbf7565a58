"""Everything measured of a gyroscope: rotations, still means, their noise and circumstances."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.effects.effect import Circumstances
from imucal_wizard.errors import DataError
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.procedure.rotations import Rotation
from imucal_wizard.readings import FloatArray, Readings
from imucal_wizard.solver.accelerometer import AccelerometerFit
from imucal_wizard.solver.attitude import IntArray
from imucal_wizard.solver.closure import BIAS, SIZE
from imucal_wizard.solver.extended.samples import Samples, lay_samples
from imucal_wizard.solver.extended.surroundings import circumstances_of, first_time
from imucal_wizard.solver.gains import Nominal, nominal_of
from imucal_wizard.solver.noise import hold_noise
from imucal_wizard.solver.result import SensorFit
from imucal_wizard.units import COUNT

SMALLEST_CLOSING = 1e-7
"""No closure is better known, rad; data without any noise keep a weight."""
SMALLEST_STILL = 1e-9
"""The same of a still mean, rad/s."""


@dataclass(frozen=True, eq=False)
class TurnData:
    """What is known of a gyroscope.

    Attributes:
        unit: of the readings, ``rad/s`` or ``count``.
        gravity: m/s².
        samples: of the m usable rotations.
        rotations: which of all rotations they are, shape (m,).
        before: up at the hold before each, unit vectors, shape (m, 3).
        after: up at the hold after, shape (m, 3).
        before_doubt: change of ``before`` with each of the k ways in which the accelerometer may
            be wrong by one standard deviation, shape (m, 3, k).
        after_doubt: the same of ``after``.
        closing_noise: variance of a closure component by the noise of both directions and of the
            rates between them, rad², shape (m,).
        motion: circumstances of the samples; force and rate are those of the base fit.
        stills: mean reading of each hold, shape (h, 3).
        still_rows: which of all holds they are, shape (h,).
        labels: number of each hold's direction, shape (h,).
        still_noise: variance of their means by noise alone, (rad/s)², shape (h, 3).
        circumstances: of the holds with a mean.
        start: matrix and bias of the base fit, shapes (3, 3) and (3,).
        carried: which of the twelve base parameters the rotations carry.
        nominal: what a gain is that is not fitted.
    """

    unit: str
    gravity: float
    samples: Samples
    rotations: IntArray
    before: FloatArray
    after: FloatArray
    before_doubt: FloatArray
    after_doubt: FloatArray
    closing_noise: FloatArray
    motion: Circumstances
    stills: FloatArray
    still_rows: IntArray
    labels: IntArray
    still_noise: FloatArray
    circumstances: Circumstances
    start: tuple[FloatArray, FloatArray]
    carried: tuple[int, ...]
    nominal: Nominal

    def __len__(self) -> int:
        return len(self.before)

    def free(self, base: Sequence[str]) -> tuple[int, ...]:
        """Which of the twelve parameters are fitted: of ``base`` what the rotations carry."""
        wanted = set(range(BIAS.start, SIZE)) if "bias" in base else set()
        wanted |= set(self.nominal.scales) if "scale" in base else set()
        if "non-orthogonality" in base:
            wanted |= set(range(9)) - set(self.nominal.scales)
        return tuple(index for index in self.carried if index in wanted)

    def begin(self, free: Sequence[int]) -> tuple[FloatArray, FloatArray]:
        """Matrix and bias to start from; what is not free has its nominal value."""
        matrix, bias = self.start
        nominal = self.nominal.filled(matrix, free)
        if self.unit == COUNT:
            flat, scales = nominal.ravel(), list(self.nominal.scales)
            common = float(np.abs(matrix.ravel()[scales]).mean())
            fixed = [index for index in scales if index not in free]
            signs = dict(zip(scales, self.nominal.signs, strict=True))
            flat[fixed] = [common * signs[index] for index in fixed]
            nominal = flat.reshape(3, 3)
        if not set(range(BIAS.start, SIZE)) & set(free):
            bias = self.stills.mean(axis=0) if self.unit == COUNT else np.zeros(3)
        return nominal, bias

    def everything(self) -> Circumstances:
        """The circumstances of holds and of samples in motion, one after the other."""
        still, motion = self.circumstances, self.motion
        return replace(
            still,
            force=np.concatenate([still.force, motion.force]),
            rate=np.concatenate([still.rate, motion.rate]),
            temperature=np.concatenate([still.temperature, motion.temperature]),
            time=np.concatenate([still.time, motion.time]),
            previous=np.concatenate([still.previous, motion.previous]),
            vibration=np.concatenate([still.vibration, motion.vibration]),
        )


def turn_data(
    holds: Sequence[Hold],
    rotations: Sequence[Rotation],
    accelerometer: AccelerometerFit,
    fit: SensorFit,
    gravity: float,
    readings: Readings | None = None,
) -> TurnData:
    """All that is known of a gyroscope.

    Args:
        holds: those that the accelerometer was fitted to.
        rotations: between them; those with a problem are left out.
        accelerometer: its fit, with the effects it has (``Extended.accelerometer``).
        fit: the gyroscope's base fit, to start from.
        gravity: m/s².
        readings: what the holds were found in: beginning of the session, temperature.

    Raises:
        DataError: no usable rotation, or no mean at rest.
    """
    places = {(hold.start, hold.end): index for index, hold in enumerate(holds)}
    ends = [
        (places.get((r.before.start, r.before.end)), places.get((r.after.start, r.after.end)))
        for r in rotations
    ]
    usable = [
        i for i, (r, end) in enumerate(zip(rotations, ends, strict=True))
        if r.problem is None and None not in end
    ]  # fmt: skip
    rows = [i for i, hold in enumerate(holds) if hold.gyroscope is not None]
    if not usable or not rows:
        raise DataError("the gyroscope has no usable rotation between two holds")
    before, after = np.array([ends[i] for i in usable], np.int64).T
    samples = lay_samples([rotations[i].time for i in usable], [rotations[i].rate for i in usable])
    gain = float(np.linalg.norm(accelerometer.fit.matrix, ord=2))
    known = circumstances_of(holds, accelerometer.up, gravity, gain, readings)
    doubt = accelerometer.up_doubt
    doubt = np.zeros((len(holds), 3, 0)) if doubt is None else doubt
    density = hold_noise(holds).gyroscope_density
    density = np.zeros(3) if density is None else density
    # |M|² per axis: variance of the corrected rate per second of averaging
    per_second = (fit.matrix**2) @ density
    seconds = np.array([holds[i].end - holds[i].start for i in rows])
    durations = samples.time[samples.offsets[1:] - 1] - samples.time[samples.offsets[:-1]]
    direction = accelerometer.direction_variance
    walk = float(per_second.mean()) * durations
    start = (fit.matrix, fit.bias)
    nominal = nominal_of(fit.matrix, fit.bias_unit != COUNT)
    dropped = {parameter.name for parameter in fit.parameters if not parameter.carried}
    return TurnData(
        unit=fit.bias_unit,
        gravity=gravity,
        samples=samples,
        rotations=np.array(usable, np.int64),
        before=accelerometer.up[before],
        after=accelerometer.up[after],
        before_doubt=doubt[before],
        after_doubt=doubt[after],
        closing_noise=np.maximum(direction[before] + direction[after] + walk, SMALLEST_CLOSING**2),
        motion=_motion(known, samples, before, start, first_time(holds, readings), readings),
        stills=np.array([holds[i].gyroscope for i in rows]),
        still_rows=np.array(rows, np.int64),
        labels=accelerometer.labels[rows],
        still_noise=np.maximum(per_second / seconds[:, None], SMALLEST_STILL**2),
        circumstances=known.select(np.array(rows)),
        start=start,
        carried=tuple(
            i for i in range(SIZE) if i >= BIAS.start or nominal.parameter(i) not in dropped
        ),
        nominal=nominal,
    )


def _motion(
    known: Circumstances,
    samples: Samples,
    before: IntArray,
    start: tuple[FloatArray, FloatArray],
    origin: float,
    readings: Readings | None,
) -> Circumstances:
    """Circumstances of the samples; time and temperature have the references of the holds."""
    hold = before[samples.rotation]
    time = samples.time - origin
    matrix, bias = start
    return replace(
        known.select(hold),
        rate=(samples.reading - bias) @ matrix.T,
        temperature=_temperature(known, time, origin, readings),
        time=time,
        previous=known.force[hold],
    )


def _temperature(
    known: Circumstances, time: FloatArray, origin: float, readings: Readings | None
) -> FloatArray:
    """As recorded, else between the holds; NaN where nothing is known."""
    if readings is not None and readings.temperature is not None and len(readings.temperature):
        series = readings.temperature
        return np.interp(time, series.time - origin, series.values[:, 0])
    told = np.isfinite(known.temperature)
    if not told.any():
        return np.full(len(time), np.nan)
    return np.interp(time, known.time[told], known.temperature[told])
