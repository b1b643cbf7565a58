"""Field disturbances: samples taken in another field than that of the rest of the session.

Noise falls with the number of samples averaged; a passing steel object or a loudspeaker does not.
Means over short blocks of time show it far below the noise of a sample. Each is compared with the
noise at its own time: a sensor that is noisier for a while is not disturbed, and its samples have
their weight in the fit. In a field that swings the samples scatter as far, but each follows from
those before it. The misfit of the model, which is the same whenever a direction comes again, is
measured beside it, so that a poor model is not taken for a disturbance.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.readings import BoolArray, FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import SIGMA_PER_MEDIAN, robust_deviation
from imucal_wizard.estimate.ellipsoid.coverage import BINS

DISTURBANCE_BLOCK_SECONDS = (0.4, 2.0)
"""Seconds of a block: no hand passes with steel in less than the first; the second is for what is
weak and slow."""
DISTURBED_SIGMAS = 6.0
"""Standard deviations beyond which a block, or a single sample, is disturbed."""
DOUBTFUL_SIGMAS = 3.0
"""The same for the blocks beside one."""
MEDIAN_ERROR = 0.787
"""Standard deviation of the median of n absolute values of normal noise, times the root of n."""
FEWEST_IN_BLOCK = 5
"""Samples of a block, and of an area whose mean counts."""
FEWEST_FORETOLD = 30
"""Samples by which it shows whether two foretell the next: those of noise seem to once in ten
thousand times."""
NOISIER = 4.0
"""Three standard errors of a noise by its median, times the root of the samples, which it must be
above the usual to count."""
LINE_SAMPLES = 256
"""Samples of a spectrum; those of a session are averaged."""
LINE_BINS = 2
"""Frequencies to either side of a line over which its window and a motor's speed spread it."""
SLOW_BINS = 8
"""Lowest frequencies, at which the misfit of the model shows as the device turns."""
MOST_OF_NOISE = 0.5
"""Share of the power at one frequency, or of that which the samples before one foretell, from which
on it is what the noise consists of: white noise has a twentieth there, and foretells nothing."""


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

    def scaled(self, factor: float) -> "LeftOut":
        """The same with its size in another unit."""
        return replace(self, size=self.size * factor)


def find_disturbances(
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
    most = DISTURBED_SIGMAS * sigma
    misfit = float(np.hypot(_misfit(np.clip(distance, -most, most), areas), rounding))
    blocks = [np.arange(len(distance)) // _size(time, one) for one in DISTURBANCE_BLOCK_SECONDS]
    swings = [_swinging(distance, block, float(np.hypot(sigma, misfit))) for block in blocks]
    during = np.any([one[block] for one, block in zip(swings, blocks, strict=True)], axis=0)
    noise = noise_of(np.where(during, 0.0, distance), time, sigma)
    far = np.abs(distance) > DISTURBED_SIGMAS * noise
    clipped = np.clip(distance, -DISTURBED_SIGMAS * noise, DISTURBED_SIGMAS * noise)
    for block in blocks:
        during |= _disturbed(clipped, block, misfit, sigma)[block]
    kept = ~far & ~during
    runs = _stretches(during, distance, time)
    single = far & ~during
    if single.any():
        rows = np.flatnonzero(single)
        worst = float(np.abs(distance[single]).max())
        runs.append(LeftOut(float(time[rows[0]]), float(time[rows[-1]]), len(rows), worst, True))
    return kept, tuple(runs)


def noise_of(distance: FloatArray, time: FloatArray, usual: float) -> FloatArray:
    """Standard deviation of each sample by noise where it was taken, at least the usual, (n,).

    By the steps from sample to sample, which no other field makes large for long. A sensor becomes
    noisier anywhere in a block, so that the noisier one of the blocks beside counts.

    Args:
        distance: of each sample from an ellipsoid, in the order of time, shape (n,).
        time: s, shape (n,).
        usual: standard deviation of most samples.
    """
    noise = np.full(len(distance), usual)
    steps = np.abs(np.diff(distance, append=distance[-1]))
    for seconds in DISTURBANCE_BLOCK_SECONDS:
        size = _size(time, seconds)
        count = len(distance) // size
        if count:
            whole = steps[: count * size].reshape(count, size)
            middle = np.partition(whole, size // 2, axis=1)[:, size // 2]
            level = SIGMA_PER_MEDIAN * np.sqrt(0.5) * middle
            level[level < (1.0 + NOISIER / np.sqrt(size)) * usual] = usual
            level = np.pad(level, 1, mode="edge")
            level = np.max([level[:-2], level[1:-1], level[2:]], axis=0)
            of_sample = np.minimum(np.arange(len(distance)) // size, count - 1)
            noise = np.maximum(noise, level[of_sample])
    return noise


def line_of(distance: FloatArray, interval: float) -> float | None:
    """Frequency, Hz, at which a field swings that makes most of the noise; None for other noise.

    As it is sampled: mains are seen at another frequency where the sampling is slow.

    Args:
        distance: of samples that follow one another from the ellipsoid, shape (n,).
        interval: between them, s.
    """
    count = len(distance) // LINE_SAMPLES
    if not count:
        return None
    parts = distance[: count * LINE_SAMPLES].reshape(count, LINE_SAMPLES)
    window = np.sin(np.pi * (np.arange(LINE_SAMPLES) + 0.5) / LINE_SAMPLES) ** 2
    parts = window * (parts - parts.mean(axis=1, keepdims=True))
    power = (np.abs(np.fft.rfft(parts, axis=1)) ** 2).mean(axis=0)[SLOW_BINS:]
    best = int(power.argmax())
    near = power[max(best - LINE_BINS, 0) : best + LINE_BINS + 1]
    if not float(near.sum()) > MOST_OF_NOISE * float(power.sum()):
        return None
    return (SLOW_BINS + best) / (LINE_SAMPLES * interval)


def _size(time: FloatArray, seconds: float) -> int:
    """Samples of a block."""
    length = float(time[-1] - time[0])
    rate = (len(time) - 1) / length if length > 0.0 else 0.0
    return max(FEWEST_IN_BLOCK, round(seconds * rate))


def _misfit(distance: FloatArray, areas: NDArray[np.intp]) -> float:
    """How far the means of directions differ: what the model lacks, and no disturbance."""
    count = np.bincount(areas, minlength=BINS)
    filled = count >= FEWEST_IN_BLOCK
    if not filled.any():
        return 0.0
    means = np.bincount(areas, distance, BINS)[filled] / count[filled]
    return robust_deviation(means)


def _disturbed(
    distance: FloatArray, block: NDArray[np.intp], misfit: float, sigma: float
) -> BoolArray:
    """Blocks whose mean is far off by their own noise, and neighbours that are off as well."""
    count = np.bincount(block)
    mean = np.abs(np.bincount(block, distance) / count)
    steps = np.diff(distance, append=distance[-1])
    noise = np.bincount(block, 0.5 * steps**2) / count
    limit = np.sqrt(np.maximum(noise, sigma**2) / count + misfit**2)
    return spread_to_neighbours(mean > DISTURBED_SIGMAS * limit, mean > DOUBTFUL_SIGMAS * limit)


def spread_to_neighbours(
    disturbed: BoolArray, doubtful: BoolArray, most: int | None = None
) -> BoolArray:
    """The disturbed blocks, and the doubtful ones that follow one another from them on.

    Args:
        disturbed: in the order of time, shape (n,).
        doubtful: which blocks may belong to a disturbance beside them, shape (n,).
        most: how many of them to either side at most; None for any number.
    """
    found = disturbed.copy()
    for _ in range(len(found) if most is None else most):
        beside = np.zeros(len(found), bool)
        beside[1:] |= found[:-1]
        beside[:-1] |= found[1:]
        more = beside & doubtful & ~found
        if not more.any():
            break
        found |= more
    return found


def _swinging(distance: FloatArray, block: NDArray[np.intp], sigma: float) -> BoolArray:
    """Blocks that scatter three times as far as the rest, by more than chance, and not as noise.

    Half of such a block's samples lie so far off, which single spikes do not cause. The two samples
    before one foretell half of the power of a swing, by its autocorrelation, and none of noise.
    """
    count = np.bincount(block)
    chance = DISTURBED_SIGMAS * MEDIAN_ERROR / np.sqrt(count)
    limit = (DOUBTFUL_SIGMAS / SIGMA_PER_MEDIAN + chance) * sigma
    beyond = np.bincount(block, np.abs(distance) > limit[block])
    wide = beyond >= count - count // 2
    # wide blocks that follow one another are judged together
    stretch = np.cumsum(np.diff(wide, prepend=False))[block]
    own = distance - (np.bincount(block, distance) / count)[block]
    number = int(stretch[-1]) + 1

    def product(lag: int) -> FloatArray:
        first, last = own[: len(own) - lag], own[lag:]
        together = stretch[: len(own) - lag] == stretch[lag:]
        return np.asarray(np.bincount(stretch[lag:], first * last * together, number), np.float64)

    power = np.maximum(product(0), np.finfo(float).tiny)
    one, two = product(1) / power, product(2) / power
    foretold = one**2 + two**2 - 2.0 * one**2 * two > MOST_OF_NOISE * (1.0 - one**2)
    enough = np.bincount(stretch, minlength=number) >= FEWEST_FORETOLD
    return np.asarray(wide & (foretold & enough)[np.cumsum(np.diff(wide, prepend=False))])


def _stretches(during: BoolArray, distance: FloatArray, time: FloatArray) -> list[LeftOut]:
    """Disturbed samples that follow one another, as one stretch each."""
    edges = np.diff(np.concatenate([[0], during.astype(int), [0]]))
    out = []
    for first, end in zip(np.flatnonzero(edges > 0), np.flatnonzero(edges < 0), strict=True):
        worst = float(np.abs(distance[first:end]).max())
        out.append(LeftOut(float(time[first]), float(time[end - 1]), int(end - first), worst))
    return out
