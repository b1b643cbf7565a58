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
from functools import cached_property

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
LEAST_ESTIMATE = 2.0
ESTIMATES = tuple(LEAST_ESTIMATE * 1.4**k for k in range(13))
"""Looked at one after the other until a rule is met, in their standard deviations."""
REFINEMENTS = 3
"""Secants between the last two of them."""

Margin = Callable[[FloatArray, float, float], float]
"""How far a rule is met with a pattern, its estimate, and the standard deviation of that."""


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

    def p(self, log_odds: float) -> float:
        """Chance that noise alone makes any suspect look as good."""
        return self._chances.p(log_odds, self._noise)

    def seen(self, candidate: Candidate) -> FloatArray:
        """Size of each parameter alone at which some suspect has p ≤ 0.01 in 95 of 100, (p,).

        In the shown unit; infinite where no size would do.
        """
        suspects = list(members(self._catalogue).values())

        def margin(pattern: FloatArray, estimate: float, error: float) -> float:
            found = self._expected(self._catalogue, pattern, estimate, error)
            odds = max(float(log_odds(found.evidence, self._catalogue, own)) for own in suspects)
            return odds - self._chances.threshold(found.noise)

        return self._sizes(candidate, margin, SEEN_DEVIATIONS)

    def named(self, candidate: Candidate) -> FloatArray:
        """Size of each parameter alone at which its family is named in 90 of 100, (p,).

        In the shown unit; infinite where no size would do.
        """
        squares = needed(candidate.family, self._discriminability)

        def margin(pattern: FloatArray, estimate: float, error: float) -> float:
            def rules(known: HypothesisSet) -> float:
                found = self._expected(known, pattern, estimate, error)
                return _rules(known, found, candidate.family, pattern * estimate, squares)

            # the explanations without unknown structure are many fewer, and usually decide it
            least = rules(self._catalogue)
            return least if least < 0.0 else rules(self._hypotheses)

        return self._sizes(candidate, margin, NAMED_DEVIATIONS)

    def _expected(
        self, known: HypothesisSet, pattern: FloatArray, estimate: float, error: float
    ) -> Posterior:
        """The probabilities with this estimate; the noise in it is no noise beside it."""
        return known.expected(pattern, estimate**2 - error**2, self._variance)

    @cached_property
    def _catalogue(self) -> HypothesisSet:
        """The explanations without unknown structure."""
        known = [one for one in self._hypotheses.single if one.kind != UNKNOWN]
        return HypothesisSet(self._hypotheses.frame, known)

    @cached_property
    def _discriminability(self) -> float:
        return discriminability(self._misfit, self._hypotheses.frame)

    def _sizes(self, candidate: Candidate, margin: Margin, deviations: float) -> FloatArray:
        """The sizes at which a rule is met so many deviations from where it begins to be, (p,)."""
        patterns = self._hypotheses.frame.across.T @ candidate.columns
        whole = np.linalg.norm(candidate.columns, axis=0)
        visible = np.linalg.norm(patterns, axis=0) > MIN_VISIBLE_SHARE * np.maximum(whole, 1e-300)
        found = np.full(len(whole), np.inf)
        for k in np.flatnonzero(visible):
            pattern = patterns[:, k]
            error = float(1.0 / np.sqrt(pattern**2 @ (1.0 / self._variance)))
            found[k] = error * (_least_estimate(pattern, error, margin) + deviations)
        return found


def _least_estimate(pattern: FloatArray, error: float, margin: Margin) -> float:
    """Estimate from which on a margin is positive, in its own errors; infinite where it never is.

    What is compared grows with the square of the estimate, so that secants in the square are
    nearly exact.
    """
    low, below = LEAST_ESTIMATE, -np.inf
    for high in ESTIMATES:
        above = margin(pattern, high * error, error)
        if above > 0.0:
            break
        low, below = high, above
    else:
        return np.inf
    for _ in range(REFINEMENTS if np.isfinite(below) else 0):
        share = np.clip(below / (below - above), 0.05, 0.95)
        middle = float(np.sqrt(low**2 + share * (high**2 - low**2)))
        between = margin(pattern, middle * error, error)
        if between > 0.0:
            high, above = middle, between
        else:
            low, below = middle, between
    return high


def _rules(
    known: HypothesisSet, found: Posterior, family: str, shown: FloatArray, squares: float
) -> float:
    """How far the rules of ``decide_verdict`` are met; negative where one of them is not.

    Args:
        known: the explanations.
        found: their probabilities.
        family: to be named.
        shown: what the effect shows, in the coordinates of the frame, shape (m,).
        squares: of the noise that it must take away.
    """
    own = np.array([family in one.families for one in known.single])
    unknown = np.array([one.kind == UNKNOWN for one in known.single])
    likeliest = np.argmax(np.where(own, found.single, 0.0))
    weights = found.noise.sum(axis=1) @ np.stack(known.frame.each_weights)
    taken = float(weights @ shown**2) / float(found.sigma[likeliest]) ** 2
    return min(
        taken / squares - 1.0,
        float(found.single[own].sum()) - MIN_FAMILY_PROBABILITY,
        MAX_UNKNOWN_PROBABILITY - float(found.single[unknown].sum()),
        MAX_NOISE_PROBABILITY - float(found.single[0]),
    )
