"""The size of errors: root mean square, and estimates that a minority of outliers does not move."""

from collections.abc import Sequence
from functools import reduce
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

if TYPE_CHECKING:  # which themselves use the median
    from imucal_wizard.core.readings import BoolArray, FloatArray

SIGMA_PER_MEDIAN = 1.4826
"""Standard deviation of normal noise over the median of its absolute values."""
MEDIAN_CHI_SQUARE = 0.4549
"""Median of the square of a normal number of variance 1."""
CORRELATION_ROUNDING = 1e-6
"""By how much rounding may change a correlation that derivatives by differences have gone into."""

MIN_SPHERE_POINTS, MIN_SPHERE_THICKNESS = 9, 0.3
"""Points that show the centre of a sphere; ratio of their smallest spread to the largest."""
MAX_SPHERE_SCATTER = 0.25
"""Relative scatter of their distances from it; those of noise about one point scatter by 0.42."""


def robust_deviation(errors: ArrayLike) -> float:
    """Standard deviation of errors about zero, from the median of their absolute values."""
    return SIGMA_PER_MEDIAN * median(np.abs(errors))


def median(values: ArrayLike) -> float:
    """Median of all numbers in an array: the bits of ``np.median``, NaN where one is NaN.

    ``np.median`` imports NumPy's masked arrays, at the cost of reading a file.
    """
    flat = np.ravel(values)
    half = len(flat) // 2
    if not len(flat):
        return float("nan")
    low, high, last = max(half - 1, 0), half, len(flat) - 1
    ordered = np.partition(flat, (low, high, last))
    if np.isnan(ordered[last]):
        return float("nan")
    return float(ordered[high] if len(flat) % 2 else (ordered[low] + ordered[high]) / 2.0)


def sample_quantile(values: ArrayLike, share: float) -> float:
    """Value below which a share of all numbers in an array lies: the bits of ``np.quantile``.

    Like ``median``, it avoids the import of NumPy's masked arrays.
    """
    ordered = np.sort(values, axis=None)
    place = share * (len(ordered) - 1)
    below = int(place)
    low, high = ordered[below], ordered[min(below + 1, len(ordered) - 1)]
    part = place - below
    # the one of two equal forms whose rounding keeps the order
    return float(high - (high - low) * (1.0 - part) if part >= 0.5 else low + (high - low) * part)


def median_of_rows(values: "FloatArray") -> "FloatArray":
    """Median along the first axis: the bits of ``np.median``, ten times faster for small arrays.

    Args:
        values: finite numbers, shape (n, …), n > 0.
    """
    ordered = np.sort(values, axis=0)
    half = len(ordered) // 2
    if len(ordered) % 2:
        return np.asarray(ordered[half])
    return np.asarray((ordered[half - 1] + ordered[half]) / 2.0)


def true_on_all_axes(true: "BoolArray") -> "BoolArray":
    """Which rows are true in all columns: ``all(axis=1)``, three times faster for few columns.

    Args:
        true: shape (n, axes).
    """
    return np.asarray(reduce(np.logical_and, true.T))


def lengths(vectors: "FloatArray") -> "FloatArray":
    """Length of each vector, (n, 3): the bits of ``np.linalg.norm``, five times faster."""
    x, y, z = vectors.T
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def sphere_through(points: "FloatArray", least: float = 1e-6) -> "tuple[FloatArray, float] | None":
    """Centre and squared radius of the sphere nearest to points, by linear least squares.

    ``|z|² = 2 z·b + (r² − |b|²)`` is linear in b and the last bracket.

    Args:
        points: of the order of one, shape (n, 3).
        least: smallest over largest singular value of the equations that may be solved.

    Returns:
        None where the points lie in a plane or do not bend like a sphere.
    """
    columns = np.column_stack([2.0 * points, np.ones(len(points))])
    solution, _, rank, _ = np.linalg.lstsq(columns, (points**2).sum(axis=1), rcond=least)
    centre = solution[:3]
    square = float(solution[3] + centre @ centre)
    return None if rank < 4 or square <= 0.0 else (np.asarray(centre), square)


def sphere_centre(points: "FloatArray") -> "FloatArray | None":
    """Centre of the sphere through points, shape (3,); None where they lie on none or hide it.

    Args:
        points: shape (n, 3).
    """
    offsets = points - points.mean(axis=0)
    spread = np.linalg.eigvalsh(offsets.T @ offsets)
    if len(points) < MIN_SPHERE_POINTS or not spread[0] > MIN_SPHERE_THICKNESS**2 * spread[-1]:
        return None
    size = float(np.abs(points).max())
    found = sphere_through(points / size)
    if found is None:
        return None
    centre = size * found[0]
    distances = lengths(points - centre)
    return centre if distances.std() < MAX_SPHERE_SCATTER * distances.mean() else None


def is_covariance(values: Sequence[Sequence[float]], count: int) -> bool:
    """Whether a matrix can be the covariance of so many numbers.

    Args:
        values: finite numbers, row by row.
        count: of the numbers; one that is not known has zeros.
    """
    if [len(row) for row in values] != [count] * count:
        return False
    matrix = np.array(values, np.float64).reshape(count, count)
    variances = np.diag(matrix)
    if (variances < 0.0).any():
        return False
    sizes = np.sqrt(np.where(variances > 0.0, variances, 1.0))
    with np.errstate(over="ignore"):  # the next line refuses what is infinite
        correlations = matrix / sizes / sizes[:, None]
    if (np.abs(correlations) > 1.0 + CORRELATION_ROUNDING).any():
        return False
    if (np.abs(correlations - correlations.T) > CORRELATION_ROUNDING).any():
        return False
    return bool((np.linalg.eigvalsh(correlations) >= -CORRELATION_ROUNDING).all())


def complement(columns: "FloatArray") -> "FloatArray":
    """Orthonormal basis of what no combination of columns makes, shape (n, n − rank)."""
    left, values, _ = np.linalg.svd(columns, full_matrices=True)
    rank = int((values > 1e-9 * values.max(initial=0.0)).sum())
    return np.asarray(left[:, rank:])


def root_mean_square(errors: "FloatArray") -> float:
    """Root mean square of errors; for vectors along the last axis, of their lengths."""
    squares = errors**2 if errors.ndim == 1 else (errors**2).sum(axis=-1)
    return float(np.sqrt(squares.mean()))


_ERROR_FUNCTION = (0.254829592, -0.284496736, 1.421413741, -1.453152027, 1.061405429)


def normal_below(deviations: "FloatArray") -> "FloatArray":
    """Probability that a normal variable is below so many standard deviations.

    Within 1e-7 (Abramowitz & Stegun, 7.1.26); importing SciPy's function takes longer than a fit.
    """
    size = np.abs(deviations) * np.sqrt(0.5)
    t = 1.0 / (1.0 + 0.3275911 * size)
    above = np.zeros_like(t)
    for one in reversed(_ERROR_FUNCTION):
        above = t * (one + above)
    above *= 0.5 * np.exp(-(size**2))
    return np.asarray(np.where(deviations > 0.0, 1.0 - above, above))
