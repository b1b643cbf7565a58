"""Slices of time within which as little changes as can be, so many as one wants.

Neighbours are joined whose joining adds least to the scatter of the features within the slices
(Ward's criterion), until few enough are left: a rest stays one slice, a circle becomes arcs.
"""

import heapq

import numpy as np

from imucal_wizard.readings import FloatArray, IntArray


def slices(features: FloatArray, weight: FloatArray, most: int) -> IntArray:
    """First row of each slice and the end, shape (k + 1,), k at most ``most``.

    Args:
        features: of what follows one another, shape (n, f).
        weight: of each row, shape (n,).
        most: slices.
    """
    count = len(weight)
    means = [np.asarray(row) for row in features]
    weights: list[float] = weight.tolist()
    after, before = list(range(1, count + 1)), list(range(-1, count - 1))
    version, alive = [0] * count, [True] * count

    def costs(row: int) -> float:
        other = after[row]
        apart = means[row] - means[other]
        square = float(apart @ apart)
        return square * weights[row] * weights[other] / (weights[row] + weights[other])

    waiting = [(costs(row), row, 0, 0) for row in range(count - 1)]
    heapq.heapify(waiting)
    left = count
    while left > most and waiting:
        _, row, mine, theirs = heapq.heappop(waiting)
        if not alive[row] or after[row] >= count:
            continue
        other = after[row]
        if version[row] != mine or version[other] != theirs:
            continue
        total = weights[row] + weights[other]
        means[row] = (weights[row] * means[row] + weights[other] * means[other]) / total
        weights[row], alive[other], after[row] = total, False, after[other]
        version[row] += 1
        left -= 1
        if after[row] < count:
            before[after[row]] = row
            heapq.heappush(waiting, (costs(row), row, version[row], version[after[row]]))
        if before[row] >= 0:
            first = before[row]
            heapq.heappush(waiting, (costs(first), first, version[first], version[row]))
    return np.append(np.flatnonzero(alive), count).astype(np.int64)
