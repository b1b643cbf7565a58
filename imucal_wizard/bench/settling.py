"""The setting of an effect that is not linear in it, found between those that are tried.

A warm-up is looked for with a handful of time constants; the one that fits lies between them. With
an error a hundred times the noise the nearest of the handful leaves structure that no noise makes,
and the rest would be blamed on something else.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.solver.extended.doubt import with_doubt
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.solver.extended.terms import Term

GOLDEN = 0.5 * (5.0**0.5 - 1.0)
STEPS = 9
"""Each narrows by the golden section, so that a factor of 3 becomes one of 1.015."""
SAME = 0.04
"""Settings that differ by less than this share are one."""
ASIDE = 0.08
"""How far to either side the fall of the likelihood is measured, in the logarithm."""

Fit = Callable[[Term], Extended]


def settled(fit: Fit, term: Term, variants: Sequence[float | None]) -> Extended:
    """The likeliest fit between the settings on either side of the one given.

    By the golden section in its logarithm and the likelihood of what each fit leaves.

    Args:
        fit: of the model with this term.
        term: with the likeliest of the settings tried.
        variants: the settings tried.

    Returns:
        The fit with the best setting; with the one given, where the effect has no setting between
        two of those tried.
    """
    grid = _grid(term, variants)
    if not grid:
        return fit(term)
    tried: dict[float, Extended] = {}

    def likelihood(at: float) -> float:
        if at not in tried:
            tried[at] = fit(replace(term, variant=float(np.exp(at))))
        return unlikeliness(tried[at])

    low, high = _enclosed(likelihood, grid, grid.index(float(np.log(term.variant or 1.0))))
    _narrow(likelihood, low, high)
    best = min(tried, key=likelihood)
    spread = _spread(likelihood, best)
    return with_doubt(tried[best], tried[best + ASIDE], ASIDE / spread) if spread else tried[best]


def unlikeliness(fit: Extended) -> float:
    """Twice the negative logarithm of the likelihood of a fit's rows."""
    linear = fit.linear
    return float((linear.residual**2).sum() + 2.0 * np.log(linear.sigma).sum())


def _grid(term: Term, variants: Sequence[float | None]) -> list[float]:
    """Logarithms of the settings tried, in order; none where there is nothing between them."""
    if not term.effect.graded or term.variant is None:
        return []
    return sorted({float(np.log(one)) for one in (*variants, term.variant) if one is not None})


def _enclosed(
    unlikely: Callable[[float], float], grid: Sequence[float], best: int
) -> tuple[float, float]:
    """Walk along the grid to the best place; its neighbours."""
    while True:
        near = range(max(best - 1, 0), min(best + 2, len(grid)))
        better = min(near, key=lambda k: unlikely(grid[k]))
        if better == best:
            return grid[near[0]], grid[near[-1]]
        best = better


def _narrow(unlikely: Callable[[float], float], low: float, high: float) -> None:
    """Try places between two by the golden section.

    With errors far above the noise the likelihood has a sharp cusp, which no parabola fits.
    """
    for _ in range(STEPS):
        if high - low < SAME:
            return
        left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        if unlikely(left) < unlikely(right):
            high = right
        else:
            low = left


def _spread(unlikely: Callable[[float], float], best: float) -> float:
    """Standard deviation of the setting's logarithm by how fast the likelihood falls; 0: none."""
    bend = unlikely(best - ASIDE) + unlikely(best + ASIDE) - 2.0 * unlikely(best)
    return float(np.sqrt(2.0 / bend)) * ASIDE if bend > 0.0 else 0.0
