"""The whitened residuals of a fit, on which every test of the misfit works.

Rows are whitened: each is divided by the standard deviation that noise alone gives it, and freed
from the noise that it shares with others. A row is a hold of the accelerometer (its error along
gravity), one axis of a hold of the gyroscope, one component of a rotation's closure, a mean
magnitude of the magnetometer, or its dip.
"""

from collections.abc import Sequence
from dataclasses import replace
from enum import IntEnum

import numpy as np

from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import complement
from imucal_wizard.estimate.experiment import Experiment
from imucal_wizard.estimate.fit import Minimum, minimum, with_effects
from imucal_wizard.estimate.lack_of_fit import LackOfFit, Visits, lack_of_fit
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.effect import Effect
from imucal_wizard.model.rows.decorrelation import Decorrelation
from imucal_wizard.model.rows.table import ResidualTable
from imucal_wizard.model.terms import Term, Terms


class RowKind(IntEnum):
    """Where a row comes from."""

    HOLD = 0
    STILL = 1
    ROTATION = 2
    FIELD = 3
    DIP = 4


MAX_BOUNDED = 2.0
"""Largest size of what is bounded, in usual sizes: that of two equal parts of a known whole."""
MAX_DOUBTS = 3.0
"""Standard deviations by which a size must exceed that to be told from one that is possible."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """One way in which one effect would show, with one setting of what is not linear in it.

    Attributes:
        effect: the effect.
        term: its name.
        family: name shared by effects that 1 g cannot split, or the term itself.
        variant: the setting, or None.
        names: the parameters, one per column.
        columns: whitened change of every row per shown unit, shape (n, p).
        typical: prior standard deviation of each parameter, shown unit, shape (p,).
        unit: the shown unit.
    """

    effect: Effect
    term: str
    family: str
    variant: float | None
    names: tuple[str, ...]
    columns: FloatArray
    typical: FloatArray
    unit: str


@dataclass(frozen=True, eq=False)
class WhitenedResiduals:
    """What is left of every row, and what may move it.

    Attributes:
        minimum: where the fit that leaves it has arrived.
        table: its rows.
        residual: whitened, shape (n,).
        base: whitened derivative by all parameters that are in the model, shape (n, b).
        held: square root of the precision of their priors, shape (b,).
        kind: where each row comes from, shape (n,).
        item: which hold, rotation or group of samples it is of, see ``ResidualTable``, shape (n,).
        direction: up at the row's hold (of a magnetometer: the field's direction), unit vectors,
            shape (n, 3); NaN for rotations.
        axis: the gyroscope's axis of a still row, -1 otherwise, shape (n,).
        time: s, shape (n,).
        sigma: standard deviation that noise alone gives each row, in the sensor's error unit, (n,).
        group: what is left out together: directions, or rotations; -1 for rows that always stay,
            shape (n,).
        lever: how far each row moves with the bias of each axis, in the sensor's error unit: a mean
            at rest by one, a closure by the seconds that its rotation lasts, a magnitude by the
            share along the field, shape (n, 3).
        noise: variance of the independent rows by noise alone, shape (n,).
        independent: how independent rows come from the measured ones.
        candidates: the effects that are not in the model.
        settings: how many settings of effects in the model the data chose.
    """

    minimum: Minimum[Experiment]
    table: ResidualTable
    residual: FloatArray
    base: FloatArray
    held: FloatArray
    kind: IntArray
    item: IntArray
    direction: FloatArray
    axis: IntArray
    time: FloatArray
    sigma: FloatArray
    group: IntArray
    lever: FloatArray
    noise: FloatArray
    independent: Decorrelation
    candidates: tuple[Candidate, ...]
    settings: int = 0

    def __len__(self) -> int:
        return len(self.residual)

    def whitened(self, columns: FloatArray) -> FloatArray:
        """Whitened rows from measured ones, shape (n, k)."""
        return self.independent.scaled(self.noise**-0.5, columns)

    def measured(self, columns: FloatArray) -> FloatArray:
        """Measured rows, in the sensor's error unit, from whitened ones, shape (n,) or (n, k)."""
        return self.independent.scaled(self.noise**0.5, columns)

    def with_effects(self, candidates: Sequence[Candidate]) -> Minimum[Experiment]:
        """Where the fit arrives with effects, by one step; with none, where it is."""
        terms = [Term(one.effect, one.variant) for one in candidates]
        columns = np.column_stack([np.zeros((len(self), 0)), *(one.columns for one in candidates)])
        # an effect of size s leaves what adding s to the model takes away
        return with_effects(self.minimum, terms, -self.independent.rows(self.measured(columns)))

    def fitted_with(self, candidates: Sequence[Candidate]) -> Minimum[Experiment]:
        """Where the fit arrives with effects that are too large for one step.

        Raises:
            DataError: it does not converge.
        """
        at, terms = self.minimum, [Term(one.effect, one.variant) for one in candidates]
        return minimum(at.experiment, (*at.terms.terms, *terms), at.base, at.directions)

    @property
    def visits(self) -> Visits:
        """Which rows repeat one another."""
        return Visits.of(self.table).without(self.table.indifferent)

    def lack_of_fit(self) -> LackOfFit:
        """Whether measured noise makes what is left."""
        return self._lack(self.base, self.visits)

    def lack_beside(self, columns: FloatArray) -> LackOfFit:
        """The same with these whitened columns in the model, shape (n, k)."""
        wider = np.column_stack([self.base, columns])
        return self._lack(wider, self.visits)

    def lack_without(self, items: Sequence[int], columns: FloatArray) -> LackOfFit:
        """The same without the rows that some holds or rotations spoil.

        The visits are compared as a fit without these rows leaves them: one that is far off turns
        the others away from each other.
        """
        out = self.table.spoilt(items)
        wider = np.column_stack([self.without(out).base, columns])
        beside = complement(wider)
        again = replace(self, residual=beside @ (beside.T @ self.residual))
        return again._lack(wider, self.visits.without(out))

    def _lack(self, columns: FloatArray, visits: Visits) -> LackOfFit:
        return lack_of_fit(self.residual, columns, self.sigma, visits, self.settings)

    def without(self, out: BoolArray) -> "WhitenedResiduals":
        """What is left of the other rows.

        Args:
            out: rows that say nothing, shape (n,).
        """
        # an error of its own for each of these rows takes them out
        own = self.whitened(np.eye(len(self))[:, out])
        held = np.append(self.held, np.zeros(own.shape[1]))
        return replace(self, base=np.column_stack([self.base, own]), held=held)


KINDS = {kind.name.lower(): kind for kind in RowKind} | {
    "heading": RowKind.ROTATION,
    "table": RowKind.ROTATION,
}
"""Rows of a rotation: its closure against gravity, and against the field; its angle on a table."""


def whitened_residuals(fit: SensorFit, effects: Sequence[Effect]) -> WhitenedResiduals:
    """What a fit leaves, whitened by the noise alone, with every effect that may explain it.

    Args:
        fit: of an experiment.
        effects: those that may explain it.
    """
    assert fit.rows is not None and fit.minimum is not None  # noqa: S101, PT018 (narrows the types)
    return whitened_rows(fit.minimum, fit.rows, effects)


def whitened_rows(
    found: Minimum[Experiment],
    table: ResidualTable,
    effects: Sequence[Effect],
    without: Sequence[str] = (),
) -> WhitenedResiduals:
    """See ``whitened_residuals``.

    Args:
        found: where a fit has arrived.
        table: its rows.
        effects: those that may explain what it leaves.
        without: effects of the fit that are taken out of it again, by their slopes where it has
            arrived: what the model without them leaves, as this fit and not one without them
            makes it linear.
    """
    experiment, sensor, of_effects = found.experiment, found.experiment.sensor, found.terms
    columns, precision = _in_modes(table, of_effects.terms)
    out, sizes = np.zeros(len(table.names), np.bool_), np.zeros(len(table.names))
    for term, group in zip(of_effects.terms, of_effects.groups, strict=True):
        if term.name in without:
            places = [table.names.index(name) for name in of_effects.names[group]]
            out[places], sizes[places] = True, found.calibration.sizes[group]
    for place in beyond_bounds(found, table):
        out[place], sizes[place] = True, found.system.value[~found.slow][place]
    # a column that only its prior holds is left out
    seen = ((columns**2).sum(axis=0) > precision) & ~out
    kind = np.array([KINDS[str(one)] for one in table.kind], np.int64)
    misfit = WhitenedResiduals(
        minimum=found,
        table=table,
        residual=table.whitened(table.residual - table.columns @ sizes),
        base=columns[:, seen],
        held=np.sqrt(precision[seen]),
        kind=kind,
        item=table.item,
        direction=table.direction,
        axis=np.where(kind == RowKind.STILL, table.axis, -1),
        time=table.time,
        sigma=table.floor,
        group=table.group,
        lever=table.lever,
        noise=table.noise,
        independent=table.independent,
        candidates=_candidates(
            table,
            sensor,
            [
                Term(effect, variant)
                for effect in effects
                for variant in effect.variants(experiment.circumstances)
            ],
        ),
        settings=of_effects.settings(without),
    )
    return misfit.without(table.indifferent) if table.indifferent.any() else misfit


def _in_modes(table: ResidualTable, terms: Sequence[Term]) -> tuple[FloatArray, FloatArray]:
    """Whitened columns of all parameters and the precision of their priors.

    A free curve has about as many coefficients as there are rows, most of which only their prior
    holds. Its columns are turned to the combinations of coefficients that are independent both in
    the prior and in these rows, so that each is held either by the rows or by the prior.
    """
    columns, precision = table.whitened(table.columns), np.diag(table.prior).copy()
    for term in terms:
        if not term.effect.free:
            continue
        own = np.array([name.startswith(f"{term.name}_") for name in table.names])
        others = complement(columns[:, ~own & (precision == 0.0)])
        scaled = columns[:, own] / np.sqrt(precision[own])
        turned = np.linalg.svd(others.T @ scaled, full_matrices=True)[2].T
        columns[:, own], precision[own] = scaled @ turned, 1.0
    return columns, precision


def beyond_bounds(found: Minimum[Experiment], table: ResidualTable) -> list[int]:
    """Places of bounded parameters that are larger than what they stand for can be.

    They have taken up what something else makes, which is to be looked for.
    """
    value, bounded = found.system.value[~found.slow], set()
    for source in found.experiment.sources:
        bounded |= set(source.bounded)
    usual = np.sqrt(np.maximum(np.diag(table.prior), np.finfo(float).tiny))
    sigma = np.sqrt(np.diag(found.balance.covariance)[~found.slow])
    large = usual * (np.abs(value) - MAX_DOUBTS * sigma) > MAX_BOUNDED
    return [k for k, name in enumerate(table.names) if large[k] and name in bounded]


def candidate_at(misfit: WhitenedResiduals, effect: Effect, variant: float) -> Candidate:
    """An effect with a setting between those of ``whitened_residuals``."""
    sensor = misfit.minimum.experiment.sensor
    return _candidates(misfit.table, sensor, [Term(effect, variant)])[0]


def _candidates(table: ResidualTable, sensor: str, terms: Sequence[Term]) -> tuple[Candidate, ...]:
    every = Terms(sensor, terms)
    # an effect of size s leaves what adding −s to the model would take away
    columns = -table.whitened(table.design_columns(every.terms))
    return tuple(
        Candidate(
            effect=term.effect,
            term=term.name,
            family=term.effect.family or term.name,
            variant=term.variant,
            names=tuple(one.name for one in every.parameters[group]),
            columns=columns[:, group],
            typical=term.effect.typical(sensor, term.variant),
            unit=every.parameters[group.start].unit,
        )
        for term, group in zip(every.terms, every.groups, strict=True)
    )
