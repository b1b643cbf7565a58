"""The usable rotations between holds, as one table of samples."""

import itertools
from collections.abc import Sequence
from dataclasses import field, replace
from functools import cached_property

import numpy as np

from imucal_wizard.core.attitude import RotationSamples, rotation_samples, strictly_later
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import (
    MAX_READING,
    MAX_SAMPLE_INTERVALS,
    BoolArray,
    FloatArray,
    IntArray,
    distinct,
)
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import lengths, median, median_of_rows
from imucal_wizard.estimate.noise import has_rate
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.estimate.rounded import rate_place, rate_shift, rate_step
from imucal_wizard.estimate.rounding_in_motion import RoundingInMotion, rounding_in_motion
from imucal_wizard.measurement.gaps import error_across_gaps
from imucal_wizard.measurement.holds import Hold, Rotation, times_in_hold
from imucal_wizard.measurement.repeats import measured_rows
from imucal_wizard.model.rows.source import (
    Parameters,
)

MIN_ROTATION_SAMPLES = 3
"""Of a rotation."""
WILD_RATIO = 10.0
"""Distance of a wrong reading from the mean of its neighbours, over the median one."""
MAX_SHARE_BESIDE = 0.2
"""Of that distance, by which its neighbours may differ: the motion goes on as before."""
WILD_RATE = 3.0
"""Times the largest of all other rates that a wrong reading is at least: a bump seldom turns the
device so much faster for one sample only. A choice: smaller, and bumped rotations are lost."""


@dataclass(frozen=True, eq=False)
class RotationSet:
    """The usable rotations between holds, ready to be integrated.

    Attributes:
        samples: of the m usable rotations.
        usable: which of all rotations they are, shape (m,); the recording's own come first, those
            that only a field makes useful have numbers beyond them.
        before: the hold that each starts from, shape (m,).
        after: the hold that it ends in, shape (m,).
        up: direction of the calibrated specific force at each sample, shape (n, 3); None where
            the accelerometer in the rotations was not kept.
        rounding: variance by which the steps of the readings shift the mean rate of all holds
            alike, reading units², shape (3,).
        step: of the readings on each axis, their unit, shape (3,); 0 where they never change.
        place: variance of the error by the place of the rests in their step, if that is not known,
            reading units², shape (3,).
    """

    samples: RotationSamples
    usable: IntArray
    before: IntArray
    after: IntArray
    up: FloatArray | None
    rounding: FloatArray
    step: FloatArray
    place: FloatArray = field(default_factory=lambda: np.zeros(3))

    @property
    def spans(self) -> FloatArray:
        """Times of the first and last sample of each, s, shape (m, 2)."""
        offsets = self.samples.offsets
        return self.samples.time[np.column_stack([offsets[:-1], offsets[1:] - 1])]

    @property
    def seconds(self) -> FloatArray:
        """How long each takes, s, shape (m,)."""
        return np.asarray(np.diff(self.spans)[:, 0])

    @cached_property
    def across_gaps(self) -> FloatArray:
        """Variance of the integral of each axis by missing samples, reading units² s², (m, 3)."""
        samples = self.samples
        interval, steps = median(samples.dt[samples.dt > 0.0]), np.diff(samples.time)
        found = np.zeros((len(self.usable), 3))
        wide = (steps > MAX_SAMPLE_INTERVALS * interval) & (np.diff(samples.rotation) == 0)
        for row in distinct(samples.rotation[:-1][wide]):
            own = slice(*samples.offsets[row : row + 2])
            found[row] = error_across_gaps(samples.time[own], samples.reading[own], interval)
        return np.nan_to_num(found, posinf=0.0)

    def rates(self, calibration: Parameters) -> FloatArray:
        """Corrected rate of each sample, rad/s, shape (n, 3)."""
        return np.asarray((self.samples.reading - calibration.bias) @ calibration.matrix.T)

    def rounding_in_motion(self, holds: Sequence[Hold]) -> RoundingInMotion:
        """What the steps of the readings do to each rotation between these still periods."""
        return rounding_in_motion(self.samples, self.step, holds)

    def between_means(
        self, holds: Sequence[Hold], turning: BoolArray
    ) -> tuple[RotationSamples, BoolArray, FloatArray]:
        """The samples from mean direction to mean direction of holds in which the device turns.

        A constant reading in half such a hold stands for its samples: its integral is that from
        each moment of the hold to where the rotation begins, in the mean over the hold. Bias, gains
        and effects act on it as on the samples.

        Args:
            holds: all of them.
            turning: those in which the device turns, shape (h,).

        Returns:
            The samples, n of them, which of these were recorded, and the time that the reading of
            each comes from, s, shapes (n,).
        """
        samples = self.samples
        if not turning[np.concatenate([self.before, self.after])].any():
            return samples, np.ones(len(samples.time), bool), samples.time
        interval, times, readings, recorded = median(samples.dt[samples.dt > 0.0]), [], [], []
        happened = []
        for place, (first, past) in enumerate(itertools.pairwise(samples.offsets.tolist())):
            time, reading = samples.time[first:past], samples.reading[first:past]
            ahead = behind = 0
            happened.append(time)
            if turning[self.before[place]]:
                until, mean = _to_mean(holds[self.before[place]], time, reading, interval, 1)
                ahead = len(until)
                time = np.append(time[0] - until[::-1], time)
                reading = np.vstack([np.tile(mean, (ahead, 1)), reading])
                happened.insert(-1, _times_of(holds[self.before[place]], ahead, 1))
            if turning[self.after[place]]:
                own = slice(ahead, None)
                hold = holds[self.after[place]]
                until, mean = _to_mean(hold, time[own], reading[own], interval, -1)
                behind = len(until)
                time = np.append(time, time[-1] + until)
                reading = np.vstack([reading, np.tile(mean, (behind, 1))])
                happened.append(_times_of(hold, behind, -1))
            times.append(time)
            readings.append(reading)
            recorded.append(np.repeat([False, True, False], [ahead, past - first, behind]))
        made = rotation_samples(times, readings)
        return made, np.concatenate(recorded), np.concatenate(happened)

    def joined(
        self,
        first: int,
        ends: Sequence[tuple[int, int]],
        times: Sequence[FloatArray],
        readings: Sequence[FloatArray],
    ) -> "RotationSet":
        """With further rotations.

        Args:
            first: number of the first of them.
            ends: the hold before and the hold after each.
            times: of the samples of each, s.
            readings: of the gyroscope in each, its unit.
        """
        if not ends:
            return self
        own = self.samples
        parts = [slice(*pair) for pair in itertools.pairwise(own.offsets.tolist())]
        before, after = np.array(ends, np.int64).T
        return replace(
            self,
            samples=rotation_samples(
                [*(own.time[part] for part in parts), *times],
                [*(own.reading[part] for part in parts), *readings],
            ),
            usable=np.concatenate([self.usable, first + np.arange(len(ends))]),
            before=np.concatenate([self.before, before]),
            after=np.concatenate([self.after, after]),
            up=None,
        )


def _times_of(hold: Hold, count: int, sign: int) -> FloatArray:
    """Times for so many samples of equal weight, rising, shape (count,)."""
    part = (np.arange(count) + 0.5) / count
    return times_in_hold(hold.start, hold.end, part, sign)


def _to_mean(
    hold: Hold, time: FloatArray, reading: FloatArray, interval: float, sign: int
) -> tuple[FloatArray, FloatArray]:
    """Times from the end of a rotation to the mean of a hold, and the reading in between.

    Args:
        hold: before the rotation (``sign`` 1) or after it (−1).
        time: of the samples of the rotation, s, shape (n,).
        reading: of these, shape (n, 3).
        interval: of the samples, s.
        sign: see ``hold``.

    Returns:
        Seconds from the first or last sample, rising, shape (k,); reading, shape (3,).
    """
    assert hold.gyroscope is not None and hold.gyroscope_turn is not None  # noqa: S101, PT018 (narrows)
    whole, half = 0.5 * (hold.end - hold.start), 0.5 * interval
    turned = whole * hold.gyroscope + sign * hold.gyroscope_turn
    if hold.gyroscope_order is not None:
        turned = turned + hold.gyroscope_order[int(sign > 0)]
    # a sample counts half an interval to either side: one that the rotation has, too, counts there,
    # but for the outer half of its first or last one
    if sign > 0:
        near, inside = reading[0], time < hold.end - half
    else:
        near, inside = reading[-1], time > hold.start - half
    shared = int(inside.sum())
    if shared:
        turned = turned - shared * interval * reading[inside].mean(axis=0)
    turned = turned + half * near
    left = max(whole - shared * interval + half, interval)
    count = max(round(left / interval), 1)
    step = left / count
    # by the trapezoidal rule, which joins the reading to the sample at the end
    return np.asarray(step * np.arange(1, count + 1), np.float64), np.asarray(
        (turned / step - 0.5 * near) / (count - 0.5)
    )


def examined(rotations: Sequence[Rotation]) -> list[Rotation]:
    """The rotations, with the problem named of those that cannot be integrated."""
    return [replace(one, problem=one.problem or _problem(one)) for one in rotations]


def _problem(rotation: Rotation) -> str | None:
    if (
        len(rotation.time) < MIN_ROTATION_SAMPLES
        or strictly_later(rotation.time).sum() < MIN_ROTATION_SAMPLES
    ):
        return "no gyroscope samples in it"
    if not (np.abs(rotation.rate) < MAX_READING).all() or not np.isfinite(rotation.time).all():
        return "its gyroscope samples are not all numbers"
    force = rotation.accelerometer
    if force is not None and not (np.abs(force) < MAX_READING).all():
        return "its accelerometer samples are not all numbers"
    return _wild_reading(rotation)


def _wild_reading(rotation: Rotation) -> str | None:
    """That single readings are far beyond all others, of which those beside them know nothing."""
    rows = measured_rows(rotation.rate)
    rate = rotation.rate if rows is None else rotation.rate[rows]
    rate = rate - median_of_rows(rate)
    if len(rate) < MIN_ROTATION_SAMPLES:
        return None
    off = np.abs(rate[1:-1] - 0.5 * (rate[:-2] + rate[2:]))
    wild = off > WILD_RATIO * np.maximum(median_of_rows(off), 1e-300)
    wild &= np.abs(rate[2:] - rate[:-2]) < MAX_SHARE_BESIDE * off
    size = np.abs(rate[1:-1])
    wild &= size > WILD_RATE * np.where(wild, 0.0, size).max()
    if not wild.any():
        return None
    axis = AXES[int(wild.sum(axis=0).argmax())]
    return f"single readings of {axis} are far beyond all others: they are wrong, or it was knocked"


def rotation_set(
    holds: Sequence[Hold], rotations: Sequence[Rotation], accelerometer: SensorFit | Parameters
) -> RotationSet:
    """The usable ones of examined rotations.

    Raises:
        DataError: there is none, or no mean of the gyroscope at rest.
    """
    places = {(hold.start, hold.end): index for index, hold in enumerate(holds)}
    found = []
    for index, one in enumerate(rotations):
        before = places.get((one.before.start, one.before.end))
        after = places.get((one.after.start, one.after.end))
        if one.problem is None and before is not None and after is not None:
            found.append((index, before, after))
    if not found or not any(has_rate(hold) for hold in holds):
        raise DataError("no usable rotation between two holds")
    table = np.array(found, np.int64)
    turned = [rotations[i] for i in table[:, 0]]
    samples = rotation_samples([one.time for one in turned], [one.rate for one in turned])
    forces = [
        one.accelerometer[strictly_later(one.time)]
        for one in turned
        if one.accelerometer is not None
    ]
    up = None
    if len(forces) == len(turned):
        force = (np.concatenate(forces) - accelerometer.bias) @ accelerometer.matrix.T
        length = lengths(force)[:, None]
        up = force / np.maximum(length, 1e-9 * max(float(length.max()), 1e-300))
    step, ends = rate_step(turned), (table[:, 1], table[:, 2])
    shift, place = (of(holds, step) for of in (rate_shift, rate_place))
    return RotationSet(samples, table[:, 0], *ends, up, shift, step, place)
