"""How well the accelerometer's fit with effects knows its base parameters and its effects."""

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.directions import unit_vectors
from imucal_wizard.solver.extended.hold_fit import HoldFit
from imucal_wizard.solver.slow_noise import Shown, slow_covariances, spans_of, unseen


def theta_covariance(fit: HoldFit) -> FloatArray | None:
    """Of the nine base parameters, dimensionless, shape (9, 9); None when nothing is left over.

    As in the plain fit with what slow noise may do to them, which the residual does not show.
    """
    if fit.covariance is None:
        return None
    count = fit.free.basis.shape[1]
    scatter = max(float((fit.residual**2 / fit.variance).sum()) / fit.freedom, 1e-12)
    pull = fit.covariance @ fit.columns.T / scatter
    more = unseen(_slow(fit), fit.columns, scatter)
    covariance = fit.covariance + pull @ more @ pull.T
    basis = fit.free.basis
    return np.asarray(basis @ covariance[:count, :count] @ basis.T)


def _slow(fit: HoldFit) -> FloatArray:
    """Covariance of the errors of holds by slow noise, in units of their own, shape (n, n)."""
    up = unit_vectors(fit.point.force[0])
    columns = fit.columns * np.sqrt(fit.variance)[:, None]
    shown = Shown(fit.residual, columns, fit.data.noise, up @ up.T)
    slow = slow_covariances(spans_of(fit.data.holds), [shown])[0]
    return np.asarray(slow / np.sqrt(np.outer(fit.variance, fit.variance)))


def size_covariance(fit: HoldFit) -> FloatArray | None:
    """Of the effects' sizes, shown units, shape (p, p); None when nothing is left over.

    What a wandering bias does to them the bench adds, which knows the other explanations.
    """
    count = fit.free.basis.shape[1]
    return None if fit.covariance is None else fit.covariance[count:, count:]
