"""The sphere of directions in a hundred equal areas: what is covered, how densely, what is missing.

Eight rings of equal angle in latitude would not have equal areas; here each ring's height follows
from how many areas it holds (Archimedes: the area of a zone is its height), so that all areas are
equal and about as wide as high, 20°.
"""

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.readings import FloatArray

RINGS = (4, 11, 16, 19, 19, 16, 11, 4)
"""Areas in each ring from the bottom (−z) to the top; in proportion to the ring's circumference."""
BINS = sum(RINGS)
_FIRST = np.concatenate([[0], np.cumsum(RINGS)])
_HEIGHTS = -1.0 + 2.0 * _FIRST / BINS
_COUNTS = np.array(RINGS)


def bin_of(directions: FloatArray) -> NDArray[np.intp]:
    """Number of the area in which each unit vector lies.

    Args:
        directions: unit vectors, shape (3, n).

    Returns:
        Numbers from 0 to 99, shape (n,).
    """
    x, y, z = directions
    ring = np.clip(np.searchsorted(_HEIGHTS, z, side="right") - 1, 0, len(RINGS) - 1)
    turn = np.arctan2(y, x) * (0.5 / np.pi)
    turn -= np.floor(turn)
    count = _COUNTS[ring]
    return np.asarray(_FIRST[ring] + np.minimum((turn * count).astype(np.intp), count - 1))


def by_area(areas: NDArray[np.intp]) -> NDArray[np.intp]:
    """The order that brings samples of one area together, in time within each, shape (n,)."""
    return np.argsort(areas.astype(np.uint8), kind="stable")


def centres() -> FloatArray:
    """Unit vector in the middle of each area, shape (100, 3)."""
    z = np.repeat(0.5 * (_HEIGHTS[1:] + _HEIGHTS[:-1]), _COUNTS)
    place = np.concatenate([np.arange(count) for count in RINGS])
    turn = 2.0 * np.pi * (place + 0.5) / np.repeat(_COUNTS, _COUNTS)
    ring = np.sqrt(1.0 - z * z)
    return np.column_stack([ring * np.cos(turn), ring * np.sin(turn), z])


def folds(count: int = 20, seed: int = 0) -> NDArray[np.intp]:
    """Which areas are left out together: five scattered ones in each of ``count`` folds, (100,).

    Every fold leaves out orientations whole, and the neighbours of each remain.
    """
    order = np.random.default_rng(seed).permutation(BINS)
    fold = np.empty(BINS, np.intp)
    fold[order] = np.arange(BINS) % count
    return fold
