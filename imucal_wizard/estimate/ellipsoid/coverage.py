"""The sphere of directions in a hundred equal areas: what is covered, how densely, what is missing.

Eight rings of equal angle in latitude would not have equal areas; here each ring's height follows
from how many areas it holds (Archimedes: the area of a zone is its height), so that all areas are
equal and about as wide as high, 20°.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass

RINGS = (4, 11, 16, 19, 19, 16, 11, 4)
"""Areas in each ring from the bottom (−z) to the top; in proportion to the ring's circumference."""
BINS = sum(RINGS)
_FIRST = np.concatenate([[0], np.cumsum(RINGS)])
_HEIGHTS = -1.0 + 2.0 * _FIRST / BINS
_COUNTS = np.array(RINGS)
GAP_SHARES = np.array([1.0, 0.2, 0.01])
"""What an area with no, one or two samples counts for: with three it is covered."""
FEWEST_FOR_QUALITY = 4
"""Samples below which nothing can be said."""


def bin_of(directions: FloatArray) -> NDArray[np.intp]:
    """Number of the area in which each unit vector lies.

    Args:
        directions: unit vectors, shape (3, n).

    Returns:
        Numbers from 0 to 99, shape (n,).
    """
    x, y, z = directions
    ring = np.searchsorted(_HEIGHTS[1:-1], z, side="right")
    turn = np.arctan2(y, x) * (0.5 / np.pi)
    turn -= np.floor(turn)
    count = _COUNTS[ring]
    return np.asarray(_FIRST[ring] + np.minimum((turn * count).astype(np.intp), count - 1))


def by_area(areas: NDArray[np.intp]) -> NDArray[np.intp]:
    """The order that brings samples of one area together, in time within each, shape (n,)."""
    return np.argsort(areas.astype(np.uint8), kind="stable")


@cache
def centres() -> FloatArray:
    """Unit vector in the middle of each area, shape (100, 3)."""
    z = np.repeat(0.5 * (_HEIGHTS[1:] + _HEIGHTS[:-1]), _COUNTS)
    place = np.concatenate([np.arange(count) for count in RINGS])
    turn = 2.0 * np.pi * (place + 0.5) / np.repeat(_COUNTS, _COUNTS)
    ring = np.sqrt(1.0 - z * z)
    found = np.column_stack([ring * np.cos(turn), ring * np.sin(turn), z])
    found.flags.writeable = False
    return found


@dataclass(frozen=True)
class Quality:
    """Four figures of a cloud of corrected readings, as the users of MotionCal (PJRC) know them.

    All are per cent, and zero is best. MotionCal accepts a calibration below 15, 4.5, 4 and 5.

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
    few = counts < len(GAP_SHARES)
    return float(GAP_SHARES[counts[few]].sum()) * 100.0 / BINS


def quality(vectors: FloatArray, areas: NDArray[np.intp]) -> Quality | None:
    """The figures of corrected readings; None for too few.

    Args:
        vectors: corrected readings over the size of the field, shape (3, n).
        areas: area of each, shape (n,).
    """
    if len(areas) < FEWEST_FOR_QUALITY:
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
