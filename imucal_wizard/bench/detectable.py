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
from imucal_wizard.readings import FloatArray

POWER = 1.645
"""Standard deviations for 95 times in 100."""
BLIND = 0.02
"""Share of a pattern left by the base below which the data do not show it."""
STEPS = np.exp(np.linspace(np.log(2.0), np.log(200.0), 40))
"""Sizes looked at, in standard deviations of the estimate."""


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
    patterns = jury.frame.across.T @ candidate.columns
    whole = np.linalg.norm(candidate.columns, axis=0)
    visible = np.linalg.norm(patterns, axis=0) > BLIND * np.maximum(whole, 1e-300)
    # the term's prior is shared with its other settings, its other parameters, and all of these
    settings = sum(
        one.kind == EFFECT and one.terms == (candidate.term,) and not one.parameter
        for one in jury.hypotheses
    )
    needed = max(threshold, 0.0) + np.log(2.0 * len(whole) * settings)
    weights = jury.frame.weights(wander)
    found = np.full(len(whole), np.inf)
    for k in np.flatnonzero(visible):
        error = noise / float(np.sqrt(weights @ patterns[:, k] ** 2))
        typical = float(candidate.typical[k])
        odds = _odds(jury, patterns[:, k], typical, STEPS * error, noise, wander)
        clear = np.flatnonzero(odds > needed)
        if len(clear):
            found[k] = (STEPS[clear[0]] + POWER) * error
    return found


def _odds(
    jury: Jury, pattern: FloatArray, typical: float, sizes: FloatArray, noise: float, wander: float
) -> FloatArray:
    """Log odds of the parameter against noise alone, at these sizes and expected noise, (k,)."""
    spread = noise**2 / jury.frame.weights(wander)
    alone = jury.log_noise(np.sqrt((sizes[:, None] * pattern) ** 2 + spread))
    gains = []
    for weights in jury.weights:
        strength = float(weights @ pattern**2)
        ratio = strength * (np.array(SPREADS)[:, None] * typical) ** 2 / SQUARES
        square = (sizes**2 * strength + noise**2)[:, None, None] * ratio / (1.0 + ratio) / SQUARES
        gain = 0.5 * (square - np.log1p(ratio))
        gains.append(np.logaddexp.reduce(gain, axis=1) - np.log(len(SPREADS)))
    both = np.logaddexp.reduce(alone + np.stack(gains, axis=1), axis=(1, 2))
    return np.asarray(both - np.logaddexp.reduce(alone, axis=(1, 2)))
