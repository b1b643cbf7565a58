"""The estimator: one MAP fit of a base model and effects to the rows of any experiment.

Gauss–Newton on ``Σ (r/σ)² + Σ (size/prior)²``; the variance of each kind of row is estimated along
with it (``variance_components``). A calibration without effects is the same fit without terms.
From the final linearisation follow, once and for all who ask: covariance, errors held out, the
errors that noise alone would leave, outliers, the residual table.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import sample_quantile
from imucal_wizard.estimate.distributions import WITHIN_NINETY, chi_square
from imucal_wizard.estimate.experiment import Directions, Experiment
from imucal_wizard.estimate.lack_of_fit import lack_without
from imucal_wizard.estimate.outliers import Outlier, outlier
from imucal_wizard.estimate.parameters import with_errors
from imucal_wizard.estimate.repeatability import repeatability_of
from imucal_wizard.estimate.result import Parameter, SensorFit
from imucal_wizard.estimate.variance_components import (
    Balance,
    System,
    balanced,
    determined,
    inverted,
    solved,
)
from imucal_wizard.model.rows.decorrelation import Decorrelation, decorrelation
from imucal_wizard.model.rows.source import Parameters, Rows, RowSource
from imucal_wizard.model.rows.table import ResidualTable, groups_of, numbered
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
HOLE = 1.0 / (1.0 + 42.0**2)
"""Share of a group's own error left in its residual, below which the base model is fitted to it by
nothing else: usual noise (1 mg) would then pass for a usual bias (42 mg)."""
BLIND_TO_GROUP = 1e-9
"""The same of the whole model, whose effects have priors."""
MIN_SHARE = 0.05
"""Of the measured noise that a kind of row may seem to have by its residual: by chance with three
degrees of freedom once in three hundred."""
NOT_SHOWN = 1e-6
"""Share of a group's own error, of the largest share of any combination in it, below which the
other rows do not show that combination."""
EARLY = 2.0 / 3.0
"""Share of the session that predicts what comes later."""
MIN_LATER = 3
"""Holds or rotations that are left to be predicted, at least."""


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
        """Which parameters an error is told with: all but those of the reference's own errors."""
        known = np.ones(len(self.system.precision), bool)
        shared = slice(self.sizes.stop, None)
        known[shared] = self.system.precision[shared] == 0.0
        return known

    @property
    def measured(self) -> BoolArray:
        """Which errors of the reference are measured noise, of all parameters.

        The others are parameters of usual size that the reference's own data do not determine.
        """
        known = ~self.reported
        undetermined = {name for s in self.experiment.sources for name in s.undetermined}
        for place, name in enumerate(_shared_names(self), self.sizes.stop):
            known[place] &= name not in undetermined
        return known

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
        residual is the better judge.
        """
        kinds, balance = self.system.kinds, self.balance
        squares = np.bincount(kinds, self.system.residual**2 / balance.variance)
        share = np.where(balance.freedom >= 1.0, squares / np.maximum(balance.freedom, 1.0), 1.0)
        return np.asarray(balance.variance * np.maximum(share, MIN_SHARE)[kinds])

    def covariance(self) -> FloatArray | None:
        """Of all parameters, by the scatter of the rows; None where nothing is left to judge by.

        ``C (Jᵀ W Σ W J + P) C`` with the weights W of the fit and the variances Σ that it leaves.
        """
        if self.balance.freedom.min() < 1.0:
            return None
        weighted = self.system.columns / self.balance.variance[:, None]
        middle = weighted.T @ (weighted * self.white_variance[:, None])
        inner = middle + np.diag(self.balance.precision)
        return np.asarray(self.balance.covariance @ inner @ self.balance.covariance)

    def pull(self) -> FloatArray:
        """By how much an error of each independent row moves each parameter, shape (p, n)."""
        weighted = self.system.columns / self.balance.variance[:, None]
        return np.asarray(-self.balance.covariance @ weighted.T)


def fit(
    experiment: Experiment, terms: Sequence[Term] = (), base: Sequence[str] | None = None
) -> SensorFit:
    """Fit a base model with effects, each effect with a prior on its sizes.

    Args:
        experiment: the rows.
        terms: the effects; none for a plain calibration.
        base: which terms of the base model are fitted, the others keeping their nominal value;
            None for all.

    Raises:
        DataError: the fit does not converge.
        UsageError: a term that the base does not have, or an effect of another sensor.
    """
    found = minimum(experiment, terms, base)
    refined = experiment.refined(found)
    return report(found if refined is experiment else minimum(refined, terms, base))


def minimum(
    experiment: E,
    terms: Sequence[Term] = (),
    base: Sequence[str] | None = None,
    directions: Directions | None = None,
    variance: FloatArray | None = None,
) -> Minimum[E]:
    """The parameters, and the rows made linear at them.

    Args:
        experiment: the rows.
        terms: the effects.
        base: terms of the base model; None for all.
        directions: what is fitted of them; None for what the experiment determines.
        variance: of each independent row where it is not to be estimated, shape (n,).

    Raises:
        DataError: the fit does not converge.
        UsageError: a term that the base does not have, or an effect of another sensor.
    """
    chosen = experiment.checked(base)
    free = experiment.directions(chosen) if directions is None else directions
    together = Terms(experiment.sensor, terms)
    shared = list(dict.fromkeys(name for one in experiment.sources for name in one.shared))
    start = experiment.begin(chosen)
    calibration = Parameters(
        start.matrix, start.bias, np.zeros(len(together)), np.zeros(len(shared))
    )
    rows = tuple(source.at(calibration, together) for source in experiment.sources)
    independent = decorrelation(experiment.sources, rows)
    problem = _Problem(experiment, chosen, free, together, shared, independent)

    def solve(system: System) -> Balance:
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
    shared = list(dict.fromkeys(name for one in sources for name in one.shared))
    independent = decorrelation(sources, rows)
    problem = _Problem(experiment, found.base, found.directions, terms, shared, independent)
    calibration = replace(found.calibration, shared=np.zeros(len(shared)))
    system, balance = _stepped(problem.system(calibration, rows))
    begun = experiment, found.base, found.directions, terms, calibration, rows
    return Minimum(*begun, system, balance, independent)


def _stepped(system: System) -> tuple[System, Balance]:
    """The system after one step of its fit, and the fit there."""
    balance = balanced(system)
    moved = replace(
        system,
        residual=system.residual + system.columns @ balance.step,
        value=system.value + balance.step,
    )
    return moved, replace(balance, step=np.zeros_like(balance.step))


def rms_fitted(found: Minimum[Experiment]) -> float:
    """Error of holds or rotations on the data fitted."""
    return _items(found).rms(found.errors)


def rms_held_out(found: Minimum[Experiment]) -> float | None:
    """Error of holds or rotations left out; None where the others do not determine the model."""
    out = _under_the_others(found, found.system.residual[:, None], found.errors[:, None])
    return None if out is None else _items(found).rms(out[:, 0])


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
            value = self.directions.columns.T @ moved
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
        doubts = system.columns[:, last:]
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
            prior = balance.precision * (system.value + step) ** 2
            cost = float((left**2 / balance.variance).sum() + prior.sum())
            # effects may be taken at the point before, which makes the cost uncertain by so much
            if cost < before * (1.0 + 1e-3) + 1e-3:
                break
            size /= 2.0
        return moved, further


def report(found: Minimum[Experiment]) -> SensorFit:
    """Everything that is said of a fit, computed once."""
    experiment, calibration, terms = found.experiment, found.calibration, found.terms
    covariance, in_session = found.covariance(), experiment.in_session(found)
    free, sizes = slice(0, len(found.directions)), found.sizes
    of_entries = of_sizes = by_repeats = None
    errors, independent = found.errors, found.independent
    left_out = _left_out(found)
    out = None if left_out is None else left_out.errors
    table = ResidualTable(
        sources=experiment.sources,
        at=found.rows,
        residual=independent.measured(found.system.residual),
        reported=errors,
        held_out=out,
        columns=independent.measured(found.system.columns),
        names=(*found.directions.names, *terms.names, *_shared_names(found)),
        precision=found.balance.precision,
        variance=found.balance.variance,
        own=found.system.own,
        independent=independent,
    )
    repeats = repeatability_of(table)
    if covariance is not None:
        basis = found.directions.columns
        of_entries = in_session
        if of_entries is None:
            of_entries = basis @ covariance[free, free] @ basis.T + experiment.left_nominal(found)
        of_sizes = covariance[sizes, sizes]
        # repeats tell the scatter of the rows fitted only where all of these are such rows
        if repeats is not None and (table.judged & table.repeats_are_noise & ~table.moving).all():
            share = repeats.rms**2 / float(found.white_variance.mean())
            by_repeats = share * of_entries
    items = _items(found)
    size_errors = np.full(len(terms), np.nan)
    if of_sizes is not None:
        size_errors = np.sqrt(np.maximum(np.diag(of_sizes), 0.0))
    odd = _accused(found, table)
    kept = list(experiment.covariance_entries)
    return SensorFit(
        sensor=experiment.sensor,
        model=(*found.directions.terms, *(term.name for term in terms.terms)),
        method=experiment.method,
        frame=experiment.frame,
        matrix=calibration.matrix,
        bias=calibration.bias,
        bias_unit=experiment.unit,
        parameters=(
            *with_errors(
                lambda entries: experiment.named(entries[:9].reshape(3, 3), entries[9:]),
                calibration.entries,
                of_entries,
                experiment.unit_of,
                found.directions.dropped,
                by_repeats,
            ),
            *experiment.settled,
            *_size_parameters(terms, calibration.sizes, size_errors),
        ),
        unit=experiment.error_unit,
        rms_before=items.rms(_before(found)),
        rms_fitted=items.rms(errors),
        rms_held_out=None if out is None else items.rms(out),
        held_out_interval=None if left_out is None else left_out.interval,
        floor=None if left_out is None else left_out.floor,
        floor_fitted=_floor_fitted(found) if left_out is None else left_out.floor_fitted,
        residuals=items.each(errors),
        held_out=None if out is None else items.each(out),
        covariance=of_entries[np.ix_(kept, kept)] if kept and of_entries is not None else None,
        warnings=(found.directions.reason,) if found.directions.reason else (),
        degrees_of_freedom=max(int(found.balance.freedom.min() + 1e-6), 0),
        repeatability=repeats,
        slow_noise_measured=experiment.slow_noise_measured,
        suspects=() if odd is None else (odd.index,),
        not_held_out="" if out is not None else _why_none(found),
        base=found.base,
        terms=terms.terms,
        sizes=terms.split(calibration.sizes),
        size_errors=terms.split(size_errors),
        size_covariance=of_sizes,
        rows=table,
        rms_late=_rms_later(found),
        reference=experiment.reference(found),
        experiment=experiment,
        outlier=odd,
        minimum=found,
    )


def _accused(found: Minimum[Experiment], table: ResidualTable) -> Outlier | None:
    """The hold or rotation that stands out, if the others agree with one another without it."""
    odd, items = outlier_of(found), _items(found)
    if odd is None:
        return None
    lack = lack_without(table, items.rows[items.item == odd.index])
    return odd if lack.within_noise else None


@dataclass(frozen=True, eq=False)
class _Items:
    """Judged rows by what they are of: errors are told per hold, per rotation.

    Attributes:
        rows: the judged rows, shape (j,).
        item: number of each one's hold or rotation, shape (j,).
    """

    rows: IntArray
    item: IntArray

    def each(self, errors: FloatArray) -> FloatArray:
        """Error of each hold (with its sign) or rotation (its angle) from those of all rows."""
        own = errors[self.rows]
        if len(own) == self.item.max(initial=-1) + 1:
            return own
        return np.sqrt(np.bincount(self.item, own**2))

    def rms(self, errors: FloatArray) -> float:
        """Of holds or rotations, from the errors of all rows."""
        return self.mean(errors**2)

    def mean(self, variances: FloatArray) -> float:
        """Root of the mean variance of a hold or rotation, from the variances of all rows."""
        return float(np.sqrt(variances[self.rows].sum() / (self.item.max(initial=0) + 1)))


def _items(found: Minimum[Experiment]) -> _Items:
    sources = found.experiment.sources
    judged = np.concatenate([np.full(len(s.labels), s.judged) for s in sources])
    index = numbered([source.labels.index for source in sources])
    rows = np.flatnonzero(judged)
    return _Items(rows, np.unique(index[rows], return_inverse=True)[1])


def _before(found: Minimum[Experiment]) -> FloatArray:
    """Errors with the nominal conversion only."""
    experiment = found.experiment
    nominal = experiment.before()
    count = len(found.calibration.shared)
    nominal = Parameters(nominal.matrix, nominal.bias, np.zeros(0), np.zeros(count))
    none = Terms(experiment.sensor, ())
    rows = [source.at(nominal, none) for source in experiment.sources]
    return np.concatenate([one.residual for one in rows])


def _shared_names(found: Minimum[Experiment]) -> list[str]:
    return list(dict.fromkeys(n for source in found.experiment.sources for n in source.shared))


def _size_parameters(terms: Terms, sizes: FloatArray, errors: FloatArray) -> tuple[Parameter, ...]:
    return tuple(
        Parameter(name, float(size), float(error) if np.isfinite(error) else None, one.unit)
        for name, size, error, one in zip(terms.names, sizes, errors, terms.parameters, strict=True)
    )


@dataclass(frozen=True, eq=False)
class _LeftOut:
    """Errors of rows under the fit of all others, and what measured noise alone would make of them.

    Attributes:
        errors: shape (n,).
        floor_fitted: expected rms of the fitted rows.
        floor: expected rms of the rows left out.
        interval: between which the rms of new holds or rotations lies nine times in ten.
    """

    errors: FloatArray
    floor_fitted: float
    floor: float
    interval: tuple[float, float]


def _left_out(found: Minimum[Experiment]) -> _LeftOut | None:
    """Errors of each group of rows under the fit of all others; what noise would make of them.

    The expected errors are the same linear maps as those of the rows, applied to the measured noise
    of the rows and of the reference. With these maps E, the mean square held out is a quadratic
    form in noise, about a chi square of ``tr(E Eᵀ)² / tr((E Eᵀ)²)`` degrees of freedom
    (Satterthwaite). A new row has its own noise and the errors of the fit of all rows.

    Returns:
        None where the other rows do not determine the model.
    """
    system, balance, reported = found.system, found.balance, found.reported
    noise = _noise_root(found)
    moved = balance.covariance @ ((system.columns / balance.variance[:, None]).T @ noise)
    left = noise - system.columns @ moved
    pulled = found.independent.measured(system.columns[:, reported] @ moved[reported])
    noise = found.independent.measured(noise)
    fitted, items = noise - pulled, _items(found)
    out = _under_the_others(
        found,
        np.column_stack([system.residual, left]),
        np.column_stack([found.errors, fitted]),
    )
    if out is None:
        return None
    errors, expected = out[:, 0], out[:, 1:]
    floor = items.mean((expected**2).sum(axis=1))
    new = items.mean((noise**2).sum(axis=1) + (pulled**2).sum(axis=1))
    judged = expected[items.rows]
    products = judged @ judged.T
    freedom = float(np.trace(products)) ** 2 / float((products**2).sum())
    usual = items.rms(errors) * new / floor
    return _LeftOut(
        errors=errors,
        floor_fitted=items.mean((fitted**2).sum(axis=1)),
        floor=floor,
        interval=(
            usual / chi_square(WITHIN_NINETY, freedom) ** 0.5,
            usual / chi_square(-WITHIN_NINETY, freedom) ** 0.5,
        ),
    )


def _under_the_others(
    found: Minimum[Experiment], left: FloatArray, errors: FloatArray
) -> FloatArray | None:
    """Errors of each group of rows under the fit of all others, shape (n, k).

    With P = Σ⁻¹ − Σ⁻¹ J N⁻¹ Jᵀ Σ⁻¹ the step from the fit of all is
    ``N⁻¹ (Σ⁻¹ J)_gᵀ P_gg⁻¹ (Σ⁻¹ r)_g``; it is exact where the rows are linear in it, and it is
    small.

    Args:
        found: the fit of all.
        left: what it leaves of k sets of independent rows, shape (n, k).
        errors: the error of each measured row that is told of these, shape (n, k).

    Returns:
        None where the other rows do not determine the model.
    """
    system, balance, reported = found.system, found.balance, found.reported
    independent, variance = found.independent, balance.variance
    weighted = system.columns / variance[:, None]
    base = np.ones(weighted.shape[1], bool)
    base[found.sizes] = False
    base_covariance = inverted(
        system.columns[:, base].T @ weighted[:, base] + np.diag(balance.precision[base])
    )
    pulls = independent.measured(left / variance[:, None])
    known, columns = independent.measured(weighted), independent.measured(system.columns)
    out = errors.copy()
    for rows in groups_by_size(found.groups):
        root = _inverse_root(independent.blocks(1.0 / variance, rows))
        white = root @ known[rows]
        gate = unexplained(white[:, :, base] @ base_covariance, white[:, :, base])
        inner = unexplained(white @ balance.covariance, white)
        if (
            np.linalg.eigvalsh(gate).min() < HOLE
            or np.linalg.eigvalsh(inner).min() < BLIND_TO_GROUP
        ):
            return None
        alone = np.swapaxes(root, 1, 2) @ np.linalg.solve(inner, root @ pulls[rows])
        step = balance.covariance[reported] @ (np.swapaxes(known[rows], 1, 2) @ alone)
        out[rows] += columns[rows][:, :, reported] @ step
    return out


def _inverse_root(blocks: FloatArray) -> FloatArray:
    """``L⁻¹`` of each block L Lᵀ, shape (g, s, s)."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(blocks)))


def groups_by_size(labels: IntArray) -> Iterator[IntArray]:
    """Places of the members of each group, for all groups of one size at once.

    Args:
        labels: number of each one's group, −1 for none, shape (n,).

    Yields:
        Shape (groups, size).
    """
    order = np.argsort(labels, kind="stable")
    order = order[labels[order] >= 0]
    counts = np.bincount(labels[order])
    sizes = np.repeat(counts, counts)
    for size in distinct(counts[counts > 0]):
        yield order[sizes == size].reshape(-1, size)


def unexplained(lever: FloatArray, white: FloatArray) -> FloatArray:
    """``1 − H`` of groups of rows: what their own pull on the fit leaves of their errors.

    Args:
        lever: whitened columns times the covariance, shape (groups, size, p).
        white: whitened columns, shape (groups, size, p).

    Returns:
        Shape (groups, size, size).
    """
    return np.asarray(np.eye(white.shape[1]) - lever @ np.swapaxes(white, 1, 2))


def left_out(unexplained: FloatArray, errors: FloatArray) -> FloatArray:
    """Errors of groups of rows under the fit of all others, ``(1 − H)⁻¹ r`` over what that shows.

    Args:
        unexplained: 1 − H of each group, shape (groups, size, size).
        errors: under the fit of all, shape (groups, size).
    """
    values, vectors = np.linalg.eigh(unexplained)
    seen = values > NOT_SHOWN * values[:, -1:]
    inverse = np.where(seen, 1.0, 0.0) / np.where(seen, values, 1.0)
    turned = np.swapaxes(vectors, 1, 2) @ errors[:, :, None]
    return np.asarray((vectors @ (inverse[:, :, None] * turned))[:, :, 0])


def _noise_root(found: Minimum[Experiment]) -> FloatArray:
    """A root of the covariance of independent rows by noise, that of the reference included."""
    own, columns = found.system.own, found.system.columns
    return np.column_stack([np.diag(np.sqrt(own)), columns[:, found.measured]])


def _floor_fitted(found: Minimum[Experiment]) -> float:
    """Expected rms of the fitted rows by noise alone, where none can be left out."""
    system, reported = found.system, found.reported
    noise, pull = _noise_root(found), found.pull()
    fitted = noise + system.columns[:, reported] @ (pull[reported] @ noise)
    fitted = found.independent.measured(fitted)
    return _items(found).mean((fitted**2).sum(axis=1))


def _why_none(found: Minimum[Experiment]) -> str:
    words = {source.group_word for source in found.experiment.sources if source.judged}
    one = " or ".join(sorted(words))
    return (
        f"without one of the {one}s the others do not determine this model, so none could be left "
        "out to check it: add some"
    )


def _rms_later(found: Minimum[Experiment]) -> float | None:
    """Rms error of the later holds or rotations under the fit of the early part of the session.

    What nothing slow moves (the base's directions without a part in a bias) is kept from all data,
    so that rotations about one axis after another leave something to predict. None where the early
    rows do not determine the rest, or too few are later.
    """
    time = np.concatenate([source.labels.time for source in found.experiment.sources])
    early = time < sample_quantile(found.experiment.circumstances.time, EARLY)
    items = _items(found)
    late = ~early[items.rows]
    count = len(distinct(items.item[late]))
    moving = np.ones(len(found.system.precision), bool)
    moving[: len(found.directions)] = found.directions.slow
    refit = _refitted(found, early, moving) if count >= MIN_LATER else None
    if refit is None:
        return None
    known = moving & found.reported
    columns = found.independent.measured(found.system.columns[:, known])
    errors = found.errors + columns @ refit[known[moving]]
    return float(np.sqrt((errors[items.rows][late] ** 2).sum() / count))


def _refitted(found: Minimum[Experiment], rows: BoolArray, moving: BoolArray) -> FloatArray | None:
    """Change of some parameters when some rows alone speak; None where these do not know them."""
    system, balance, independent = found.system, found.balance, found.independent
    columns = independent.measured(system.columns)[np.ix_(rows, moving)]
    weighted = independent.weighted(columns, balance.variance, rows)
    normal = columns.T @ weighted + np.diag(balance.precision[moving])
    if not determined(normal):
        return None
    residual = independent.measured(system.residual)[rows]
    pull = weighted.T @ residual + (balance.precision * system.value)[moving]
    return np.asarray(-inverted(normal) @ pull)


def outlier_of(found: Minimum[Experiment]) -> Outlier | None:
    """The hold or rotation that does not fit with all others, if one stands out."""
    system, items, independent = found.system, _items(found), found.independent
    variance, covariance = found.balance.variance, found.balance.covariance
    known = independent.measured(system.columns / variance[:, None])
    pulls = independent.measured(system.residual / variance)
    drops = np.zeros(items.item.max(initial=-1) + 1)
    for places in groups_by_size(items.item):
        rows = items.rows[places]
        root = _inverse_root(independent.blocks(1.0 / variance, rows))
        errors = (root @ pulls[rows][:, :, None])[:, :, 0]
        white = root @ known[rows]
        alone = left_out(unexplained(white @ covariance, white), errors)
        drops[items.item[places[:, 0]]] = (errors * alone).sum(axis=1)
    # the judged rows are mixed among themselves alone
    own = (system.residual / np.sqrt(variance))[items.rows]
    judged = distinct(system.kinds[items.rows])
    freedom = float(found.balance.freedom[judged].sum())
    size = len(own) // max(len(drops), 1)
    return outlier(drops, float(own @ own), size, freedom)
