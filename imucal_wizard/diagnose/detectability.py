"""From which size an effect is seen in such data, and from which its family is named.

Both sizes follow from the rules by which the program judges a recording. The size from which the
verdict names the family in 90 of 100 is found with draws of noise (see ``nameability``).

A misfit is seen in 95 of 100 from the size on at which some suspect's odds reach the threshold of
p ≤ 0.01. Noise that has the pattern of the effect changes its estimate; all other noise is replaced
by its expected squares. The odds then rise with the estimate alone, and the rule is met from one
estimate ``l`` on. With ``e`` the standard deviation of the estimate a size ``s`` meets it in the
share ``Φ((s − l)/e)`` of recordings. This is averaged over the wanders that the data allow the
noise (see ``random_walk``). The threshold is the one that noise alone reaches in one recording of a
hundred, of the noise that the data would then seem to have: the noise that a misfit makes look
larger, or wandering, is part of the rule.
"""

from collections.abc import Callable
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.explained_variance import discriminability
from imucal_wizard.diagnose.nameability import NoiseDraws, nameable_size, size_reaching
from imucal_wizard.diagnose.posterior import HypothesisSet, Posterior
from imucal_wizard.diagnose.random_walk import SIGMAS
from imucal_wizard.diagnose.residuals import Candidate, WhitenedResiduals
from imucal_wizard.diagnose.significance import (
    MIN_WANDER_PROBABILITY,
    Chances,
    log_odds,
    members,
)
from imucal_wizard.diagnose.verdict import needed

SEEN_SHARE = 0.95
"""Share of recordings in which a misfit of the size told is seen."""
USUAL_SIZES = 5.0
"""Typical sizes above which a parameter of an effect is not to be expected."""
MIN_VISIBLE_SHARE = 0.02
"""Share of a pattern left by the base below which the data do not show it."""
FIRST_ESTIMATE = 5.0
"""At which the search begins, in standard deviations of the estimate."""
MIN_ESTIMATE, MAX_ESTIMATE = 1.0, 100.0
"""Estimates looked at."""
GROWTH = 1.3
"""From one to the next until two enclose the least one with which a rule is met."""
REFINEMENTS = 2
"""Secants between these two."""


@dataclass(frozen=True, eq=False)
class PossibleNoise:
    """Noise that these data allow.

    Attributes:
        share: its probability.
        variance: along each coordinate, shape (m,).
        log_weights: see ``HypothesisSet.log_weights``, with its expected squares alone.
    """

    share: float
    variance: FloatArray
    log_weights: FloatArray


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
        self._noise = posterior.noise

    def p(self, log_odds: float) -> float:
        """Chance that noise alone makes any suspect look as good."""
        return self._chances.p(log_odds, self._noise)

    def seen(self, candidate: Candidate) -> FloatArray:
        """Size of each parameter alone at which some suspect has p ≤ 0.01 in 95 of 100, (p,).

        In the shown unit; infinite where no size would do.
        """
        known = self._hypotheses
        suspects = list(members(known).values())

        def margin(found: Posterior) -> float:
            odds = max(float(log_odds(found.evidence, known, places)) for places in suspects)
            # odds against the effect are below every threshold, which need not be simulated
            return odds - self._chances.threshold(found.noise) if odds > 0.0 else odds - 1.0

        patterns, shown = self._shown(candidate)
        shares = np.array([noise.share for noise in self._noises])
        sizes, begin = np.full(len(shown), np.inf), FIRST_ESTIMATE
        for k in np.flatnonzero(shown):
            slope = known.log_weights(partial(_squares_along, patterns[:, k]), False)
            errors, least = np.zeros(len(shares)), np.zeros(len(shares))
            for place, noise in enumerate(self._noises):
                errors[place] = 1.0 / np.sqrt(patterns[:, k] ** 2 @ (1.0 / noise.variance))
                own = slope * errors[place] ** 2

                def met(
                    estimate: float, noise: PossibleNoise = noise, own: FloatArray = own
                ) -> float:
                    # the noise in the estimate is no noise beside it
                    weights = noise.log_weights + (estimate**2 - 1.0) * own
                    return margin(known.expected(weights))

                least[place] = begin = _least_estimate(met, begin)
                if not np.isfinite(begin):
                    break
            if np.isfinite(begin):
                sizes[k] = size_reaching(SEEN_SHARE, shares, errors, least)
            else:
                begin = FIRST_ESTIMATE
        return sizes

    def named(self, candidate: Candidate) -> FloatArray:
        """Size of each parameter alone at which its family is named in 90 of 100, (p,).

        In the shown unit; infinite where no size would do.
        """
        squares = needed(candidate.family, self._discriminability)
        patterns, shown = self._shown(candidate)
        sizes = np.full(len(shown), np.inf)
        for k in np.flatnonzero(shown):
            sizes[k] = nameable_size(self._draws, patterns[:, k], candidate.family, squares)
        return sizes

    def _shown(self, candidate: Candidate) -> tuple[FloatArray, NDArray[np.bool_]]:
        """What each parameter shows at a size of one, (m, p), and which show anything, (p,)."""
        patterns = self._hypotheses.frame.across.T @ candidate.columns
        whole = np.linalg.norm(candidate.columns, axis=0)
        shown = np.linalg.norm(patterns, axis=0) > MIN_VISIBLE_SHARE * np.maximum(whole, 1e-300)
        # an estimate more uncertain than any size to be expected shows nothing
        strength = (1.0 / self._noises[0].variance) @ patterns**2
        shown &= strength * (USUAL_SIZES * candidate.typical) ** 2 > 1.0
        return patterns, shown

    @cached_property
    def _draws(self) -> NoiseDraws:
        return NoiseDraws(self._hypotheses, self._noise)

    @cached_property
    def _noises(self) -> list[PossibleNoise]:
        """The noise under each wander that these data allow."""
        shares = self._noise.sum(axis=1)
        shares = np.where(shares > MIN_WANDER_PROBABILITY, shares, 0.0)
        sizes = np.exp(self._noise @ np.log(SIGMAS) / np.maximum(self._noise.sum(axis=1), 1e-300))
        found = []
        for wander in np.flatnonzero(shares):
            weights = self._hypotheses.frame.each_weights[wander]
            variance = sizes[wander] ** 2 / weights
            log_weights = self._hypotheses.log_weights(partial(_expected_squares, variance), True)
            found.append(PossibleNoise(float(shares[wander] / shares.sum()), variance, log_weights))
        return found

    @cached_property
    def _discriminability(self) -> float:
        return discriminability(self._misfit, self._hypotheses.frame)


def _least_estimate(met: Callable[[float], float], begin: float) -> float:
    """Estimate from which on a rule is met; infinite where none of those looked at meets it.

    What is compared grows about with the square of the estimate.
    """
    low = high = begin
    below = above = met(begin)
    while above <= 0.0:
        low, below, high = high, above, GROWTH * high
        if high > MAX_ESTIMATE:
            return np.inf
        above = met(high)
    while below > 0.0:
        low, high, above = low / GROWTH, low, below
        if low < MIN_ESTIMATE:
            return MIN_ESTIMATE
        below = met(low)
    for _ in range(REFINEMENTS):
        share = float(np.clip(below / (below - above), 0.05, 0.95))
        middle = float(np.sqrt(low**2 + share * (high**2 - low**2)))
        between = met(middle)
        if between > 0.0:
            high, above = middle, between
        else:
            low, below = middle, between
    share = float(np.clip(below / (below - above), 0.0, 1.0))
    return float(np.sqrt(low**2 + share * (high**2 - low**2)))


def _expected_squares(variance: FloatArray, along: FloatArray) -> FloatArray:
    return np.asarray(variance @ along**2)


def _squares_along(pattern: FloatArray, along: FloatArray) -> FloatArray:
    return np.asarray((pattern @ along) ** 2)
