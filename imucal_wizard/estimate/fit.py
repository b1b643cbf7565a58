"""The estimator: one MAP fit of a base model and effects to the rows of any experiment.

A calibration without effects is the same fit without terms. ``gauss_newton`` finds the minimum;
``held_out`` computes the errors of holds and rotations left out, and those that noise alone makes.
``report`` computes every figure of the fit once, for all commands and screens.
"""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.experiment import Experiment
from imucal_wizard.estimate.gauss_newton import Minimum, minimum, shared_names
from imucal_wizard.estimate.held_out import (
    floor_fitted,
    held_out,
    items_of,
    outlier_of,
    rms_later,
    why_none_held_out,
)
from imucal_wizard.estimate.lack_of_fit import lack_without
from imucal_wizard.estimate.outliers import Outlier
from imucal_wizard.estimate.parameters import with_errors
from imucal_wizard.estimate.repeatability import Repeatability, repeatability_of
from imucal_wizard.estimate.result import Parameter, SensorFit
from imucal_wizard.model.rows.source import Parameters
from imucal_wizard.model.rows.table import ResidualTable
from imucal_wizard.model.terms import Term, Terms


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


def report(found: Minimum[Experiment]) -> SensorFit:
    """All figures of a fit, computed once."""
    experiment, calibration, terms = found.experiment, found.calibration, found.terms
    errors, independent, left_out = found.errors, found.independent, held_out(found)
    out = None if left_out is None else left_out.errors
    of_model, names = (
        ~found.slow,
        (*found.directions.names, *terms.names, *shared_names(experiment)),
    )
    table = ResidualTable(
        sources=experiment.sources,
        at=found.rows,
        residual=independent.measured(found.residual),
        reported=errors,
        held_out=out,
        columns=independent.measured(found.system.columns[:, of_model]),
        names=tuple(name for name, one in zip(names, of_model, strict=True) if one),
        precision=found.balance.precision[of_model],
        variance=found.balance.variance,
        own=found.system.own,
        independent=independent,
    )
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
        held_out_interval=None if left_out is None else left_out.interval,
        floor=None if left_out is None else left_out.floor,
        floor_fitted=floor_fitted(found) if left_out is None else left_out.floor_fitted,
        residuals=items.each(errors),
        held_out=None if out is None else items.each(out),
        covariance=of_entries[np.ix_(kept, kept)] if kept and of_entries is not None else None,
        warnings=(found.directions.reason,) if found.directions.reason else (),
        degrees_of_freedom=max(int(found.balance.freedom.min() + 1e-6), 0),
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
        rms_late=rms_later(found),
        reference=experiment.reference(found),
        experiment=experiment,
        outlier=odd,
        minimum=found,
    )


def _covariances(
    found: Minimum[Experiment], table: ResidualTable, repeats: Repeatability | None
) -> tuple[FloatArray | None, FloatArray | None, FloatArray | None]:
    """Covariance of M and b, that of the sizes of effects, and that of M and b by repeats alone.

    None where nothing is left to judge by, or without repeats.
    """
    experiment, covariance = found.experiment, found.covariance()
    if covariance is None:
        return None, None, None
    of_entries = experiment.in_session(found)
    if of_entries is None:
        free, basis = slice(0, len(found.directions)), found.directions.columns
        of_entries = basis @ covariance[free, free] @ basis.T + experiment.left_nominal(found)
    by_repeats = None
    # repeats show the scatter of the rows fitted only where all of these are such rows
    if repeats is not None and (table.judged & table.repeats_are_noise & ~table.moving).all():
        by_repeats = repeats.rms**2 / float(found.white_variance.mean()) * of_entries
    return of_entries, covariance[found.sizes, found.sizes], by_repeats


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
    return np.concatenate([one.residual for one in rows])


def _size_parameters(terms: Terms, sizes: FloatArray, errors: FloatArray) -> tuple[Parameter, ...]:
    return tuple(
        Parameter(name, float(size), float(error) if np.isfinite(error) else None, one.unit)
        for name, size, error, one in zip(terms.names, sizes, errors, terms.parameters, strict=True)
    )
