"""Simulated sessions of the study, small and with fixed seeds."""

from functools import cache

import numpy as np

from benchmarks.hidden.designs import EXACT, PLANS
from benchmarks.hidden.fitted import left_over, measured_of
from benchmarks.hidden.noise import COLOURS
from benchmarks.hidden.recording import record
from imucal_wizard.bench.evidence import Jury, make_jury
from imucal_wizard.bench.misfit import Misfit
from imucal_wizard.devices.virtual.hidden import parse_hidden

EXACT_POSES = EXACT.name


@cache
def session(
    *hidden: str, design: str = "26+12", colour: str = "consumer", seed: int = 5
) -> tuple[Misfit, Jury]:
    """What the base model leaves of a session, and its jury."""
    rng = np.random.default_rng(seed)
    effects = tuple(parse_hidden(text) for text in hidden)
    misfit = left_over(measured_of(record(PLANS[design], COLOURS[colour], effects, rng)))
    return misfit, make_jury(misfit)
