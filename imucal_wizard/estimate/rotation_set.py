"""The usable rotations between holds, as one table of samples."""

import itertools
from collections.abc import Sequence
from dataclasses import field, replace

import numpy as np

from imucal_wizard.core.attitude import RotationSamples, rotation_samples, strictly_later
from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import MAX_READING, BoolArray, FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import lengths, median
from imucal_wizard.estimate.noise import Rest, has_rate
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.estimate.rounded import rate_place, rate_shift, rate_step, unseen_rounding
from imucal_wizard.measurement.holds import Hold, Rotation
from imucal_wizard.measurement.rounding import LEAVING, integrated_rounding
from imucal_wizard.model.rows.source import (
    Parameters,
)

MIN_ROTATION_SAMPLES = 3
"""Of a rotation."""

LEVELS = ((2.0, 6.0, 0.9), (4.0, 12.0, 1.25))
"""Two distances from the rests, in steps, and how many times the time between them an axis begins
to move before the first. As long as it rests, an error by rounding is that of the rests. A twentieth
of a step is enough to make it another one; whether the reading has changed by then depends on the
place of the rests in their step, so the beginning follows from what comes later.

The factors are those of simulated motions. A rate that grows with the n-th power of time x = (t/c)ⁿ,
in steps, has the mean error of the rests for ``c Γ(1+1/n) cos(π/2n) Σ (6/π²k²) (2πk)^(−1/n)`` on
average over all places: 0.20 c, 0.36 c and 0.47 c for n = 2, 3 and 4."""
BEGINNING = 0.28
"""Error of the sum of the readings after the beginning that is even in the place of the rests in
their step, and has the sense of the motion: standard deviation over that of the place and the time
between two ``LEVELS``. By the same series with sin(π/2n) for n = 3."""
ON_STEP = 0.75
"""Steps between the mean of the rests and a reading on their step; between two steps, on both."""

MIN_RESTS_FOR_A_COURSE = 5
"""Holds at rest from which on the bias is taken to follow a straight line over time."""


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

    def rates(self, calibration: Parameters) -> FloatArray:
        """Corrected rate of each sample, rad/s, shape (n, 3)."""
        return np.asarray((self.samples.reading - calibration.bias) @ calibration.matrix.T)

    def at_rest(self, holds: Sequence[Hold]) -> BoolArray:
        """Samples at either end of a rotation whose errors by rounding are those of the holds.

        Of an axis that never leaves the step of the rests, all of them.

        Returns:
            Of each axis, shape (n, 3).
        """
        away, out = self._away(holds), self._before_and_after(holds)
        for part in self._parts:
            out[part, (np.abs(away[part]) < ON_STEP).all(axis=0)] = True
        return out

    def _before_and_after(self, holds: Sequence[Hold]) -> BoolArray:
        """Samples before and after the motion about each axis, shape (n, 3)."""
        away, out = self._away(holds), np.zeros((len(self.samples.time), 3), bool)
        for part in self._parts:
            own, place = away[part], 0.5 + np.arange(part.stop - part.start)[:, None]
            out[part] = place < _begun(own)[0]
            out[part] |= place[::-1] < _begun(own[::-1])[0]
        return out

    def begun(self, holds: Sequence[Hold]) -> FloatArray:
        """Errors by rounding while an axis begins to move, by the place of the rests in their step.

        See ``BEGINNING``.

        Returns:
            One standard deviation, over that of the place itself, shape (n, 3).
        """
        away, out = self._away(holds), np.zeros((len(self.samples.time), 3))
        for part in self._parts:
            for own, into in ((away[part], out[part]), (away[part][::-1], out[part][::-1])):
                begun, pace, way = _begun(own)
                for axis in np.flatnonzero(pace):
                    first = int(max(begun[axis], 0.0))
                    past = int(np.ceil(begun[axis] + 2.0 * pace[axis]))
                    into[first:past, axis] += way[axis] * BEGINNING * pace[axis] / (past - first)
        return out

    def _away(self, holds: Sequence[Hold]) -> FloatArray:
        """How many steps each reading is from the mean at rest, shape (n, 3)."""
        resting = np.array([hold.gyroscope for hold in holds if has_rate(hold)]).mean(axis=0)
        stepped = self.step > 0.0
        off = np.where(stepped, self.samples.reading - resting, 0.0)
        return np.asarray(off / np.where(stepped, self.step, 1.0))

    @property
    def _parts(self) -> list[slice]:
        """The samples of each rotation."""
        return [slice(*pair) for pair in itertools.pairwise(self.samples.offsets.tolist())]

    def rounding_in_motion(self, holds: Sequence[Hold]) -> FloatArray:
        """Variance of the integral of each by steps that the noise at rest does not show.

        Args:
            holds: still periods.

        Returns:
            Of each axis, (reading × s)², shape (m, 3).
        """
        out, unseen = np.zeros((len(self.usable), 3)), unseen_rounding(holds, self.step)
        if not unseen.any():
            return out
        samples, moving = self.samples, ~self._before_and_after(holds)
        away = np.abs(self._away(holds))
        for place, part in enumerate(self._parts):
            interval = median(np.diff(samples.time[part]))
            for axis in range(3):
                own, step = samples.reading[part, axis][moving[part, axis]], self.step[[axis]]
                whole = float(integrated_rounding(own[:, None], step)[0])
                if (away[part, axis] < ON_STEP).all():
                    whole *= LEAVING  # the rest of it is the error of the holds
                whole -= len(own) * (float(step[0]) ** 2 / 12.0 - unseen[axis])
                out[place, axis] = max(whole, 0.0) * interval**2
        return np.where(unseen != 0.0, out, 0.0)

    def turned_inside(
        self, holds: Sequence[Hold], rest: Rest, start: Parameters
    ) -> tuple[FloatArray, FloatArray]:
        """How the device turned in the holds, from its mean direction to that at each rotation.

        The bias in such a hold is on a straight line through those of the holds at rest: a bias
        that has drifted is no turn.

        Args:
            holds: all of them.
            rest: their noise, which tells the holds in which it turned.
            start: calibration of the gyroscope.

        Returns:
            Rotation vectors from the mean of the hold before to the first sample, and from that of
            the hold after to the last one, rad, shape (m, 3) each.
        """
        out = np.zeros((2, len(self.usable), 3))
        middle = np.array([0.5 * (hold.start + hold.end) for hold in holds])
        bias = np.tile(start.bias, (len(holds), 1))
        still = [k for k, hold in enumerate(holds) if has_rate(hold) and not rest.carried[k]]
        if len(still) >= MIN_RESTS_FOR_A_COURSE:
            means = np.array([holds[k].gyroscope for k in still])
            course = np.polynomial.polynomial.polyfit(middle[still] - middle[0], means, 1)
            bias = course[0] + np.outer(middle - middle[0], course[1])
        parts = itertools.pairwise(self.samples.offsets.tolist())
        for place, (first, past) in enumerate(parts):
            time, reading = self.samples.time[first:past], self.samples.reading[first:past]
            for side, number in enumerate((self.before[place], self.after[place])):
                hold = holds[number]
                if not rest.carried[number]:
                    continue
                assert hold.gyroscope is not None and hold.gyroscope_turn is not None  # noqa: S101, PT018 (narrows)
                sign, inside = (1.0, time < hold.end) if side == 0 else (-1.0, time >= hold.start)
                whole = 0.5 * (hold.end - hold.start) * (hold.gyroscope - bias[number])
                turned = sign * whole + hold.gyroscope_turn
                if inside.any():  # the rotation reaches into the hold
                    within = hold.end - time[0] if side == 0 else time[-1] - hold.start
                    turned -= sign * within * (reading[inside].mean(axis=0) - bias[number])
                out[side, place] = start.matrix @ turned
        return out[0], out[1]

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


def _begun(away: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """When each axis begins to move.

    Args:
        away: how many steps each reading of a rotation is from the mean of the rests, shape (n, 3).

    Returns:
        The sample at which it begins, the samples from one of ``LEVELS`` to the other, 0 where it
        does not reach them in the first half of the rotation, and the direction, shape (3,) each.
    """
    size, axes = np.abs(away[: (len(away) + 1) // 2]), np.arange(3)
    still = float(np.logical_and.accumulate((size < 1.0).all(axis=1)).sum())
    begun, pace, way = np.full(3, still), np.zeros(3), np.zeros(3)
    for near, far, before in LEVELS:
        reached = size > far - 0.5
        moved = reached.any(axis=0)
        if not moved.any():
            continue
        first, last = np.argmax(size > near - 0.5, axis=0), np.argmax(reached, axis=0)
        fastest = moved & (last == last[moved].min())
        begun = np.where(moved, first - before * (last - first), begun)
        pace = np.where(moved, np.maximum(last - first, 0.5), pace)
        way = np.where(moved, np.sign(away[last, axes]), way)
        # the others move less, and so the fastest one is well on its way when they begin to
        start = first[fastest].min()
        begun = np.where(pace > 0.0, np.clip(begun, begun[fastest].min(), start), start)
    return begun, pace, way


def carried_inside(up: FloatArray, vector: FloatArray) -> FloatArray:
    """Directions in the frame of a body that has turned by small rotation vectors, (m, 3)."""
    return unit_vectors(up + np.cross(up, vector))


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
    return None


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
    shift, place = rate_shift(holds, step), rate_place(holds, step)
    return RotationSet(samples, table[:, 0], *ends, up, shift, step, place)
