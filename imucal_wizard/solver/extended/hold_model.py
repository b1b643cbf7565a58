"""The accelerometer with effects: ``x = M (y − b) − ε(x)``, and how ``|x|`` moves.

Many calibrations of the same holds are evaluated at once, d of them, so that leaving out each
direction in turn costs little more than one fit. ``ε`` depends on x itself; it is small, so that
x is found by putting it in again a few times, each of which adds two to three digits.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from imucal_wizard.effects.effect import Circumstances
from imucal_wizard.ellipsoid.shape import TRIANGLE
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.extended.terms import Terms
from imucal_wizard.solver.magnitude import SHORTEST, SIZE, Problem

PASSES = 30
EXACT = 1e-13
"""Change of x, in units of gravity, at which it is found."""
WILD = 1e6
"""Factor on the residual where effects are so large that ``x`` is not determined: no fit goes
there."""
STEP = 1e-4
"""For the derivative of ε by x, in units of gravity."""


@dataclass(frozen=True, eq=False)
class HoldModel:
    """What turns parameters into corrected forces.

    Attributes:
        problem: the readings, dimensionless.
        terms: the effects.
        circumstances: of the holds; their force is replaced by the corrected one.
        repeated: the same so many times over, kept because it is asked for again and again.
    """

    problem: Problem
    terms: Terms
    circumstances: Circumstances
    repeated: dict[int, Circumstances] = field(default_factory=dict)

    def errors(self, force: FloatArray, sizes: FloatArray) -> FloatArray:
        """``ε`` at forces (d, k, n, 3) for sizes (d, p), m/s², of the same shape as the forces."""
        columns = self.terms.columns(self.at(force)).reshape(*force.shape, -1)
        return np.asarray(np.einsum("dknip,dp->dkni", columns, sizes))

    def at(self, force: FloatArray) -> Circumstances:
        """The circumstances of all holds at forces (…, n, 3), one after the other."""
        flat = force.reshape(-1, 3)
        count = len(flat) // len(self.circumstances)
        if count not in self.repeated:
            rows = np.tile(np.arange(len(self.circumstances)), count)
            self.repeated[count] = self.circumstances.select(rows)
        return replace(self.repeated[count], force=flat)


@dataclass(frozen=True, eq=False)
class HoldPoint:
    """d calibrations.

    Attributes:
        theta: the base parameters, shape (d, 9).
        sizes: of the effects, shape (d, p).
        force: corrected, m/s², shape (d, n, 3).
        residual: ``|x| − g``, m/s², shape (d, n).
    """

    theta: FloatArray
    sizes: FloatArray
    force: FloatArray
    residual: FloatArray


def point_at(model: HoldModel, theta: FloatArray, sizes: FloatArray) -> HoldPoint:
    """The corrected forces at d calibrations."""
    problem = model.problem
    offsets = problem.points - theta[:, None, :3]
    linear = problem.magnitude * offsets @ np.swapaxes(triangles(theta), 1, 2)
    force, wild = linear, np.zeros(len(theta), bool)
    for _ in range(PASSES if len(model.terms) else 0):
        moved = linear - model.errors(force[:, None], sizes)[:, 0]
        change = np.abs(moved - force).max(axis=(1, 2))
        wild |= change > problem.magnitude
        force = np.where(wild[:, None, None], linear, moved)
        if not (change[~wild] > EXACT * problem.magnitude).any():
            break
    residual = np.linalg.norm(force, axis=2) - problem.magnitude
    return HoldPoint(theta, sizes, force, np.where(wild[:, None], WILD * residual, residual))


def triangles(theta: FloatArray) -> FloatArray:
    """The dimensionless upper-triangular matrices, shape (d, 3, 3)."""
    out = np.zeros((len(theta), 3, 3))
    rows, columns = zip(*TRIANGLE, strict=True)
    out[:, rows, columns] = theta[:, 3:]
    return out


def levers(model: HoldModel, point: HoldPoint) -> FloatArray:
    """How ``|x|`` moves with a change of the linear part ``M (y − b)``, shape (d, n, 3).

    From ``x + ε(x) = M (y − b)`` follows ``∂|x|/∂(M (y − b)) = ûᵀ (I + ∂ε/∂x)⁻¹``.
    """
    length = np.maximum(np.linalg.norm(point.force, axis=2), SHORTEST)
    unit = point.force / length[:, :, None]
    if not len(model.terms):
        return np.asarray(unit)
    step = STEP * model.problem.magnitude
    aside = step * np.vstack([np.eye(3), -np.eye(3)])[:, None, :]
    moved = model.errors(point.force[:, None] + aside, point.sizes)
    slope = np.moveaxis((moved[:, :3] - moved[:, 3:]) / (2.0 * step), 1, 3)  # (d, n, ε, x)
    inner = np.swapaxes(np.eye(3) + slope, 2, 3)
    return np.asarray(np.linalg.solve(inner, unit[..., None])[..., 0])


def jacobian(model: HoldModel, point: HoldPoint) -> FloatArray:
    """Derivative of the residual by the nine base parameters and the sizes, (d, n, 9 + p)."""
    lever = levers(model, point)
    gravity = model.problem.magnitude
    offsets = model.problem.points - point.theta[:, None, :3]
    out = np.empty((*lever.shape[:2], SIZE + len(model.terms)))
    out[..., :3] = -gravity * lever @ triangles(point.theta)
    for place, (row, column) in enumerate(TRIANGLE):
        out[..., 3 + place] = gravity * lever[..., row] * offsets[..., column]
    if len(model.terms):
        columns = model.terms.columns(model.at(point.force)).reshape(*lever.shape, -1)
        out[..., SIZE:] = -np.einsum("dni,dnip->dnp", lever, columns)
    return out
