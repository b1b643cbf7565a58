"""Rotation closure: gravity carried through a rotation by the gyroscope, against gravity measured.

Up in the body frame obeys ``du/dt = u × w``. Carried from the hold before, ``û = Cᵀ u_before`` with
C the rotation in between; the closure error is the rotation vector from ``û`` to ``u_after``.
The part of a rotation about gravity leaves no trace in it.

A change δφ of one step's rotation vector turns ``û`` by ``û × ψ`` with ``ψ = Cᵀ L δφ``, where
``L = ∫₀¹ C(s) ds`` is the attitude averaged over that step (Simpson's rule; the attitude half way
is the normalised sum of those at either end). δφ being linear in the prepared sums of ``Steps``,
a few products of ``L`` with them, summed over each rotation, give every derivative.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.attitude import Steps, attitudes, coned_by, rotation_vectors, total
from imucal_wizard.solver.directions import unit_vectors
from imucal_wizard.solver.quaternions import cofactor, cross, matrices, quaternions

MATRIX = slice(0, 9)
BIAS = slice(9, 12)
SIZE = 12
"""Parameters: the nine entries of M by rows, then the three biases."""

LEVI_CIVITA = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    LEVI_CIVITA[_i, _j, _k], LEVI_CIVITA[_i, _k, _j] = 1.0, -1.0


@dataclass(frozen=True, eq=False)
class Turns:
    """Rotations ready to be closed, m of them.

    Attributes:
        steps: their integration steps, in reading units.
        before: up at the hold before, unit vectors, shape (m, 3).
        after: up at the hold after, shape (m, 3).
        before_doubt: change of ``before`` for one standard deviation along each of the k ways in
            which the accelerometer's calibration may be wrong, shape (m, 3, k), or None.
        after_doubt: the same of ``after``.
    """

    steps: Steps
    before: FloatArray
    after: FloatArray
    before_doubt: FloatArray | None = None
    after_doubt: FloatArray | None = None

    def __len__(self) -> int:
        return len(self.before)


@dataclass(frozen=True, eq=False)
class Linearised:
    """Closure at one calibration.

    Attributes:
        errors: closure error of each rotation as a rotation vector, rad, shape (m, 3).
        jacobian: its derivative by the twelve parameters, shape (m, 3, 12).
        ends: rotation from the hold before to the hold after, shape (m, 3, 3).
    """

    errors: FloatArray
    jacobian: FloatArray
    ends: FloatArray


def errors(turns: Turns, matrix: FloatArray, bias: FloatArray) -> FloatArray:
    """Closure error of each rotation as a rotation vector, rad, shape (m, 3).

    Args:
        turns: the rotations.
        matrix: M, rad/s per reading; one (3, 3), or one per rotation (m, 3, 3).
        bias: b, reading units; one (3,), or one per rotation (m, 3).
    """
    steps = turns.steps
    phi = rotation_vectors(steps, matrix, bias)
    ends = np.moveaxis(matrices(total(quaternions(phi), steps.offsets)), -1, 0)
    return between(carry(ends, turns.before), turns.after)


def carry(ends: FloatArray, before: FloatArray) -> FloatArray:
    """``Cᵀ u`` for each rotation, shape (m, 3)."""
    return np.asarray(np.einsum("mji,mj->mi", ends, before))


def between(a: FloatArray, b: FloatArray) -> FloatArray:
    """Rotation vector from the direction of each a to that of b, rad, shape (m, 3).

    Between opposite vectors, where every axis across serves, one of them.
    """
    normal = cross(a.T, b.T).T
    sine = np.linalg.norm(normal, axis=1)
    cosine = (a * b).sum(axis=1)
    ratio = np.where(sine > 1e-12, np.arctan2(sine, cosine) / np.maximum(sine, 1e-12), 1.0)
    opposite = (sine <= 1e-12) & (cosine < 0.0)
    if opposite.any():
        normal[opposite], ratio[opposite] = _across(a[opposite]), np.pi
    return np.asarray(normal * ratio[:, None])


def _across(a: FloatArray) -> FloatArray:
    """A unit vector across each unit vector."""
    axis = np.eye(3)[np.abs(a).argmin(axis=1)]
    return unit_vectors(cross(a.T, axis.T).T)


def linearise(turns: Turns, matrix: FloatArray, bias: FloatArray) -> Linearised:
    """Closure errors and their derivative by the entries of M and b."""
    steps = turns.steps
    offset = bias - steps.origin
    moved = steps.integral - offset[:, None] * steps.dt
    coned = coned_by(steps, offset)
    phi = matrix @ moved + cofactor(matrix) @ coned
    first, last = attitudes(quaternions(phi), steps.offsets)
    ends = np.moveaxis(matrices(last[:, steps.offsets[1:] - 1]), -1, 0)
    sums = _sums(turns, averaged(first, last), np.vstack([moved, coned, steps.drift, steps.dt]))
    turned = np.einsum("mji,mjp->mip", ends, _turned(sums, matrix))
    carried = carry(ends, turns.before)
    shifted = np.einsum("iab,ma,mbp->mip", LEVI_CIVITA, carried, turned)
    return Linearised(
        between(carried, turns.after), error_slope(carried, turns.after, shifted), ends
    )


def frame_shift(turns: Turns, at: Linearised) -> FloatArray | None:
    """Change of the closure errors with each doubt about the accelerometer, shape (m, 3, k)."""
    if turns.before_doubt is None or turns.after_doubt is None:
        return None
    shifts = np.empty_like(turns.before_doubt)
    for k in range(shifts.shape[2]):
        before, after = turns.before_doubt[:, :, k], turns.after_doubt[:, :, k]
        above = between(carry(at.ends, turns.before + before), turns.after + after)
        below = between(carry(at.ends, turns.before - before), turns.after - after)
        shifts[:, :, k] = 0.5 * (above - below)
    return shifts


def averaged(first: FloatArray, last: FloatArray) -> FloatArray:
    """``L``: attitude averaged over each step, shape (9, n)."""
    middle = first + last
    middle *= 2.0 / np.sqrt(np.maximum((middle * middle).sum(axis=0), 1e-30))
    return np.asarray((matrices(first) + matrices(middle) + matrices(last)).reshape(9, -1) / 6.0)


def _sums(turns: Turns, lever: FloatArray, columns: FloatArray) -> FloatArray:
    """``Σ L ⊗ column`` over each rotation, shape (m, 3, 3, 10)."""
    offsets = turns.steps.offsets
    out = np.empty((len(turns), 9, len(columns)))
    for index in range(len(turns)):
        part = slice(int(offsets[index]), int(offsets[index + 1]))
        out[index] = lever[:, part] @ columns[:, part].T
    return out.reshape(len(turns), 3, 3, len(columns))


def _turned(sums: FloatArray, matrix: FloatArray) -> FloatArray:
    """``Σ L δφ`` per unit of each parameter, shape (m, 3, 12).

    From ``φ = M u + cof(M) c`` follows, E_ij being 1 in one place,

        ∂φ/∂M_ij = E_ij u + e_i × M (c × e_j)        ∂φ/∂b = −M dt + cof(M) ∂(b × D)/∂b
    """
    moved, coned, drift, dt = (sums[..., s] for s in (slice(3), slice(3, 6), slice(6, 9), 9))
    out = np.empty((len(sums), 3, SIZE))
    coning = np.einsum("piq,qr,raj->pija", LEVI_CIVITA, matrix, LEVI_CIVITA)
    by_matrix = moved + np.einsum("mkpa,pija->mkij", coned, coning)
    out[:, :, MATRIX] = by_matrix.reshape(-1, 3, 9)
    by_bias = np.einsum("pq,qba->pba", cofactor(matrix), LEVI_CIVITA)
    out[:, :, BIAS] = np.einsum("mkpa,pba->mkb", drift, by_bias) - dt @ matrix
    return out


def error_slope(carried: FloatArray, after: FloatArray, moved: FloatArray) -> FloatArray:
    """Derivative of ``between(carried, after)`` when ``carried`` moves by ``moved`` (m, 3, p).

    With n = û × u, s = |n|, α = atan2(s, û·u), the error is ``(α/s) n``; α/s changes by
    ``(α' − (α/s) s') / s`` with ``s' = n·n'/s`` and ``α' = (c s' − s c')``, c = û·u.
    """
    normal = cross(carried.T, after.T).T
    slope = np.einsum("iab,map,mb->mip", LEVI_CIVITA, moved, after)
    sine = np.linalg.norm(normal, axis=1)
    cosine = (carried * after).sum(axis=1)
    safe = np.maximum(sine, 1e-9)
    ratio = np.where(sine > 1e-9, np.arctan2(sine, cosine) / safe, 1.0)
    direction = normal / safe[:, None]
    sine_slope = np.einsum("mi,mip->mp", direction, slope)
    cosine_slope = np.einsum("mi,mip->mp", after, moved)
    angle_slope = cosine[:, None] * sine_slope - sine[:, None] * cosine_slope
    ratio_slope = (angle_slope - ratio[:, None] * sine_slope) / safe[:, None]
    ratio_slope = np.where(sine[:, None] > 1e-6, ratio_slope, 0.0)
    return np.asarray(ratio[:, None, None] * slope + normal[:, :, None] * ratio_slope[:, None, :])
