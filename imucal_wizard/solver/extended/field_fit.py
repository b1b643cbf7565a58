"""The MAP fit of the magnetometer with effects: Gauss–Newton over magnitudes and dips."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imucal_wizard.ellipsoid.shape import TRIANGLE
from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray, IntArray
from imucal_wizard.solver.extended.balance import Balance, System, balanced
from imucal_wizard.solver.extended.field_data import FieldData
from imucal_wizard.solver.extended.field_model import (
    SENSOR,
    FieldPoint,
    base_columns,
    effect_columns,
    levers,
    place_columns,
    point_at,
)
from imucal_wizard.solver.extended.inverse import determined, inverted
from imucal_wizard.solver.extended.result import EARLY
from imucal_wizard.solver.extended.terms import Term, Terms

MAX_ITERATIONS = 40
ALONE = 1e-9
"""Share of rows left in their residual, below which they are fitted by nothing else."""
FEWEST_ROWS = 5
"""Magnitudes and dips that are left to be predicted, at least."""


@dataclass(frozen=True, eq=False)
class FieldFit:
    """A fit.

    Attributes:
        data: what was fitted.
        terms: the effects.
        basis: free directions of b and M, shape (9, pb).
        point: the calibration.
        doubts: found of the accelerometer's, in standard deviations, shape (d,).
        system: the rows at it; parameters are the free base, the sizes, level and doubts.
        found: the fit of these rows.
    """

    data: FieldData
    terms: Terms
    basis: FloatArray
    point: FieldPoint
    doubts: FloatArray
    system: System
    found: Balance

    @property
    def sizes(self) -> slice:
        """Places of the sizes among the parameters."""
        first = self.basis.shape[1]
        return slice(first, first + len(self.terms))


def fit_field(data: FieldData, terms: Sequence[Term], base: Sequence[str]) -> FieldFit:
    """The MAP fit, with the scatter of magnitudes and of dips estimated along with it.

    Raises:
        DataError: it does not converge.
    """
    together, basis = Terms(SENSOR, terms), data.basis(base)
    matrix, bias = data.begin(base)
    point = point_at(data, together, matrix, bias, np.zeros(len(together)))
    doubts = np.zeros(data.dips.doubt.shape[2] if len(data.dips) else 0)
    for _ in range(MAX_ITERATIONS):
        system = _system(data, together, basis, point, doubts)
        found = balanced(system)
        if found.arrived:
            return FieldFit(data, together, basis, point, doubts, system, found)
        point, doubts = _moved(data, together, basis, point, doubts, found.step)
        if not np.isfinite(point.residual).all():
            break
    raise DataError(
        "the fit of the magnetometer with these effects does not converge: leave the last effect "
        "out, and look for iron near the place where it was turned"
    )


def _moved(
    data: FieldData,
    terms: Terms,
    basis: FloatArray,
    point: FieldPoint,
    doubts: FloatArray,
    step: FloatArray,
) -> tuple[FieldPoint, FloatArray]:
    """The calibration a step further."""
    base, sizes, rest = np.split(step, [basis.shape[1], basis.shape[1] + len(terms)])
    full = basis @ base
    matrix = point.matrix.copy()
    for value, (i, j) in zip(full[3:], TRIANGLE, strict=True):
        matrix[i, j] += data.gain * value
        if i != j:
            matrix[j, i] += data.gain * value
    level = point.level + (float(rest[0]) / data.field if len(rest) else 0.0)
    bias = point.bias + full[:3] / data.gain
    moved = point_at(data, terms, matrix, bias, point.sizes + sizes, level)
    return moved, doubts + rest[1:] if len(rest) else doubts


def _system(
    data: FieldData, terms: Terms, basis: FloatArray, point: FieldPoint, doubts: FloatArray
) -> System:
    lever = levers(data, point)
    parts = [base_columns(data, point, lever) @ basis]
    parts += [effect_columns(data, point, lever, one.effect, one.variant) for one in terms.terms]
    place = place_columns(data, point)
    columns = np.concatenate([*parts, place], axis=1)
    residual, first = point.residual, basis.shape[1]
    if len(doubts):
        residual = residual + place[:, 1:] @ doubts
    free, fixed = np.zeros(first), np.zeros(min(place.shape[1], 1))
    return System(
        residual=residual,
        columns=columns,
        known=np.concatenate([data.noise, data.dips.noise * (lever.still**2).sum(axis=1)]),
        kinds=data.kinds,
        precision=np.concatenate([free, terms.precision, fixed, np.ones(len(doubts))]),
        value=np.concatenate([free, point.sizes, fixed, doubts]),
        groups=tuple(slice(first + g.start, first + g.stop) for g in terms.groups),
    )


def groups_of(data: FieldData) -> IntArray:
    """What is left out together: the groups of one direction, the still poses of one, (k + h,)."""
    cells = np.unique(data.pieces.cell, return_inverse=True)[1]
    return np.concatenate([cells, cells.max(initial=-1) + 1 + data.dips.labels]).astype(np.int64)


def held_out(fit: FieldFit) -> FloatArray | None:
    """Error of each row under the fit without its direction, µT; None where one decides alone.

    The step from the fit of all is exact where the rows are linear in it, and it is small.
    """
    sigma, groups = np.sqrt(fit.found.variance), groups_of(fit.data)
    columns, residual = fit.system.columns / sigma[:, None], fit.system.residual / sigma
    errors = np.empty(len(residual))
    for group in np.unique(groups):
        rows = np.flatnonzero(groups == group)
        own = columns[rows]
        inner = np.eye(len(rows)) - own @ fit.found.covariance @ own.T
        if np.linalg.eigvalsh(inner)[0] < ALONE:
            return None
        errors[rows] = np.linalg.solve(inner, residual[rows]) * sigma[rows]
    return errors


def later(fit: FieldFit) -> FloatArray | None:
    """Errors of the later rows under the fit of the earlier ones, µT.

    M, which nothing slow moves, is kept from all data. None where the earlier rows do not determine
    the rest, or too few are later.
    """
    order = fit.data.circumstances.time
    limit = float(np.quantile(order, EARLY))
    early = order < limit
    moving = np.ones(fit.system.columns.shape[1], bool)
    moving[: fit.basis.shape[1]] = ~fit.basis[3:].any(axis=0)
    columns, variance = fit.system.columns[:, moving], fit.found.variance
    weighted = columns[early] / variance[early, None]
    precision, value = fit.found.precision[moving], fit.system.value[moving]
    normal = columns[early].T @ weighted + np.diag(precision)
    if (~early).sum() < FEWEST_ROWS or not determined(normal):
        return None
    pull = weighted.T @ fit.system.residual[early] + precision * value
    step = -inverted(normal) @ pull
    return np.asarray((fit.system.residual + columns @ step)[~early])
