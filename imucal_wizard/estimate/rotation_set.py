"""The usable rotations between holds, as one table of samples."""

import itertools
from collections.abc import Sequence
from dataclasses import field, replace

import numpy as np

from imucal_wizard.core.attitude import RotationSamples, rotation_samples, strictly_later
from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import MAX_READING, FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import lengths
from imucal_wizard.estimate.noise import Rest, has_rate
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.estimate.rounded import rate_place, rate_shift, rate_step
from imucal_wizard.estimate.rounding_in_motion import RoundingInMotion, rounding_in_motion
from imucal_wizard.measurement.holds import Hold, Rotation
from imucal_wizard.model.rows.source import (
    Parameters,
)

MIN_ROTATION_SAMPLES = 3
"""Of a rotation."""

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

    def rounding_in_motion(self, holds: Sequence[Hold]) -> RoundingInMotion:
        """What the steps of the readings do to each rotation between these still periods."""
        return rounding_in_motion(self.samples, self.step, holds)

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
