"""The sizes from which an effect is seen in such data, and from which its family is named.

Both sizes follow from the rules by which the program judges a recording, applied to draws of the
noise that these data allow with the pattern of the effect (see ``noise_draws``). A misfit is seen
where some suspect has p ≤ 0.01, a family is named as ``decide_verdict`` does. What noise makes of a
suspect is part of the first rule: a drift makes the noise look like a wandering bias, of which
larger odds are to be expected.

A size told is as uncertain as the noise along the pattern of the effect, to which it is nearly
proportional: a session with few holds shows the size of its noise, slow noise above all, with few
degrees of freedom.
"""

from collections.abc import Callable
from contextlib import suppress
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose.explained_variance import discriminability
from imucal_wizard.diagnose.hypotheses import UNKNOWN, visible
from imucal_wizard.diagnose.noise_draws import EffectInDraws, NoiseDraws, Weighed
from imucal_wizard.diagnose.posterior import MAX_NOISE_PROBABILITY, HypothesisSet, Posterior
from imucal_wizard.diagnose.residuals import Candidate, WhitenedResiduals
from imucal_wizard.diagnose.significance import (
    Chances,
    any_misfit,
    beyond_simulated,
    in_larger_unit,
    likely_noise,
    log_odds,
    members,
)
from imucal_wizard.diagnose.verdict import (
    MAX_SHARE_LEFT_BY_PROBABLE,
    MAX_UNKNOWN_PROBABILITY,
    MIN_FAMILY_PROBABILITY,
    needed,
    share_left,
)
from imucal_wizard.estimate.distributions import chi_square
from imucal_wizard.estimate.experiment import Experiment
from imucal_wizard.estimate.fit import Minimum, residual_table
from imucal_wizard.estimate.lack_of_fit import lack_without

SEEN_SHARE = 0.95
"""Share of recordings in which a misfit of the size reported is seen."""
NAMED_SHARE = 0.90
"""Share of recordings in which the family is named at the size reported."""
USUAL_SIZES = 5.0
"""Typical sizes above which a parameter of an effect is not to be expected."""
MAX_COMPLETE = 0.5
"""Probability of noise alone below which the model is likelier to lack something than nothing."""
FIRST_ESTIMATE = 5.0
"""At which the search for a misfit that is seen begins, in standard deviations of the estimate."""
FIRST_EXCESS = 1.15
"""The same for a name, over the least estimate that takes away squares enough."""
UNCERTAINTY_ENDS = 0.05, 0.95
"""Of the intervals of sizes: 90 %, as those of the errors held out."""
SCALE_DEVIATES: FloatArray = np.linspace(-2.5, 2.5, 11)
"""Standard deviations of a normal variable at which the scale of the noise is taken."""


class Detectability:
    """What noise alone makes of suspects, and the sizes that show in recordings like this one.

    Args:
        misfit: what is left.
        hypotheses: the explanations of this design.
        posterior: their probabilities.
        chances: simulations of noise alone on this design.
    """

    def __init__(
        self,
        misfit: WhitenedResiduals,
        hypotheses: HypothesisSet,
        posterior: Posterior,
        chances: Chances,
    ) -> None:
        self._misfit, self._hypotheses, self._chances = misfit, hypotheses, chances
        self._posterior, self._noise = posterior, posterior.noise
        self._known: dict[Candidate, list[EffectInDraws | None]] = {}

    def p(self, term: str, odds: float) -> float:
        """Chance that noise alone makes any suspect look as good as this one with its log odds."""
        chances, noise, in_unit = self._alone
        return chances.p(odds if in_unit is None else in_unit.get(term, -np.inf), noise)

    @cached_property
    def _alone(self) -> tuple[Chances, FloatArray, dict[str, float] | None]:
        """Simulations, the noise they are to have, and odds where its unit is a larger one."""
        hypotheses, residual, noise = self._hypotheses, self._misfit.residual, self._noise
        any_ = any_misfit(hypotheses)
        kept = [hypotheses.single[place] for place in np.flatnonzero(~any_)]
        if not any(one.terms for one in kept):
            return self._chances, noise, None
        known = HypothesisSet(hypotheses.frame, kept, hypotheses.pairs)
        if self._posterior.single[any_].sum() > MAX_UNKNOWN_PROBABILITY:
            noise = known.posterior(residual).noise
        if not beyond_simulated(noise):
            return self._chances, noise, None
        scaled, evidence, noise = in_larger_unit(known, residual)
        own = {
            term: float(log_odds(evidence, scaled, places))
            for term, places in members(scaled).items()
        }
        return Chances(scaled), noise, own

    def seen(self, candidate: Candidate) -> FloatArray:
        """Size of each parameter alone at which some suspect has p ≤ 0.01 in 95 of 100, (p,).

        In the shown unit; infinite where no size would do.
        """
        prior = np.exp(self._hypotheses.log_prior)
        over_prior = self._suspects / (self._suspects @ prior)[:, None]

        def margin(found: Weighed) -> FloatArray:
            best = (over_prior[:, found.places] @ found.single).max(axis=0)
            odds = _log(best) - _log(found.single[0] / prior[0])
            return odds - self._chances.threshold(found.noise)

        return self._sizes(candidate, margin, SEEN_SHARE, FIRST_ESTIMATE)

    def named(self, candidate: Candidate) -> FloatArray:
        """Size of each parameter alone at which its family is named in 90 of 100, (p,).

        In the shown unit; infinite where no size would do.
        """
        known, family = self._hypotheses.single, candidate.family
        of_family = np.array([family in one.families for one in known])
        unknown = np.array([one.kind == UNKNOWN for one in known])
        squares = needed(family, self._discriminability)

        def margin(found: Weighed) -> FloatArray:
            own = of_family[found.places]
            likeliest = np.argmax(np.where(own[:, None], found.single, -1.0), axis=0)
            best = likeliest, np.arange(len(likeliest))
            taken = found.taken[best] / np.maximum(found.sigma[best], 1.0) ** 2
            present = _log_odds(found.single[own].sum(axis=0))
            unnamed = _log_odds(found.single[unknown[found.places]].sum(axis=0))
            nothing = _log_odds(found.single[0])
            margins = [
                0.5 * (taken - squares),
                present - _log_odds(MIN_FAMILY_PROBABILITY),
                _log_odds(MAX_UNKNOWN_PROBABILITY) - unnamed,
                _log_odds(MAX_NOISE_PROBABILITY) - nothing,
            ]
            return np.asarray(np.min(margins, axis=0))

        return self._sizes(candidate, margin, NAMED_SHARE, FIRST_EXCESS * float(np.sqrt(squares)))

    def uncertainty(self, candidate: Candidate) -> FloatArray:
        """Ends of the 90 % interval of the sizes of each parameter, over the sizes, (2, p).

        They are those of the noise along the pattern: of each kind that the data allow, with the
        χ² that the degrees of freedom of the fit give to its scale.
        """
        shares, variances = self._foreseen
        patterns, shown = self._shown(candidate)
        freedom = max(float(self._complete.balance.freedom.min()), 1.0)
        squares = [chi_square(float(one), freedom) for one in SCALE_DEVIATES]
        weights = np.outer(shares, np.exp(-0.5 * SCALE_DEVIATES**2)).ravel()
        ends = np.ones((2, len(shown)))
        for k in np.flatnonzero(shown):
            variance = 1.0 / ((1.0 / variances) @ patterns[:, k] ** 2)
            each = np.outer(variance, 1.0 / np.array(squares)).ravel()
            order = np.argsort(each)
            below = np.cumsum(weights[order]) / weights.sum()
            ends[:, k] = np.sqrt(
                np.interp(UNCERTAINTY_ENDS, below, each[order]) / (shares @ variance)
            )
        return ends

    def _sizes(
        self,
        candidate: Candidate,
        margin: Callable[[Weighed], FloatArray],
        share: float,
        first: float,
    ) -> FloatArray:
        """Size of each parameter alone at which a rule is met in a share of recordings, (p,)."""
        if candidate not in self._known:  # the same for both sizes
            patterns, shown = self._shown(candidate)
            self._known[candidate] = [
                EffectInDraws(self._draws, pattern, candidate.family) if one else None
                for pattern, one in zip(patterns.T, shown, strict=True)
            ]
        effects = self._known[candidate]
        sizes = [np.inf if e is None else e.size_meeting(margin, share, first) for e in effects]
        return np.array(sizes)

    def _shown(self, candidate: Candidate) -> tuple[FloatArray, NDArray[np.bool_]]:
        """What each parameter shows at a size of one, (m, p), and which show anything, (p,)."""
        patterns = visible(candidate.columns, self._hypotheses.frame)
        shown = patterns.any(axis=0)
        # an estimate more uncertain than any size to be expected shows nothing
        strength = (1.0 / self._draws.variance).mean(axis=0) @ patterns**2
        shown &= strength * (USUAL_SIZES * candidate.typical) ** 2 > 1.0
        return patterns, shown

    @cached_property
    def _draws(self) -> NoiseDraws:
        return NoiseDraws(self._hypotheses, *self._foreseen)

    @cached_property
    def _foreseen(self) -> tuple[FloatArray, FloatArray]:
        """Probability of each kind of noise, (k,), and variance along each coordinate, (k, m)."""
        misfit, frame, found = self._misfit, self._hypotheses.frame, self._complete
        rows = misfit.independent.measured(np.eye(len(misfit)))
        coordinates = frame.across.T @ misfit.whitened(rows)
        noise = found.experiment.foreseen(found, coordinates)
        if noise is None:
            shares, sizes = likely_noise(self._noise)
            noise = shares, sizes[:, None] ** 2 / np.array(frame.each_weights)
        return noise

    @cached_property
    def _complete(self) -> Minimum[Experiment]:
        """The fit with the likeliest effects, if the model likely lacks them and nothing else.

        What the model lacks would count as noise, and hide all but the largest effects. Where they
        leave more than noise, no effect is named before that is found: it hides others as well. Of
        effects so large that they are not linear, one step of the fit leaves some.
        """
        likeliest = set(self._hypotheses.likeliest_effects(self._posterior))
        every = self._misfit.candidates
        chosen = [one for one in every if (one.term, one.variant) in likeliest]
        if chosen and self._posterior.single[0] < MAX_COMPLETE:
            columns = np.concatenate([one.columns for one in chosen], axis=1)
            left, before = self._misfit.lack_beside(columns), self._misfit.lack_of_fit()
            if left.within_noise:
                return self._misfit.with_effects(chosen)
            if share_left(before, left) <= MAX_SHARE_LEFT_BY_PROBABLE:
                with suppress(DataError):
                    found = self._misfit.fitted_with(chosen)
                    if lack_without(residual_table(found), np.zeros(0, np.intp)).within_noise:
                        return found
        return self._misfit.with_effects([])

    @cached_property
    def _suspects(self) -> FloatArray:
        """Which explanations are those of each suspect, 1 or 0, shape (suspects, h)."""
        each = members(self._hypotheses).values()
        found = np.zeros((len(each), len(self._hypotheses.single)))
        for row, places in zip(found, each, strict=True):
            row[places] = 1.0
        return found

    @cached_property
    def _discriminability(self) -> float:
        return discriminability(self._misfit, self._hypotheses.frame)


def _log(share: FloatArray) -> FloatArray:
    return np.asarray(np.log(np.maximum(share, 1e-300)))


def _log_odds(share: FloatArray | float) -> FloatArray:
    inside = np.clip(share, 1e-12, 1.0 - 1e-12)
    return np.asarray(np.log(inside) - np.log1p(-inside))
