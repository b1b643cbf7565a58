"""The gyroscope with two references: gravity and the field close a rotation about every axis.

Gravity carried through a rotation shows its error θ across the vertical, ``e_g = θ − u (u·θ)``; the
field shows it across the field, ``e_f = θ − f (f·θ)``. With ``n = (u − f (f·u))/s``,
``s² = 1 − (f·u)²``, the part about the vertical follows,

    ψ = u·θ = ( e_f·n + (f·u) (e_g·f)/s ) / s,

so that ``θ = e_g + ψ u`` is closed in all three directions, also of a turn about the vertical. The
two parts have noise of their own (the field's direction is the worse known) and are weighed by it.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.attitude import Steps
from imucal_wizard.solver.closure import Turns, linearise


@dataclass(frozen=True, eq=False)
class References:
    """Rotations with both references at either end, unit vectors in the accelerometer's frame.

    Attributes:
        steps: the rotations' integration steps.
        up_before: up at the hold before, shape (m, 3).
        up_after: up at the hold after.
        field_before: field at the hold before.
        field_after: field at the hold after.
        spread: standard deviation of each closure across the vertical and about it, relative to
            that of most, shape (m, 2): larger for a long turn, and where the device was not steady
            at an end.
    """

    steps: Steps
    up_before: FloatArray
    up_after: FloatArray
    field_before: FloatArray
    field_after: FloatArray
    spread: FloatArray

    def __len__(self) -> int:
        return len(self.up_before)


@dataclass(frozen=True, eq=False)
class Closed:
    """Closure of every rotation at one calibration.

    Attributes:
        tilt: ``e_g``, rad, shape (m, 3).
        heading: ψ, rad, shape (m,).
        tilt_slope: derivative by M's nine entries and b, shape (m, 3, 12).
        heading_slope: the same of ψ, shape (m, 12).
    """

    tilt: FloatArray
    heading: FloatArray
    tilt_slope: FloatArray
    heading_slope: FloatArray


def closed(data: References, matrix: FloatArray, bias: FloatArray) -> Closed:
    """Closure across and about the vertical, with derivatives."""
    gravity = linearise(Turns(data.steps, data.up_before, data.up_after), matrix, bias)
    field = linearise(Turns(data.steps, data.field_before, data.field_after), matrix, bias)
    up, north = data.up_after, data.field_after
    along = (up * north).sum(axis=1)
    sine = np.sqrt(np.maximum(1.0 - along**2, 1e-6))
    across = (up - north * along[:, None]) / sine[:, None]
    flat = north - up * along[:, None]

    def heading(of_field: FloatArray, of_gravity: FloatArray) -> FloatArray:
        seen = np.einsum("mi...,mi->m...", of_field, across)
        tilted = np.einsum("mi...,mi->m...", of_gravity, flat)
        shape = (-1,) + (1,) * (seen.ndim - 1)
        return np.asarray((seen + (along / sine).reshape(shape) * tilted) / sine.reshape(shape))

    return Closed(
        gravity.errors,
        heading(field.errors, gravity.errors),
        gravity.jacobian,
        heading(field.jacobian, gravity.jacobian),
    )
