"""The smallest size of an effect that the data would show.

The odds of an effect of one parameter grow with its size. Where they reach the threshold, it is
seen every second time; where they do so 1.645 of their standard deviations before, 95 times in 100.
Noise that may wander imitates slow effects and raises that size.
"""

import numpy as np

from imucal_wizard.bench.evidence import Jury
from imucal_wizard.bench.foreseen import foresee
from imucal_wizard.bench.hypotheses import EFFECT
from imucal_wizard.bench.misfit import Candidate
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
    error = noise / np.sqrt(jury.frame.weights(wander) @ patterns**2)
    sizes = STEPS * error[:, None]
    odds = foresee(jury, patterns, candidate.typical[visible], sizes, noise, wander)
    found = np.full(len(whole), np.inf)
    found[visible] = _reached(odds.mean - POWER * odds.deviation - needed) * error
    return found


def _reached(margin: FloatArray) -> FloatArray:
    """Where a margin over ``STEPS`` first is positive, infinite where it never is; shape (p,)."""
    clear = margin > 0.0
    first = clear.argmax(axis=1)
    before = np.maximum(first - 1, 0)
    row = np.arange(len(margin))
    low, high = margin[row, before], margin[row, first]
    share = np.where(first > before, -low / np.where(high > low, high - low, 1.0), 0.0)
    found = STEPS[before] * (STEPS[first] / STEPS[before]) ** share
    return np.where(clear.any(axis=1), found, np.inf)


def _claimed(jury: Jury, candidate: Candidate) -> float:
    """Log odds of one parameter against noise alone at which something is claimed."""
    own = next(
        one.log_prior
        for one in jury.hypotheses
        if one.kind == EFFECT and one.terms == (candidate.term,) and one.parameter
    )
    return float(jury.hypotheses[0].log_prior - own + np.log(1.0 / NOISE - 1.0)) - COMPANY
