"""Simulated sessions of the study, small and with fixed seeds."""

from functools import cache

import numpy as np

from benchmarks.hidden.designs import EXACT, PLANS
from benchmarks.hidden.fitted import left_over, measured_of
from benchmarks.hidden.noise import COLOURS
from benchmarks.hidden.recording import record
from imucal_wizard.diagnose.posterior import HypothesisSet, hypothesis_set
from imucal_wizard.diagnose.residuals import WhitenedResiduals
from imucal_wizard.simulate.hidden import parse_hidden

EXACT_POSES = EXACT.name


@cache
def session(
    *hidden: str,
    design: str = "26+12",
    colour: str = "consumer",
    seed: int = 5,
    louder: float = 1.0,
) -> tuple[WhitenedResiduals, HypothesisSet]:
    """What the base model leaves of a session, and its hypotheses."""
    rng = np.random.default_rng(seed)
    effects = tuple(parse_hidden(text) for text in hidden)
    noise = COLOURS[colour].scaled(louder)
    misfit = left_over(measured_of(record(PLANS[design], noise, effects, rng)))
    return misfit, hypothesis_set(misfit)
