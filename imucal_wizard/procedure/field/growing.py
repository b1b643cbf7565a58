"""Rows that come one after the other, kept in one array."""

import numpy as np

from imucal_wizard.readings import FloatArray

_FIRST = 256


class Growing:
    """An array that grows at its end; what was handed out stays as it is.

    Args:
        width: columns.
    """

    def __init__(self, width: int) -> None:
        self._table = np.empty((_FIRST, width))
        self._count = 0

    def __len__(self) -> int:
        return self._count

    @property
    def rows(self) -> FloatArray:
        """All rows, shape (n, width); a view that later rows do not change."""
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
