"""A bounded set of samples that keeps what covers the sphere."""

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.ellipsoid.bins import BINS, by_area
from imucal_wizard.readings import BoolArray, FloatArray

EACH = 15
"""Samples kept of one area; where more come, some between them are dropped."""
MOST = EACH * BINS
"""Samples kept before it is known where they lie."""


class Thinned:
    """Samples and the moment each belongs to, in the order of time."""

    def __init__(self) -> None:
        self.values: FloatArray = np.zeros((0, 3))
        self.moment: NDArray[np.intp] = np.zeros(0, np.intp)

    def __len__(self) -> int:
        return len(self.values)

    def add(self, values: FloatArray, moment: int) -> None:
        """Take the samples of a moment, shape (n, 3)."""
        self.values = np.concatenate([self.values, values])
        self.moment = np.concatenate([self.moment, np.full(len(values), moment, np.intp)])
        if len(self) > 2 * MOST:
            self.keep(np.arange(len(self)) % 2 == 0)

    def keep(self, rows: BoolArray) -> None:
        """Drop all others."""
        self.values, self.moment = self.values[rows], self.moment[rows]

    def thin(self, areas: NDArray[np.intp]) -> NDArray[np.intp]:
        """Leave at most ``EACH`` in an area, spread over the time; the areas of what stays.

        Args:
            areas: area of each sample.
        """
        count = np.bincount(areas, minlength=BINS)
        if count.max(initial=0) <= EACH:
            return areas
        order = by_area(areas)
        first = np.cumsum(count) - count
        place = np.arange(len(areas)) - first[areas[order]]
        share = np.minimum(1.0, EACH / np.maximum(count, 1))[areas[order]]
        chosen = np.zeros(len(areas), bool)
        chosen[order] = np.floor((place + 1) * share + 1e-9) > np.floor(place * share + 1e-9)
        self.keep(chosen)
        return np.asarray(areas[chosen])
