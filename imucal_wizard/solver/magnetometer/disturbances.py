"""Samples during which the field was not the place's own: found by how they follow in time.

Noise falls with the number of samples averaged; a passing steel object or a loudspeaker does not.
Means over short blocks of time show it far below the noise of a sample, and their scatter shows
what swings. What the model leaves in every direction alike is measured beside it, so that a poor
model is not taken for a disturbance.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.ellipsoid.bins import BINS
from imucal_wizard.ellipsoid.robust import NORMAL
from imucal_wizard.readings import BoolArray, FloatArray

BLOCKS = (0.4, 2.0)
"""Seconds of a block: no hand passes with steel in less than the first; the second is for what is
weak and slow."""
FAR = 6.0
"""Standard deviations beyond which a block, or a single sample, is disturbed."""
NEAR = 3.0
"""The same for the blocks beside one."""
MEDIAN_ERROR = 0.787
"""Standard deviation of the median of n absolute values of normal noise, times the root of n."""
FEWEST = 5
"""Samples of a block, and of an area whose mean counts."""


@dataclass(frozen=True)
class LeftOut:
    """Samples that were not used.

    Attributes:
        start: first of them, s.
        end: last of them, s.
        samples: how many.
        size: largest distance from the ellipsoid, in the distances' unit.
        single: scattered single samples rather than a stretch of time.
    """

    start: float
    end: float
    samples: int
    size: float
    single: bool = False


def find(
    distance: FloatArray,
    time: FloatArray,
    areas: NDArray[np.intp],
    sigma: float,
    rounding: float,
) -> tuple[BoolArray, tuple[LeftOut, ...]]:
    """Which samples to keep, and the stretches left out.

    Args:
        distance: of each sample from a robust ellipsoid, in the order of time, shape (n,).
        time: s, shape (n,).
        areas: direction of each sample, shape (n,).
        sigma: robust standard deviation of the distances.
        rounding: by how much the steps of the readings may shift the mean of a rest.
    """
    sigma = max(sigma, rounding)
    far = np.abs(distance) > FAR * sigma
    clipped = np.clip(distance, -FAR * sigma, FAR * sigma)
    misfit = float(np.hypot(_misfit(clipped, areas), rounding))
    during = np.zeros(len(distance), bool)
    for seconds in BLOCKS:
        block = np.arange(len(distance)) // _size(time, seconds)
        during |= _disturbed(clipped, block, misfit, sigma)[block]
        during |= _swinging(np.abs(distance), block, np.hypot(sigma, misfit))[block]
    kept = ~far & ~during
    runs = _stretches(during, distance, time)
    single = far & ~during
    if single.any():
        rows = np.flatnonzero(single)
        worst = float(np.abs(distance[single]).max())
        runs.append(LeftOut(float(time[rows[0]]), float(time[rows[-1]]), len(rows), worst, True))
    return kept, tuple(runs)


def _size(time: FloatArray, seconds: float) -> int:
    """Samples of a block."""
    length = float(time[-1] - time[0])
    rate = (len(time) - 1) / length if length > 0.0 else 0.0
    return max(FEWEST, round(seconds * rate))


def _misfit(distance: FloatArray, areas: NDArray[np.intp]) -> float:
    """How far the means of directions differ: what the model lacks, and no disturbance."""
    count = np.bincount(areas, minlength=BINS)
    filled = count >= FEWEST
    if not filled.any():
        return 0.0
    means = np.bincount(areas, distance, BINS)[filled] / count[filled]
    return NORMAL * float(np.median(np.abs(means)))


def _disturbed(
    distance: FloatArray, block: NDArray[np.intp], misfit: float, sigma: float
) -> BoolArray:
    """Blocks whose mean is far off, and their neighbours that are off as well."""
    count = np.bincount(block)
    mean = np.abs(np.bincount(block, distance) / count)
    limit = np.sqrt(sigma**2 / count + misfit**2)
    disturbed = mean > FAR * limit
    doubtful = mean > NEAR * limit
    for _ in range(len(mean)):
        beside = np.zeros(len(mean), bool)
        beside[1:] |= disturbed[:-1]
        beside[:-1] |= disturbed[1:]
        more = beside & doubtful & ~disturbed
        if not more.any():
            break
        disturbed |= more
    return np.asarray(disturbed)


def _swinging(off: FloatArray, block: NDArray[np.intp], sigma: float) -> BoolArray:
    """Blocks that scatter ``NEAR`` times as far as the rest, beyond what chance makes of so few.

    Half of such a block's samples lie so far off, which no spikes bring about.
    """
    count = np.bincount(block)
    limit = (NEAR / NORMAL + FAR * MEDIAN_ERROR / np.sqrt(count)) * sigma
    beyond = np.bincount(block, off > limit[block])
    return np.asarray(beyond >= count - count // 2)


def _stretches(during: BoolArray, distance: FloatArray, time: FloatArray) -> list[LeftOut]:
    """Disturbed samples that follow one another, as one stretch each."""
    edges = np.diff(np.concatenate([[0], during.astype(int), [0]]))
    out = []
    for first, end in zip(np.flatnonzero(edges > 0), np.flatnonzero(edges < 0), strict=True):
        worst = float(np.abs(distance[first:end]).max())
        out.append(LeftOut(float(time[first]), float(time[end - 1]), int(end - first), worst))
    return out
