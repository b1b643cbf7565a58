"""Stillness: one rule on windows of half a second, for streams and files.

A window is still if the standard deviation of every accelerometer and gyroscope axis over it, and
the deviation of the gyroscope's mean from its resting value, are within their limits. The standard
deviation covers all samples in the window (within and between blocks), so a slow rotation counts as
well as a tremor.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.limits.stillness import WINDOW_BLOCKS
from imucal_wizard.core.readings import BoolArray, FloatArray, Readings, Series, join_series
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median_of_rows, true_on_all_axes
from imucal_wizard.measurement.blocks import BlockCutter, Blocks, join_blocks


@dataclass(frozen=True, eq=False)
class Limits:
    """The largest motion that counts as rest, in the reading's units.

    Attributes:
        accelerometer: standard deviation per axis, shape (3,).
        gyroscope: the same for the gyroscope, or None without one.
        gyroscope_mean: the gyroscope's reading at rest, shape (3,), or in each of m windows, shape
            (m, 3); None if unknown.
        rate: largest deviation of a window's mean from ``gyroscope_mean``, shape (3,), or None.
    """

    accelerometer: FloatArray
    gyroscope: FloatArray | None = None
    gyroscope_mean: FloatArray | None = None
    rate: FloatArray | None = None

    def scaled(self, factor: float) -> "Limits":
        """The limits scaled by a factor."""

        def wider(limit: FloatArray | None) -> FloatArray | None:
            return None if limit is None else limit * factor

        return replace(
            self,
            accelerometer=self.accelerometer * factor,
            gyroscope=wider(self.gyroscope),
            rate=wider(self.rate),
        )

    def capped(self, end: "Limits") -> "Limits":
        """The limits, nowhere looser than others."""

        def lower(limit: FloatArray | None, most: FloatArray | None) -> FloatArray | None:
            return limit if limit is None or most is None else np.minimum(limit, most)

        return replace(
            self,
            accelerometer=np.minimum(self.accelerometer, end.accelerometer),
            gyroscope=lower(self.gyroscope, end.gyroscope),
            rate=lower(self.rate, end.rate),
        )

    def equals(self, other: "Limits") -> bool:
        """Whether the limits of the standard deviations are equal."""
        rates = self.gyroscope, other.gyroscope
        return bool(
            np.array_equal(self.accelerometer, other.accelerometer)
            and (rates[0] is rates[1] is None or np.array_equal(*rates))  # type: ignore[arg-type] # None only together
        )


@dataclass(frozen=True, eq=False)
class Windows:
    """Statistics of the half second that ends with each of m blocks.

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

    def select(self, rows: slice) -> "Windows":
        """A slice of the windows."""
        return Windows(
            self.std_a[rows],
            None if self.std_g is None else self.std_g[rows],
            None if self.mean_g is None else self.mean_g[rows],
            self.full[rows],
        )

    def turning(self, rest: FloatArray | None, most: float) -> BoolArray:
        """Which windows turn in the mean, however calmly, shape (m,).

        Args:
            rest: the gyroscope's reading at rest, shape (3,) or (m, 3); None if not known.
            most: deviation from it that is no turn, in its unit; 0 if not known.
        """
        if self.mean_g is None or rest is None or not most > 0.0:
            return np.zeros(len(self), bool)
        return np.asarray((np.abs(self.mean_g - rest) > most).any(axis=1))

    def still(self, limits: Limits) -> BoolArray:
        """Which windows are still under these limits, shape (m,)."""
        still = self.full & true_on_all_axes(self.std_a <= limits.accelerometer)
        # where samples of the gyroscope are missing (NaN), the accelerometer alone decides
        if self.std_g is not None and limits.gyroscope is not None:
            still &= true_on_all_axes(~(self.std_g > limits.gyroscope))
        rest = limits.gyroscope_mean
        if self.mean_g is not None and limits.rate is not None and rest is not None:
            still &= true_on_all_axes(~(np.abs(self.mean_g - rest) > limits.rate))
        return still


def join_windows(parts: Sequence[Windows]) -> Windows:
    """Join consecutive pieces of one stream of windows."""

    def joined(pieces: list[FloatArray | None]) -> FloatArray | None:
        known = [piece for piece in pieces if piece is not None]
        return np.concatenate(known) if known else None

    return Windows(
        np.concatenate([part.std_a for part in parts]),
        joined([part.std_g for part in parts]),
        joined([part.mean_g for part in parts]),
        np.concatenate([part.full for part in parts]),
    )


class WindowMaker:
    """Slides the window over the blocks of a stream; the pieces make no difference."""

    def __init__(self) -> None:
        self._tail: Blocks | None = None

    def feed(self, blocks: Blocks) -> Windows:
        """The window that ends with each of these blocks."""
        known = 0 if self._tail is None else len(self._tail)
        both = blocks if self._tail is None else join_blocks([self._tail, blocks])
        windows = self._windows(both)
        self._tail = both.select(slice(max(len(both) - WINDOW_BLOCKS + 1, 0), len(both)))
        return windows.select(slice(known, len(windows)))

    def _windows(self, blocks: Blocks) -> Windows:
        count, length = len(blocks), WINDOW_BLOCKS
        full = np.zeros(count, bool)
        if count >= length:
            gaps = np.cumsum(np.append(False, blocks.gap))
            full[length - 1 :] = gaps[length:] == gaps[:-length]
        std, mean = _spread(blocks.mean, blocks.variance, length)
        if not blocks.turning:
            return Windows(std, None, None, full)
        return Windows(std[:, :3], std[:, 3:], mean[:, 3:], full)


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


@dataclass(frozen=True, eq=False)
class Noise:
    """The noise of a device at rest, from which limits are derived.

    Attributes:
        std_a: typical standard deviation over a window, per axis, shape (3,), reading units.
        std_g: the same for the gyroscope, or None.
        mean_g: the gyroscope's reading at rest, shape (3,), or None.
    """

    std_a: FloatArray
    std_g: FloatArray | None
    mean_g: FloatArray | None

    def limits(self, factor: float) -> Limits:
        """Limits at ``factor`` standard deviations of the noise.

        An axis whose noise is below its resolution shows none; it takes a third of the noisiest
        axis of its sensor, because a limit of zero could never be met.
        """
        gyroscope = None if self.std_g is None else factor * _floored(self.std_g)
        return Limits(factor * _floored(self.std_a), gyroscope, self.mean_g, gyroscope)


def _floored(std: FloatArray) -> FloatArray:
    """Noise per axis; axes far below the noisiest one are raised to a third of it."""
    return np.maximum(std, np.max(std) / 3.0)


def measure_noise(windows: Windows) -> Noise | None:
    """The noise of windows at rest: the median of each axis; None without windows."""
    if not windows.full.any():
        return None
    rows = windows.full
    std_g, mean_g = windows.std_g, windows.mean_g
    return Noise(
        median_of_rows(windows.std_a[rows]),
        None if std_g is None else median_of_rows(std_g[rows]),
        None if mean_g is None else median_of_rows(mean_g[rows]),
    )


@dataclass(frozen=True, eq=False)
class Block:
    """One block of the stream, its samples and the half second that ends with it.

    Attributes:
        summary: its statistics (``len(summary) == 1``).
        window: the window that ends with it (``len(window) == 1``).
        time: sample times, s, shape (n,).
        acceleration: accelerometer readings, shape (n, 3).
        rate: gyroscope readings, shape (n, 3), or None without a gyroscope.
        seconds: nominal length of the block, s.
        field: the magnetometer's samples since the previous block, with their own times; None
            before the first one.
    """

    summary: Blocks
    window: Windows
    time: FloatArray
    acceleration: FloatArray
    rate: FloatArray | None
    seconds: float
    field: Series | None = None

    @property
    def end(self) -> float:
        """Time at which the block ends, s."""
        return float(self.summary.end[0])

    @property
    def full(self) -> bool:
        """Whether the window is full, without a gap."""
        return bool(self.window.full[0])

    @property
    def mean_a(self) -> FloatArray:
        """Mean accelerometer reading of the block, shape (3,)."""
        return np.asarray(self.summary.mean_a[0], float)


class BlockStream:
    """Cuts a stream into blocks with their samples; the pieces make no difference."""

    def __init__(self, rate: float) -> None:
        self._cutter = BlockCutter(rate)
        self._windows = WindowMaker()
        self._seconds = self._cutter.size / rate
        self._rest: list[FloatArray] = []
        self._field: Series | None = None

    def feed(self, readings: Readings) -> list[Block]:
        """The blocks that these readings complete."""
        if not len(readings):
            return []
        columns = self._columns(readings)
        self._field = join_series([self._field, readings.magnetometer])
        blocks = self._cutter.feed(readings)
        size, count = self._cutter.size, len(blocks)
        self._rest = [column[count * size :] for column in columns]
        if not count:
            return []
        windows = self._windows.feed(blocks)
        return [self._block(blocks, windows, columns, index, size) for index in range(count)]

    def _columns(self, readings: Readings) -> list[FloatArray]:
        new = [readings.accelerometer.time, readings.accelerometer.values]
        if readings.gyroscope is not None:
            new.append(readings.gyroscope.values)
        if not self._rest:
            return new
        return [np.concatenate(pair) for pair in zip(self._rest, new, strict=True)]

    def _block(
        self, blocks: Blocks, windows: Windows, columns: list[FloatArray], index: int, size: int
    ) -> Block:
        row = slice(index, index + 1)
        pieces = [column[index * size : (index + 1) * size].copy() for column in columns]
        rate = pieces[2] if len(pieces) > 2 else None
        field = self._field_until(float(pieces[0][-1]))
        return Block(
            blocks.select(row),
            windows.select(row),
            pieces[0],
            pieces[1],
            rate,
            self._seconds,
            field,
        )

    def _field_until(self, last: float) -> Series | None:
        """The magnetometer's samples up to a block's last sample; later ones wait."""
        series = self._field
        if series is None:
            return None
        count = int(np.searchsorted(series.time, last, side="right"))
        self._field = series.part(count, len(series))
        return series.part(0, count)
