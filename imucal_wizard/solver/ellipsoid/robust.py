"""A first ellipsoid that disturbed samples do not pull: least trimmed squares (Rousseeuw).

From several starts, each without one stretch of time, the samples that fit best are kept and the
algebraic fit is repeated on them until they stay the same; the start with the least trimmed sum
wins. Disturbances last for a while, so that one of the starts is free of any single one.
"""

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.ellipsoid.algebraic import algebraic
from imucal_wizard.solver.ellipsoid.shape import look

LARGEST = 1000
"""Samples looked at; more make the start no safer."""
TRUSTED = 0.7
"""Share of the samples that is taken to be undisturbed."""
STRETCHES = 6
ROUNDS = 12
OUTSIDE = 1.7
"""Times the median distance from the middle, beyond which no sample of a field lies that fills half
of a sphere and more."""
CLEAN = 5.0
"""Standard deviations within which all samples lie when none is disturbed: one start is enough."""
NORMAL = 1.4826
"""Standard deviation over median absolute value, of normal noise."""


def robust_start(points: FloatArray, basis: FloatArray) -> tuple[FloatArray, float]:
    """θ and the standard deviation of the distances, from samples in the order of time.

    Args:
        points: dimensionless readings, shape (3, n).
        basis: quadrics allowed, shape (10, p).

    Raises:
        DataError: no start leads to an ellipsoid.
    """
    some = points[:, :: max(1, points.shape[1] // LARGEST)]
    best: tuple[float, FloatArray, float] | None = None
    problem: DataError | None = None
    for kept in _starts(some):
        try:
            theta, cost = _concentrate(some, kept, basis)
        except DataError as error:
            problem = error
            continue
        distance = look(theta, some)[0]
        sigma = spread(distance)
        if best is None or cost < best[0]:
            best = cost, theta, sigma
        if np.abs(distance).max() < CLEAN * sigma:
            break
    if best is None:
        raise problem or DataError("there are no samples of the magnetometer")
    return best[1], best[2]


def spread(distance: FloatArray) -> float:
    """Standard deviation of distances that a minority of outliers does not move."""
    return NORMAL * float(np.median(np.abs(distance)))


def _starts(points: FloatArray) -> list[FloatArray]:
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


def _concentrate(
    points: FloatArray, kept: FloatArray, basis: FloatArray
) -> tuple[FloatArray, float]:
    """Repeat: fit, keep those that fit best. The trimmed sum never grows by much."""
    size = max(int(TRUSTED * points.shape[1]), 10)
    last = np.inf
    for _ in range(ROUNDS):
        theta = algebraic(points[:, kept], basis)
        square = look(theta, points)[0] ** 2
        chosen = np.argpartition(square, min(size, len(square) - 1))[:size]
        cost = float(square[chosen].sum())
        if not cost < 0.999 * last:
            break
        last = cost
        kept = np.zeros(points.shape[1], bool)
        kept[chosen] = True
    return theta, min(cost, last)
