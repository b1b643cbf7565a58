"""How a fit of the gyroscope predicts what it has not seen, and what each kind of data says."""

import numpy as np

from imucal_wizard.readings import BoolArray, FloatArray, IntArray
from imucal_wizard.solver.closure import BIAS
from imucal_wizard.solver.extended.inverse import inverted
from imucal_wizard.solver.extended.result import EARLY, FEWEST_LATER, Witness
from imucal_wizard.solver.extended.turn_data import TurnData
from imucal_wizard.solver.extended.turn_fit import TurnFit

ALONE = 1e-9
"""Share of a rotation's own closure left in its residual, below which it is fitted by nothing
else."""


def left_out(fit: TurnFit, rows: IntArray) -> FloatArray | None:
    """Errors of some rows under the fit of all others, in the unit of the rows.

    The step from the fit of all, ``N⁻¹ J_gᵀ (1 − H_gg)⁻¹ r_g``, is exact where the rows are linear
    in it, and it is small. None where nothing else determines what these rows do.
    """
    sigma = np.sqrt(fit.found.variance[rows])
    own = fit.system.columns[rows] / sigma[:, None]
    lever = own @ fit.found.covariance
    inner = np.eye(len(rows)) - lever @ own.T
    if np.linalg.eigvalsh(inner)[0] < ALONE:
        return None
    step = lever.T @ np.linalg.solve(inner, fit.system.residual[rows] / sigma)
    known = slice(0, fit.model)
    return np.asarray(fit.plain[rows] + fit.system.columns[rows, known] @ step[known])


def held_out_rotations(fit: TurnFit) -> FloatArray | None:
    """Closure error of each rotation when it is left out, rad, shape (m, 2)."""
    start = fit.stills
    found = [left_out(fit, start + np.array([2 * m, 2 * m + 1])) for m in range(len(fit.data))]
    kept = [errors for errors in found if errors is not None]
    return np.array(kept) if len(kept) == len(found) else None


def later(fit: TurnFit) -> FloatArray | None:
    """Closures of the later rotations under the fit of the earlier part, rad, shape (l, 2).

    The gains, which nothing slow moves, are kept from all data, so that rotations one axis after
    another leave something to predict. None when too few are later.
    """
    early, late = _split(fit)
    if late[fit.stills :].sum() < 2 * FEWEST_LATER:
        return None
    gains = sum(index < BIAS.start for index in fit.free)
    moving = slice(gains, None)
    columns = fit.system.columns[early, moving]
    weighted = columns / fit.found.variance[early, None]
    precision, value = fit.found.precision[moving], fit.system.value[moving]
    pull = weighted.T @ fit.system.residual[early] + precision * value
    step = -inverted(columns.T @ weighted + np.diag(precision)) @ pull
    known = slice(gains, fit.model)
    errors = fit.plain + fit.system.columns[:, known] @ step[: fit.model - gains]
    return np.asarray(errors[fit.stills :][late[fit.stills :]].reshape(-1, 2))


def _split(fit: TurnFit) -> tuple[BoolArray, BoolArray]:
    """Which rows are early and which late."""
    order = row_times(fit.data)
    moments = np.sort(fit.data.circumstances.time)
    count = int(np.ceil(EARLY * len(moments)))
    limit = 0.5 * (moments[count - 1] + moments[count]) if count < len(moments) else np.inf
    return order < limit, order >= limit


def row_times(data: TurnData) -> FloatArray:
    """Time of each row, s since the session's first sample."""
    ends = data.samples.offsets
    middle = 0.5 * (data.motion.time[ends[:-1]] + data.motion.time[ends[1:] - 1])
    return np.concatenate([np.repeat(data.circumstances.time, 3), np.repeat(middle, 2)])


def witnesses(fit: TurnFit) -> tuple[Witness, Witness]:
    """The sizes from the still means alone, and from the rotations alone.

    The still means do not know the gains, which are kept; the rotations fit everything anew.
    """
    still = np.arange(len(fit.system.residual)) < fit.stills
    gains = sum(index < BIAS.start for index in fit.free)
    return _witness(fit, still, gains), _witness(fit, ~still, 0)


def _witness(fit: TurnFit, rows: BoolArray, kept: int) -> Witness:
    """The sizes that some rows say, the first ``kept`` parameters staying as they are."""
    columns = fit.system.columns[rows, kept:]
    weighted = columns / fit.found.variance[rows, None]
    precision, value = fit.found.precision[kept:], fit.system.value[kept:]
    covariance = inverted(columns.T @ weighted + np.diag(precision))
    step = -covariance @ (weighted.T @ fit.system.residual[rows] + precision * value)
    own = slice(len(fit.free) - kept, fit.model - kept)
    return Witness(fit.point.sizes + step[own], covariance[own, own])
