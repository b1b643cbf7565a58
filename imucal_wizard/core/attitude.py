"""Attitude from angular rate, to fourth order in the sampling interval, many rotations at once.

The rotation vector of the step from one sample to the next (Magnus expansion, two terms) is

    φ = ∫ w dt + (dt²/12) w₀ × w₁  =  (dt/2) (w₀ + w₁) + (dt²/12) (w₀′ − w₁′) + (dt²/12) w₀ × w₁

with slopes w′ from the parabola through neighbouring samples. The trapezoidal rule alone is of
second order; the cross product is the coning that a sum of rates misses. Steps are joined as unit
quaternions by a tree of pairs. Arrays over the steps have their components first, (3, n), so that
each component is contiguous.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from imucal_wizard.core.quaternions import cross, multiply
from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray
from imucal_wizard.core.records import dataclass

MAX_UNEVEN = 4.0
"""Of two intervals beside a sample, the longer over the shorter; three lost samples make it 4."""
STEPS_PER_PIECE = 32
"""Each rotation is padded with empty steps to a multiple of this, so that pairs are slices."""


@dataclass(frozen=True, eq=False)
class RotationSamples:
    """n samples of m rotations, and the s steps between them, padded with empty ones.

    Attributes:
        time: s, shape (n,).
        reading: reading of the gyroscope in its own unit, shape (n, 3).
        rotation: rotation to which a sample belongs, shape (n,).
        offsets: first sample of each rotation, and finally n, shape (m + 1,).
        first: sample at which a step begins, shape (s,).
        second: sample at which it ends, shape (s,); equal to ``first`` for an empty step.
        dt: duration of each step, s, shape (s,).
        step_offsets: first step of each rotation, and finally s, shape (m + 1,).
        begins: step that begins at each sample, s if there is none, shape (n,).
        ends: step that ends at each sample, s if there is none, shape (n,).
        slope: weights of three samples in the slope of their parabola at each sample, 1/s, shape
            (3, n): the previous sample, itself and the next one; at the ends of a rotation, the
            first or last three.
    """

    time: FloatArray
    reading: FloatArray
    rotation: IntArray
    offsets: IntArray
    first: IntArray
    second: IntArray
    dt: FloatArray
    step_offsets: IntArray
    begins: IntArray
    ends: IntArray
    slope: FloatArray

    def rotation_vectors(self, rate: FloatArray) -> FloatArray:
        """Rotation vector of each step, rad, shape (3, s), for rates (n, 3) in rad/s."""
        w = np.ascontiguousarray(rate.T)
        slope = np.empty_like(w)
        before, here, after = self.slope[:, 1:-1]
        np.multiply(w[:, 1:-1], here, out=slope[:, 1:-1])
        slope[:, 1:-1] += w[:, :-2] * before
        slope[:, 1:-1] += w[:, 2:] * after
        first, last = self.offsets[:-1], self.offsets[1:] - 1
        for ends, around in ((first, first + 1), (last, last - 1)):
            near = w[:, around + np.array([[-1], [0], [1]])]
            slope[:, ends] = (near * self.slope[:, ends]).sum(axis=1)
        w0, w1, dt = w[:, :-1], w[:, 1:], np.diff(self.time)
        bent = slope[:, :-1] - slope[:, 1:]
        bent += cross(w0, w1)
        bent *= dt * dt / 12.0
        phi = w0 + w1
        phi *= 0.5 * dt
        phi += bent
        steps = phi.take(self.first, axis=1)
        steps[:, np.flatnonzero(self.first == self.second)] = 0.0
        return steps

    def sample_weights(self, steps: FloatArray) -> FloatArray:
        """``Σ steps · w`` as weights of the samples' w, with w at the middle of each step.

        Args:
            steps: a factor of each step, shape (k, s).

        Returns:
            Shape (k, n).
        """
        half = np.zeros((len(steps), len(self.dt) + 1))  # the last one stands for no step
        np.multiply(0.5, steps, out=half[:, :-1])
        return np.asarray(half.take(self.begins, axis=1) + half.take(self.ends, axis=1))

    def at_middles(self, values: FloatArray) -> FloatArray:
        """Values at the samples (n, k), interpolated to the middle of each step, shape (s, k)."""
        return np.asarray(
            0.5 * (values.take(self.first, axis=0) + values.take(self.second, axis=0))
        )

    def at_samples(self, before: FloatArray, after: FloatArray) -> FloatArray:
        """Values before and after each step (k, s), at the samples, shape (k, n)."""
        out = before.take(self.begins, axis=1, mode="clip")
        out[:, self.offsets[1:] - 1] = after[:, self.step_offsets[1:] - 1]
        return out


def rotation_samples(
    times: Sequence[FloatArray], readings: Sequence[FloatArray]
) -> RotationSamples:
    """Arrange rotations, given by sample times (k,) and readings (k, 3), k ≥ 3 for each.

    A sample that is not later than the previous one is dropped.
    """
    kept = [strictly_later(time) for time in times]
    times = [time[keep] for time, keep in zip(times, kept, strict=True)]
    counts = np.array([len(time) for time in times])
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    firsts, seconds, begins, slopes, steps = [], [], [], [], [0]
    for start, time in zip(offsets[:-1], times, strict=True):
        begin = np.arange(len(time) - 1) + start
        empty = np.full(-len(begin) % STEPS_PER_PIECE, start)
        firsts.append(np.concatenate([begin, empty]))
        seconds.append(np.concatenate([begin + 1, empty]))
        begins.append(np.arange(len(time)) + steps[-1])
        steps.append(steps[-1] + len(begin) + len(empty))
        nodes = np.clip(np.arange(len(time)), 1, len(time) - 2) + np.array([[-1], [0], [1]])
        slopes.append(_slopes(time, nodes))
    time = np.concatenate(times)
    first, second = np.concatenate(firsts), np.concatenate(seconds)
    beginning = np.concatenate(begins)
    ending = beginning - 1
    beginning[offsets[1:] - 1] = ending[offsets[:-1]] = len(first)
    return RotationSamples(
        time=time,
        reading=np.concatenate([y[keep] for y, keep in zip(readings, kept, strict=True)]),
        rotation=np.repeat(np.arange(len(times)), counts),
        offsets=offsets,
        first=first,
        second=second,
        dt=time[second] - time[first],
        step_offsets=np.array(steps, np.int64),
        begins=beginning,
        ends=ending,
        slope=np.concatenate(slopes, axis=1),
    )


def _slopes(time: FloatArray, nodes: IntArray) -> FloatArray:
    """Weights of three nodes in the slope of their parabola at each time (Lagrange), (3, k).

    Where the two intervals differ much, the shorter one is mostly an error of the times, by which
    the parabola would divide: the chord from the first node to the last one stands for it.
    """
    p, q, r = time[nodes]
    parabola = np.array(
        [
            (2.0 * time - q - r) / ((p - q) * (p - r)),
            (2.0 * time - p - r) / ((q - p) * (q - r)),
            (2.0 * time - p - q) / ((r - p) * (r - q)),
        ]
    )
    chord = np.array([1.0, 0.0, -1.0])[:, None] / (p - r)
    uneven = np.maximum(q - p, r - q) > MAX_UNEVEN * np.minimum(q - p, r - q)
    return np.where(uneven, chord, parabola)


def strictly_later(time: FloatArray) -> BoolArray:
    """Which samples are later than all before them, shape (n,)."""
    return np.diff(np.maximum.accumulate(time), prepend=-np.inf) > 0.0


class Attitudes:
    """Attitudes in m rotations, each relative to its rotation's beginning.

    A tree is built by products of pairs of steps; it gives the whole rotations. Only where the
    attitude at every step is asked for, it is traversed down with the product of everything before
    each pair.

    Args:
        steps: step quaternions, shape (4, n); each rotation has a multiple of ``STEPS_PER_PIECE``.
        offsets: first step of each rotation, and finally n, shape (m + 1,).
    """

    def __init__(self, steps: FloatArray, offsets: IntArray) -> None:
        self._offsets = offsets
        self._levels = [steps]
        for _ in range(STEPS_PER_PIECE.bit_length() - 1):
            finest = self._levels[-1]
            self._levels.append(multiply(finest[:, 0::2], finest[:, 1::2]))
        self._running = _scan(self._levels[-1], offsets // STEPS_PER_PIECE)

    @property
    def whole(self) -> FloatArray:
        """Quaternion of each rotation, shape (4, m)."""
        return self._running[:, self._offsets[1:] // STEPS_PER_PIECE - 1]

    @cached_property
    def each(self) -> tuple[FloatArray, FloatArray]:
        """Quaternions at the beginning and at the end of each step, shape (4, n) each."""
        offsets, steps = self._offsets, self._levels[0]
        before = np.empty_like(self._running)
        before[:, 1:] = self._running[:, :-1]
        before[:, offsets[:-1] // STEPS_PER_PIECE] = np.array([[1.0], [0.0], [0.0], [0.0]])
        for level in self._levels[-2::-1]:
            finer = np.empty_like(level)
            finer[:, 0::2] = before
            finer[:, 1::2] = multiply(before, level[:, 0::2])
            before = finer
        after, last = np.empty_like(before), offsets[1:] - 1
        after[:, :-1] = before[:, 1:]
        after[:, last] = multiply(before[:, last], steps[:, last])
        return before, after


def _scan(pieces: FloatArray, offsets: IntArray) -> FloatArray:
    """Running products within each rotation: after pass k each holds up to 2^k pieces."""
    out = pieces.copy()
    counts = np.diff(offsets)
    position = np.arange(pieces.shape[1]) - np.repeat(offsets[:-1], counts)
    reach = 1
    while reach < int(counts.max(initial=0)):
        later = np.flatnonzero(position >= reach)
        out[:, later] = multiply(out[:, later - reach], out[:, later])
        reach *= 2
    return out
