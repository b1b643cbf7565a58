"""The log odds that an effect of a given size will have against noise alone: mean and spread.

With coordinates ``x = s p + n``, n of variance ``v``, and q(w, σ) the probability of each wander
and noise without the effect, q'(w, σ) with it, the log odds change with each coordinate by

    ∂/∂xᵢ = s pᵢ Σ_w Wᵢ [Σ_σ q/σ² − Σ_σ q' (1 − ρ)/σ²],   ρ = t/(1 + t),  t = spread² XᵀWX/σ²

and with its square by ``½ Σ_w Wᵢ Σ_σ (q − q')/σ²``. The spread follows to first order: the noise
moves the estimate, and it makes the noise itself seem to wander more or less far.

An effect is detectable from the size at which these odds clear what noise alone reaches, 1.645 of
their standard deviations before: 95 times in 100. A bias that may walk imitates slow effects and
raises that size.
"""

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.hypotheses import EFFECT, SPREADS
from imucal_wizard.diagnose.posterior import HypothesisSet
from imucal_wizard.diagnose.random_walk import SQUARES
from imucal_wizard.diagnose.residuals import Candidate
from imucal_wizard.diagnose.verdict import MAX_NOISE_PROBABILITY


@dataclass(frozen=True, eq=False)
class ExpectedLogOdds:
    """Log odds of parameters at sizes, each alone in the data.

    Attributes:
        mean: with the expected squares put in, shape (p, k).
        deviation: standard deviation over recordings, shape (p, k).
    """

    mean: FloatArray
    deviation: FloatArray


def expected_log_odds(
    hypotheses: HypothesisSet,
    patterns: FloatArray,
    typical: FloatArray,
    sizes: FloatArray,
    noise: float,
    wander: float,
) -> ExpectedLogOdds:
    """The log odds that each parameter will have.

    Args:
        hypotheses: the explanations of this design.
        patterns: of each parameter at a size of one, in the hypotheses's coordinates, shape (m, p).
        typical: prior standard deviation of each, shape (p,).
        sizes: to look at, shape (p, k).
        noise: in units of that within the holds.
        wander: of the bias.
    """
    weights = np.stack(hypotheses.frame.each_weights)
    usual = noise**2 / hypotheses.frame.weights(wander)
    strength = weights @ patterns**2
    squares = sizes[:, :, None] ** 2 * strength.T[:, None]
    alone = hypotheses.frame.log_noise_of(squares + weights @ usual)
    spread = (strength.T * typical[:, None] ** 2)[:, None, :, None] * np.array(SPREADS) ** 2
    ratio = spread[..., None] / SQUARES
    share = ratio / (1.0 + ratio)
    gain = 0.5 * ((squares + noise**2)[..., None, None] * share / SQUARES - np.log1p(ratio))
    effect = alone[..., None, :] + gain - np.log(len(SPREADS))
    without, with_it = _shares(alone), _shares(effect)
    mean = _log_sum(effect) - _log_sum(alone)
    pull = (without / SQUARES).sum(axis=-1)
    along = pull - (with_it * (1.0 - share) / SQUARES).sum(axis=(-2, -1))
    apart = pull - (with_it / SQUARES).sum(axis=(-2, -1))
    by_pattern = np.einsum("ai,bi,i,ip->pab", weights, weights, usual, patterns**2)
    by_noise = (weights * usual**2) @ weights.T
    variance = sizes**2 * np.einsum("pka,pab,pkb->pk", along, by_pattern, along)
    variance += 0.5 * np.einsum("pka,ab,pkb->pk", apart, by_noise, apart)
    return ExpectedLogOdds(mean, np.sqrt(np.maximum(variance, 0.0)))


def _shares(values: FloatArray) -> FloatArray:
    """Probabilities from logarithms, over all axes but the first two."""
    inner = tuple(range(2, values.ndim))
    found: FloatArray = np.exp(values - values.max(axis=inner, keepdims=True))
    return np.asarray(found / found.sum(axis=inner, keepdims=True))


def _log_sum(values: FloatArray) -> FloatArray:
    """Logarithm of the sum of exponentials over all axes but the first two."""
    inner = tuple(range(2, values.ndim))
    highest = values.max(axis=inner, keepdims=True)
    total = np.exp(values - highest).sum(axis=inner)
    return np.asarray(np.log(total) + highest.reshape(total.shape))


POWER_DEVIATIONS = 1.645
"""Standard deviations for 95 times in 100."""
MIN_VISIBLE_SHARE = 0.02
"""Share of a pattern left by the base below which the data do not show it."""
FAMILY_LOG_ODDS = 2.0
"""Log odds that an effect's look-alikes (its family, pairs, unknown structure) lend to it."""
MIN_WANDER = 0.3
"""Wander of the bias that no session can exclude."""
SIZES_IN_ERRORS = np.exp(np.linspace(np.log(2.0), np.log(200.0), 40))
"""Sizes looked at, in standard deviations of the estimate."""


def detectable(
    hypotheses: HypothesisSet, candidate: Candidate, threshold: float, noise: float, wander: float
) -> FloatArray:
    """Size of each parameter alone that clears the threshold 95 times in 100, shape (p,).

    Args:
        hypotheses: the explanations of this design.
        candidate: the effect.
        threshold: log odds that chance reaches once in a hundred recordings.
        noise: in units of that within the holds.
        wander: of the bias.

    Returns:
        In the shown unit; infinite where the data are blind.
    """
    wander = max(wander, MIN_WANDER)
    patterns = hypotheses.frame.across.T @ candidate.columns
    whole = np.linalg.norm(candidate.columns, axis=0)
    visible = np.linalg.norm(patterns, axis=0) > MIN_VISIBLE_SHARE * np.maximum(whole, 1e-300)
    # the term's prior is shared with its other settings, its other parameters, and all of these
    settings = sum(
        one.kind == EFFECT and one.terms == (candidate.term,) and not one.parameter
        for one in hypotheses.single
    )
    shared = np.log(2.0 * len(whole) * settings)
    needed = max(threshold + shared, shared, _claimed(hypotheses, candidate))
    patterns = patterns[:, visible]
    error = noise / np.sqrt(hypotheses.frame.weights(wander) @ patterns**2)
    sizes = SIZES_IN_ERRORS * error[:, None]
    odds = expected_log_odds(hypotheses, patterns, candidate.typical[visible], sizes, noise, wander)
    found = np.full(len(whole), np.inf)
    found[visible] = _reached(odds.mean - POWER_DEVIATIONS * odds.deviation - needed) * error
    return found


def _reached(margin: FloatArray) -> FloatArray:
    """Size in errors at which a margin first is positive, infinite where it never is; (p,)."""
    clear = margin > 0.0
    first = clear.argmax(axis=1)
    before = np.maximum(first - 1, 0)
    row = np.arange(len(margin))
    low, high = margin[row, before], margin[row, first]
    share = np.where(first > before, -low / np.where(high > low, high - low, 1.0), 0.0)
    found = SIZES_IN_ERRORS[before] * (SIZES_IN_ERRORS[first] / SIZES_IN_ERRORS[before]) ** share
    return np.where(clear.any(axis=1), found, np.inf)


def _claimed(hypotheses: HypothesisSet, candidate: Candidate) -> float:
    """Log odds of one parameter against noise alone at which something is claimed."""
    own = next(
        one.log_prior
        for one in hypotheses.single
        if one.kind == EFFECT and one.terms == (candidate.term,) and one.parameter
    )
    return (
        float(hypotheses.single[0].log_prior - own + np.log(1.0 / MAX_NOISE_PROBABILITY - 1.0))
        - FAMILY_LOG_ODDS
    )
