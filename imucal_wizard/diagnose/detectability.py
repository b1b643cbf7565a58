"""From which size an effect is seen in such data, and from which its family is named.

Both sizes follow from the rules by which the program judges a recording. Noise that has the
pattern of the effect changes its estimate; all other noise is replaced by its expected squares.
What the program computes (odds, probabilities, squares taken away) then rises with the estimate
alone, and a rule is met from one estimate on. With ``e`` the standard deviation of the estimate

    seen  = (least estimate with which some suspect's odds reach their threshold) + 1.645 e
    named = (least estimate with which the rule of the verdict names the family) + 1.282 e

so that the rule is met in 95 and in 90 of 100 recordings. The threshold is the one that noise alone
reaches in one recording of a hundred, of the noise that the data would then seem to have: the noise
that a misfit makes look larger, or wandering, is part of the rule.
"""

from collections.abc import Callable
from functools import cached_property, partial

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose.explained_variance import discriminability
from imucal_wizard.diagnose.hypotheses import UNKNOWN
from imucal_wizard.diagnose.posterior import HypothesisSet, Posterior
from imucal_wizard.diagnose.residuals import Candidate, WhitenedResiduals
from imucal_wizard.diagnose.significance import Chances, log_odds, members
from imucal_wizard.diagnose.verdict import (
    MAX_NOISE_PROBABILITY,
    MAX_UNKNOWN_PROBABILITY,
    MIN_FAMILY_PROBABILITY,
    needed,
)

SEEN_DEVIATIONS = 1.645
"""Standard deviations for 95 times in 100."""
NAMED_DEVIATIONS = 1.282
"""The same for 90 times in 100."""
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

Margin = Callable[[Posterior, FloatArray], float]
"""How far a rule is met with these probabilities and what the effect shows, shape (m,)."""


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
        self._variance = posterior.expected_noise**2 / hypotheses.frame.weights(posterior.wander)
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
            return odds - self._chances.threshold(found.noise)

        return self._sizes(candidate, margin, FIRST_ESTIMATE, SEEN_DEVIATIONS)

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
            taken = float(wandering @ weights @ shown**2) / float(found.sigma[likeliest]) ** 2
            return min(
                taken / squares - 1.0,
                float(found.single[family].sum()) - MIN_FAMILY_PROBABILITY,
                MAX_UNKNOWN_PROBABILITY - float(found.single[unknown].sum()),
                MAX_NOISE_PROBABILITY - float(found.single[0]),
            )

        return self._sizes(candidate, margin, float(np.sqrt(squares)), NAMED_DEVIATIONS)

    def _sizes(
        self, candidate: Candidate, margin: Margin, begin: float, deviations: float
    ) -> FloatArray:
        """The sizes at which a rule is met so many deviations from where it begins to be, (p,)."""
        patterns = self._hypotheses.frame.across.T @ candidate.columns
        whole = np.linalg.norm(candidate.columns, axis=0)
        visible = np.linalg.norm(patterns, axis=0) > MIN_VISIBLE_SHARE * np.maximum(whole, 1e-300)
        found = np.full(len(whole), np.inf)
        for k in np.flatnonzero(visible):
            error = 1.0 / np.sqrt(patterns[:, k] ** 2 @ (1.0 / self._variance))
            pattern = patterns[:, k] * error
            slope = self._slope(pattern, (candidate.term, candidate.variant, int(k)))
            met = partial(self._met, margin, pattern, slope)
            found[k] = error * (_least_estimate(met, begin) + deviations)
        return found

    def _met(
        self, margin: Margin, pattern: FloatArray, slope: FloatArray, estimate: float
    ) -> float:
        """How far a rule is met by an estimate; the noise in it is no noise beside it."""
        log_weights = self._without + (estimate**2 - 1.0) * slope
        return margin(self._hypotheses.expected(log_weights), estimate * pattern)

    def _slope(self, pattern: FloatArray, key: tuple[str, float | None, int]) -> FloatArray:
        """What the square of an estimate brings to the weights; kept for the second question."""
        if key not in self._slopes:
            known = self._hypotheses
            self._slopes[key] = known.log_weights(lambda along: (pattern @ along) ** 2, False)
        return self._slopes[key]

    @cached_property
    def _without(self) -> FloatArray:
        """The weights with the expected squares of the noise alone."""
        return self._hypotheses.log_weights(lambda along: self._variance @ along**2, True)

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
