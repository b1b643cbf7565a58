"""Attitude from angular rate, to fourth order in the sampling interval, many rotations at once.

The rotation vector of the step from one sample to the next (Magnus expansion, two terms) is

    φ = ∫ w dt + (dt²/12) w₀ × w₁  =  (dt/2) (w₀ + w₁) + (dt²/12) (w₀′ − w₁′) + (dt²/12) w₀ × w₁

with slopes w′ from the parabola through neighbouring samples (the trapezoidal rule alone is of
second order; the product is the coning that a plain sum of rates leaves out). Steps are joined as
unit quaternions by a tree of pairs. Arrays over the steps have their components first, (3, n), so
that each component lies in one piece.
"""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.quaternions import cross, multiply
from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray
from imucal_wizard.core.records import dataclass

PIECE = 32
"""Each rotation is filled up with empty steps to a multiple of this, so that pairs are slices."""


@dataclass(frozen=True, eq=False)
class Samples:
    """n samples of m rotations, and the s steps between them (empty ones fill up each rotation).

    Attributes:
        time: s, shape (n,).
        reading: of the gyroscope, its unit, shape (n, 3).
        rotation: which rotation a sample belongs to, shape (n,).
        offsets: first sample of each rotation, and n, shape (m + 1,).
        first: sample at which a step begins, shape (s,).
        second: sample at which it ends, the same for an empty step, shape (s,).
        dt: duration of each step, s, shape (s,).
        step_offsets: first step of each rotation, and s, shape (m + 1,).
        begins: step that begins at each sample, s where none does, shape (n,).
        ends: step that ends at each sample, s where none does, shape (n,).
        slope: weights of three samples in the slope of their parabola at each sample, 1/s, shape
            (3, n): of the sample before, itself and the one after; at the ends of a rotation, of
            the first or last three.
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

    def turned(self, rate: FloatArray) -> FloatArray:
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
        w0, w1 = w.take(self.first, axis=1), w.take(self.second, axis=1)
        bent = slope.take(self.first, axis=1) - slope.take(self.second, axis=1)
        twelfth = self.dt * self.dt / 12.0
        return np.asarray(0.5 * self.dt * (w0 + w1) + twelfth * (bent + cross(w0, w1)))

    def spread(self, steps: FloatArray) -> FloatArray:
        """``Σ steps · w`` as weights of the samples' w, with w half way through each step.

        Args:
            steps: a factor of each step, shape (k, s).

        Returns:
            Shape (k, n).
        """
        half = np.zeros((len(steps), len(self.dt) + 1))  # the last one is of no step
        np.multiply(0.5, steps, out=half[:, :-1])
        return np.asarray(half.take(self.begins, axis=1) + half.take(self.ends, axis=1))

    def at_middles(self, values: FloatArray) -> FloatArray:
        """What is known at the samples (n, k), half way through each step, shape (s, k)."""
        return np.asarray(
            0.5 * (values.take(self.first, axis=0) + values.take(self.second, axis=0))
        )

    def at_samples(self, before: FloatArray, after: FloatArray) -> FloatArray:
        """What is known before and after each step (k, s), at the samples, shape (k, n)."""
        out = before.take(self.begins, axis=1, mode="clip")
        out[:, self.offsets[1:] - 1] = after[:, self.step_offsets[1:] - 1]
        return out


def lay_samples(times: Sequence[FloatArray], readings: Sequence[FloatArray]) -> Samples:
    """Rotations given by their sample times (k,) and readings (k, 3), k ≥ 3 for each.

    A sample that is not later than the one before it is left out.
    """
    kept = [advancing(time) for time in times]
    times = [time[keep] for time, keep in zip(times, kept, strict=True)]
    counts = np.array([len(time) for time in times])
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    firsts, seconds, begins, slopes, steps = [], [], [], [], [0]
    for start, time in zip(offsets[:-1], times, strict=True):
        begin = np.arange(len(time) - 1) + start
        empty = np.full(-len(begin) % PIECE, start)
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
    return Samples(
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
    """Weights of three nodes in the slope of their parabola at each time (Lagrange), (3, k)."""
    p, q, r = time[nodes]
    return np.array(
        [
            (2.0 * time - q - r) / ((p - q) * (p - r)),
            (2.0 * time - p - r) / ((q - p) * (q - r)),
            (2.0 * time - p - q) / ((r - p) * (r - q)),
        ]
    )


def advancing(time: FloatArray) -> BoolArray:
    """Which samples are later than all before them, shape (n,)."""
    return np.concatenate([[True], np.diff(np.maximum.accumulate(time)) > 0.0])


def attitudes(steps: FloatArray, offsets: IntArray) -> tuple[FloatArray, FloatArray]:
    """Attitude at the beginning and at the end of each step, relative to its rotation's beginning.

    Up the tree by products of pairs, down again with what came before each pair.

    Args:
        steps: step quaternions, shape (4, n); of each rotation a multiple of ``PIECE``.
        offsets: first step of each rotation, and n, shape (m + 1,).

    Returns:
        Two arrays of quaternions, shape (4, n).
    """
    levels = _tree(steps)
    running = _scan(levels[-1], offsets // PIECE)
    before = np.empty_like(running)
    before[:, 1:] = running[:, :-1]
    before[:, offsets[:-1] // PIECE] = np.array([[1.0], [0.0], [0.0], [0.0]])
    for level in levels[-2::-1]:
        finer = np.empty_like(level)
        finer[:, 0::2] = before
        finer[:, 1::2] = multiply(before, level[:, 0::2])
        before = finer
    after, last = np.empty_like(before), offsets[1:] - 1
    after[:, :-1] = before[:, 1:]
    after[:, last] = multiply(before[:, last], steps[:, last])
    return before, after


def _tree(steps: FloatArray) -> list[FloatArray]:
    """Products of 1, 2, 4 … PIECE neighbouring steps."""
    levels = [steps]
    for _ in range(PIECE.bit_length() - 1):
        levels.append(multiply(levels[-1][:, 0::2], levels[-1][:, 1::2]))
    return levels


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
