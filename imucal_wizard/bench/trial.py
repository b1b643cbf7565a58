"""What adding an effect would do, without adding it: size, error fitted and held out.

The linearised fit with a Gaussian prior on the effect's parameters. ``A`` holds the base and the
effect's columns, Λ the prior's precision on the effect alone; then

    β = (AᵀA + Λ)⁻¹ Aᵀr        H = A (AᵀA + Λ)⁻¹ Aᵀ
    error of group d when it is left out = (I − H_dd)⁻¹ (r − Hr)_d
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from imucal_wizard.bench.misfit import Candidate, Misfit
from imucal_wizard.readings import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Trial:
    """An effect tried.

    Attributes:
        size: of each parameter, shown unit, shape (p,).
        standard_error: of each, shape (p,).
        rms_fitted: error with it, in the sensor's error unit.
        rms_held_out: error with it when each group is left out; None when a group cannot be.
        fitted: what is left of every row, whitened, shape (n,).
    """

    size: FloatArray
    standard_error: FloatArray
    rms_fitted: float
    rms_held_out: float | None
    fitted: FloatArray


def try_effect(
    misfit: Misfit,
    candidates: tuple[Candidate, ...],
    noise: float = 1.0,
    walk: FloatArray | None = None,
) -> Trial:
    """Add effects to the linearised model; with none, the model as it is.

    Args:
        misfit: what the present model leaves.
        candidates: the effects to add together.
        noise: true noise in units of the rows' sigma; it weighs data against priors.
        walk: covariance of a wandering bias in units of that noise, shape (n, n); it widens the
            standard errors of what is slow.
    """
    base = misfit.base
    extra = [candidate.columns for candidate in candidates]
    typical = np.concatenate([np.zeros(0), *(candidate.typical for candidate in candidates)])
    columns = np.concatenate([base, *extra], axis=1)
    precision = np.zeros(columns.shape[1])
    precision[base.shape[1] :] = (noise / typical) ** 2
    # the prior as rows of its own keeps the condition of the columns, not of their squares
    stacked = np.concatenate([columns, np.diag(np.sqrt(precision))[base.shape[1] :]])
    left, values, right = np.linalg.svd(stacked, full_matrices=False)
    seen = values > 1e-10 * values[0]
    inner = left[: len(columns), seen]
    residual = misfit.residual - inner @ (inner.T @ misfit.residual)
    spread = right[seen].T / values[seen]
    estimate = spread @ (inner.T @ misfit.residual)
    variance = (spread**2).sum(axis=1)
    if walk is not None:
        taken = spread @ inner.T
        variance += ((taken @ walk) * taken).sum(axis=1)
    variance *= noise**2
    held_out = _left_out(misfit, inner, residual)
    judged = misfit.judged
    return Trial(
        size=estimate[base.shape[1] :],
        standard_error=np.sqrt(variance[base.shape[1] :]),
        rms_fitted=_rms((residual * misfit.sigma)[judged], misfit),
        rms_held_out=None if held_out is None else _rms((held_out * misfit.sigma)[judged], misfit),
        fitted=residual,
    )


def _left_out(misfit: Misfit, inner: FloatArray, residual: FloatArray) -> FloatArray | None:
    """Errors of the rows of each group under the fit of all others; rows without group stay in."""
    errors = residual.copy()
    for rows in _groups(misfit.group):
        own = inner[rows]
        gates = np.eye(rows.shape[1]) - own @ np.swapaxes(own, 1, 2)
        if np.linalg.eigvalsh(gates)[:, 0].min() < 1e-9:
            return None
        errors[rows] = np.linalg.solve(gates, residual[rows][..., None])[..., 0]
    return errors


def _groups(group: IntArray) -> Iterator[IntArray]:
    """Rows of the groups of each size, shape (groups, size)."""
    order = np.argsort(group, kind="stable")
    order = order[group[order] >= 0]
    _, first, count = np.unique(group[order], return_index=True, return_counts=True)
    for size in np.unique(count):
        yield order[first[count == size][:, None] + np.arange(size)]


def _rms(errors: FloatArray, misfit: Misfit) -> float:
    """Rms per hold, or per rotation over the components of its closure."""
    sources = np.unique(misfit.source[misfit.judged])
    return float(np.sqrt((errors**2).sum() / max(len(sources), 1)))
