"""The minimum of a fit: Gauss–Newton on ``Σ (r/σ)² + Σ (size/prior)²``.

The variance of each kind of row is estimated along with the parameters (``variance_components``).
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.experiment import Directions, Experiment
from imucal_wizard.estimate.variance_components import (
    Balance,
    System,
    balanced,
    solved,
)
from imucal_wizard.model.rows.decorrelation import Decorrelation, decorrelation
from imucal_wizard.model.rows.source import Parameters, Rows, RowSource
from imucal_wizard.model.rows.table import groups_of, numbered
from imucal_wizard.model.terms import Term, Terms

E = TypeVar("E", bound=Experiment)

E_co = TypeVar("E_co", bound=Experiment, covariant=True)

MAX_ITERATIONS = 40

MAX_HALVINGS = 10

ARRIVED = 1e-2
"""Step in standard deviations that no longer matters; the next one is a hundredth of it."""

VALLEY = 0.2
"""The same in a valley so long and flat that its bottom is not reached: what no data and hardly a
prior determine."""

MIN_FREEDOM_TO_JUDGE = 3.0
"""Degrees of freedom from which on a kind of row shows its noise by its residual alone."""
MIN_SHARE = 0.05
"""Of the measured noise that a kind of row may seem to have by its residual: by chance with three
degrees of freedom once in three hundred."""


@dataclass(frozen=True, eq=False)
class Minimum(Generic[E_co]):
    """Where a fit has arrived.

    Parameters are, in this order, the free directions of the base, the sizes of the effects, and
    the shared parameters.

    Attributes:
        experiment: what was fitted.
        base: terms of the base model that were asked for.
        directions: what of them is fitted.
        terms: the effects.
        calibration: the parameters.
        rows: of each source, there.
        system: the rows made linear, and independent of one another by ``independent``.
        balance: the fit of the system.
        independent: how independent rows come from the measured ones.
    """

    experiment: E_co
    base: tuple[str, ...]
    directions: Directions
    terms: Terms
    calibration: Parameters
    rows: tuple[Rows, ...]
    system: System
    balance: Balance
    independent: Decorrelation

    @property
    def sizes(self) -> slice:
        """Places of the sizes among the parameters."""
        return slice(len(self.directions), len(self.directions) + len(self.terms))

    @property
    def reported(self) -> BoolArray:
        """Which parameters have a reported error: all but the reference's own errors."""
        known = np.ones(len(self.system.precision), bool)
        shared = slice(self.sizes.stop, None)
        known[shared] = self.system.precision[shared] == 0.0
        return known

    @property
    def measured(self) -> BoolArray:
        """Which errors of the reference are measured noise, of all parameters.

        The others are parameters of usual size that the reference's own data do not determine.
        """
        known = ~self.reported & ~self.slow
        undetermined = {name for s in self.experiment.sources for name in s.undetermined}
        for place, name in enumerate(shared_names(self.experiment), self.sizes.stop):
            known[place] &= name not in undetermined
        return known

    @property
    def slow(self) -> BoolArray:
        """Which of all parameters are slow noise, estimated from the rows themselves."""
        slow = {name for source in self.experiment.sources for name in source.slow}
        known = np.zeros(len(self.system.precision), bool)
        known[self.sizes.stop :] = [name in slow for name in shared_names(self.experiment)]
        return known

    @property
    def residual(self) -> FloatArray:
        """What is left of each independent row, slow noise included, shape (n,)."""
        slow = self.slow
        return self.system.residual - self.system.columns[:, slow] @ self.system.value[slow]

    @property
    def errors(self) -> FloatArray:
        """Error of each measured row with the reference taken as it is, shape (n,)."""
        doubts = ~self.reported
        return self.independent.measured(
            self.system.residual - self.system.columns[:, doubts] @ self.system.value[doubts]
        )

    @property
    def groups(self) -> IntArray:
        """What is left out together, of each measured row, shape (n,)."""
        return groups_of(self.experiment.sources)

    @property
    def white_variance(self) -> FloatArray:
        """Variance of each independent row by what its kind leaves, shape (n,).

        The variance found is at least that of the measured noise; where a kind leaves less, its
        residual is the better judge. With fewer than three degrees of freedom it leaves little by
        chance, and the measured noise stands for those that lack.
        """
        kinds, balance = self.system.kinds, self.balance
        squares = np.bincount(kinds, self.system.residual**2 / balance.variance)
        lacking = np.maximum(MIN_FREEDOM_TO_JUDGE - balance.freedom, 0.0)
        share = (squares + lacking) / (balance.freedom + lacking)
        return np.asarray(balance.variance * np.maximum(share, MIN_SHARE)[kinds])

    def covariance(self) -> FloatArray | None:
        """Of all parameters, by the scatter of the rows; None where nothing is left to judge by.

        ``C (Jᵀ W Σ W J + P) C`` with the weights W of the fit and the variances Σ that it leaves.
        The experiment adds slow noise (``Experiment.in_session``).
        """
        if self.balance.freedom.min() < 1.0:
            return None
        weighted = self.system.columns / self.balance.variance[:, None]
        middle = weighted.T @ (weighted * self.white_variance[:, None])
        inner = middle + np.diag(np.where(self.slow, 0.0, self.balance.precision))
        return np.asarray(self.balance.covariance @ inner @ self.balance.covariance)

    def pull(self) -> FloatArray:
        """By how much an error of each independent row moves each parameter, shape (p, n)."""
        weighted = self.system.columns / self.balance.variance[:, None]
        return np.asarray(-self.balance.covariance @ weighted.T)


def minimum(
    experiment: E,
    terms: Sequence[Term] = (),
    base: Sequence[str] | None = None,
    directions: Directions | None = None,
    variance: FloatArray | None = None,
    own_noise: float | None = None,
) -> Minimum[E]:
    """The parameters, and the rows made linear at them.

    Args:
        experiment: the rows.
        terms: the effects.
        base: terms of the base model; None for all.
        directions: what is fitted of them; None for what the experiment determines.
        variance: of each independent row where it is not to be estimated, shape (n,).
        own_noise: the variance of each row as a multiple of its measured noise, where it is not to
            be estimated.

    Raises:
        DataError: the fit does not converge.
        UsageError: a term that the base does not have, or an effect of another sensor.
    """
    chosen = experiment.checked(base)
    free = experiment.directions(chosen) if directions is None else directions
    together = Terms(experiment.sensor, terms)
    shared = shared_names(experiment)
    start = experiment.begin(chosen)
    calibration = Parameters(
        start.matrix, start.bias, np.zeros(len(together)), np.zeros(len(shared))
    )
    rows = tuple(source.at(calibration, together) for source in experiment.sources)
    independent = decorrelation(experiment.sources, rows)
    problem = _Problem(experiment, chosen, free, together, shared, independent)

    def solve(system: System) -> Balance:
        if own_noise is not None:
            return solved(system, own_noise * system.own, system.precision)
        if variance is None:
            return balanced(system)
        return solved(system, variance, system.precision)

    for _ in range(MAX_ITERATIONS):
        with np.errstate(over="ignore", invalid="ignore"):  # a fit that diverges is refused below
            system = problem.system(calibration, rows)
            balance = solve(system)
            calibration, rows = problem.downhill(calibration, rows, system, balance)
        length = balance.step_length
        if not np.isfinite(calibration.entries).all():
            length = np.inf
        if length < ARRIVED or length == np.inf:
            break
    if not length < VALLEY:
        raise DataError(
            f"the fit of the {experiment.sensor} does not converge: these data do not belong to "
            "one calibration of this model. Check the columns, unit and sampling rate and the "
            "largest residuals, and leave the last effect out"
        )
    system = problem.system(calibration, rows, system.columns)
    arrived = experiment, chosen, free, together, calibration, rows, system
    return Minimum(*arrived, solve(system), independent)


def with_effects(
    found: Minimum[Experiment], terms: Sequence[Term], columns: FloatArray
) -> Minimum[Experiment]:
    """The fit with more effects, by one step from where the fit without them has arrived.

    The variances of the rows and the widths of the priors are estimated again, as adding the
    effects does; only the rows stay linear.

    Args:
        found: the fit without them.
        terms: the effects.
        columns: derivative of the independent rows by their sizes, shape (n, p).
    """
    system, place = found.system, found.sizes.stop
    more = Terms(found.experiment.sensor, terms)
    wider = System(
        residual=system.residual,
        columns=np.insert(system.columns, [place], columns, axis=1),
        own=system.own,
        kinds=system.kinds,
        precision=np.insert(system.precision, place, more.precision),
        value=np.insert(system.value, place, np.zeros(len(more))),
        groups=(
            *system.groups,
            *(slice(place + group.start, place + group.stop) for group in more.groups),
        ),
    )
    both = Terms(found.experiment.sensor, (*found.terms.terms, *terms))
    moved, balance = _stepped(wider)
    return replace(found, terms=both, system=moved, balance=balance)


def under_reference(found: Minimum[E], experiment: E) -> Minimum[E]:
    """The fit of the same rows under another reference, by one step from where the fit has arrived.

    Args:
        found: the fit.
        experiment: its experiment under the other reference.
    """
    sources, terms = experiment.sources, found.terms
    rows = tuple(
        s.at(found.calibration, terms, r) for s, r in zip(sources, found.rows, strict=True)
    )
    shared = shared_names(experiment)
    independent = decorrelation(sources, rows)
    problem = _Problem(experiment, found.base, found.directions, terms, shared, independent)
    calibration = replace(found.calibration, shared=np.zeros(len(shared)))
    system, balance = _stepped(problem.system(calibration, rows))
    begun = experiment, found.base, found.directions, terms, calibration, rows
    return Minimum(*begun, system, balance, independent)


def shared_names(experiment: Experiment) -> list[str]:
    """Names of the parameters that rows of an experiment share."""
    return list(dict.fromkeys(name for one in experiment.sources for name in one.shared))


def _stepped(system: System) -> tuple[System, Balance]:
    """The system after one step of its fit, and the fit there."""
    balance = balanced(system)
    moved = replace(
        system,
        residual=system.residual + system.columns @ balance.step,
        value=system.value + balance.step,
    )
    return moved, replace(balance, step=np.zeros_like(balance.step))


@dataclass(frozen=True, eq=False)
class _Problem:
    """What stays the same while the parameters move."""

    experiment: Experiment
    base: tuple[str, ...]
    directions: Directions
    terms: Terms
    shared: list[str]
    independent: Decorrelation

    def rows_at(self, calibration: Parameters, near: tuple[Rows, ...]) -> tuple[Rows, ...]:
        return tuple(
            source.at(calibration, self.terms, one)
            for source, one in zip(self.experiment.sources, near, strict=True)
        )

    def residual(
        self, rows: tuple[Rows, ...], shared: FloatArray, doubts: FloatArray
    ) -> FloatArray:
        measured = np.concatenate([one.residual for one in rows])
        return self.independent.rows(measured) + doubts @ shared

    def system(
        self,
        calibration: Parameters,
        rows: tuple[Rows, ...],
        columns: FloatArray | None = None,
    ) -> System:
        """The rows made linear, at columns known already where they are given."""
        sources, first = self.experiment.sources, len(self.directions)
        if columns is None:
            parts = [self._columns(s, r) for s, r in zip(sources, rows, strict=True)]
            columns = self.independent.rows(np.concatenate(parts))
        doubts = columns[:, first + len(self.terms) :]
        value = np.zeros(first)
        if len(self.directions.precision):
            moved = calibration.entries - self.experiment.begin(self.base).entries
            value = np.linalg.pinv(self.directions.columns) @ moved
        return System(
            residual=self.residual(rows, calibration.shared, doubts),
            columns=columns,
            own=self.independent.own(np.concatenate([one.own for one in rows])),
            kinds=self._kinds,
            precision=self._precision,
            value=np.concatenate([value, calibration.sizes, calibration.shared]),
            groups=tuple(slice(first + g.start, first + g.stop) for g in self.terms.groups),
        )

    @cached_property
    def _kinds(self) -> IntArray:
        return numbered([source.labels.component for source in self.experiment.sources])

    @cached_property
    def _precision(self) -> FloatArray:
        known = {
            name: precision
            for source in self.experiment.sources
            for name, precision in zip(source.shared, source.shared_precision, strict=True)
        }
        prior = self.directions.precision
        return np.concatenate(
            [
                prior if len(prior) else np.zeros(len(self.directions)),
                self.terms.precision,
                [known[name] for name in self.shared],
            ]
        )

    def _columns(self, source: RowSource, rows: Rows) -> FloatArray:
        shared = np.zeros((len(rows.residual), len(self.shared)))
        places = [self.shared.index(name) for name in source.shared]
        shared[:, places] = rows.shared_columns()
        effects = [rows.term_columns(self.terms.terms)] if len(self.terms) else []
        base = rows.base_columns() @ self.directions.columns
        return np.concatenate([base, *effects, shared], axis=1)

    def downhill(
        self, calibration: Parameters, rows: tuple[Rows, ...], system: System, balance: Balance
    ) -> tuple[Parameters, tuple[Rows, ...]]:
        """The parameters a step further, or a half, a quarter … of it where the cost would rise."""
        first, last = len(self.directions), len(self.directions) + len(self.terms)
        doubts, sources = system.columns[:, last:], self.experiment.sources
        exact = np.repeat(
            [one.exact_slope for one in sources], [len(one.labels) for one in sources]
        )
        before = float((system.residual**2 / balance.variance).sum())
        before += float((balance.precision * system.value**2).sum())
        size = 1.0
        for _ in range(MAX_HALVINGS):
            step = size * balance.step
            entries = self.directions.columns @ step[:first]
            moved = calibration.moved(entries, step[first:last], step[last:])
            moved = self.experiment.constrained(moved, self.base)
            further = self.rows_at(moved, rows)
            left = self.residual(further, moved.shared, doubts)
            left = np.where(exact, left, system.residual + system.columns @ step)
            prior = balance.precision * (system.value + step) ** 2
            cost = float((left**2 / balance.variance).sum() + prior.sum())
            # effects may be taken at the point before, which makes the cost uncertain by so much
            if cost < before * (1.0 + 1e-3) + 1e-3:
                break
            size /= 2.0
        return moved, further
