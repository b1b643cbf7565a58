"""From which size an effect is seen in such data, and from which its family is named.

Both sizes follow from the rules by which the program judges a recording. PossibleNoise that has the
pattern of the effect changes its estimate; all other noise is replaced by its expected squares.
What the program computes (odds, probabilities, squares taken away) then rises with the estimate
alone, and a rule is met from one estimate ``l`` on. With ``e`` the standard deviation of the
estimate a size ``s`` meets it in the share ``Φ((s − l)/e)`` of recordings. This is averaged over
the wanders that the data allow the noise (see ``random_walk``), and solved for

    seen    in 95 of 100: some suspect's odds reach the threshold of p ≤ 0.01
    named   in 90 of 100: the rule of the verdict names the family

The threshold is the one that noise alone
reaches in one recording of a hundred, of the noise that the data would then seem to have: the noise
that a misfit makes look larger, or wandering, is part of the rule.
"""

import math
from collections.abc import Callable
from functools import cached_property, partial

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.explained_variance import discriminability
from imucal_wizard.diagnose.hypotheses import UNKNOWN
from imucal_wizard.diagnose.posterior import HypothesisSet, Posterior
from imucal_wizard.diagnose.random_walk import SIGMAS
from imucal_wizard.diagnose.residuals import Candidate, WhitenedResiduals
from imucal_wizard.diagnose.significance import (
    MIN_WANDER_PROBABILITY,
    Chances,
    log_odds,
    members,
)
from imucal_wizard.diagnose.verdict import (
    MAX_NOISE_PROBABILITY,
    MAX_UNKNOWN_PROBABILITY,
    MIN_FAMILY_PROBABILITY,
    needed,
)

SEEN_SHARE, NAMED_SHARE = 0.95, 0.90
"""Shares of recordings that the sizes are told for."""
USUAL_SIZES = 5.0
"""Typical sizes above which a parameter of an effect is not to be expected."""
MIN_VISIBLE_SHARE = 0.02
"""Share of a pattern left by the base below which the data do not show it."""
FIRST_ESTIMATE = 5.0
"""At which the search begins for what is seen, in standard deviations of the estimate."""
MIN_ESTIMATE, MAX_ESTIMATE = 1.0, 100.0
"""Estimates looked at."""
GROWTH = 1.3
"""From one to the next until two enclose the least one with which a rule is met."""
REFINEMENTS = 2
"""Secants between these two."""
BISECTIONS = 20
"""Of a size between nothing and one that is surely enough."""

Margin = Callable[[Posterior, FloatArray], float]
"""How far a rule is met with these probabilities and what the effect shows, shape (m,)."""


@dataclass(frozen=True, eq=False)
class PossibleNoise:
    """PossibleNoise that these data allow.

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
        self._slopes: dict[tuple[str, float | None, int], FloatArray] = {}

    def p(self, log_odds: float) -> float:
        """Chance that noise alone makes any suspect look as good."""
        return self._chances.p(log_odds, self._noise)

    def seen(self, candidate: Candidate) -> FloatArray:
        """Size of each parameter alone at which some suspect has p ≤ 0.01 in 95 of 100, (p,).

        In the shown unit; infinite where no size would do.
        """
        known = self._hypotheses
        suspects = list(members(known).values())

        def margin(found: Posterior, _: FloatArray) -> float:
            odds = max(float(log_odds(found.evidence, known, places)) for places in suspects)
            # odds against the effect are below every threshold, which need not be simulated
            return odds - self._chances.threshold(found.noise) if odds > 0.0 else odds - 1.0

        return self._sizes(candidate, margin, FIRST_ESTIMATE, SEEN_SHARE)

    def named(self, candidate: Candidate) -> FloatArray:
        """Size of each parameter alone at which its family is named in 90 of 100, (p,).

        In the shown unit; infinite where no size would do.
        """
        known = self._hypotheses
        squares = needed(candidate.family, self._discriminability)
        family = np.array([candidate.family in one.families for one in known.single])
        unknown = np.array([one.kind == UNKNOWN for one in known.single])
        weights = np.stack(known.frame.each_weights)

        def margin(found: Posterior, shown: FloatArray) -> float:
            likeliest = np.argmax(np.where(family, found.single, 0.0))
            wandering = found.noise.sum(axis=1)
            noise = max(float(found.sigma[likeliest]), 1.0)
            taken = float(wandering @ weights @ shown**2) / noise**2
            return min(
                taken / squares - 1.0,
                float(found.single[family].sum()) - MIN_FAMILY_PROBABILITY,
                MAX_UNKNOWN_PROBABILITY - float(found.single[unknown].sum()),
                MAX_NOISE_PROBABILITY - float(found.single[0]),
            )

        return self._sizes(candidate, margin, float(np.sqrt(squares)), NAMED_SHARE)

    def _sizes(
        self, candidate: Candidate, margin: Margin, begin: float, share: float
    ) -> FloatArray:
        """The sizes at which a rule is met in a share of recordings, (p,)."""
        patterns = self._hypotheses.frame.across.T @ candidate.columns
        whole = np.linalg.norm(candidate.columns, axis=0)
        visible = np.linalg.norm(patterns, axis=0) > MIN_VISIBLE_SHARE * np.maximum(whole, 1e-300)
        found = np.full(len(whole), np.inf)
        # an estimate more uncertain than any size to be expected shows nothing
        strength = (1.0 / self._noises[0].variance) @ patterns**2
        visible &= strength * (USUAL_SIZES * candidate.typical) ** 2 > 1.0
        for k in np.flatnonzero(visible):
            slope = self._slope(patterns[:, k], (candidate.term, candidate.variant, int(k)))
            errors, least = np.zeros(len(self._noises)), np.zeros(len(self._noises))
            for place, noise in enumerate(self._noises):
                errors[place] = 1.0 / np.sqrt(patterns[:, k] ** 2 @ (1.0 / noise.variance))
                pattern = patterns[:, k] * errors[place]
                own = slope * errors[place] ** 2
                met = partial(self._met, margin, noise, pattern, own)
                least[place] = begin = _least_estimate(met, begin)
                if not np.isfinite(begin):
                    break
            if np.isfinite(begin):
                shares = np.array([noise.share for noise in self._noises])
                found[k] = _size_reaching(share, shares, errors, least)
            else:
                begin = FIRST_ESTIMATE
        return found

    def _met(
        self,
        margin: Margin,
        noise: PossibleNoise,
        pattern: FloatArray,
        slope: FloatArray,
        estimate: float,
    ) -> float:
        """How far a rule is met by an estimate; the noise in it is no noise beside it.

        Args:
            margin: of the rule.
            noise: in which the effect is.
            pattern: what the effect shows with an estimate of one standard deviation, shape (m,).
            slope: what the square of the estimate brings to the weights.
            estimate: in its standard deviations.
        """
        log_weights = noise.log_weights + (estimate**2 - 1.0) * slope
        return margin(self._hypotheses.expected(log_weights), estimate * pattern)

    def _slope(self, pattern: FloatArray, key: tuple[str, float | None, int]) -> FloatArray:
        """What the square of a size brings to the weights; kept for the second question."""
        if key not in self._slopes:
            known = self._hypotheses
            self._slopes[key] = known.log_weights(lambda along: (pattern @ along) ** 2, False)
        return self._slopes[key]

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


def _size_reaching(
    share: float, shares: FloatArray, errors: FloatArray, least: FloatArray
) -> float:
    """Size whose estimate is above the least one in a share of recordings.

    Args:
        share: of the recordings.
        shares: probability of each noise, shape (k,).
        errors: standard deviation of the estimate in each, shape (k,).
        least: estimate from which on a rule is met, in that, shape (k,).
    """
    low, high = 0.0, float(((least + 4.0) * errors).max())
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        deviates = (middle / errors - least) / np.sqrt(2.0)
        reached = float(shares @ [0.5 + 0.5 * math.erf(one) for one in deviates])
        low, high = (middle, high) if reached < share else (low, middle)
    return high
