"""Readings: the samples of a recording or of a part of a stream, in SI units or counts."""

from collections.abc import Sequence
from dataclasses import field
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.limits.data_quality import (
    MIN_DATE_SECONDS,
    RESTART_GAP_SECONDS,
    RESTART_GAP_TOLERANCE,
)
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
A = TypeVar("A", FloatArray, IntArray)

MAX_SAMPLE_INTERVALS = 2.5
"""An interval of this many sample intervals or more means that samples are missing."""
MAX_READING = 1e30
"""Larger numbers are neither readings, in any unit, nor times (nanoseconds since 1970 have 19
digits); their higher powers would overflow."""


EVEN_STEP = 0.01
"""Usual intervals by which one may differ from the usual one and counts as the same."""
REGULAR_SHARE = 0.99
"""Of the intervals, from which on the others are faults of the clock."""
LONG_STEP = 1.6
"""Usual intervals from which on a sample is missing, or its time is coarser than the sampling."""
MIN_EVENLY_LONG = 0.9
"""Of the intervals of one tick more, those that follow one another at even distances, from which on
the time is coarser than the sampling: samples are missing at uneven ones."""


def across_restarts(steps: FloatArray) -> BoolArray:
    """Which steps of time, s, stand for an interruption of unknown length, shape (n,)."""
    return np.isclose(steps, RESTART_GAP_SECONDS, rtol=0.0, atol=RESTART_GAP_TOLERANCE)


def origin_of_times(first: float) -> float:
    """From where on the times of a recording are told, s: its start, if its clock counts a date.

    Args:
        first: time of the first sample by the clock, s.
    """
    return first if first >= MIN_DATE_SECONDS else 0.0


def distinct(values: A) -> A:
    """The different numbers in an array, from the smallest on.

    ``np.unique`` gives the same, but imports NumPy's masked arrays, at the cost of reading a file.
    """
    ordered = np.sort(values, axis=None)
    new = np.ones(len(ordered), bool)
    np.less(ordered[:-1], ordered[1:], out=new[1:])
    new[1:] |= ~np.isnan(ordered[:-1]) & np.isnan(ordered[1:])  # of several NaN, the first
    return ordered[new]


@dataclass(frozen=True, eq=False)
class Series:
    """The samples of one sensor with their own times.

    Attributes:
        time: sample times, s, shape (n,), never decreasing.
        values: readings ``y``, shape (n, 3); (n, 1) for temperature and current.
        unit: ``m/s^2``, ``rad/s``, ``uT``, ``degC``, ``A``, ``%`` or ``count``.
    """

    time: FloatArray
    values: FloatArray
    unit: str

    def __len__(self) -> int:
        return len(self.time)

    def between(self, start: float, end: float) -> "Series":
        """The samples with ``start <= time < end``."""
        first, last = np.searchsorted(self.time, (start, end))
        return Series(self.time[first:last], self.values[first:last], self.unit)

    def part(self, first: int, past: int) -> "Series":
        """The samples with indices from ``first`` to before ``past``."""
        return Series(self.time[first:past], self.values[first:past], self.unit)

    @cached_property
    def rate(self) -> float:
        """Samples per second while none are missing; 0 when fewer than two samples.

        Of times in whole ticks, as of a millisecond, the median interval is one of several.
        """
        if len(self.time) < 2:
            return 0.0
        steps = np.diff(self.time)
        usual = median(steps)
        if not usual > 0.0:
            return 0.0
        ordinary = steps < LONG_STEP * usual
        twice = ~ordinary & (steps < 2.0 * LONG_STEP * usual)
        apart = np.diff(np.flatnonzero(twice))
        if len(apart) and np.mean(np.abs(apart - median(apart)) <= 1.0) > MIN_EVENLY_LONG:
            ordinary |= twice
        elif np.mean(np.abs(steps - usual) < EVEN_STEP * usual) > REGULAR_SHARE:
            return 1.0 / usual
        return float(ordinary.sum() / steps[ordinary].sum())


@dataclass(frozen=True, eq=False)
class Readings:
    """The samples of all sensors in a recording or a part of a stream.

    Attributes:
        accelerometer: readings of specific force.
        gyroscope: readings of angular rate, or None when there is no gyroscope.
        magnetometer: readings of flux density, or None.
        temperature: degrees Celsius, or None.
        warnings: messages to the user about the data.
        current: current of the board's motors, A, or their throttle, %; or None.
    """

    accelerometer: Series
    gyroscope: Series | None = None
    magnetometer: Series | None = None
    temperature: Series | None = None
    warnings: tuple[str, ...] = field(default=())
    current: Series | None = None

    def __len__(self) -> int:
        return len(self.accelerometer)

    def inertial_part(self, first: int, past: int) -> "Readings":
        """Accelerometer and gyroscope samples with indices from ``first`` to before ``past``."""
        gyroscope = self.gyroscope
        return Readings(
            self.accelerometer.part(first, past),
            None if gyroscope is None else gyroscope.part(first, past),
        )


def join_series(parts: Sequence[Series | None], time: FloatArray | None = None) -> Series | None:
    """Consecutive pieces of one sensor's samples as one series; None if no piece has samples.

    Args:
        parts: the pieces.
        time: the sample times of all pieces, where they are joined already.
    """
    series = [part for part in parts if part is not None]
    if len(series) < 2:
        return series[0] if series else None
    return Series(
        np.concatenate([part.time for part in series]) if time is None else time,
        np.concatenate([part.values for part in series]),
        series[0].unit,
    )


def join_readings(parts: "list[Readings]") -> Readings:
    """Consecutive pieces of one stream as one recording."""
    accelerometer = join_series([part.accelerometer for part in parts]) or parts[0].accelerometer
    together = all(
        part.gyroscope is not None and part.gyroscope.time is part.accelerometer.time
        for part in parts
    )
    return Readings(
        accelerometer,
        join_series([part.gyroscope for part in parts], accelerometer.time if together else None),
        join_series([part.magnetometer for part in parts]),
        join_series([part.temperature for part in parts]),
        tuple(dict.fromkeys(text for part in parts for text in part.warnings)),
        join_series([part.current for part in parts]),
    )
