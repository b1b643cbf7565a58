"""Four figures of a cloud of corrected readings, as the users of MotionCal (PJRC) know them.

All are per cent, and zero is best. Its button to send the calibration wakes below 15, 4.5, 4 and 5.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.ellipsoid.bins import BINS, centres
from imucal_wizard.readings import FloatArray

GAP = np.array([1.0, 0.2, 0.01])
"""What an area with no, one or two samples counts for: with three it is covered."""
LEAST = 4
"""Samples below which nothing can be said."""


@dataclass(frozen=True)
class Quality:
    """The four figures.

    Attributes:
        gaps: share of the hundred areas without samples; one or two samples nearly fill one.
        variance: standard deviation of the magnitude over its mean.
        wobble: how far, over the radius, the means of the areas together lie off their middles.
        fit_error: half the root mean square of the relative error of the squared magnitude, which
            for small errors is the error of the magnitude.
    """

    gaps: float
    variance: float
    wobble: float
    fit_error: float


def gaps(counts: NDArray[np.intp]) -> float:
    """Share of the sphere that is not covered, per cent.

    Args:
        counts: samples in each area, shape (100,).
    """
    few = counts < len(GAP)
    return float(GAP[counts[few]].sum()) * 100.0 / BINS


def quality(vectors: FloatArray, areas: NDArray[np.intp]) -> Quality | None:
    """The figures of corrected readings; None for too few.

    Args:
        vectors: corrected readings over the size of the field, shape (3, n).
        areas: area of each, shape (n,).
    """
    if len(areas) < LEAST:
        return None
    length = np.sqrt(np.einsum("in,in->n", vectors, vectors))
    radius = float(length.mean())
    counts = np.bincount(areas, minlength=BINS)
    filled = counts > 0
    sums = np.array([np.bincount(areas, axis, BINS) for axis in vectors])
    off = (sums[:, filled] / counts[filled] - radius * centres()[filled].T).mean(axis=1)
    return Quality(
        gaps=gaps(counts),
        variance=100.0 * float(length.std()) / radius,
        wobble=100.0 * float(np.linalg.norm(off)) / radius,
        fit_error=50.0 * float(np.sqrt(((length**2 - 1.0) ** 2).mean())),
    )
