"""The MAP fit of the gyroscope with effects: Gauss–Newton over rotations and still means."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray, IntArray
from imucal_wizard.solver.closure import BIAS, SIZE
from imucal_wizard.solver.extended.balance import Balance, System, balanced
from imucal_wizard.solver.extended.levers import effect_columns, levers
from imucal_wizard.solver.extended.terms import Term, Terms
from imucal_wizard.solver.extended.turn_data import TurnData
from imucal_wizard.solver.extended.turn_model import (
    TurnPoint,
    base_columns,
    doubt_columns,
    point_at,
)

MAX_ITERATIONS = 30
HALVINGS = 8
ROTATION = 3
"""Kinds of rows: the still means of the three axes, and closures."""


@dataclass(frozen=True, eq=False)
class TurnFit:
    """A fit.

    Attributes:
        data: what was fitted.
        terms: the effects.
        free: which of the twelve base parameters are fitted.
        point: the calibration.
        system: the rows at it: still means hold by hold, then closures.
        found: the fit of these rows.
        basis: two directions across gravity after each rotation, shape (m, 2, 3).
    """

    data: TurnData
    terms: Terms
    free: tuple[int, ...]
    point: TurnPoint
    system: System
    found: Balance
    basis: FloatArray

    @property
    def stills(self) -> int:
        """How many rows are still means."""
        return int(self.data.stills.size)

    @property
    def model(self) -> int:
        """How many parameters belong to the gyroscope; those after are doubts of its reference."""
        return len(self.free) + len(self.terms)

    @property
    def plain(self) -> FloatArray:
        """Residual with the accelerometer taken as it is, shape (n,)."""
        return residual_of(self.point, self.basis)


def fit_turns(data: TurnData, terms: Sequence[Term], base: Sequence[str]) -> TurnFit:
    """The MAP fit, with the scatter of still means and closures estimated along with it.

    Raises:
        DataError: it does not converge.
    """
    together, free, basis = Terms("gyroscope", terms), data.free(base), across(data.after)
    matrix, bias = data.begin(free)
    point = point_at(data, together, matrix, bias, np.zeros(len(together)))
    doubts = np.zeros(data.before_doubt.shape[2])
    for _ in range(MAX_ITERATIONS):
        system = _system(data, together, free, point, doubts, basis)
        found = balanced(system)
        point, size = _downhill(data, together, free, point, found, system, basis)
        doubts = doubts + size * found.step[len(free) + len(together) :]
        if found.arrived:
            system = _system(data, together, free, point, doubts, basis, system.columns)
            return TurnFit(data, together, free, point, system, balanced(system), basis)
    raise DataError(
        "the fit of the gyroscope with these effects does not converge: leave the last effect out, "
        "and check the closure of each rotation"
    )


def across(up: FloatArray) -> FloatArray:
    """Two unit vectors across each direction (m, 3) and one another, shape (m, 2, 3)."""
    axis = np.eye(3)[np.abs(up).argmin(axis=1)]
    first = np.cross(up, axis)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(up, first)], axis=1)


def residual_of(point: TurnPoint, basis: FloatArray) -> FloatArray:
    """Still means, then closures across gravity, shape (3 h + 2 m,)."""
    closing = np.einsum("mai,mi->ma", basis, point.closure)
    return np.concatenate([point.still.ravel(), closing.ravel()])


def stacked(basis: FloatArray, closing: FloatArray, still: FloatArray) -> FloatArray:
    """Derivatives of closures (m, 3, p) and still means (h, 3, p) row by row, (3 h + 2 m, p)."""
    count = closing.shape[2]
    rows = np.einsum("mai,mip->map", basis, closing)
    return np.concatenate(
        [still.reshape(3 * len(still), count), rows.reshape(2 * len(rows), count)]
    )


def kinds_of(data: TurnData) -> IntArray:
    """The kind of each row."""
    return np.concatenate(
        [np.tile([0, 1, 2], len(data.stills)), np.full(2 * len(data), ROTATION)]
    ).astype(np.int64)


def _columns(
    data: TurnData, terms: Terms, free: Sequence[int], point: TurnPoint, basis: FloatArray
) -> FloatArray:
    """Derivative of all rows by the free base parameters, the sizes and the doubts."""
    closing, still = base_columns(data, point)
    chosen = np.array(free, np.int64)
    parts = [stacked(basis, closing[:, :, chosen], still[:, :, chosen])]
    lever = levers(data, point)
    parts += [stacked(basis, *effect_columns(data, point, term, lever)) for term in terms.terms]
    doubts = doubt_columns(data, point)
    parts.append(stacked(basis, doubts, np.zeros((len(data.stills), 3, doubts.shape[2]))))
    return np.concatenate(parts, axis=1)


def _system(
    data: TurnData,
    terms: Terms,
    free: Sequence[int],
    point: TurnPoint,
    doubts: FloatArray,
    basis: FloatArray,
    columns: FloatArray | None = None,
) -> System:
    if columns is None:
        columns = _columns(data, terms, free, point, basis)
    doubted = columns[:, columns.shape[1] - len(doubts) :]
    zeros = np.zeros(len(free))
    return System(
        residual=residual_of(point, basis) + doubted @ doubts,
        columns=columns,
        known=np.concatenate([data.still_noise.ravel(), np.repeat(data.closing_noise, 2)]),
        kinds=kinds_of(data),
        precision=np.concatenate([zeros, terms.precision, np.ones(len(doubts))]),
        value=np.concatenate([zeros, point.sizes, doubts]),
        groups=tuple(
            slice(len(free) + group.start, len(free) + group.stop) for group in terms.groups
        ),
    )


def _downhill(
    data: TurnData,
    terms: Terms,
    free: Sequence[int],
    point: TurnPoint,
    found: Balance,
    system: System,
    basis: FloatArray,
) -> tuple[TurnPoint, float]:
    """The point a step further, or a half, a quarter … of it where it would raise the cost."""
    model = len(free) + len(terms)
    full = np.zeros(SIZE)
    full[list(free)] = found.step[: len(free)]
    doubted = system.columns[:, model:]
    before = float((system.residual**2 / found.variance).sum())
    before += float((found.precision * system.value**2).sum())
    size = 1.0
    for _ in range(HALVINGS):
        moved = point_at(
            data,
            terms,
            point.matrix + size * full[:9].reshape(3, 3),
            point.bias + size * full[BIAS],
            point.sizes + size * found.step[len(free) : model],
            point,
        )
        value = system.value + size * found.step
        left = residual_of(moved, basis) + doubted @ value[model:]
        cost = float((left**2 / found.variance).sum() + (found.precision * value**2).sum())
        # effects are taken at the point before, which makes the cost uncertain by about this much
        if cost < before * (1.0 + 1e-3) + 1e-3:
            break
        size /= 2.0
    return moved, size
