"""One MAP fit of the accelerometer with its weights, and how it predicts what it has not seen."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.readings import BoolArray, FloatArray
from imucal_wizard.solver.carried import amplification
from imucal_wizard.solver.extended.balance import FEWEST_LEFT
from imucal_wizard.solver.extended.hold_data import HoldData
from imucal_wizard.solver.extended.hold_model import HoldModel, HoldPoint, point_at
from imucal_wizard.solver.extended.hold_solver import FreeModel, solve
from imucal_wizard.solver.extended.inverse import determined, inverted
from imucal_wizard.solver.extended.result import EARLY, FEWEST_LATER
from imucal_wizard.solver.extended.terms import WIDE, Term, Terms, widened
from imucal_wizard.solver.magnitude import NON_ORTHOGONALITY
from imucal_wizard.solver.task import ANGLE_XZ
from imucal_wizard.solver.uncertainty import LARGEST_HOLE

ROUNDS = 40
SETTLED = 1e-3
"""Relative change of the scatter that no longer matters."""
LARGEST_EARLY = 5.0
"""Amplification of a hold's noise up to which the earlier holds carry the base model."""


@dataclass(frozen=True, eq=False)
class HoldFit:
    """A fit.

    Attributes:
        data: what was fitted.
        free: the model.
        point: the calibration (d = 1).
        variance: of each hold's error, (m/s²)², shape (n,).
        columns: derivative of ``r/σ`` by the fitted parameters, shape (n, p).
        covariance: of the fitted parameters, shape (p, p); None when nothing is left over.
        freedom: degrees of freedom of the residual.
    """

    data: HoldData
    free: FreeModel
    point: HoldPoint
    variance: FloatArray
    columns: FloatArray
    covariance: FloatArray | None
    freedom: float

    @property
    def residual(self) -> FloatArray:
        """``|x| − g``, m/s², shape (n,)."""
        return np.asarray(self.point.residual[0])


def fit_holds(data: HoldData, terms: Sequence[Term], base: Sequence[str]) -> HoldFit:
    """The MAP fit, with the scatter from hold to hold estimated along with it.

    Raises:
        DataError: it does not converge.
    """
    model = HoldModel(data.task.problem, Terms("accelerometer", terms), data.circumstances)
    basis = data.basis(base)
    angles = set(data.task.carried.places) & set(NON_ORTHOGONALITY)
    product = "non-orthogonality" in base and bool(angles) and ANGLE_XZ not in angles
    free = FreeModel(model, basis, product, model.terms.precision / WIDE)
    theta = data.full if basis.shape == data.task.carried.basis.shape else data.nominal()
    point = point_at(model, theta[None], np.zeros((1, len(model.terms))))
    free, point, variance = _weighed(data, free, point)
    columns = free.columns(point)[0] / np.sqrt(variance)[:, None]
    freedom = _freedom(columns, free.precision)
    covariance = None
    if freedom >= 1.0:
        share = float((point.residual[0] ** 2 / variance).sum()) / freedom
        normal = columns.T @ columns / max(share, 1e-12)
        covariance = inverted(normal + np.diag(free.precision))
    return HoldFit(data, free, point, variance, columns, covariance, freedom)


def _weighed(
    data: HoldData, free: FreeModel, point: HoldPoint
) -> tuple[FreeModel, HoldPoint, FloatArray]:
    """The fit under the scatter that it leaves and the priors that it calls for.

    It begins with no scatter and wide priors, if then something is left over to judge by. Begun
    with what the base model leaves, an effect many times larger than its prior expects would itself
    pass for scatter and never be fitted.
    """
    terms = free.model.terms
    variance = data.noise if data.scatter is None else data.noise + data.scatter**2
    columns = free.columns(point)[0] / np.sqrt(variance)[:, None]
    if _freedom(columns, free.precision) < FEWEST_LEFT:
        free = replace(free, prior=terms.precision)
        if data.scatter is None:
            variance = data.noise + float(np.mean(point.residual**2))
    for _ in range(ROUNDS):
        point = solve(free, point, variance[None] ** -0.5, rough=True)
        prior = widened(terms.precision, point.sizes[0], terms.groups)
        before = variance
        if data.scatter is None:
            variance = data.noise + _rest(data, free, point, variance)
        settled = np.abs(variance / before - 1.0).max() < SETTLED
        settled &= np.abs(prior / free.prior - 1.0).max(initial=0.0) < 10.0 * SETTLED
        free = replace(free, prior=prior)
        if settled:
            break
    return free, solve(free, point, variance[None] ** -0.5), variance


def _rest(data: HoldData, free: FreeModel, point: HoldPoint, variance: FloatArray) -> float:
    """Variance from hold to hold on top of the noise, (m/s²)²."""
    columns = free.columns(point)[0] / np.sqrt(variance)[:, None]
    freedom = max(_freedom(columns, free.precision), 1.0)
    return max(float((point.residual**2).sum()) / freedom - float(data.noise.mean()), 0.0)


def _freedom(columns: FloatArray, precision: FloatArray) -> float:
    """Rows less the effective number of parameters, ``n − tr H``; a prior frees a part of one."""
    normal = columns.T @ columns
    return len(columns) - float((inverted(normal + np.diag(precision)) * normal).sum())


def left_out(fit: HoldFit, out: BoolArray) -> FloatArray | None:
    """Residuals of d exact refits without some holds each, m/s², shape (d, n).

    Args:
        fit: the fit of all.
        out: which holds each refit leaves out, shape (d, n).

    Returns:
        None when what is kept does not determine the model.
    """
    weights = np.where(out, 0.0, fit.variance**-0.5)
    columns = np.where(out[:, :, None], 0.0, fit.columns)
    normal = np.swapaxes(columns, 1, 2) @ columns
    if len(fit.free.precision) and not determined(normal + np.diag(fit.free.precision)):
        return None
    count = len(out)
    theta, sizes = np.tile(fit.point.theta, (count, 1)), np.tile(fit.point.sizes, (count, 1))
    start = point_at(fit.free.model, theta, sizes)
    return solve(fit.free, start, weights).residual


def held_out(fit: HoldFit) -> FloatArray | None:
    """Error of each hold under the fit without its whole direction, m/s², shape (n,).

    None when the other directions do not carry the base model.
    """
    labels, carried = fit.data.task.labels, fit.data.task.carried
    if fit.free.basis.shape[1] == carried.basis.shape[1] and carried.spare < 1:
        return None
    every = np.arange(labels.max() + 1)
    if any(_amplified(fit, labels != label) > LARGEST_HOLE for label in every):
        return None
    errors = left_out(fit, every[:, None] == labels)
    return None if errors is None else errors[labels, np.arange(len(labels))]


def later(fit: HoldFit) -> FloatArray | None:
    """Errors of the later holds under the fit of the earlier ones, m/s², shape (k,).

    The earlier part is two thirds of the holds, more where those do not carry the base model; None
    when then too few are left.
    """
    early = early_count(fit)
    if early is None:
        return None
    late = np.arange(len(fit.residual)) >= early
    errors = left_out(fit, late[None])
    return None if errors is None else errors[0][late]


def early_count(fit: HoldFit) -> int | None:
    """How many of the first holds carry the base model, two thirds at least."""
    total = len(fit.residual)
    for count in range(int(np.ceil(EARLY * total)), total - FEWEST_LATER + 1):
        if _amplified(fit, np.arange(total) < count) <= LARGEST_EARLY:
            return count
    return None


def _amplified(fit: HoldFit, kept: BoolArray) -> float:
    """What the base model makes of a hold's noise at worst anywhere, from the holds kept alone."""
    if not fit.free.basis.shape[1]:
        return 0.0
    _, first = np.unique(fit.data.task.labels[kept], return_index=True)
    up = fit.point.force[0][kept][first] / fit.data.gravity
    return float(amplification(up, fit.free.basis).max())
