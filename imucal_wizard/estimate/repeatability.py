"""Repeatability: how far the same pose differs from one visit to the next (the pure error).

The scatter of visits to one direction about their mean. The noise within the holds does not show
what changes from hold to hold (the seat, a wandering bias); the repeats do, and they show it apart
from what the model lacks. Pieces of one rest, cut by a disturbance, are one visit.
"""

from math import inf

import numpy as np

from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.distributions import WITHIN_NINETY, chi_square, exceeded
from imucal_wizard.model.rows.table import ResidualTable

WITHIN_FREEDOM = 8.0
"""Degrees of freedom per hold behind the noise within: of the twelve of three axes its scatter from
session to session shows 8 to 10.5, the fewest with many holds of an accelerometer
(``pytest -m study tests/estimate/test_lack_of_fit.py``), and 12 with a gyroscope. The least is
taken."""
REPEATABLE_P = 0.01
"""An F ratio rarer than this says that poses do not repeat."""
ENOUGH_FREEDOM = 10
"""Degrees of freedom of repeats that agree, from which on more of them show little: these exclude,
nineteen times in twenty, that visits differ by 1.6 times what they show."""


@dataclass(frozen=True)
class Repeatability:
    """How far the same pose differs from visit to visit.

    Attributes:
        rms: of the visits about the mean of their direction, in ``unit``.
        freedom: degrees of freedom of ``rms``.
        p: chance that the noise within the holds alone makes the visits differ as much.
        unit: ``m/s^2``, ``rad/s`` (of the gyroscope's rates at rest) or ``uT``.
    """

    rms: float
    freedom: int
    p: float
    unit: str

    @property
    def repeatable(self) -> bool:
        """Whether the same pose reads the same again, within the noise."""
        return self.p > REPEATABLE_P

    @property
    def agree(self) -> bool:
        """Whether there are enough repeats to say that it does."""
        return self.repeatable and self.freedom >= ENOUGH_FREEDOM

    @property
    def interval(self) -> tuple[float, float]:
        """Of ``rms``: it holds the truth nine times in ten."""
        reach = (WITHIN_NINETY, -WITHIN_NINETY)
        low, high = (self.rms / chi_square(one, self.freedom) ** 0.5 for one in reach)
        return low, high


def repeatability_of(table: ResidualTable) -> Repeatability | None:
    """From the rows at rest of a fit; None where no pose was repeated."""
    rest = rows_at_rest(table)
    if not rest.any():
        return None
    axis, noise, residual = np.maximum(table.axis, 0)[rest], table.floor[rest], table.residual[rest]
    group, visit = 3 * table.pose[rest] + axis, 3 * table.visit[rest] + axis
    square, freedom = pure_error(residual, np.ones(len(residual)), group, visit)
    if not freedom:
        return None
    share = pure_error(residual, noise, group, visit)[0] if noise.all() else inf
    p = exceeded(share, freedom, within_freedom(table))
    unit = str(table.unit[np.flatnonzero(rest)[0]])
    return Repeatability(float(np.sqrt(square)), freedom, p, unit)


def within_freedom(table: ResidualTable) -> float:
    """Degrees of freedom behind the noise of the rows, of which a hold may have several.

    The noise of rotations follows from that of the holds; where there are none, each has its own.
    Of the slow noise that holds share less may be known: the share that it has in the squares of
    the whitened rows counts with its own degrees of freedom (Satterthwaite).
    """
    holds = len(distinct(table.item[~table.moving]))
    within = WITHIN_FREEDOM * (holds or len(table))
    slow = min(one.slow_freedom for one in table.sources)
    if slow == inf:
        return within
    alone = np.concatenate([one.own for one in table.at])
    share = 1.0 - float(np.mean(alone * table.independent.diagonal(1.0 / table.own)))
    return 1.0 / ((1.0 - share) ** 2 / within + share**2 / slow)


def rows_at_rest(table: ResidualTable) -> BoolArray:
    """Which rows a direction may repeat, all of one unit: holds, rates at rest, magnitudes."""
    rest = ~table.moving & (table.pose >= 0)
    unit = table.unit
    return np.asarray(rest & (unit == unit[int(rest.argmax())]))


def pure_error(
    residual: FloatArray, sigma: FloatArray, group: IntArray, visit: IntArray
) -> tuple[float, int]:
    """Mean square of the visits about the mean of their group, and its degrees of freedom.

    The visits are compared as they were measured, and only then divided by their noise: what a
    model lacks in a direction is the same in a quiet visit and in a noisy one.

    Args:
        residual: of the rows, shape (n,).
        sigma: standard deviation of each, shape (n,).
        group: which rows are of one direction, shape (n,).
        visit: which rows are pieces of one visit, shape (n,).

    Returns:
        The mean square in units of ``sigma``, and its degrees of freedom.
    """
    _, first, number = np.unique(visit, return_index=True, return_inverse=True)
    # the mean of the pieces of a visit, as exact as they are together
    weight = np.bincount(number, sigma**-2.0)
    together = np.bincount(number, residual / sigma**2) / weight
    _, place, visits = np.unique(group[first], return_inverse=True, return_counts=True)
    middle = np.bincount(place, weight * together) / np.bincount(place, weight)
    rest = together - middle[place]
    freedom = len(first) - len(visits)
    return (float(weight @ rest**2) / freedom if freedom else 0.0), freedom
