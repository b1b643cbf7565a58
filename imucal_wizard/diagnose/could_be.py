"""The figure "could be": the error in any direction by effects that these poses hardly show.

An effect that the measured directions barely show may still be large elsewhere. Each explanation in
the catalogue has a probability and, given these data, a normal distribution of its sizes. The share
that the base parameters absorb, and their own noise, follow from the fit. Together they give the
distribution of the error of a corrected reading in any direction.

With the whitened columns B of the model and C of an effect of size s, the fit moves by
``δ = −N⁻¹ Bᵀ (C s + n)``, ``N = BᵀB + prior``, and a new row without noise is off by
``C' s + B' δ``. The noise n wanders as far as the rows leave it open, about its mean over the
session (see ``random_walk``): that moves the base more than rows that are independent. The square
of the error is taken as a scaled chi square with the same mean and variance. What the base has
beyond that (parameters that the directions do not determine, errors that the rows share) adds to
it, see ``Experiment.unseen``.
"""

from collections.abc import Iterator
from functools import cache

import numpy as np

from imucal_wizard.core.directions import even_directions
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import normal_below, sample_quantile
from imucal_wizard.diagnose.hypotheses import (
    EFFECT,
    NOTHING,
    PAIR,
    PAIR_SPREAD,
    PRIOR,
    Hypothesis,
)
from imucal_wizard.diagnose.posterior import HypothesisSet, Posterior
from imucal_wizard.diagnose.random_walk import walk_of
from imucal_wizard.diagnose.residuals import Candidate, WhitenedResiduals
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.estimate.variance_components import inverted
from imucal_wizard.model.rows.source import Parameters
from imucal_wizard.model.rows.table import numbered
from imucal_wizard.model.terms import Term, Terms

COVERED_SHARE = 0.95
"""Share of directions and of explanations, by their probability, in which the error is smaller."""
DIRECTIONS = even_directions(240)
"""Enough that one in twenty is several of them. Each hold or rotation of the session has some that
follow one another: what changes with time is met all over the sphere."""
MIN_LIKELY_SHARE = 1e-4
"""Explanations less likely than this are left out, about one per cent of the probability in all."""
_WITH_EFFECT = (PRIOR[EFFECT] + PRIOR[PAIR]) / (PRIOR[NOTHING] + PRIOR[EFFECT] + PRIOR[PAIR])
TRULY = {
    NOTHING: 1.0 - _WITH_EFFECT,
    EFFECT: 1.0 + _WITH_EFFECT * PRIOR[NOTHING] / PRIOR[EFFECT],
}
"""Factors on the probabilities of nothing and of an effect. By ``PRIOR``, which a verdict uses,
half of all sensors have nothing that a session could show. The share of this half that has an
effect, too small to show, is taken to be that of all sensors."""
HALVINGS = 18
"""Of the interval in which the quantile is looked for."""
MIN_CATALOGUE_SHARE = 0.05
"""Probability of noise and effects together below which the catalogue says nothing."""


def could_be(
    fit: SensorFit,
    misfit: WhitenedResiduals,
    hypotheses: HypothesisSet,
    posterior: Posterior,
) -> float | None:
    """The error without noise that is exceeded with a probability of 5 % in a random direction.

    Given these data, with each effect of the catalogue as rare and as large as in usual sensors.

    Args:
        fit: the model.
        misfit: what it leaves.
        hypotheses: the explanations.
        posterior: their probabilities.

    Returns:
        In the unit of the fit's errors; None where hardly any explanation in the catalogue fits.
    """
    elsewhere = Elsewhere(fit)
    absorbed, unseen, item = elsewhere.absorbed, elsewhere.unseen, elsewhere.item
    noise = (absorbed**2).sum(axis=1)
    square = posterior.noise.sum(axis=1) @ np.array(hypotheses.frame.wanders) ** 2
    slow = square * ((absorbed @ walk_of(misfit)) * absorbed).sum(axis=1)
    candidates = {(one.term, one.variant): one for one in misfit.candidates}

    @cache
    def moved(term: str, variant: float | None) -> FloatArray:
        return elsewhere.moved(candidates[term, variant])

    def columns_of(one: Hypothesis) -> FloatArray:
        if one.kind != EFFECT:
            return np.zeros((len(absorbed), one.patterns.shape[1]))
        key = one.terms[0], one.variant
        if not one.parameter:
            return moved(*key)
        return moved(*key)[:, [candidates[key].names.index(one.parameter)]]

    weights = hypotheses.frame.weights(posterior.wander)
    coordinates = hypotheses.frame.across.T @ misfit.residual
    shares, means, squares = [], [], []
    for members, spreads, often, share, sigma in _likely(hypotheses, posterior):
        columns = np.concatenate([columns_of(one) for one in members], axis=1)
        patterns = np.concatenate([one.patterns for one in members], axis=1)
        for part, found, root in _sizes(patterns, (spreads, often), coordinates, weights, sigma):
            if share * part < 0.1 * MIN_LIKELY_SHARE:
                continue
            mean = columns @ found
            # some experiments have the slow noise in what is unseen: it counts once
            beyond = sigma**2 * noise + np.maximum(sigma**2 * slow, unseen)
            variance = ((columns @ root) ** 2).sum(axis=1) + beyond
            shares.append(share * part)
            means.append(np.bincount(item, mean**2 + variance))
            # of two components of a closure, whose covariance hardly moves the quantile of them all
            squares.append(np.bincount(item, 2.0 * variance**2 + 4.0 * mean**2 * variance))
    if sum(shares) < MIN_CATALOGUE_SHARE:
        return None
    return _quantile(np.array(shares), np.array(means), np.array(squares))


MAX_HIDDEN_INFORMATION = 3.0
"""Squares of the noise that an effect of usual size may take away and still is not determined: the
standard deviation that is left of its prior is then more than half."""


@dataclass(frozen=True)
class HiddenEffect:
    """An effect of orientation that these data do not determine.

    Attributes:
        name: of the effect, with its parameter.
        error: that it makes at its usual size, exceeded in one of twenty directions, in the unit of
            the fit's errors.
    """

    name: str
    error: float


def most_hidden(
    fit: SensorFit, misfit: WhitenedResiduals, hypotheses: HypothesisSet, posterior: Posterior
) -> HiddenEffect | None:
    """The effect that these data hide and that would make the largest error at its usual size.

    Args:
        fit: the model.
        misfit: what it leaves.
        hypotheses: the explanations.
        posterior: their probabilities.
    """
    elsewhere, found = Elsewhere(fit), []
    frame, lengths = hypotheses.frame, np.bincount(elsewhere.item)
    for one in misfit.candidates:
        if one.effect.kind != "orientation" or one.effect.free:
            continue
        seen = (frame.across.T @ one.columns) * one.typical
        information = frame.weights(posterior.wander) @ seen**2
        hidden = np.flatnonzero(information < MAX_HIDDEN_INFORMATION)
        if not len(hidden):
            continue
        moved = elsewhere.moved(one)[:, hidden] ** 2
        for place, squares in zip(hidden, moved.T, strict=True):
            size = np.sqrt(np.bincount(elsewhere.item, squares)[lengths > 0])
            error = sample_quantile(size, COVERED_SHARE)
            found.append(HiddenEffect(f"{one.term} {one.names[place]}", error))
    return max(found, key=lambda one: one.error, default=None)


def _likely(
    hypotheses: HypothesisSet, posterior: Posterior
) -> Iterator[tuple[list[Hypothesis], FloatArray, FloatArray, float, float]]:
    """Explanations by noise and effects.

    Returns:
        Members, prior spreads and their shares, probability and noise of each.
    """
    for place in np.flatnonzero(posterior.single > MIN_LIKELY_SHARE):
        one = hypotheses.single[place]
        if one.kind in (NOTHING, EFFECT):
            share = TRULY[one.kind] * float(posterior.single[place])
            found = share, float(posterior.sigma[place])
            yield [one], np.array(one.spreads), np.array(one.shares), *found
    pairs = hypotheses.pairs
    for place in np.flatnonzero(posterior.paired > MIN_LIKELY_SHARE):
        if pairs is not None:
            found = float(posterior.paired[place]), float(posterior.sigma_paired[place])
            yield pairs.both(int(place)), np.array([PAIR_SPREAD]), np.ones(1), *found


def _quantile(shares: FloatArray, means: FloatArray, variances: FloatArray) -> float:
    """The error below which ``COVERED_SHARE`` of a mixture of scaled chi squares lies.

    Args:
        shares: of each component, shape (h,).
        means: of its squared error in each direction, shape (h, d).
        variances: of that squared error, shape (h, d).
    """
    means = np.maximum(means, 1e-300)
    # Wilson and Hilferty, as in ``distributions.chi_square``: 2/(9ν) with ν = 2 mean²/variance
    part = variances / (9.0 * means**2)
    scale = np.cbrt(means)
    middle, width = (1.0 - part) * scale, np.maximum(np.sqrt(part), 1e-9) * scale
    low, high = 0.0, float((middle + 2.0 * width).max())
    for _ in range(HALVINGS):
        cube = 0.5 * (low + high)
        below = shares @ normal_below((cube - middle) / width).mean(axis=1)
        low, high = (cube, high) if below < COVERED_SHARE * shares.sum() else (low, cube)
    return float(high**1.5)


class Elsewhere:
    """Judged rows in directions that were not measured, at the calibration found.

    Args:
        fit: the model.

    Attributes:
        rows: of each source.
        absorbed: by how much a unit of noise in each row measured moves each of them, by what the
            model absorbs of it, shape (k, n).
        unseen: their variance by errors of the base that the rows do not show, shape (k,).
        item: the number of each row's hold or rotation, shape (k,).
    """

    def __init__(self, fit: SensorFit) -> None:
        experiment, table = fit.experiment, fit.rows
        assert experiment is not None and table is not None  # noqa: S101, PT018 (narrows the types)
        sizes = np.concatenate([np.zeros(0), *fit.sizes])
        calibration, terms = Parameters(fit.matrix, fit.bias, sizes), Terms(fit.sensor, fit.terms)
        judged = [one for one in experiment.sources if one.judged]
        sources = [one.elsewhere(DIRECTIONS, calibration, terms) for one in judged]
        self.rows = [source.at(calibration, terms) for source in sources]
        self.item = numbered([source.labels.index for source in sources])
        directions = experiment.directions(fit.base).columns
        # errors of the reference, which come last, are no error of this sensor
        base = np.zeros((len(self.item), table.columns.shape[1]))
        entries = [one.base_columns() for one in self.rows]
        own = [
            np.concatenate([by_entries @ directions, one.term_columns(fit.terms)], axis=1)
            for by_entries, one in zip(entries, self.rows, strict=True)
        ]
        base[:, : own[0].shape[1]] = np.concatenate(own)
        white = table.whitened(table.columns)
        normal = white.T @ white + table.prior
        self.absorbed = np.asarray(-base @ inverted(normal) @ white.T)
        self.unseen = np.zeros(len(base))
        covariance = None if fit.minimum is None else experiment.unseen(fit.minimum)
        if covariance is not None:
            whole = np.concatenate(entries)
            self.unseen = np.maximum(((whole @ covariance) * whole).sum(axis=1), 0.0)

    def moved(self, one: Candidate) -> FloatArray:
        """Change of each row by each parameter of an effect, of usual size, shape (k, p)."""
        effect = Term(one.effect, one.variant)
        own = np.concatenate([each.design_columns([effect]) for each in self.rows])
        return np.asarray(one.typical * (self.absorbed @ one.columns - own))


def _sizes(
    patterns: FloatArray,
    prior: tuple[FloatArray, FloatArray],
    coordinates: FloatArray,
    weights: FloatArray,
    sigma: float,
) -> Iterator[tuple[float, FloatArray, FloatArray]]:
    """By prior spread of an explanation: share, mean and root of the covariance of its sizes."""
    weighted = patterns * weights[:, None] / sigma**2
    values, vectors = np.linalg.eigh(patterns.T @ weighted)
    # noise alone has no sizes
    spreads, often = prior if len(values) else (prior[0][:1], prior[1][:1])
    spreads = spreads[:, None]
    variance = 1.0 / (np.maximum(values, 0.0) + spreads**-2)
    turned = vectors.T @ (weighted.T @ coordinates)
    log = 0.5 * (variance * turned**2 + np.log(variance / spreads**2)).sum(axis=1) + np.log(often)
    share = np.exp(log - log.max())
    for part, own in zip(share / share.sum(), variance, strict=True):
        yield float(part), vectors @ (own * turned), vectors * np.sqrt(own)
