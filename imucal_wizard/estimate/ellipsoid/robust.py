"""A first ellipsoid that disturbed samples do not pull: least trimmed squares (Rousseeuw).

From several starts, each without one stretch of time, the samples that fit best are kept and the
algebraic fit is repeated on them until they stay the same; the start with the least trimmed sum
wins. Disturbances last for a while, so that one of the starts is free of any single one.
"""

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import BoolArray, FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import (
    median,
    median_of_rows,
    robust_deviation,
    sample_quantile,
)
from imucal_wizard.estimate.ellipsoid.surface import locate
from imucal_wizard.estimate.methods.algebraic import algebraic

STARTING_SAMPLES = 5000
CELLS_ACROSS = 5.0
"""Cells across the readings in each direction."""
ROBUST_SAMPLES = 1000
"""Samples that the start rests on; more make it no safer."""
TRUSTED_SHARE = 0.7
"""Share of the samples that is taken to be undisturbed."""
MIN_QUADRIC_SAMPLES = 10
"""Samples of the first fit: as many as a quadric has numbers."""
STRETCHES = 6
FIRST_ROUNDS = 2
"""Rounds after which it shows which starts lead anywhere ..."""
ROBUST_FINALISTS = 2
"""... and how many of them go on."""
CONCENTRATIONS = 12
OUTSIDE_MEDIANS = 1.7
"""Times the median distance from the middle, beyond which no sample of a field lies that fills half
of a sphere and more."""
CLEAN_SIGMAS = 5.0
"""Standard deviations within which all samples lie when none is disturbed: one start is enough."""


@dataclass(frozen=True, eq=False)
class Concentrated:
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
    some = _balanced(points[:, :: max(1, points.shape[1] // STARTING_SAMPLES)])
    tried: list[Concentrated] = []
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
    best = sorted(tried, key=lambda trial: trial.cost)[:ROBUST_FINALISTS]
    ends = [_concentrate(some, trial.kept, basis, CONCENTRATIONS) for trial in best]
    theta = min(ends, key=lambda trial: trial.cost).theta
    return theta, robust_deviation(locate(theta, some)[0])


def _balanced(points: FloatArray) -> FloatArray:
    """About a thousand samples, crowded places thinned, still in the order of time.

    Else a long rest on one face is the majority, and all other faces look like outliers to it.
    Places are cells of the readings' own space, since no centre is known yet; a sample alone in
    its cell is left out.
    """
    if points.shape[1] <= ROBUST_SAMPLES:
        return points
    some = points[:, ::4]
    low, high = (np.array([sample_quantile(axis, one) for axis in some]) for one in (0.05, 0.95))
    steps = np.floor(
        (points - low[:, None]) * (CELLS_ACROSS / np.ptp([low, high], axis=0).max())
    ).astype(np.int64)
    steps = np.clip(steps, -100, 100) + 100
    _, cell, count = np.unique(
        (steps[0] * 256 + steps[1]) * 256 + steps[2], return_inverse=True, return_counts=True
    )
    shared = count > 1
    each = ROBUST_SAMPLES / max(int(shared.sum()), 1)
    share = np.where(shared, each / count, 0.0)
    order = np.argsort(cell, kind="stable")
    # in each cell samples are taken evenly: where the running share passes a whole
    running = np.floor(np.cumsum(np.minimum(share, 1.0)[cell[order]]) + 0.5)
    return points[:, np.sort(order[np.diff(running, prepend=0.0) > 0.0])]


def _clean(trial: Concentrated, points: FloatArray) -> bool:
    """Whether no sample lies far off, so that another start can find nothing better."""
    distance = locate(trial.theta, points)[0]
    return bool(np.abs(distance).max() < CLEAN_SIGMAS * robust_deviation(distance))


def _starts(points: FloatArray) -> list[BoolArray]:
    """Which samples each start keeps: all, those not far out, and of these all but one stretch."""
    count = points.shape[1]
    length = np.linalg.norm(points - median_of_rows(points.T)[:, None], axis=0)
    near = length < OUTSIDE_MEDIANS * median(length)
    out = [np.ones(count, bool), near]
    for number in range(STRETCHES):
        kept = near.copy()
        kept[count * number // STRETCHES : count * (number + 1) // STRETCHES] = False
        out.append(kept)
    return out


def _concentrate(
    points: FloatArray, kept: BoolArray, basis: FloatArray, rounds: int
) -> Concentrated:
    """Repeat: fit, keep those that fit best. The trimmed sum never grows by much."""
    size = min(max(int(TRUSTED_SHARE * points.shape[1]), 10), points.shape[1] - 1)
    last = np.inf
    for _ in range(rounds):
        if kept.sum() < MIN_QUADRIC_SAMPLES:
            raise DataError("too few distinct samples of the magnetometer")
        theta = algebraic(points[:, kept], basis)
        square = locate(theta, points)[0] ** 2
        chosen = np.argpartition(square, size)[:size]
        cost = float(square[chosen].sum())
        kept = np.zeros(points.shape[1], bool)
        kept[chosen] = True
        if not cost < 0.999 * last:
            break
        last = cost
    return Concentrated(theta, kept, min(cost, last))
