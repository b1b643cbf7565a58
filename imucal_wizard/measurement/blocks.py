"""Blocks of a tenth of a second, on which stillness and holds are decided.

The sums of a block are formed in an order that depends only on its size, so the same samples give
the same bits whether they arrive one at a time or all at once.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.limits.stillness import (
    BLOCK_SECONDS,
    MIN_BLOCK_SAMPLES,
    MIN_USUAL_RATE,
    TIME_TOLERANCE,
    USUAL_REST_SECONDS,
    WINDOW_BLOCKS,
)
from imucal_wizard.core.readings import (
    MAX_SAMPLE_INTERVALS,
    BoolArray,
    FloatArray,
    Readings,
    Series,
    join_readings,
    join_series,
)
from imucal_wizard.core.records import dataclass

_SAMPLES_AT_ONCE = 8192
"""Samples summed at once, so that they stay in the processor's cache."""


def block_size(rate: float) -> int:
    """Samples in each block at so many samples per second."""
    return max(MIN_BLOCK_SAMPLES, round(rate * BLOCK_SECONDS))


def shortest_rest(rate: float) -> float:
    """Seconds in one position in which a hold is found, at so many samples per second.

    A window and a block in which the device comes to rest: more than the usual two seconds where
    blocks are long.
    """
    return max(USUAL_REST_SECONDS, (WINDOW_BLOCKS + 1) * block_size(rate) / rate)


def rest_in_words(rate: float) -> str:
    """``shortest_rest`` for the user.

    Args:
        rate: samples per second; 0 where it is not known.
    """
    if rate >= MIN_USUAL_RATE or rate <= 0.0:
        return "two seconds"
    seconds = math.ceil(shortest_rest(rate) - TIME_TOLERANCE)
    return f"{seconds} s (at {rate:.3g} samples/s two seconds are too few samples)"


@dataclass(frozen=True, eq=False)
class Blocks:
    """m consecutive blocks of a stream.

    Attributes:
        start: time of the first sample of each block, s, shape (m,).
        end: time one interval after the last sample, s, shape (m,).
        mean: mean reading of the accelerometer and, if any, the gyroscope, shape (m, 3) or (m, 6);
            NaN where samples of the gyroscope are missing.
        variance: variance about that mean, of the same shape.
        moment: mean of the reading times its place in the block, −½ to ½, of the same shape: with
            it slow waves are told from fast ones that have the same means.
        temperature: mean temperature, °C, NaN where unknown, shape (m,).
        gap: for as long as a block samples are missing in it, or between it and the previous one,
            shape (m,).
        size: samples in each block.
    """

    start: FloatArray
    end: FloatArray
    mean: FloatArray
    variance: FloatArray
    moment: FloatArray
    temperature: FloatArray
    gap: BoolArray
    size: int

    def __len__(self) -> int:
        return len(self.start)

    @property
    def mean_a(self) -> FloatArray:
        """Mean accelerometer reading, shape (m, 3)."""
        return self.mean[:, :3]

    @property
    def turning(self) -> bool:
        """Whether there is a gyroscope."""
        return int(self.mean.shape[1]) > 3

    def select(self, rows: slice) -> "Blocks":
        """A slice of the blocks."""
        return Blocks(
            start=self.start[rows],
            end=self.end[rows],
            mean=self.mean[rows],
            variance=self.variance[rows],
            moment=self.moment[rows],
            temperature=self.temperature[rows],
            gap=self.gap[rows],
            size=self.size,
        )


def join_blocks(parts: Sequence[Blocks]) -> Blocks:
    """Join consecutive pieces of one stream of blocks."""

    def joined(name: str) -> FloatArray:
        return np.concatenate([getattr(part, name) for part in parts])

    return Blocks(
        start=joined("start"),
        end=joined("end"),
        mean=joined("mean"),
        variance=joined("variance"),
        moment=joined("moment"),
        temperature=joined("temperature"),
        gap=np.concatenate([part.gap for part in parts]),
        size=parts[0].size,
    )


def block_moments(pieces: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean, variance and moment of each piece.

    Each piece is re-centred on its first sample; a plain sum of squares would lose the variance of
    raw counts around 32768.

    Args:
        pieces: shape (m, size, channels).

    Returns:
        Means, variances and moments (see ``Blocks``), each of shape (m, channels).
    """
    count, size, _ = pieces.shape
    step = max(1, _SAMPLES_AT_ONCE // size)
    parts = [_moments(pieces[i : i + step]) for i in range(0, max(count, 1), step)]
    if len(parts) == 1:
        return parts[0]
    mean, variance, moment = (np.concatenate(each) for each in zip(*parts, strict=True))
    return mean, variance, moment


def _moments(pieces: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The same for a number of pieces that stays in the processor's cache.

    Every channel of a piece is copied into a row of its own, so that its sum is formed in an order
    that depends only on ``size``.
    """
    offset = np.array(pieces.swapaxes(1, 2), order="C")
    origin = offset[:, :, 0].copy()
    offset -= origin[:, :, None]
    mean = offset.mean(axis=2)
    size = offset.shape[2]
    moment = (offset * ((np.arange(size) - 0.5 * (size - 1)) / size)).mean(axis=2)
    offset *= offset
    return origin + mean, np.maximum(offset.mean(axis=2) - mean * mean, 0.0), moment


class BlockCutter:
    """Cuts a stream into blocks and keeps the samples of an unfinished one.

    Args:
        rate: samples per second.

    Attributes:
        size: samples in each block.
    """

    def __init__(self, rate: float) -> None:
        self.size = block_size(rate)
        self._interval = 1.0 / rate
        self._rest: Readings | None = None
        self._last_time: float | None = None
        self._temperatures: Series | None = None

    def feed(self, readings: Readings) -> Blocks:
        """The blocks that these readings complete.

        The gyroscope, if any, must have the accelerometer's sample times.
        """
        whole = readings if self._rest is None else join_readings([self._rest, readings])
        self._keep_temperatures(readings.temperature)
        count = len(whole) // self.size
        used = count * self.size
        self._rest = whole.inertial_part(used, len(whole)) if used < len(whole) else None
        blocks = self._blocks(whole, count)
        if count:
            self._last_time = float(whole.accelerometer.time[used - 1])
        return blocks

    def _blocks(self, whole: Readings, count: int) -> Blocks:
        used = count * self.size
        time = whole.accelerometer.time[:used].reshape(count, self.size)
        moments = block_moments(_pieces(whole.accelerometer, count, self.size))
        if whole.gyroscope is not None:
            of_gyroscope = block_moments(_pieces(whole.gyroscope, count, self.size))
            both = (np.hstack(pair) for pair in zip(moments, of_gyroscope, strict=True))
            mean, variance, moment = both
        else:
            mean, variance, moment = moments
        return Blocks(
            start=time[:, 0].copy(),
            end=time[:, -1] + self._interval,
            mean=mean,
            variance=variance,
            moment=moment,
            temperature=self._temperature(time),
            gap=self._gaps(time),
            size=self.size,
        )

    def _gaps(self, time: FloatArray) -> BoolArray:
        """Where a device may have moved unseen.

        In less than a block it does not leave its rest and come back. The samples that are left
        have the same mean, and their number is that of the block.
        """
        limit = self.size * self._interval
        steps = np.diff(time, axis=1)
        inside = ((steps > limit) | (steps < 0.0)).any(axis=1)
        if len(time):
            ends_before = np.empty(len(time))
            ends_before[0] = time[0, 0] if self._last_time is None else self._last_time
            ends_before[1:] = time[:-1, -1]
            between = time[:, 0] - ends_before
            inside |= (between > limit) | (between < 0.0)
        return np.asarray(inside, bool)

    def _keep_temperatures(self, new: Series | None) -> None:
        if new is not None and len(new):
            self._temperatures = join_series([self._temperatures, new])

    def _temperature(self, time: FloatArray) -> FloatArray:
        """The newest temperature at the end of each block; the value of a slow sensor is held."""
        series = self._temperatures
        if series is None or not len(time):
            return np.full(len(time), np.nan)
        newest = np.searchsorted(series.time, time[:, -1], side="right") - 1
        values = np.where(newest < 0, np.nan, series.values[np.maximum(newest, 0), 0])
        keep = max(int(newest[-1]), 0)
        self._temperatures = Series(series.time[keep:], series.values[keep:], series.unit)
        return values


def _pieces(series: Series, count: int, size: int) -> FloatArray:
    return series.values[: count * size].reshape(count, size, series.values.shape[1])


def resample_gyroscope(readings: Readings) -> Readings:
    """Interpolate the gyroscope to the accelerometer's times if it has its own; NaN in its gaps."""
    own, gyroscope = readings.accelerometer, readings.gyroscope
    if gyroscope is None or np.array_equal(own.time, gyroscope.time):
        return readings
    values = np.full((len(own), 3), np.nan)
    if len(gyroscope):
        columns = [np.interp(own.time, gyroscope.time, column) for column in gyroscope.values.T]
        values = np.column_stack(columns)
    values[_far_from(own.time, gyroscope)] = np.nan
    return replace(readings, gyroscope=Series(own.time, values, gyroscope.unit))


def _far_from(time: FloatArray, series: Series) -> BoolArray:
    """Which times lie in a gap of a series, before its first or after its last sample."""
    if len(series) < 2:
        return np.ones(len(time), bool)
    reach = MAX_SAMPLE_INTERVALS / series.rate
    later = np.searchsorted(series.time, time).clip(1, len(series) - 1)
    before, after = series.time[later - 1], series.time[later]
    gap = after - before > reach
    away = np.minimum(np.abs(time - before), np.abs(time - after))
    outside = (time < series.time[0]) | (time > series.time[-1])
    return np.asarray(np.where(outside, away > reach, gap & (away > 0.0)), bool)
