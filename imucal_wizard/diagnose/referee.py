"""The gyroscope as referee between explanations of the accelerometer's misfit.

The magnitude of gravity cannot separate some effects of the accelerometer, but each of them turns
the measured directions of up in its own way, and these directions are the gyroscope's reference.
Under each explanation the accelerometer is fitted with its terms, and the marginal likelihood of
the gyroscope's rows is computed under the directions that follow, with

- the gyroscope's own parameters free,
- the errors of the accelerometer's parameters, those of the terms included, as parameters with
  priors (``GravityReference.doubt``),
- each effect of the gyroscope, or none, in any of its usual sizes,
- closures that scatter by σ times their measured noise.

Sizes, effects and σ are averaged over, so that what a gyroscope's own effect or a trembling hand
explains as well counts for no explanation. Where even the best one leaves closures that scatter by
far more than their noise, something else tilts gravity, and the rotations decide nothing. With the
columns B of the free parameters and
``V = D + F Fᵀ`` the variance of the rows by noise, doubts and effect,

    2 ln p = −ln |V| − ln |Bᵀ V⁻¹ B| − rᵀ (V⁻¹ − V⁻¹ B (Bᵀ V⁻¹ B)⁻¹ Bᵀ V⁻¹) r

What is open of an explanation counts against it in this average, as it must where explanations are
compared. It is contradicted only if even the best of what it leaves open does worse than none.

The same average gives the posterior of what the accelerometer's rows leave open of its effects
(``estimate.split``).
"""

import itertools
from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.readings import FloatArray, IntArray, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.hypotheses import EFFECT, NOTHING, PRIOR, SPREAD_SHARES, SPREADS
from imucal_wizard.diagnose.random_walk import SIGMAS, sigma_prior
from imucal_wizard.diagnose.residuals import Candidate, WhitenedResiduals
from imucal_wizard.estimate.experiment import Experiment
from imucal_wizard.estimate.fit import Minimum, split_by, under_reference
from imucal_wizard.estimate.held_out import rms_held_out
from imucal_wizard.estimate.split import SHOWN, Opened, Split
from imucal_wizard.model.terms import Term

_SHARE_OF_EFFECTS = PRIOR[EFFECT] / (PRIOR[EFFECT] + PRIOR[NOTHING])

MAX_CLOSURE_SCATTER = 1.5
"""Scatter of closures over their measured noise above which something is missing ..."""
SURE_OF_SCATTER = 0.99
"""... if this is so with that probability."""
MIN_SHARE_HEARD = 1e-3
"""Share of the probability below which an effect of the gyroscope does not count for a split."""
MIN_LOG_FACTOR = float(np.log(100.0))
"""Logarithm of the factor by which a true explanation is less likely than a wrong one in at most
one recording of a hundred (Markov's inequality)."""


@dataclass(frozen=True)
class Testimony:
    """What the gyroscope says of one model of the accelerometer.

    Attributes:
        closure: error of its rotations held out against that model's gravity, rad; None where none
            can be left out.
        log_evidence: logarithm of the marginal likelihood of its rows.
        scattered: probability that its closures scatter by far more than their noise.
        best_beyond: logarithm of the likelihood with the best of what the accelerometer's rows
            leave open of its effects, above ``log_evidence``; 0 where nothing is open.
        split: what they show of what the accelerometer's rows leave open of its effects; None where
            nothing is open.
    """

    closure: float | None
    log_evidence: float
    scattered: float = 0.0
    best_beyond: float = 0.0
    split: Split | None = None


@dataclass(frozen=True, eq=False)
class Hearing:
    """What the gyroscope says of some explanations.

    Attributes:
        now: of the accelerometer's present model.
        with_terms: of that with each of these sets of effects.
    """

    now: Testimony
    with_terms: dict[tuple[str, ...], Testimony]

    @property
    def against_all(self) -> bool:
        """Whether the rotations contradict every one of these explanations.

        That is so if no effect is more likely than the best of what each of them allows. The truth
        may be one of many parameters alone. It is then far more likely than the average over all.
        """
        best = max(one.log_evidence + one.best_beyond for one in self.with_terms.values())
        return best < self.now.log_evidence - MIN_LOG_FACTOR

    @property
    def unlikely(self) -> bool:
        """Whether the rotations make every one less likely, averaged over all that it allows."""
        return self._best.log_evidence < self.now.log_evidence - MIN_LOG_FACTOR

    @property
    def lacks_all(self) -> bool:
        """Whether none of them is all that the rotations lack, so that these cannot decide."""
        return self._best.scattered > SURE_OF_SCATTER and not self.unlikely

    @property
    def enough(self) -> tuple[tuple[str, ...], ...]:
        """What explains the rotations, so that they lack nothing, the likeliest first."""
        best, least = self._best, MIN_LOG_FACTOR + np.log(len(self.with_terms))
        if best.scattered > 0.5 or best.log_evidence < self.now.log_evidence + least:
            return ()
        order = sorted(self.with_terms.items(), key=lambda one: -one[1].log_evidence)
        return tuple(
            terms
            for terms, one in order
            if one.scattered <= 0.5 and one.log_evidence > best.log_evidence - MIN_LOG_FACTOR
        )

    @property
    def _best(self) -> Testimony:
        return max(self.with_terms.values(), key=lambda one: one.log_evidence)


class Referee:
    """The gyroscope's rows, ready to be judged under any model of the accelerometer.

    Args:
        misfit: what the gyroscope's present model leaves under the accelerometer's present one,
            with the effects that may explain it.
    """

    def __init__(self, misfit: WhitenedResiduals) -> None:
        self._found = misfit.minimum
        first: dict[str, Candidate] = {}
        for one in misfit.candidates:
            first.setdefault(one.term, one)
        self._effects = tuple(first.values())
        self.now = self._testimony(self._found)

    def hear(self, accelerometer: Minimum[Experiment]) -> Testimony:
        """What the gyroscope says of a fit of the accelerometer by its own rows."""
        return self._testimony(self._under(accelerometer), accelerometer)

    def log_evidence(self, accelerometer: Minimum[Experiment]) -> float:
        """Logarithm of the marginal likelihood of its rows under a fit of the accelerometer."""
        every = self._by_scatter(self._under(accelerometer))
        return float(np.logaddexp.reduce([one.whole for one in every]))

    def _under(self, accelerometer: Minimum[Experiment]) -> Minimum[Experiment]:
        reference = accelerometer.experiment.reference(accelerometer)
        experiment = self._found.experiment.under(reference, None)
        return under_reference(self._found, experiment)

    def _by_scatter(self, found: Minimum[Experiment]) -> "list[Scatter]":
        """See ``evidence_by_scatter``, with each effect that may explain the misfit."""
        # evaluated anew: under another reference a closure may be measured along other directions
        terms = [Term(one.effect, one.variant) for one in self._effects]
        columns = np.concatenate([rows.design_columns(terms) for rows in found.rows])
        columns *= np.concatenate([np.zeros(0), *(one.typical for one in self._effects)])
        ends = np.cumsum([0, *(len(one.typical) for one in self._effects)])
        own = found.independent.rows(columns)
        effects = [own[:, first:past] for first, past in itertools.pairwise(ends.tolist())]
        return evidence_by_scatter(found, effects)

    def _testimony(
        self, found: Minimum[Experiment], heard: Minimum[Experiment] | None = None
    ) -> Testimony:
        every = self._by_scatter(found)
        each = np.array([one.whole for one in every])
        whole = float(np.logaddexp.reduce(each))
        scattered = float(np.exp(each[SIGMAS > MAX_CLOSURE_SCATTER] - whole).sum())
        said = None if heard is None else _opened(found, every)
        if heard is None or said is None:
            return Testimony(rms_held_out(found), whole, scattered)
        opened, beyond = said
        return Testimony(rms_held_out(found), whole, scattered, beyond, split_by(heard, opened))


@dataclass(frozen=True, eq=False)
class Scatter:
    """A gyroscope's rows with one σ.

    Attributes:
        each: logarithm of the marginal likelihood with each effect in each size, none first, (k,).
        products: of the rows by the doubts, the residual and the effects, what is free taken out.
        places: of the effect among these, and its variance over the usual one, of each of the k.
    """

    each: FloatArray
    products: FloatArray
    places: tuple[tuple[IntArray, float], ...]

    @property
    def whole(self) -> float:
        """Logarithm of the marginal likelihood, the effects averaged over."""
        return float(np.logaddexp.reduce(self.each))


def _opened(found: Minimum[Experiment], every: Sequence[Scatter]) -> tuple[Opened, float] | None:
    """What is open of the accelerometer's effects, by a gyroscope's rows; None where nothing is.

    With the logarithm of the likelihood of the best of it over that of its average.
    """
    decided = {name for source in found.experiment.sources for name in source.decided}
    if not decided:
        return None
    known = found.system.precision > 0.0
    names = [""] * found.sizes.stop + found.shared
    count = int(known.sum())
    wanted = [k for k, place in enumerate(np.flatnonzero(known)) if names[place] in decided]
    log = np.concatenate([one.each for one in every])
    shares = np.exp(log - np.logaddexp.reduce(log))
    cases = [(one.products, *place) for one in every for place in one.places]
    means, covariances, weights, beyond = [], [], [], []
    for share, (products, places, variance) in zip(shares, cases, strict=True):
        if share < MIN_SHARE_HEARD:
            continue
        chosen = np.concatenate([np.arange(count), places])
        prior = np.repeat([1.0, 1.0 / variance], [count, len(places)])
        inverse = np.linalg.inv(products[np.ix_(chosen, chosen)] + np.diag(prior))
        means.append(-(inverse @ products[chosen, count])[wanted])
        covariances.append(inverse[np.ix_(wanted, wanted)])
        weights.append(share)
        beyond.append(best_beyond(means[-1], covariances[-1]))
    share = np.array(weights) / np.sum(weights)
    mean = share @ np.array(means)
    apart = np.array(means) - mean
    within = np.einsum("k,kij->ij", share, np.array(covariances))
    opened = Opened(mean, within + (share[:, None] * apart).T @ apart)
    return opened, float(np.logaddexp.reduce(np.log(share) + np.array(beyond)))


def best_beyond(mean: FloatArray, covariance: FloatArray) -> float:
    """Logarithm of the largest likelihood over any values, above that with their unit prior.

    Args:
        mean: of their posterior, shape (k,).
        covariance: the same, shape (k, k).
    """
    left, turned = np.linalg.eigh(covariance)
    shown = 1.0 - left > SHOWN
    left, place = left[shown], turned.T[shown] @ mean
    return 0.5 * float((place**2 / (1.0 - left) - np.log(left)).sum())


def evidence_by_scatter(found: Minimum[Experiment], effects: Sequence[FloatArray]) -> list[Scatter]:
    """Marginal likelihood of a gyroscope's rows with each σ.

    Args:
        found: its fit under some reference.
        effects: independent rows by the effects that it may have, at their usual sizes, (n, p).
    """
    system = found.system
    moving = np.concatenate([np.full(len(s.labels), s.moving) for s in found.experiment.sources])
    known = system.precision > 0.0
    doubts = system.columns[:, known]
    residual = system.residual - doubts @ system.value[known]
    doubts = doubts / np.sqrt(system.precision[known])
    free, own = system.columns[:, ~known], np.where(moving, system.own, found.balance.variance)
    sizes, count = np.array([one.shape[1] for one in effects], np.int64), doubts.shape[1]
    first, variances = 1 + np.cumsum(sizes) - sizes, np.array(SPREADS) ** 2
    # effects with the same number of parameters are decomposed together
    alike = [(sizes == q, first[sizes == q, None] + np.arange(q)) for q in distinct(sizes)]
    places = [count + start + np.arange(q) for start, q in zip(first, sizes, strict=True)]
    cases = [(one, variance) for one in places for variance in variances.tolist()]
    total, unit = [], np.eye(count)
    every_column = np.column_stack([doubts, residual, *effects])
    for sigma, prior in zip(SIGMAS, sigma_prior(), strict=True):
        scale = 1.0 / np.sqrt(np.where(moving, sigma**2, 1.0) * own)
        inner, triangle = np.linalg.qr(scale[:, None] * free)
        volume = np.log(np.abs(np.diag(triangle))).sum() - np.log(scale).sum()
        white = scale[:, None] * every_column
        white -= inner @ (inner.T @ white)
        products = white.T @ white
        lower = np.linalg.cholesky(unit + products[:count, :count])
        volume += np.log(np.diag(lower)).sum()
        taken = np.linalg.solve(lower, products[:count, count:])
        left = products[count:, count:] - taken.T @ taken
        gains = np.empty((len(effects), len(SPREADS)))
        for numbers, at in alike:
            strength, vectors = np.linalg.eigh(left[at[:, :, None], at[:, None, :]])
            squares = (left[0, at][:, None] @ vectors) ** 2
            ratio = np.maximum(strength, 0.0)[:, None] * variances[:, None]
            growth = squares * variances[:, None] / (1.0 + ratio) - np.log1p(ratio)
            often = np.log(_SHARE_OF_EFFECTS / len(effects) * np.array(SPREAD_SHARES))
            gains[numbers] = often + 0.5 * growth.sum(axis=2)
        every = np.append(np.log(1.0 - _SHARE_OF_EFFECTS), gains)
        log = prior - volume - 0.5 * left[0, 0] + every
        total.append(Scatter(log, products, ((np.zeros(0, np.int64), 1.0), *cases)))
    return total
