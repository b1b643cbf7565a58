"""Attitude from angular rate, to fourth order in the sampling interval, many rotations at once.

The rotation vector of the step from one sample to the next (Magnus expansion, two terms) is

    φ = ∫ w dt + (dt²/12) w₀ × w₁

The integral of the samples is that of the cubic through them and their slopes,

    ∫ y dt = (dt/2) (y₀ + y₁) + (dt²/12) (y₀′ − y₁′)

(the trapezoidal rule alone is of second order); the product is the coning that a plain sum of rates
leaves out. With ``w = M (y − b)`` both are linear in what can be prepared once:

    φ = M (∫ y dt − b dt) + cof(M) (C + b × D),   C = (dt²/12) y₀ × y₁,  D = (dt²/12) (y₀ − y₁)

since ``(M p) × (M q) = cof(M) (p × q)``. Steps are joined as unit quaternions by a tree of pairs.
Arrays over the steps have their components first, (3, n), so that each component lies in one piece.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imucal_wizard.readings import BoolArray, FloatArray, IntArray
from imucal_wizard.solver.quaternions import cofactor, cross, multiply

PIECE = 32
"""Each rotation is filled up with empty steps to a multiple of this, so that pairs are slices."""


@dataclass(frozen=True, eq=False)
class Steps:
    """The integration steps of several rotations, laid end to end.

    Readings are kept relative to ``origin``, so that raw counts around 32768 lose no digits.

    Attributes:
        integral: ``∫ y dt`` of each step, shape (3, n).
        coning: ``C``, shape (3, n).
        drift: ``D``, shape (3, n).
        dt: duration, s, shape (n,); 0 for an empty step.
        rotation: which rotation it belongs to, shape (n,).
        offsets: index of the first step of each rotation, and n at the end, shape (m + 1,).
        origin: the reading that counts as zero, shape (3,).
    """

    integral: FloatArray
    coning: FloatArray
    drift: FloatArray
    dt: FloatArray
    rotation: IntArray
    offsets: IntArray
    origin: FloatArray


def lay_out(times: Sequence[FloatArray], readings: Sequence[FloatArray]) -> Steps:
    """Steps of rotations given by their sample times (n,) and readings (n, 3).

    A sample that is not later than the one before it is left out.
    """
    origin = np.mean([reading[0] for reading in readings], axis=0)
    parts = []
    for time, reading in zip(times, readings, strict=True):
        keep = advancing(time)
        parts.append(_filled(_steps(time[keep], reading[keep] - origin)))
    counts = np.array([part.shape[1] for part in parts])
    rows = np.concatenate(parts, axis=1)
    return Steps(
        integral=rows[:3],
        coning=rows[3:6],
        drift=rows[6:9],
        dt=rows[9],
        rotation=np.repeat(np.arange(len(parts)), counts),
        offsets=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        origin=origin,
    )


def advancing(time: FloatArray) -> BoolArray:
    """Which samples are later than all before them, shape (n,)."""
    return np.concatenate([[True], np.diff(np.maximum.accumulate(time)) > 0.0])


def _steps(time: FloatArray, reading: FloatArray) -> FloatArray:
    """Integral, coning, drift and duration of the steps between samples, shape (10, n − 1)."""
    dt = np.diff(time)
    first, last = reading[:-1].T, reading[1:].T
    integral = 0.5 * dt * (first + last)
    if len(time) > 2:
        slope = np.gradient(reading, time, axis=0, edge_order=2).T
        integral += dt * dt / 12.0 * (slope[:, :-1] - slope[:, 1:])
    twelfth = dt * dt / 12.0
    return np.vstack([integral, twelfth * cross(first, last), twelfth * (first - last), dt])


def _filled(steps: FloatArray) -> FloatArray:
    empty = -steps.shape[1] % PIECE or (0 if steps.shape[1] else PIECE)
    return np.pad(steps, ((0, 0), (0, empty)))


def rotation_vectors(steps: Steps, matrix: FloatArray, bias: FloatArray) -> FloatArray:
    """Rotation vector of each step under ``w = M (y − b)``, rad, shape (3, n).

    Args:
        steps: the steps.
        matrix: M, rad/s per reading; one (3, 3), or one per rotation (m, 3, 3).
        bias: b, reading units; one (3,), or one per rotation (m, 3).
    """
    offset = bias - steps.origin
    if matrix.ndim == 3:
        offset = offset[steps.rotation].T
        moved = steps.integral - offset * steps.dt
        coned = steps.coning + cross(offset, steps.drift)
        each, cofactors = matrix[steps.rotation], cofactor(matrix)[steps.rotation]
        turned = np.einsum("nij,jn->in", each, moved)
        return np.asarray(turned + np.einsum("nij,jn->in", cofactors, coned))
    moved = steps.integral - offset[:, None] * steps.dt
    return np.asarray(matrix @ moved + cofactor(matrix) @ coned_by(steps, offset))


def coned_by(steps: Steps, offset: FloatArray) -> FloatArray:
    """``C + b × D`` for one bias relative to the origin, shape (3, n)."""
    return steps.coning + cross(offset[:, None], steps.drift)


def total(steps: FloatArray, offsets: IntArray) -> FloatArray:
    """The product of all step quaternions (4, n) of each rotation, shape (4, m).

    The number of steps of each rotation is a multiple of ``PIECE``, as ``lay_out`` makes it.
    """
    running = _scan(_tree(steps)[-1], offsets // PIECE)
    return running[:, offsets[1:] // PIECE - 1]


def attitudes(steps: FloatArray, offsets: IntArray) -> tuple[FloatArray, FloatArray]:
    """Attitude at the beginning and at the end of each step, relative to its rotation's beginning.

    Up the tree by products of pairs, down again with what came before each pair.

    Args:
        steps: step quaternions, shape (4, n), as for ``total``.
        offsets: as of ``Steps``.

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
    return before, multiply(before, steps)


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
