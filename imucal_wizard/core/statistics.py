"""The size of errors: root mean square, and estimates that a minority of outliers does not move."""

import numpy as np
from numpy.typing import ArrayLike

from imucal_wizard.core.readings import FloatArray

SIGMA_PER_MEDIAN = 1.4826
"""Standard deviation of normal noise over the median of its absolute values."""
MEDIAN_CHI_SQUARE = 0.4549
"""Median of the square of a normal number of variance 1."""


def robust_deviation(errors: ArrayLike) -> float:
    """Standard deviation of errors about zero, from the median of their absolute values."""
    return SIGMA_PER_MEDIAN * float(np.median(np.abs(errors)))


def median_of_rows(values: FloatArray) -> FloatArray:
    """Median along the first axis: the bits of ``np.median``, ten times sooner for small arrays.

    Args:
        values: finite numbers, shape (n, …), n > 0.
    """
    ordered = np.sort(values, axis=0)
    half = len(ordered) // 2
    if len(ordered) % 2:
        return np.asarray(ordered[half])
    return np.asarray((ordered[half - 1] + ordered[half]) / 2.0)


def root_mean_square(errors: FloatArray) -> float:
    """Of errors of any shape; of vectors, of their lengths when they are the last axis."""
    squares = errors**2 if errors.ndim == 1 else (errors**2).sum(axis=-1)
    return float(np.sqrt(squares.mean()))
