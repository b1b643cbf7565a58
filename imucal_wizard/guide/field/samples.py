"""Storage of the magnetometer's samples, by blocks of the stream."""

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.limits.procedure import (
    MAX_BLOCK_GAP,
    MAX_SAMPLES_PER_AREA,
    MIDDLE_SAMPLES,
)
from imucal_wizard.core.readings import BoolArray, FloatArray, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.ellipsoid.coverage import BINS, by_area

_INITIAL_ROWS = 256


class Growing:
    """An array that rows are appended to; views of earlier rows stay valid.

    Args:
        width: number of columns.
    """

    def __init__(self, width: int) -> None:
        self._table = np.empty((_INITIAL_ROWS, width))
        self._count = 0

    def __len__(self) -> int:
        return self._count

    @property
    def rows(self) -> FloatArray:
        """All rows, shape (n, width), as a view that later rows do not change."""
        return self._table[: self._count]

    def add(self, rows: FloatArray) -> None:
        """Append rows, shape (k, width)."""
        past = self._count + len(rows)
        if past > len(self._table):
            table = np.empty((max(past, 2 * len(self._table)), self._table.shape[1]))
            table[: self._count] = self.rows
            self._table = table
        self._table[self._count : past] = rows
        self._count = past


class FieldRecord:
    """All samples of the session; the fit also uses those outside the magnetometer's step."""

    def __init__(self) -> None:
        self._rows = Growing(4)
        self._unit = ""

    def add(self, series: Series) -> None:
        """Take the next samples."""
        self._unit = series.unit
        self._rows.add(np.column_stack([series.time, series.values]))

    def series(self) -> Series | None:
        """All samples, or None if there are none."""
        if not len(self._rows):
            return None
        rows = self._rows.rows
        return Series(rows[:, 0], rows[:, 1:], self._unit)


MAX_SAMPLES = MAX_SAMPLES_PER_AREA * BINS
"""Samples kept before their areas are known."""


class Thinned:
    """A bounded number of samples with the block of each, in time order."""

    def __init__(self) -> None:
        self.values: FloatArray = np.zeros((0, 3))
        self.block: NDArray[np.intp] = np.zeros(0, np.intp)

    def __len__(self) -> int:
        return len(self.values)

    def add(self, values: FloatArray, block: int) -> None:
        """Take the samples of a block, shape (n, 3)."""
        self.values = np.concatenate([self.values, values])
        self.block = np.concatenate([self.block, np.full(len(values), block, np.intp)])
        if len(self) > 2 * MAX_SAMPLES:
            self.keep(np.arange(len(self)) % 2 == 0)

    def keep(self, rows: BoolArray) -> None:
        """Keep only these samples."""
        self.values, self.block = self.values[rows], self.block[rows]

    def thin(self, areas: NDArray[np.intp]) -> NDArray[np.intp]:
        """Keep at most ``MAX_SAMPLES_PER_AREA`` samples of each area, spread over time.

        Args:
            areas: area of each sample.

        Returns:
            The areas of the samples that are kept.
        """
        count = np.bincount(areas, minlength=BINS)
        if count.max(initial=0) <= MAX_SAMPLES_PER_AREA:
            return areas
        order = by_area(areas)
        first = np.cumsum(count) - count
        place = np.arange(len(areas)) - first[areas[order]]
        share = np.minimum(1.0, MAX_SAMPLES_PER_AREA / np.maximum(count, 1))[areas[order]]
        chosen = np.zeros(len(areas), bool)
        chosen[order] = np.floor((place + 1) * share + 1e-9) > np.floor(place * share + 1e-9)
        self.keep(chosen)
        return np.asarray(areas[chosen])


@dataclass(frozen=True, eq=False)
class FieldBlock:
    """A block with samples of the magnetometer.

    Attributes:
        start: begin, s.
        end: end, s.
        values: new readings, shape (n, 3).
        circle: number of the circle it belongs to.
        down: whether the face of that circle is on the table.
        before: angle about the vertical at the start of the block, degrees; NaN if unknown.
        after: the same at the end of the block.
        up: up direction in the body frame, shape (3,); NaN if unknown.
    """

    start: float
    end: float
    values: FloatArray
    circle: int
    down: bool
    before: float
    after: float
    up: FloatArray


class Log:
    """The blocks in time order."""

    def __init__(self) -> None:
        self._rows = Growing(14)

    def __len__(self) -> int:
        return len(self._rows)

    def add(self, passed: FieldBlock) -> None:
        """Take the next block."""
        count = len(passed.values)
        spare = max(count - MIDDLE_SAMPLES, 0) // 2
        middle = passed.values[spare : spare + MIDDLE_SAMPLES]
        row = [passed.start, passed.end, passed.circle, passed.down, passed.before, passed.after]
        numbers = [*row, count, len(middle), *middle.mean(axis=0), *passed.up]
        self._rows.add(np.array([numbers]))

    @property
    def start(self) -> FloatArray:
        """Start of each block, s, shape (n,)."""
        return self._rows.rows[:, 0]

    @property
    def end(self) -> FloatArray:
        """End of each block, s."""
        return self._rows.rows[:, 1]

    @property
    def circle(self) -> FloatArray:
        """Number of each block's circle."""
        return self._rows.rows[:, 2]

    @property
    def down(self) -> BoolArray:
        """Whether the face of the circle was on the table."""
        return self._rows.rows[:, 3] > 0.0

    @property
    def angles(self) -> tuple[FloatArray, FloatArray]:
        """Angle about the vertical at the start and at the end of each block, degrees."""
        return self._rows.rows[:, 4], self._rows.rows[:, 5]

    @property
    def count(self) -> FloatArray:
        """Number of new samples in each block."""
        return self._rows.rows[:, 6]

    @property
    def averaged(self) -> FloatArray:
        """Number of samples averaged in ``reading``."""
        return self._rows.rows[:, 7]

    @property
    def reading(self) -> FloatArray:
        """Mean reading in the middle of each block, shape (n, 3)."""
        return self._rows.rows[:, 8:11]

    @property
    def up(self) -> FloatArray:
        """Up direction in the body frame, shape (n, 3)."""
        return self._rows.rows[:, 11:14]

    def stretches(self, rows: BoolArray) -> list[slice]:
        """The chosen blocks as runs of consecutive blocks without a gap."""
        chosen = np.flatnonzero(rows)
        if not len(chosen):
            return []
        breaks = (np.diff(chosen) > 1) | (
            self.start[chosen[1:]] - self.end[chosen[:-1]] > MAX_BLOCK_GAP
        )
        edges = np.flatnonzero(breaks) + 1
        parts = np.split(chosen, edges)
        return [slice(int(part[0]), int(part[-1]) + 1) for part in parts]
