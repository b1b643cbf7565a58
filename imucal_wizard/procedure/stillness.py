"""Is the device still? One rule on windows of half a second, for streams and for files alike.

A window is still when the standard deviation of every accelerometer and gyroscope axis over it, and
the distance of the gyroscope's mean from its resting value, are within their limits. The standard
deviation is of all samples in the window (within blocks and between them), so a slow turn counts as
well as a tremor.
"""

from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.procedure.blocks import Blocks, join_blocks
from imucal_wizard.readings import BoolArray, FloatArray

WINDOW_BLOCKS = 5


@dataclass(frozen=True, eq=False)
class Limits:
    """The largest motion that still counts as rest, in the reading's units.

    Attributes:
        accelerometer: standard deviation per axis, shape (3,).
        gyroscope: the same for the gyroscope, or None without one.
        gyroscope_mean: the gyroscope's reading at rest, shape (3,), or None when not known.
        rate: largest distance of a window's mean from ``gyroscope_mean``, shape (3,), or None.
    """

    accelerometer: FloatArray
    gyroscope: FloatArray | None = None
    gyroscope_mean: FloatArray | None = None
    rate: FloatArray | None = None

    def scaled(self, factor: float) -> "Limits":
        """The same limits, wider by a factor."""

        def wider(limit: FloatArray | None) -> FloatArray | None:
            return None if limit is None else limit * factor

        return replace(
            self,
            accelerometer=self.accelerometer * factor,
            gyroscope=wider(self.gyroscope),
            rate=wider(self.rate),
        )

    def capped(self, end: "Limits") -> "Limits":
        """The same limits, but nowhere looser than others."""

        def lower(limit: FloatArray | None, most: FloatArray | None) -> FloatArray | None:
            return limit if limit is None or most is None else np.minimum(limit, most)

        return replace(
            self,
            accelerometer=np.minimum(self.accelerometer, end.accelerometer),
            gyroscope=lower(self.gyroscope, end.gyroscope),
            rate=lower(self.rate, end.rate),
        )

    def equals(self, other: "Limits") -> bool:
        """Whether the largest standard deviations are the same."""
        rates = self.gyroscope, other.gyroscope
        return bool(
            np.array_equal(self.accelerometer, other.accelerometer)
            and (rates[0] is rates[1] is None or np.array_equal(*rates))  # type: ignore[arg-type] # None only together
        )


@dataclass(frozen=True, eq=False)
class Windows:
    """What the half second that ends with each block shows, m blocks.

    Attributes:
        std_a: standard deviation of the accelerometer, shape (m, 3); NaN until the window is full.
        std_g: standard deviation of the gyroscope, shape (m, 3), or None.
        mean_g: mean of the gyroscope, shape (m, 3), or None.
        full: the window is full and has no gap, shape (m,).
    """

    std_a: FloatArray
    std_g: FloatArray | None
    mean_g: FloatArray | None
    full: BoolArray

    def __len__(self) -> int:
        return len(self.full)

    def still(self, limits: Limits) -> BoolArray:
        """Which windows are still under these limits, shape (m,)."""
        still = self.full & (self.std_a <= limits.accelerometer).all(axis=1)
        if self.std_g is not None and limits.gyroscope is not None:
            still &= (self.std_g <= limits.gyroscope).all(axis=1)
        rest = limits.gyroscope_mean
        if self.mean_g is not None and limits.rate is not None and rest is not None:
            still &= (np.abs(self.mean_g - rest) <= limits.rate).all(axis=1)
        return still


class WindowMaker:
    """Slides the window over the blocks of a stream, however they are cut."""

    def __init__(self, blocks: int = WINDOW_BLOCKS) -> None:
        self._length = blocks
        self._tail: Blocks | None = None

    def feed(self, blocks: Blocks) -> Windows:
        """One window for each of these blocks, the one that ends with it."""
        known = 0 if self._tail is None else len(self._tail)
        both = blocks if self._tail is None else join_blocks([self._tail, blocks])
        windows = self._windows(both)
        self._tail = both.select(slice(max(len(both) - self._length + 1, 0), len(both)))
        return _from(windows, known)

    def _windows(self, blocks: Blocks) -> Windows:
        count, length = len(blocks), self._length
        full = np.zeros(count, bool)
        if count >= length:
            gaps = np.lib.stride_tricks.sliding_window_view(blocks.gap, length)
            full[length - 1 :] = ~gaps.any(axis=1)
        std_a, _ = _spread(blocks.mean_a, blocks.var_a, length)
        std_g = mean_g = None
        if blocks.mean_g is not None and blocks.var_g is not None:
            std_g, mean_g = _spread(blocks.mean_g, blocks.var_g, length)
        return Windows(std_a, std_g, mean_g, full)


def _spread(means: FloatArray, variances: FloatArray, length: int) -> tuple[FloatArray, FloatArray]:
    """Standard deviation and mean over the ``length`` blocks that end with each block."""
    count = len(means)
    std = np.full_like(means, np.nan)
    mean = np.full_like(means, np.nan)
    windows = count - length + 1
    if windows > 0:
        pieces = [means[lag : lag + windows] for lag in range(length)]
        centre = np.zeros_like(pieces[0])
        for piece in pieces:
            centre = centre + (piece - pieces[0])
        centre = pieces[0] + centre / length
        variance = np.zeros_like(centre)
        for lag, piece in enumerate(pieces):
            variance += variances[lag : lag + windows] + (piece - centre) ** 2
        std[length - 1 :] = np.sqrt(variance / length)
        mean[length - 1 :] = centre
    return std, mean


def _from(windows: Windows, first: int) -> Windows:
    return Windows(
        windows.std_a[first:],
        None if windows.std_g is None else windows.std_g[first:],
        None if windows.mean_g is None else windows.mean_g[first:],
        windows.full[first:],
    )


@dataclass(frozen=True, eq=False)
class Noise:
    """What a device at rest shows: the floor from which limits are set.

    Attributes:
        std_a: typical standard deviation over a window per axis, shape (3,), reading units.
        std_g: the same for the gyroscope, or None.
        mean_g: the gyroscope's reading at rest, shape (3,), or None.
    """

    std_a: FloatArray
    std_g: FloatArray | None
    mean_g: FloatArray | None

    def limits(self, factor: float) -> Limits:
        """Limits at ``factor`` standard deviations of the noise.

        An axis whose noise is below its resolution shows none at all; it takes the limit of the
        noisiest axis of its sensor, since a limit of zero could never be met.
        """
        gyroscope = None if self.std_g is None else factor * _floored(self.std_g)
        return Limits(factor * _floored(self.std_a), gyroscope, self.mean_g, gyroscope)


def _floored(std: FloatArray) -> FloatArray:
    """Noise per axis, with axes far below the noisiest one raised to a third of it."""
    return np.maximum(std, np.max(std) / 3.0)


def measure_noise(windows: Windows) -> Noise | None:
    """The noise of windows that are all at rest: the median of each axis; None without any."""
    if not windows.full.any():
        return None
    rows = windows.full
    std_g, mean_g = windows.std_g, windows.mean_g
    return Noise(
        np.median(windows.std_a[rows], axis=0),
        None if std_g is None else np.median(std_g[rows], axis=0),
        None if mean_g is None else np.median(mean_g[rows], axis=0),
    )
