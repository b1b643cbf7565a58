"""The smallest size of an effect that the data would show.

An effect of one parameter, without any noise on it, has odds that grow with its size; where they
reach the threshold, it is seen every second time, and 1.645 standard deviations of its estimate
further 95 times in 100. Noise that may wander imitates slow effects and raises that size.
"""

import numpy as np

from imucal_wizard.bench.evidence import Jury
from imucal_wizard.bench.hypotheses import EFFECT, SPREADS
from imucal_wizard.bench.misfit import Candidate
from imucal_wizard.bench.noise import SQUARES
from imucal_wizard.bench.verdict import NOISE
from imucal_wizard.readings import FloatArray

POWER = 1.645
"""Standard deviations for 95 times in 100."""
BLIND = 0.02
"""Share of a pattern left by the base below which the data do not show it."""
COMPANY = 2.0
"""Log odds that an effect's look-alikes (its family, pairs, unknown structure) lend to it."""
CALM = 0.3
"""Wander of the bias that no session can exclude."""
STEPS = np.exp(np.linspace(np.log(2.0), np.log(200.0), 40))
"""Sizes looked at, in standard deviations of the estimate; the first that is enough is taken."""


def detectable(
    jury: Jury, candidate: Candidate, threshold: float, noise: float, wander: float
) -> FloatArray:
    """Size of each parameter alone that clears the threshold 95 times in 100, shape (p,).

    Args:
        jury: the explanations of this design.
        candidate: the effect.
        threshold: log odds that chance reaches once in a hundred recordings.
        noise: in units of that within the holds.
        wander: of the bias.

    Returns:
        In the shown unit; infinite where the data are blind.
    """
    wander = max(wander, CALM)
    patterns = jury.frame.across.T @ candidate.columns
    whole = np.linalg.norm(candidate.columns, axis=0)
    visible = np.linalg.norm(patterns, axis=0) > BLIND * np.maximum(whole, 1e-300)
    # the term's prior is shared with its other settings, its other parameters, and all of these
    settings = sum(
        one.kind == EFFECT and one.terms == (candidate.term,) and not one.parameter
        for one in jury.hypotheses
    )
    shared = np.log(2.0 * len(whole) * settings)
    needed = max(threshold + shared, shared, _claimed(jury, candidate))
    patterns = patterns[:, visible]
    strength = np.stack([weights @ patterns**2 for weights in jury.weights])
    error = noise / np.sqrt(jury.frame.weights(wander) @ patterns**2)
    sizes = STEPS * error[:, None]
    odds = _odds(jury, strength, candidate.typical[visible], sizes, noise, wander)
    clear = odds > needed
    reached = np.where(clear.any(axis=1), STEPS[clear.argmax(axis=1)], np.inf)
    found = np.full(len(whole), np.inf)
    found[visible] = (reached + POWER) * error
    return found


def _claimed(jury: Jury, candidate: Candidate) -> float:
    """Log odds of one parameter against noise alone at which something is claimed."""
    own = next(
        one.log_prior
        for one in jury.hypotheses
        if one.kind == EFFECT and one.terms == (candidate.term,) and one.parameter
    )
    return float(jury.hypotheses[0].log_prior - own + np.log(1.0 / NOISE - 1.0)) - COMPANY


def _odds(
    jury: Jury,
    strength: FloatArray,
    typical: FloatArray,
    sizes: FloatArray,
    noise: float,
    wander: float,
) -> FloatArray:
    """Log odds of each parameter against noise alone, expected squares put in, shape (p, k).

    Args:
        jury: the explanations.
        strength: ``xᵀWx`` of each pattern under each wander, shape (wanders, p).
        typical: prior standard deviation of each, shape (p,).
        sizes: to look at, shape (p, k).
        noise: in units of that within the holds.
        wander: of the bias.
    """
    usual = noise**2 / jury.frame.weights(wander)
    totals = [
        sizes**2 * own[:, None] + weights @ usual
        for own, weights in zip(strength, jury.weights, strict=True)
    ]
    alone = jury.log_noise_of(np.stack(totals, axis=-1))
    gains = []
    for own in strength:
        ratio = (own * typical**2)[:, None, None] * np.array(SPREADS)[:, None] ** 2 / SQUARES
        share = ratio / (1.0 + ratio) / SQUARES
        square = (sizes**2 * own[:, None] + noise**2)[:, :, None, None]
        gain = 0.5 * (square * share[:, None] - np.log1p(ratio)[:, None])
        gains.append(_log_mean(gain))
    both = _log_sum(alone + np.stack(gains, axis=2))
    return np.asarray(both - _log_sum(alone))


def _log_mean(values: FloatArray) -> FloatArray:
    """Logarithm of the mean of exponentials over the last axis but one."""
    highest = values.max(axis=-2, keepdims=True)
    mean = np.exp(values - highest).mean(axis=-2)
    return np.asarray(np.log(mean) + highest[..., 0, :])


def _log_sum(values: FloatArray) -> FloatArray:
    """Logarithm of the sum of exponentials over the last two axes."""
    highest = values.max(axis=(-2, -1), keepdims=True)
    return np.asarray(np.log(np.exp(values - highest).sum(axis=(-2, -1))) + highest[..., 0, 0])
