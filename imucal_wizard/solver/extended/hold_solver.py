"""The MAP fit of the accelerometer with effects: Gauss–Newton, many selections of holds at once.

The cost is ``Σ (r/σ)² + Σ (size/prior)²``: a Gaussian prior as wide as data sheets say keeps a
combination of sizes that the holds do not determine near zero, where least squares would give it
any value.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.extended.hold_model import HoldModel, HoldPoint, jacobian, point_at
from imucal_wizard.solver.extended.inverse import inverted
from imucal_wizard.solver.magnitude import SIZE
from imucal_wizard.solver.task import ANGLE_XZ

MAX_ITERATIONS = 60
ROUGH_ITERATIONS = 6
HALVINGS = 12
SETTLED = 1e-3
"""Step in standard deviations of the fit that no longer matters."""
FLAT = 0.2
"""The same in a valley so long and flat that its bottom is not reached: what no data and hardly a
prior determine."""


@dataclass(frozen=True, eq=False)
class FreeModel:
    """A model and which of its parameters are fitted.

    Attributes:
        model: the model.
        basis: free directions of the nine base parameters, shape (9, pb).
        product: ``M_xz`` is not free and follows from the two other angles (Q, eq. 8).
        prior: precision of the prior of each size, shape (p,).
    """

    model: HoldModel
    basis: FloatArray
    product: bool
    prior: FloatArray

    @property
    def precision(self) -> FloatArray:
        """Of the priors of all fitted parameters, shape (pb + p,)."""
        return np.concatenate([np.zeros(self.basis.shape[1]), self.prior])

    def columns(self, point: HoldPoint) -> FloatArray:
        """Derivative of the residual by the fitted parameters, shape (d, n, pb + p)."""
        full = jacobian(self.model, point)
        return np.concatenate([full[..., :SIZE] @ self.basis, full[..., SIZE:]], axis=2)

    def moved(self, point: HoldPoint, step: FloatArray) -> HoldPoint:
        """The calibrations a step (d, pb + p) further."""
        count = self.basis.shape[1]
        theta = point.theta + step[:, :count] @ self.basis.T
        if self.product:
            theta[:, ANGLE_XZ] = theta[:, 4] * theta[:, 7] / theta[:, 6]
        return point_at(self.model, theta, point.sizes + step[:, count:])


def solve(
    free: FreeModel, start: HoldPoint, weights: FloatArray, *, rough: bool = False
) -> HoldPoint:
    """Minimise the cost for d selections of the holds at once.

    Args:
        free: the model.
        start: d calibrations to start from.
        weights: 1/σ of each hold, 0 where it is left out, s²/m, shape (d, n).
        rough: a few steps are enough, since weights and priors will change.

    Raises:
        DataError: it does not converge.
    """
    point = start
    if not len(free.precision):
        return point
    for _ in range(ROUGH_ITERATIONS if rough else MAX_ITERATIONS):
        columns = weights[:, :, None] * free.columns(point)
        normal = np.swapaxes(columns, 1, 2) @ columns
        pull = np.einsum("dnp,dn->dp", columns, weights * point.residual)
        count = free.basis.shape[1]
        pull[:, count:] += free.prior * point.sizes
        step = -np.einsum("dpq,dq->dp", inverted(normal + np.diag(free.precision)), pull)
        point = _downhill(free, point, step, weights)
        # how far the step goes in standard deviations, over all its parameters together
        length = np.einsum("dp,dp->d", step, -pull)
        if not (length > SETTLED**2).any():
            return point
    if rough or (length < FLAT**2).all():
        return point
    raise DataError(
        "the fit of the accelerometer with these effects does not converge: some still positions "
        "are not of one gravity. Check the residual of each hold, and leave the last effect out"
    )


def _downhill(
    free: FreeModel, point: HoldPoint, step: FloatArray, weights: FloatArray
) -> HoldPoint:
    """A step further, or a half, a quarter … of it where it would raise the cost."""
    before = _cost(free, point, weights)
    size = np.ones((len(step), 1))
    for _ in range(HALVINGS):
        moved = free.moved(point, size * step)
        worse = _cost(free, moved, weights) > before * (1.0 + 1e-9) + 1e-9
        if not worse.any():
            break
        size[worse] /= 2.0
    return moved


def _cost(free: FreeModel, point: HoldPoint, weights: FloatArray) -> FloatArray:
    """Of each calibration, shape (d,)."""
    prior = free.prior * point.sizes**2
    return np.asarray(((weights * point.residual) ** 2).sum(axis=1) + prior.sum(axis=1))
