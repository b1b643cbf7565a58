"""Errors of holds and rotations: on the data fitted, left out of the fit, and by noise alone."""

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import sample_quantile
from imucal_wizard.estimate.distributions import (
    EXACT_FREEDOM,
    WITHIN_NINETY,
    chi_square,
    exceeded,
)
from imucal_wizard.estimate.outliers import Outlier, outlier
from imucal_wizard.estimate.variance_components import (
    determined,
    inverted,
    solved,
)
from imucal_wizard.model.rows.table import numbered
from imucal_wizard.model.terms import Term

if TYPE_CHECKING:
    from imucal_wizard.estimate.experiment import Experiment
    from imucal_wizard.estimate.fit import Minimum

HOLE = 1.0 / (1.0 + 42.0**2)
"""Share of a group's own error left in its residual, below which the base model is fitted to it by
nothing else: usual noise (1 mg) would then pass for a usual bias (42 mg)."""

BLIND_TO_GROUP = 1e-9
"""The same of the whole model, whose effects have priors."""

NOT_SHOWN = 1e-6
"""Share of a group's own error, of the largest share of any combination in it, below which the
other rows do not show that combination."""

OTHER_SETTINGS = 16
"""Of one term, the likeliest beside the one chosen, that are tried again without each group."""

TIED = 0.01
"""Difference of two sums of squares, in the variances of the rows, up to which two settings are
equally good: a moment before and one after the hold left out."""

EARLY = 2.0 / 3.0
"""Share of the holds and rotations, in the order of time, that predict the later ones."""

LEAST_OF_NOISES = 1e-3
"""Variance of a hold by noise, of the largest, below which holds do not differ any more."""

MADE_BY_NOISE_P = 0.05
"""Probability of errors as large as those that count as made by noise."""
MIN_LATER = 3
"""Holds or rotations that are left to be predicted, at least."""


def rms_fitted(found: "Minimum[Experiment]") -> float:
    """Error of holds or rotations on the data fitted."""
    return items_of(found).rms(found.errors)


def errors_held_out(found: "Minimum[Experiment]") -> FloatArray | None:
    """Error of each row under the fit of all other groups, shape (n,).

    Returns:
        None where the others do not determine the model.
    """
    out = _under_the_others(found, found.system.residual[:, None], found.errors[:, None])
    return None if out is None else _settings_chosen_again(found, out)


def rms_held_out(found: "Minimum[Experiment]") -> float | None:
    """Error of holds or rotations left out; None where the others do not determine the model."""
    out = errors_held_out(found)
    return None if out is None else items_of(found).rms(out)


def rms_in_noise(found: "Minimum[Experiment]", out: FloatArray) -> float:
    """Rms of the errors held out of all rows that judge a model, in units of measured noise.

    Rates at rest are not reported, but they show effects that hardly move a rotation.

    Args:
        found: the fit.
        out: error of each row held out, NaN where it is not judged, shape (n,).
    """
    return float(np.sqrt(_squares_in_noise(found, out).mean()))


def made_by_noise(found: "Minimum[Experiment]", out: FloatArray) -> bool:
    """Whether measured noise makes errors as large as these in more than one case of twenty.

    Args:
        found: the fit.
        out: error of each row held out, NaN where it is not judged, shape (n,).
    """
    squares = _squares_in_noise(found, out)
    return exceeded(float(squares.mean()), len(squares), EXACT_FREEDOM) > MADE_BY_NOISE_P


def _squares_in_noise(found: "Minimum[Experiment]", out: FloatArray) -> FloatArray:
    """Squares of the errors of the rows that judge a model, in units of measured noise."""
    noise = found.independent.measured(_noise_root(found))
    sources = found.experiment.sources
    rows = np.concatenate([np.full(len(s.labels), s.confirms) for s in sources])
    rows &= (found.groups >= 0) & np.isfinite(out)
    return np.asarray(out[rows] ** 2 / (noise[rows] ** 2).sum(axis=1))


@dataclass(frozen=True, eq=False)
class Items:
    """Judged rows by what they are of: errors are reported per hold, per rotation.

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

    def bounded(self, errors: FloatArray, largest: float) -> FloatArray:
        """Errors of all rows, cut so that no hold or rotation has one above the largest."""
        if np.isinf(largest):
            return errors
        own, out = np.sqrt(np.bincount(self.item, errors[self.rows] ** 2)), errors.copy()
        out[self.rows] *= np.minimum(largest / np.maximum(own, largest), 1.0)[self.item]
        return out

    def rms(self, errors: FloatArray) -> float:
        """Of holds or rotations, from the errors of all rows."""
        return self.mean(errors**2)

    def mean(self, variances: FloatArray) -> float:
        """Root of the mean variance of a hold or rotation, from the variances of all rows."""
        return float(np.sqrt(variances[self.rows].sum() / (self.item.max(initial=0) + 1)))


def items_of(found: "Minimum[Experiment]") -> Items:
    """The judged rows of a fit by hold or rotation."""
    sources = found.experiment.sources
    judged = np.concatenate([np.full(len(s.labels), s.judged) for s in sources])
    index = numbered([source.labels.index for source in sources])
    rows = np.flatnonzero(judged)
    return Items(rows, np.unique(index[rows], return_inverse=True)[1])


@dataclass(frozen=True, eq=False)
class HeldOut:
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


def held_out(found: "Minimum[Experiment]") -> HeldOut | None:
    """Errors of each group of rows under the fit of all others; what noise would make of them.

    The expected errors are the same linear maps as those of the rows, applied to the measured noise
    of the rows and of the reference. With these maps E, the mean square held out is a quadratic
    form in noise, about a chi square of ``tr(E Eᵀ)² / tr((E Eᵀ)²)`` degrees of freedom
    (Satterthwaite). A new row has its own noise and the errors of the fit of all rows: its mean
    square scatters, too, by the errors that the fit happens to have and, if holds are unequally
    noisy, by how noisy the measured ones happened to be (the noise of rotations follows from their
    length, in which new ones are alike). Slow noise is in the interval, but in no floor.

    Returns:
        None where the other rows do not determine the model.
    """
    system, balance, reported = found.system, found.balance, found.reported
    slow = system.columns[:, found.slow]
    noise = np.column_stack([_noise_root(found), slow])
    moved = balance.covariance @ ((system.columns / balance.variance[:, None]).T @ noise)
    left = noise - system.columns @ moved
    pulled = found.independent.measured(system.columns[:, reported] @ moved[reported])
    noise = found.independent.measured(noise)
    fitted, items = noise - pulled, items_of(found)
    out = _under_the_others(
        found,
        np.column_stack([system.residual, left]),
        np.column_stack([found.errors, fitted]),
    )
    if out is None:
        return None
    largest = found.experiment.largest_error
    # under a fit that hardly determines them, linear errors are no angles
    errors = items.bounded(_settings_chosen_again(found, out), largest)
    expected = out.errors[:, 1:]
    own_squares = (noise**2).sum(axis=1)
    new = items.mean(own_squares + (pulled**2).sum(axis=1))
    number = int(items.item.max(initial=0)) + 1
    unlike = 2.0 * _squares(pulled[items.rows] / number**0.5)
    if number == len(items.rows):  # one row each, as holds have
        # of a few values that differ by factors the variance misses the rare large ones
        own = own_squares[items.rows]
        own = np.maximum(own, LEAST_OF_NOISES * float(own.max()) + np.finfo(float).tiny)
        unlike += float(own.mean()) ** 2 * np.expm1(float(np.var(np.log(own)))) / number
    judged = expected[items.rows]
    freedom = 2.0 / (2.0 * _squares(judged) / float((judged**2).sum()) ** 2 + unlike / new**4)
    usual = items.rms(errors) * new / items.mean((expected**2).sum(axis=1))
    own = slice(0, noise.shape[1] - slow.shape[1])
    return HeldOut(
        errors=errors,
        floor_fitted=items.mean((fitted[:, own] ** 2).sum(axis=1)),
        floor=items.mean((expected[:, own] ** 2).sum(axis=1)),
        interval=(
            min(usual / chi_square(WITHIN_NINETY, freedom) ** 0.5, largest),
            min(usual / chi_square(-WITHIN_NINETY, freedom) ** 0.5, largest),
        ),
    )


def _squares(maps: FloatArray) -> float:
    """``tr((E Eᵀ)²)``: half the variance of the sum of squares that E makes of unit noise."""
    return float(((maps @ maps.T) ** 2).sum())


@dataclass(frozen=True, eq=False)
class _Under:
    """Groups of rows under the fit of all others.

    Attributes:
        errors: of k sets of errors, shape (n, k).
        spared: by how much the sum of squares of the fit, in its variances, is smaller without
            each row's group, of the first set, shape (n,).
    """

    errors: FloatArray
    spared: FloatArray


def _settings_chosen_again(found: "Minimum[Experiment]", out: _Under) -> FloatArray:
    """Error of each row, where the others also choose the settings of the terms, shape (n,).

    A moment or a time constant that all data have chosen has seen the data left out. One term is
    settled at a time, among the settings that are tried for it; a setting between them, to which it
    was refined, stays one of the choices. The settings of a free curve are its prior.

    Args:
        found: the fit of all.
        out: its errors under the others.
    """
    groups, errors, best = found.terms.groups, out.errors[:, 0], _cost(found) - out.spared
    for number, one in enumerate(found.terms.terms):
        if one.variant is None or one.effect.free:
            continue
        first = found.sizes.start
        own = slice(first + groups[number].start, first + groups[number].stop)
        tried = []
        for variant in one.effect.variants(found.experiment.circumstances):
            if variant is not None and variant != one.variant:
                other = _with_setting(found, own, replace(one, variant=variant))
                tried.append((_cost(other), variant, other))
        tried.sort(key=lambda made: made[:2])
        for cost, _, other in tried[:OTHER_SETTINGS]:
            made = _under_the_others(other, other.system.residual[:, None], other.errors[:, None])
            if made is not None:
                closer = cost - made.spared < best - TIED
                best = np.where(closer, cost - made.spared, best)
                errors = np.where(closer, made.errors[:, 0], errors)
    return errors


def _cost(found: "Minimum[Experiment]") -> float:
    """Sum of squares of the fit, in its variances, with what the priors add."""
    system, balance = found.system, found.balance
    cost = float((system.residual**2 / balance.variance).sum())
    cost += float((balance.precision * system.value**2).sum())
    return cost + float(system.away @ system.information @ system.away if len(system.away) else 0.0)


def _with_setting(found: "Minimum[Experiment]", own: slice, term: Term) -> "Minimum[Experiment]":
    """The fit with another setting of a term, by one step at the same variances and priors.

    Args:
        found: the fit.
        own: places of the sizes of the term among its parameters.
        term: the term with the other setting.
    """
    system, balance = found.system, found.balance
    parts = [one.term_columns([term]) for one in found.rows]
    columns, value = system.columns.copy(), system.value.copy()
    columns[:, own] = found.independent.rows(np.concatenate(parts))
    value[own] = 0.0
    left = system.residual - system.columns[:, own] @ system.value[own]
    other = replace(system, residual=left, columns=columns, value=value)
    made = solved(other, balance.variance, balance.precision)
    moved = other.moved(made.step)
    return replace(found, system=moved, balance=replace(made, step=np.zeros_like(made.step)))


def _under_the_others(
    found: "Minimum[Experiment]", left: FloatArray, errors: FloatArray
) -> _Under | None:
    """Errors of each group of rows under the fit of all others.

    With P = Σ⁻¹ − Σ⁻¹ J N⁻¹ Jᵀ Σ⁻¹ the step from the fit of all is
    ``N⁻¹ (Σ⁻¹ J)_gᵀ P_gg⁻¹ (Σ⁻¹ r)_g``; it is exact where the rows are linear in it, and it is
    small.

    Args:
        found: the fit of all.
        left: what it leaves of k sets of independent rows, shape (n, k).
        errors: the reported error of each measured row, shape (n, k).

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
    out, spared = errors.copy(), np.zeros(len(errors))
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
        spared[rows] = (pulls[rows][:, :, 0] * alone[:, :, 0]).sum(axis=1)[:, None]
    return _Under(out, spared)


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


def _noise_root(found: "Minimum[Experiment]") -> FloatArray:
    """A root of the covariance of independent rows by noise, that of the reference included."""
    own, columns = found.system.own, found.system.columns
    return np.column_stack([np.diag(np.sqrt(own)), columns[:, found.measured]])


def floor_fitted(found: "Minimum[Experiment]") -> float:
    """Expected rms of the fitted rows by noise alone, where none can be left out."""
    system, reported = found.system, found.reported
    noise, pull = _noise_root(found), found.pull()
    fitted = noise + system.columns[:, reported] @ (pull[reported] @ noise)
    fitted = found.independent.measured(fitted)
    return items_of(found).mean((fitted**2).sum(axis=1))


def why_none_held_out(found: "Minimum[Experiment]") -> str:
    """Why no error held out is known, and what to measure."""
    words = {source.group_word for source in found.experiment.sources if source.judged}
    one = " or ".join(sorted(words))
    return (
        f"this model needs every one of the {one}s, so none could be left out to check it: add some"
    )


def errors_later(found: "Minimum[Experiment]") -> FloatArray | None:
    """Errors of the later rows under the fit of the ``EARLY`` ones, shape (n,).

    What nothing slow moves (the base's directions without a part in a bias) is kept from all data,
    so that rotations about one axis after another leave something to predict.

    Returns:
        NaN for early rows. None where the early rows do not determine the rest, or too few holds or
        rotations are later.
    """
    time = np.concatenate([source.labels.time for source in found.experiment.sources])
    early = time < sample_quantile(found.experiment.circumstances.time, EARLY)
    items = items_of(found)
    count = len(distinct(items.item[~early[items.rows]]))
    moving = np.ones(len(found.system.precision), bool)
    moving[: len(found.directions)] = found.directions.slow
    refit = _refitted(found, early, moving) if count >= MIN_LATER else None
    if refit is None:
        return None
    known = moving & found.reported
    columns = found.independent.measured(found.system.columns[:, known])
    return np.where(early, np.nan, found.errors + columns @ refit[known[moving]])


def rms_later(found: "Minimum[Experiment]", errors: FloatArray) -> float:
    """Rms of the later holds or rotations, of their errors by ``errors_later``."""
    items = items_of(found)
    own = errors[items.rows]
    late = np.isfinite(own)
    return float(np.sqrt((own[late] ** 2).sum() / len(distinct(items.item[late]))))


def _refitted(
    found: "Minimum[Experiment]", rows: BoolArray, moving: BoolArray
) -> FloatArray | None:
    """Change of some parameters when some rows alone speak; None where these do not know them."""
    system, balance, independent = found.system, found.balance, found.independent
    columns = independent.measured(system.columns)[np.ix_(rows, moving)]
    weighted = independent.weighted(columns, balance.variance, rows)
    normal = columns.T @ weighted + balance.prior[np.ix_(moving, moving)]
    if not determined(normal):
        return None
    residual = independent.measured(system.residual)[rows]
    pull = weighted.T @ residual + balance.prior_pull[moving]
    return np.asarray(-inverted(normal) @ pull)


def outlier_of(found: "Minimum[Experiment]") -> Outlier | None:
    """The hold or rotation that does not fit with all others, if one stands out."""
    system, items, independent = found.system, items_of(found), found.independent
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
