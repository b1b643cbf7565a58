"""How often even an all-knowing rule would take a stranger for an effect of the catalogue.

The rule is told the exact shape and size of the stranger and of the effect nearest to it, the noise
too, and has but to choose between these two. What it goes by is what the stranger has of its own:
with ``d`` the part of the stranger's pattern that the effect cannot make, in noise standard
deviations, the best test that calls a share α of true effects strange (Neyman and Pearson) still
takes a share ``Φ(z(1 − α) − d)`` of the strangers for the effect. A rule that must find the shape
first is worse. Strangers too weak to be named as anything are not counted: what they share with the
effect, with noise on it, must reach what a name needs.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.hidden.designs import Plan
from benchmarks.hidden.fitted import left_over, measured_of
from benchmarks.hidden.noise import MILLI_G, Colour
from benchmarks.hidden.recording import Extra, record
from benchmarks.hidden.scenarios import Scenario
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose.explained_variance import discriminability
from imucal_wizard.diagnose.random_walk import frame_of
from imucal_wizard.diagnose.residuals import WhitenedResiduals
from imucal_wizard.diagnose.verdict import needed

LOST = 0.02
"""Share of true effects that the rule may call strange; 3 % may go without their name in all."""


@dataclass(frozen=True)
class Limit:
    """What is to be told apart in one recording.

    Attributes:
        shared: square of the part of the stranger's pattern that the nearest effect makes.
        own: square of the part that it cannot make; both in squares of the noise.
        needed: square that the effect needs to be named.
    """

    shared: float
    own: float
    needed: float

    @property
    def mistaken(self) -> float:
        """Probability that the stranger is named."""
        from scipy.stats import norm

        # with noise z on it, the shared part's square is about (√shared + z)²
        strong = norm.sf(np.sqrt(self.needed) - np.sqrt(self.shared))
        return float(strong * norm.cdf(norm.isf(LOST) - np.sqrt(self.own)))


def limits(
    plan: Plan, colour: Colour, scenario: Scenario, recordings: int, seed: int
) -> Iterator[Limit]:
    """One after the other, for recordings of a stranger.

    Args:
        plan: of the sessions.
        colour: of the noise.
        scenario: the stranger.
        recordings: how many.
        seed: of the first.
    """
    if scenario.extra is None:
        raise ValueError(f"{scenario.name} is no stranger")
    for number in range(recordings):
        yield _limit(plan, colour, scenario.extra, [seed, number, sum(map(ord, scenario.name))])


def _limit(plan: Plan, colour: Colour, stranger: Extra, seed: list[int]) -> Limit:
    recorded = record(plan, colour, (), np.random.default_rng(seed))
    misfit = left_over(measured_of(recorded))
    error = stranger.error(recorded.schedule, np.random.default_rng([*seed, 1])) * MILLI_G
    frame = frame_of(misfit)
    across = frame.across
    pattern = across.T @ ((error * recorded.schedule.up).sum(axis=1) / misfit.sigma)
    whole = float(pattern @ pattern)
    share = discriminability(misfit, frame)
    every = [(_outside(pattern, across.T @ x), family) for x, family in _effects(misfit)]
    own, family = min(every)
    return Limit(whole - own, own, needed(family, share))


def _effects(misfit: WhitenedResiduals) -> Iterator[tuple[FloatArray, str]]:
    """Columns of every effect, on all its parameters and on each alone; its family."""
    for one in misfit.candidates:
        yield one.columns, one.family
        for column in one.columns.T:
            yield column[:, None], one.family


def _outside(pattern: FloatArray, columns: FloatArray) -> float:
    """Square of what is left of a pattern beside all combinations of the columns."""
    left, values, _ = np.linalg.svd(columns, full_matrices=False)
    inside = left[:, values > 1e-6 * values.max(initial=0.0)].T @ pattern
    return max(float(pattern @ pattern - inside @ inside), 0.0)
