"""The estimator: one MAP fit of a base model and effects to the rows of any experiment.

The minimum of ``Σ (r/σ)² + Σ (size/prior)²`` is found by Gauss–Newton. The variance of each kind of
row is estimated along with the parameters (``variance_components``). A calibration without effects
is the same fit without terms. ``held_out`` computes the errors of holds and rotations left out, and
those that noise alone makes. ``report`` computes every figure of the fit once, for all commands and
screens.
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
from imucal_wizard.estimate.held_out import (
    HeldOut,
    errors_later,
    floor_fitted,
    held_out,
    items_of,
    made_by_noise,
    outlier_of,
    rms_in_noise,
    rms_later,
    why_none_held_out,
)
from imucal_wizard.estimate.lack_of_fit import lack_without
from imucal_wizard.estimate.outliers import Outlier
from imucal_wizard.estimate.parameters import with_errors
from imucal_wizard.estimate.repeatability import Repeatability, repeatability_of
from imucal_wizard.estimate.result import Parameter, SensorFit
from imucal_wizard.estimate.split import Opened, Split, split_of, steps_by_rows
from imucal_wizard.estimate.variance_components import (
    Balance,
    System,
    balanced,
    solved,
)
from imucal_wizard.model.rows.decorrelation import Decorrelation, decorrelation
from imucal_wizard.model.rows.source import ENTRIES, Parameters, Rows, RowSource
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

RMS_OF_SQUARE = np.sqrt(3.0)
"""Of a normal variable, in units of its variance."""
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
    def shared(self) -> list[str]:
        """Names of the parameters that rows share."""
        return shared_names(self.experiment, self.terms)

    @property
    def reported(self) -> BoolArray:
        """Which parameters have a reported error: all but the reference's own errors.

        Errors of the reference that these rows decide are fitted with them.
        """
        known = np.ones(len(self.system.precision), bool)
        shared = slice(self.sizes.stop, None)
        decided = {name for source in self.experiment.sources for name in source.decided}
        known[shared] = self.system.precision[shared] == 0.0
        own = [name in decided for name in self.shared]
        known[shared] |= np.array(own, bool)
        return known

    @property
    def alone(self) -> "Minimum[E_co]":
        """The same fit as its own rows determine it, without what another sensor's rows show."""
        if not len(self.system.away):
            return self
        system = replace(self.system, information=np.zeros((0, 0)), away=np.zeros(0))
        balance = solved(system, self.balance.variance, self.balance.precision)
        return replace(self, system=system, balance=balance)

    @property
    def measured(self) -> BoolArray:
        """Which errors of the reference are measured noise, of all parameters.

        The others are parameters of usual size that the reference's own data do not determine.
        """
        known = ~self.reported & ~self.slow
        undetermined = {name for s in self.experiment.sources for name in s.undetermined}
        for place, name in enumerate(self.shared, self.sizes.stop):
            known[place] &= name not in undetermined
        return known

    @property
    def slow(self) -> BoolArray:
        """Which of all parameters are slow noise, estimated from the rows themselves."""
        slow = {name for source in self.experiment.sources for name in source.slow}
        known = np.zeros(len(self.system.precision), bool)
        known[self.sizes.stop :] = [name in slow for name in self.shared]
        return known

    def shared_values(self, names: Sequence[str]) -> FloatArray:
        """Values of some of the parameters that rows share, by their names."""
        return self.calibration.shared[[self.shared.index(name) for name in names]]

    @cached_property
    def freedom(self) -> FloatArray:
        """Degrees of freedom that the model leaves of each kind of row, shape (kinds,).

        Slow noise is part of the errors of the rows and takes none of them.
        """
        if not self.slow.any():
            return self.balance.freedom
        kept = self.system.of(~self.slow)
        return solved(kept, self.balance.variance, self.balance.precision[~self.slow]).freedom

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
        if self.freedom.min() < 1.0:
            return None
        weighted = self.system.columns / self.balance.variance[:, None]
        middle = weighted.T @ (weighted * self.white_variance[:, None])
        inner = middle + np.where(self.slow, 0.0, self.balance.prior)
        return np.asarray(self.balance.covariance @ inner @ self.balance.covariance)

    @cached_property
    def of_entries(self) -> FloatArray | None:
        """Covariance of M and b by noise, slow noise and priors, (12, 12); None as ``covariance``.

        What stays nominal adds ``nominal_modes``.
        """
        covariance = self.covariance()
        if covariance is None:
            return None
        in_session = self.experiment.in_session(self)
        if in_session is not None:
            return in_session
        free, basis = slice(0, len(self.directions)), self.directions.columns
        return np.asarray(basis @ covariance[free, free] @ basis.T)

    @cached_property
    def nominal_modes(self) -> FloatArray:
        """Errors by what of the base stays nominal and by what rows share, shape (12 + p, k).

        Of M and b and of the p sizes of effects, each of usual size. With rows J, weights W, prior
        P and the parameters fitted F, an error δ of entries that stay nominal moves those fitted by
        ``−(Fᵀ Jᵀ W J F + P)⁻¹ Fᵀ Jᵀ W J δ``, and errors of the rows do so in place of ``J δ``.
        """
        common = self.independent.rows(self.experiment.common_errors)
        left, pull = self._left_nominal, self.pull()
        shift = np.concatenate([pull @ self._nominal_columns, pull @ common], axis=1)
        entries = self.directions.columns @ shift[: len(self.directions)]
        entries[:, : left.shape[1]] += left
        return np.concatenate([entries, shift[self.sizes]])

    @cached_property
    def nominal_shown(self) -> FloatArray:
        """Combinations of the independent rows that show what stays nominal, shape (n, k).

        An error of usual size moves each by more than measured noise does, so that what a fit
        leaves of it is no noise.
        """
        columns, own = self._nominal_columns, np.sqrt(self.system.own)[:, None]
        left = columns + self.system.columns @ (self.pull() @ columns)
        rows, sizes, _ = np.linalg.svd(left / own, full_matrices=False)
        return np.asarray(own * rows[:, sizes > 1.0])

    @cached_property
    def _left_nominal(self) -> FloatArray:
        if self.base != self.experiment.base_terms:
            return np.zeros((ENTRIES, 0))
        return self.experiment.left_nominal(self)

    @cached_property
    def _nominal_columns(self) -> FloatArray:
        """Change of each independent row by what stays nominal, see ``nominal_columns``."""
        if not self._left_nominal.shape[1]:
            return np.zeros((len(self.system.residual), 0))
        # effects that are only tried have no sizes yet
        tried = np.zeros(len(self.terms) - len(self.calibration.sizes))
        here = replace(self.calibration, sizes=np.append(self.calibration.sizes, tried))
        args = self.experiment, self.rows, here, self.terms, self._left_nominal
        return self.independent.rows(nominal_columns(*args))

    def pull(self) -> FloatArray:
        """By how much an error of each independent row moves each parameter, shape (p, n)."""
        weighted = self.system.columns / self.balance.variance[:, None]
        return np.asarray(-self.balance.covariance @ weighted.T)


def nominal_columns(
    experiment: Experiment,
    rows: Sequence[Rows],
    here: Parameters,
    terms: Terms,
    left: FloatArray,
) -> FloatArray:
    """Change of each measured row by errors in what stays nominal, shape (n, 2 k).

    Of first order, then of second order: an axis that is off by 1° is longer by 0.15 ‰ along its
    nominal direction, which good poses show.

    Args:
        experiment: the rows' own.
        rows: of each source at these parameters.
        here: the parameters.
        terms: the effects.
        left: errors of usual size, shape (12, k).
    """

    def residual_at(calibration: Parameters) -> FloatArray:
        return np.concatenate([one.at(calibration, terms).residual for one in experiment.sources])

    first = np.concatenate([one.base_columns() for one in rows]) @ left
    size, shared, now = np.zeros(len(terms)), np.zeros(len(here.shared)), residual_at(here)
    second = []
    for step in left.T:
        ends = [here.moved(sign * step, size, shared) for sign in (1.0, -1.0)]
        second.append(0.5 * sum(residual_at(end) - now for end in ends))
    return np.column_stack([first, *(RMS_OF_SQUARE * one for one in second)])


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
    return report(refined_minimum(experiment, terms, base))


def refined_minimum(
    experiment: Experiment,
    terms: Sequence[Term],
    base: Sequence[str] | None,
    arrived: float = ARRIVED,
    split: Split | None = None,
) -> Minimum[Experiment]:
    """The minimum with what the fit itself shows of the rows; the arguments are ``minimum``'s."""
    found = minimum(experiment, terms, base, arrived=arrived, split=split)
    refined = experiment.refined(found)
    if refined is experiment:
        return found
    return minimum(refined, terms, base, arrived=arrived, split=split)


def split_by(found: Minimum[Experiment], said: Opened) -> Split | None:
    """What other rows show of the parameters of a fit; None where they show nothing.

    Args:
        found: the fit by its own rows.
        said: of the combinations that its rows leave open, by their steps in its reference.
    """
    base, steps = found.directions.columns, _steps(found)
    return split_of(found.calibration, base, steps, said)


def _steps(found: Minimum[Experiment]) -> tuple[FloatArray, FloatArray]:
    return steps_by_rows(found.covariance(), found.balance.precision, found.terms)


def with_split(found: Minimum[Experiment], split: Split) -> Minimum[Experiment]:
    """The fit with what other rows show, by one step from where the fit without it has arrived.

    Args:
        found: the fit; effects that are only tried have their sizes in its system.
        split: of the model with all its effects.
    """
    system, others = found.system, len(found.system.value) - found.sizes.stop
    here = replace(found.calibration, sizes=system.value[found.sizes])
    away = split.away(found.directions.columns, here, others)
    # by how much effects that are only tried have moved the base
    away[: found.sizes.start] += system.value[: found.sizes.start]
    known = replace(system, information=split.over(others), away=away)
    moved, balance = _stepped(known)
    return replace(found, system=moved, balance=balance)


def residual_table(found: Minimum[Experiment], out: FloatArray | None = None) -> ResidualTable:
    """The rows of a fit.

    Args:
        found: the fit.
        out: error of each measured row held out, where it is known, shape (n,).
    """
    independent, of_model = found.independent, ~found.slow
    names = (*found.directions.names, *found.terms.names, *found.shared)
    return ResidualTable(
        sources=found.experiment.sources,
        at=found.rows,
        residual=independent.measured(found.residual),
        reported=found.errors,
        held_out=out,
        columns=independent.measured(found.system.columns[:, of_model]),
        names=tuple(name for name, one in zip(names, of_model, strict=True) if one),
        prior=found.balance.prior[np.ix_(of_model, of_model)],
        variance=found.balance.variance,
        own=found.system.own,
        independent=independent,
        settings=found.terms.settings(),
    )


def report(found: Minimum[Experiment]) -> SensorFit:
    """All figures of a fit, computed once."""
    experiment, calibration, terms = found.experiment, found.calibration, found.terms
    errors, left_out, later = found.errors, held_out(found), errors_later(found)
    out = None if left_out is None else left_out.errors
    table, floors = residual_table(found, out), _floors(found, left_out)
    repeats = repeatability_of(table)
    of_entries, of_sizes, by_repeats = _covariances(found, table, repeats)
    size_errors = np.full(len(terms), np.nan)
    if of_sizes is not None:
        size_errors = np.sqrt(np.maximum(np.diag(of_sizes), 0.0))
    items, odd, kept = items_of(found), _accused(found, table), list(experiment.covariance_entries)
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
        held_out_in_noise=None if out is None else rms_in_noise(found, out),
        held_out_interval=None if left_out is None else left_out.interval,
        floor=floors[0],
        floor_fitted=floors[1],
        residuals=items.each(errors),
        held_out=None if out is None else items.each(out),
        covariance=of_entries[np.ix_(kept, kept)] if kept and of_entries is not None else None,
        warnings=(found.directions.reason,) if found.directions.reason else (),
        degrees_of_freedom=max(int(found.freedom.min()), 0),
        repeatability=repeats,
        slow_noise_measured=experiment.slow_noise_measured,
        suspects=() if odd is None else (odd.index,),
        not_held_out="" if out is not None else why_none_held_out(found),
        base=found.base,
        terms=terms.terms,
        sizes=terms.split(calibration.sizes),
        size_errors=terms.split(size_errors),
        size_covariance=of_sizes,
        rows=table,
        rms_late=None if later is None else rms_later(found, later),
        late_in_noise=None if later is None else rms_in_noise(found, later),
        late_by_noise=later is not None and made_by_noise(found, later),
        reference=experiment.reference(found),
        experiment=experiment,
        outlier=odd,
        minimum=found,
    )


def _floors(found: Minimum[Experiment], left_out: HeldOut | None) -> tuple[float | None, float]:
    """What measured noise makes of the rms held out and fitted, under a complete reference."""
    by_noise = found.experiment.by_noise_alone
    if by_noise is not found.experiment:
        found = under_reference(found, by_noise)
        left_out = None if left_out is None else held_out(found)
    if left_out is None:
        return None, floor_fitted(found)
    return left_out.floor, left_out.floor_fitted


def _covariances(
    found: Minimum[Experiment], table: ResidualTable, repeats: Repeatability | None
) -> tuple[FloatArray | None, FloatArray | None, FloatArray | None]:
    """Covariance of M and b, that of the sizes of effects, and that of M and b by repeats alone.

    None where nothing is left to judge by, or without repeats.
    """
    covariance, of_entries = found.covariance(), found.of_entries
    if covariance is None or of_entries is None:
        return None, None, None
    by_nominal = found.nominal_modes @ found.nominal_modes.T
    of_nominal, sizes = by_nominal[:ENTRIES, :ENTRIES], by_nominal[ENTRIES:, ENTRIES:]
    by_repeats = None
    # repeats show the scatter of the rows fitted only where all of these are such rows
    if repeats is not None and (table.judged & table.repeats_are_noise & ~table.moving).all():
        share = repeats.rms**2 / float(found.white_variance.mean())
        by_repeats = share * of_entries + of_nominal
    of_sizes = found.terms.within_gauge(covariance[found.sizes, found.sizes] + sizes)
    return of_entries + of_nominal, of_sizes, by_repeats


def _accused(found: Minimum[Experiment], table: ResidualTable) -> Outlier | None:
    """The hold or rotation that stands out, if the others agree with one another without it."""
    odd, items = outlier_of(found), items_of(found)
    if odd is None:
        return None
    lack = lack_without(table, items.rows[items.item == odd.index])
    return odd if lack.within_noise else None


def _before(found: Minimum[Experiment]) -> FloatArray:
    """Errors with the nominal conversion only."""
    experiment = found.experiment
    nominal = experiment.before()
    count = len(found.calibration.shared)
    nominal = Parameters(nominal.matrix, nominal.bias, np.zeros(0), np.zeros(count))
    none = Terms(experiment.sensor, ())
    rows = [source.at(nominal, none) for source in experiment.sources]
    return experiment.scale_before * np.concatenate([one.residual for one in rows])


def _size_parameters(terms: Terms, sizes: FloatArray, errors: FloatArray) -> tuple[Parameter, ...]:
    return tuple(
        Parameter(name, float(size), float(error) if np.isfinite(error) else None, one.unit)
        for name, size, error, one in zip(terms.names, sizes, errors, terms.parameters, strict=True)
    )


def minimum(
    experiment: E,
    terms: Sequence[Term] = (),
    base: Sequence[str] | None = None,
    directions: Directions | None = None,
    variance: FloatArray | None = None,
    own_noise: float | None = None,
    arrived: float = ARRIVED,
    split: Split | None = None,
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
        arrived: the last step, in standard deviations, after which the fit ends.
        split: what other rows show of the parameters.

    Raises:
        DataError: the fit does not converge.
        UsageError: a term that the base does not have, or an effect of another sensor.
    """
    chosen = experiment.checked(base)
    free = experiment.directions(chosen) if directions is None else directions
    together = Terms(experiment.sensor, terms)
    shared = shared_names(experiment, together)
    start = experiment.begin(chosen)
    calibration = Parameters(
        start.matrix, start.bias, np.zeros(len(together)), np.zeros(len(shared))
    )
    rows = tuple(source.at(calibration, together) for source in experiment.sources)
    independent = decorrelation(experiment.sources, rows)
    problem = _Problem(experiment, chosen, free, together, shared, independent, split)

    def solve(system: System) -> Balance:
        if own_noise is not None:
            return solved(system, own_noise * system.own, system.precision)
        if variance is None:
            return balanced(system, kept if kept.any() else None)
        return solved(system, variance, system.precision)

    kept = dropped = had = np.zeros(1, bool)
    for _ in range(MAX_ITERATIONS):
        with np.errstate(over="ignore", invalid="ignore"):  # a fit that diverges is refused below
            system = problem.system(calibration, rows)
            balance = solve(system)
            calibration, rows = problem.downhill(calibration, rows, system, balance)
        # at the limit of the test for an excess, the fit with it and that without it can each lead
        # to the other: what has an excess, has none and has it again keeps it
        has = balance.variance > system.own
        kept, dropped, had = kept | (dropped & has), dropped | (had & ~has), has
        length = balance.step_length
        if not np.isfinite(calibration.entries).all():
            length = np.inf
        if length < arrived or length == np.inf:
            break
    if not length < VALLEY:
        raise _no_convergence(experiment.sensor, [term.name for term in terms])
    system = problem.system(calibration, rows, system.columns)
    balance = solve(system)
    return Minimum(
        experiment, chosen, free, together, calibration, rows, system, balance, independent
    )


def _no_convergence(sensor: str, effects: Sequence[str]) -> DataError:
    """What is said of a fit that does not converge, with these effects or without any."""
    if not effects:
        return DataError(
            f"the fit of the {sensor} does not converge: these data do not belong to one "
            "calibration of this model. Check columns, unit, sampling rate and the largest "
            "residuals"
        )
    them, together = ("them", " together") if len(effects) > 1 else ("it", "")
    return DataError(
        f"{' and '.join(effects)} cannot be fitted to these data{together}: the fit of the "
        f"{sensor} with {them} does not converge. Look at the largest residuals first"
    )


def _shifted(groups: Sequence[slice], places: int) -> tuple[slice, ...]:
    return tuple(slice(group.start + places, group.stop + places) for group in groups)


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
        groups=(*system.groups, *_shifted(more.groups, place)),
        open_groups=(*system.open_groups, *_shifted(more.open_groups, place)),
    )
    if len(system.away):
        places = [place] * len(more)
        information = np.insert(system.information, places, 0.0, axis=0)
        wider = replace(
            wider,
            information=np.insert(information, places, 0.0, axis=1),
            away=np.insert(system.away, places, 0.0),
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
    shared = shared_names(experiment, terms)
    independent = decorrelation(sources, rows)
    problem = _Problem(experiment, found.base, found.directions, terms, shared, independent)
    calibration = replace(found.calibration, shared=np.zeros(len(shared)))
    system, balance = _stepped(problem.system(calibration, rows))
    begun = experiment, found.base, found.directions, terms, calibration, rows
    return Minimum(*begun, system, balance, independent)


def shared_names(experiment: Experiment, terms: Terms) -> list[str]:
    """Names of the parameters that rows of an experiment share, without those of its effects.

    What the rows share by default may be a part of an effect: in a model that has this effect it is
    the effect's parameter.
    """
    every = dict.fromkeys(name for one in experiment.sources for name in one.shared)
    return [name for name in every if name not in terms.names]


def _stepped(system: System) -> tuple[System, Balance]:
    """The system after one step of its fit, and the fit there."""
    balance = balanced(system)
    return system.moved(balance.step), replace(balance, step=np.zeros_like(balance.step))


@dataclass(frozen=True, eq=False)
class _Problem:
    """What stays the same while the parameters move."""

    experiment: Experiment
    base: tuple[str, ...]
    directions: Directions
    terms: Terms
    shared: list[str]
    independent: Decorrelation
    split: Split | None = None

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
        known, others = {}, len(self.shared)
        if self.split is not None:
            away = self.split.away(self.directions.columns, calibration, others)
            known = {"information": self.split.over(others), "away": away}
        return System(
            residual=self.residual(rows, calibration.shared, doubts),
            columns=columns,
            own=self.independent.own(np.concatenate([one.own for one in rows])),
            kinds=self._kinds,
            precision=self._precision,
            value=np.concatenate([value, calibration.sizes, calibration.shared]),
            groups=_shifted(self.terms.groups, first),
            open_groups=_shifted(self.terms.open_groups, first),
            **known,
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
        own = [place for place, name in enumerate(source.shared) if name in self.shared]
        places = [self.shared.index(source.shared[place]) for place in own]
        shared[:, places] = rows.shared_columns()[:, own]
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
        before += _held(system, balance, np.zeros(len(system.value)))
        size = 1.0
        for _ in range(MAX_HALVINGS):
            step = size * balance.step
            entries = self.directions.columns @ step[:first]
            moved = calibration.moved(entries, step[first:last], step[last:])
            moved = self.experiment.constrained(moved, self.base)
            further = self.rows_at(moved, rows)
            left = self.residual(further, moved.shared, doubts)
            left = np.where(exact, left, system.residual + system.columns @ step)
            cost = float((left**2 / balance.variance).sum()) + _held(system, balance, step)
            # effects may be taken at the point before, which makes the cost uncertain by so much
            if cost < before * (1.0 + 1e-3) + 1e-3:
                break
            size /= 2.0
        return moved, further


def _held(system: System, balance: Balance, step: FloatArray) -> float:
    """What the priors and other rows add to the cost after a step."""
    cost = float((balance.precision * (system.value + step) ** 2).sum())
    if len(system.away):
        away = system.away + step
        cost += float(away @ system.information @ away)
    return cost
