"""A first ellipsoid that disturbed samples do not pull: least trimmed squares (Rousseeuw).

From several starts, each without one stretch of time, the samples that fit best are kept and the
algebraic fit is repeated on them until they stay the same; the start with the least trimmed sum
wins. Disturbances last for a while, so that one of the starts is free of any single one.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.ellipsoid.algebraic import algebraic
from imucal_wizard.solver.ellipsoid.shape import look

LARGEST = 1000
"""Samples looked at; more make the start no safer."""
TRUSTED = 0.7
"""Share of the samples that is taken to be undisturbed."""
STRETCHES = 6
FIRST_ROUNDS = 2
"""Rounds after which it shows which starts lead anywhere ..."""
FINALISTS = 2
"""... and how many of them go on."""
ROUNDS = 12
OUTSIDE = 1.7
"""Times the median distance from the middle, beyond which no sample of a field lies that fills half
of a sphere and more."""
CLEAN = 5.0
"""Standard deviations within which all samples lie when none is disturbed: one start is enough."""
NORMAL = 1.4826
"""Standard deviation over median absolute value, of normal noise."""

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Trial:
    """Where a start has led: θ, the samples that fit it best, and their sum of squares."""

    theta: FloatArray
    kept: BoolArray
    cost: float


def robust_start(points: FloatArray, basis: FloatArray) -> tuple[FloatArray, float]:
    """θ and the standard deviation of the distances, from samples in the order of time.

    Args:
        points: dimensionless readings, shape (3, n).
        basis: quadrics allowed, shape (10, p).

    Raises:
        DataError: no start leads to an ellipsoid.
    """
    some = points[:, :: max(1, points.shape[1] // LARGEST)]
    tried: list[Trial] = []
    problem: DataError | None = None
    for kept in _starts(some):
        try:
            trial = _concentrate(some, kept, basis, FIRST_ROUNDS)
        except DataError as error:
            problem = error
            continue
        tried.append(trial)
        if _clean(trial, some):
            break
    if not tried:
        raise problem or DataError("there are no samples of the magnetometer")
    best = sorted(tried, key=lambda trial: trial.cost)[:FINALISTS]
    ends = [_concentrate(some, trial.kept, basis, ROUNDS) for trial in best]
    theta = min(ends, key=lambda trial: trial.cost).theta
    return theta, spread(look(theta, some)[0])


def _clean(trial: Trial, points: FloatArray) -> bool:
    """Whether no sample lies far off, so that another start can find nothing better."""
    distance = look(trial.theta, points)[0]
    return bool(np.abs(distance).max() < CLEAN * spread(distance))


def spread(distance: FloatArray) -> float:
    """Standard deviation of distances that a minority of outliers does not move."""
    return NORMAL * float(np.median(np.abs(distance)))


def _starts(points: FloatArray) -> list[BoolArray]:
    """Which samples each start keeps: all, those not far out, and of these all but one stretch."""
    count = points.shape[1]
    length = np.linalg.norm(points - np.median(points, axis=1)[:, None], axis=0)
    near = length < OUTSIDE * np.median(length)
    out = [np.ones(count, bool), near]
    for number in range(STRETCHES):
        kept = near.copy()
        kept[count * number // STRETCHES : count * (number + 1) // STRETCHES] = False
        out.append(kept)
    return out


def _concentrate(points: FloatArray, kept: BoolArray, basis: FloatArray, rounds: int) -> Trial:
    """Repeat: fit, keep those that fit best. The trimmed sum never grows by much."""
    size = min(max(int(TRUSTED * points.shape[1]), 10), points.shape[1] - 1)
    last = np.inf
    for _ in range(rounds):
        theta = algebraic(points[:, kept], basis)
        square = look(theta, points)[0] ** 2
        chosen = np.argpartition(square, size)[:size]
        cost = float(square[chosen].sum())
        kept = np.zeros(points.shape[1], bool)
        kept[chosen] = True
        if not cost < 0.999 * last:
            break
        last = cost
    return Trial(theta, kept, min(cost, last))
