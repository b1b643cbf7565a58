"""Rotation closure: gravity carried through a rotation by the gyroscope, against gravity measured.

Up in the body frame obeys ``du/dt = u × w``. Carried from the hold before, ``û = Cᵀ u_before`` with
C the rotation in between; the closure error is the rotation vector from ``û`` to ``u_after``.
The part of a rotation about gravity leaves no trace in it.

A change δφ_i of one step's rotation vector turns ``û`` by ``û × (A_i δφ_i)`` with
``A_i = C_endᵀ C_i J_r(φ_i)``, so all derivatives come from one pass over the samples.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.attitude import (
    Steps,
    accumulate,
    cross,
    matrices,
    quaternions,
    right_jacobian,
    rotation_vectors,
    skews,
    total,
)

MATRIX = slice(0, 9)
BIAS = slice(9, 12)
SIZE = 12
"""Parameters: the nine entries of M by rows, then the three biases."""


@dataclass(frozen=True, eq=False)
class Turns:
    """Rotations ready to be closed, m of them.

    Attributes:
        steps: their integration steps, in reading units.
        before: up at the hold before, unit vectors, shape (m, 3).
        after: up at the hold after, shape (m, 3).
    """

    steps: Steps
    before: FloatArray
    after: FloatArray

    def __len__(self) -> int:
        return len(self.before)


def errors(turns: Turns, matrix: FloatArray, bias: FloatArray) -> FloatArray:
    """Closure error of each rotation as a rotation vector, rad, shape (m, 3).

    Args:
        turns: the rotations.
        matrix: M, rad/s per reading; one (3, 3), or one per rotation (m, 3, 3).
        bias: b, reading units; one (3,), or one per rotation (m, 3).
    """
    first, last = _rates(turns.steps, matrix, bias)
    phi = rotation_vectors(first, last, turns.steps.dt)
    attitude = matrices(total(quaternions(phi), turns.steps.offsets))
    carried = np.einsum("mji,mj->mi", attitude, turns.before)
    return between(carried, turns.after)


def between(a: FloatArray, b: FloatArray) -> FloatArray:
    """Rotation vector from each unit vector a to b, rad, shape (m, 3)."""
    normal = cross(a, b)
    sine = np.linalg.norm(normal, axis=1)
    angle = np.arctan2(sine, (a * b).sum(axis=1))
    return normal * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 1.0)[:, None]


def _rates(steps: Steps, matrix: FloatArray, bias: FloatArray) -> tuple[FloatArray, FloatArray]:
    if matrix.ndim == 2:
        return (steps.first - bias) @ matrix.T, (steps.last - bias) @ matrix.T
    each, offset = matrix[steps.rotation], bias[steps.rotation]
    return (
        np.einsum("nij,nj->ni", each, steps.first - offset),
        np.einsum("nij,nj->ni", each, steps.last - offset),
    )


def errors_and_jacobian(
    turns: Turns, matrix: FloatArray, bias: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Closure errors, shape (m, 3), and their derivative by the twelve parameters, (m, 3, 12)."""
    steps = turns.steps
    offset_first, offset_last = steps.first - bias, steps.last - bias
    first, last = offset_first @ matrix.T, offset_last @ matrix.T
    phi = rotation_vectors(first, last, steps.dt)
    attitude = matrices(accumulate(quaternions(phi), steps.offsets))
    end = attitude[steps.offsets[1:] - 1]
    carried = np.einsum("mji,mj->mi", end, turns.before)
    lever = np.swapaxes(end, 1, 2)[steps.rotation] @ (attitude @ right_jacobian(phi))

    dt = steps.dt[:, None, None]
    skew_first, skew_last = skews(first), skews(last)
    turned = np.empty((len(turns), 3, SIZE))
    starts = steps.offsets[:-1]
    for column in range(3):
        u, v = offset_first[:, column, None, None], offset_last[:, column, None, None]
        change = 0.5 * dt * (u + v) * np.eye(3) + dt * dt / 12.0 * (v * skew_first - u * skew_last)
        turned[:, :, column:9:3] = np.add.reduceat(lever @ change, starts, axis=0)
    change = -(dt * np.eye(3) + dt * dt / 12.0 * (skew_first - skew_last))
    turned[:, :, BIAS] = np.add.reduceat(lever @ change, starts, axis=0) @ matrix

    moved = np.cross(carried[:, :, None], turned, axis=1)
    return between(carried, turns.after), _error_slope(carried, turns.after, moved)


def _error_slope(carried: FloatArray, after: FloatArray, moved: FloatArray) -> FloatArray:
    """Derivative of ``between(carried, after)`` when ``carried`` moves by ``moved`` (m, 3, p).

    With n = û × u, s = |n|, α = atan2(s, û·u), the error is ``(α/s) n``; α/s changes by
    ``(α' − (α/s) s') / s`` with ``s' = n·n'/s`` and ``α' = (c s' − s c')``, c = û·u.
    """
    normal = cross(carried, after)
    slope = np.cross(moved, after[:, :, None], axis=1)
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
    return ratio[:, None, None] * slope + normal[:, :, None] * ratio_slope[:, None, :]
