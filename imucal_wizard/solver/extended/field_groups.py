"""Thousands of samples of a turning magnetometer as some sixty means: by time and by direction.

Samples that follow one another in about one direction are averaged to pieces of a fifth of a
second. A mean of vectors along an arc is shorter than the vectors; by how much is remembered
(``extra``), so that the magnitude of the mean is the mean magnitude. Pieces of one stretch of time
and one direction form a group: a row of the fit.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.procedure.poses import DIRECTIONS
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.attitude import IntArray

MOST = 72
"""Groups, so that the bench ranks its suspects as quickly as for sixty holds."""
STRETCHES = 24
"""Stretches of time at most."""
FEWEST = 5
"""Samples of a group; the passages between directions that hold fewer are left out."""
SPARSE = 0.1
"""Share of the usual number of samples below which a group tells nothing."""
PIECE = 0.2
"""Seconds of a piece."""
GAP = 2.5
"""Intervals from which a passage has ended."""
AWAY = 3.0
"""Seconds after which a direction is visited anew."""
_CELLS = np.array(list(DIRECTIONS.values()))


@dataclass(frozen=True, eq=False)
class Pieces:
    """Means of samples that follow one another, group by group.

    Attributes:
        reading: shape (p, 3).
        count: samples in each, shape (p,).
        time: mean, s, shape (p,).
        beside: means of what was recorded beside, shape (p, b).
        extra: by how much the mean magnitude is more than the magnitude of the mean, in the unit of
            the corrected field, shape (p,).
        offsets: first piece of each group and the end, shape (k + 1,).
        cell: number of each group's direction, shape (k,).
        passage: number of the passage through a cell that each piece belongs to, shape (p,).
    """

    reading: FloatArray
    count: FloatArray
    time: FloatArray
    beside: FloatArray
    extra: FloatArray
    offsets: IntArray
    cell: IntArray
    passage: IntArray

    def mean(self, values: FloatArray) -> FloatArray:
        """Means over the groups of values of the pieces, shape (p, …) to (k, …)."""
        weight = self.count.reshape(-1, *[1] * (values.ndim - 1))
        total = np.add.reduceat(self.count, self.offsets[:-1])
        sums = np.add.reduceat(values * weight, self.offsets[:-1], axis=0)
        return np.asarray(sums / total.reshape(-1, *[1] * (values.ndim - 1)))

    @property
    def samples(self) -> FloatArray:
        """Samples of each group, shape (k,)."""
        return np.asarray(np.add.reduceat(self.count, self.offsets[:-1]))


def cut(
    time: FloatArray,
    reading: FloatArray,
    field: FloatArray,
    beside: FloatArray,
    level: NDArray[np.bool_],
) -> Pieces:
    """The pieces and groups of a recording.

    Args:
        time: s, in order, shape (n,).
        reading: shape (n, 3).
        field: the same corrected about right, shape (n, 3).
        beside: what was recorded beside it, shape (n, b).
        level: whether much current flows; samples with and without are kept apart, shape (n,).
    """
    size = np.linalg.norm(field, axis=1)
    cell = np.argmax(field @ _CELLS.T, axis=1)
    key = _keys(time, 2 * cell + level)
    order = np.argsort(key, kind="stable")
    order = order[key[order] >= 0]
    key, time, cell = key[order], time[order], cell[order]
    step = float(np.median(np.diff(np.sort(time)))) if len(time) > 1 else 1.0
    begins = np.concatenate([[True], np.diff(time) > GAP * max(step, 1e-6)])
    begins |= np.concatenate([[True], np.diff(key) != 0])
    passage = np.cumsum(begins) - 1
    starts = _piece_starts(begins, max(round(PIECE / max(step, 1e-6)), 1))
    count = np.diff(np.append(starts, len(time))).astype(float)

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray((np.add.reduceat(values, starts, axis=0).T / count).T)

    extra = mean(size[order]) - np.linalg.norm(mean(field[order]), axis=1)
    _, first = np.unique(key[starts], return_index=True)
    return Pieces(
        mean(reading[order]),
        count,
        mean(time),
        mean(beside[order]),
        extra,
        np.append(first, len(starts)).astype(np.int64),
        np.asarray(cell[starts][first], np.int64),
        np.asarray(passage[starts], np.int64),
    )


def _keys(time: FloatArray, place: IntArray) -> IntArray:
    """Group of each sample, −1 for those that are left out; as many stretches of time as can be."""
    share = (time - time[0]) / max(float(time[-1] - time[0]), 1e-9)
    least = max(FEWEST, SPARSE * len(time) / MOST)
    for stretches in range(STRETCHES, 0, -1):
        stretch = np.minimum((share * stretches).astype(np.int64), stretches - 1)
        key = stretch * (2 * len(_CELLS)) + place
        count = np.bincount(key)
        if (count >= least).sum() <= MOST:
            break
    return np.where(count[key] >= least, key, -1)


def _piece_starts(begins: NDArray[np.bool_], length: int) -> IntArray:
    """First sample of each piece: passages cut into about equal lengths."""
    first = np.flatnonzero(begins)
    sizes = np.diff(np.append(first, len(begins)))
    parts = np.maximum(np.round(sizes / length).astype(np.int64), 1)
    starts = [f + (np.arange(n) * s) // n for f, s, n in zip(first, sizes, parts, strict=True)]
    return np.concatenate(starts).astype(np.int64)


def noise_of(pieces: Pieces, magnitude: FloatArray) -> float:
    """Variance times samples of a mean, from pieces that follow one another in a passage.

    Half the mean square of their differences, by its median, so that a step does not count.

    Args:
        pieces: of the recording.
        magnitude: of each piece's corrected field, shape (p,).
    """
    beside = np.diff(pieces.passage) == 0
    both = 1.0 / pieces.count[1:] + 1.0 / pieces.count[:-1]
    squares = (np.diff(magnitude + pieces.extra) ** 2 / both)[beside]
    if not len(squares):
        return 0.0
    return float(np.median(squares)) / 0.4549  # the median of a χ² of one degree of freedom


def visits_of(pieces: Pieces) -> IntArray:
    """Number of the visit to a direction that each group is, shape (k,).

    Groups of one direction whose stretches of time touch are one visit.
    """
    first, last = pieces.time[pieces.offsets[:-1]], pieces.time[pieces.offsets[1:] - 1]
    number = np.zeros(len(first), np.int64)
    known: dict[int, tuple[float, int]] = {}
    count = 0
    for group in np.argsort(first, kind="stable"):
        cell = int(pieces.cell[group])
        end, visit = known.get(cell, (-np.inf, -1))
        if first[group] - end > AWAY:
            visit, count = count, count + 1
        number[group] = visit
        known[cell] = (max(end, float(last[group])), visit)
    return number
