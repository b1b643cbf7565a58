"""The newest seconds of all channels, thinned out for drawing, in arrays of fixed size."""

import math

import numpy as np

from imucal_wizard.procedure.upright import guessed_offset
from imucal_wizard.readings import FloatArray, Readings

SECONDS = 10.0
"""What the traces span."""
_POINTS = 500
"""About how many points a trace has: more than the widest terminal can show."""
_CHANNELS = 6


class Ring:
    """The newest rows of a table.

    Args:
        rows: how many are kept.
        columns: how wide the table is.
    """

    def __init__(self, rows: int, columns: int) -> None:
        self._rows = np.zeros((rows, columns))
        self._next = 0
        self._count = 0

    def add(self, rows: FloatArray) -> None:
        """Take new rows, shape (n, columns)."""
        size = len(self._rows)
        rows = rows[-size:]
        first = min(len(rows), size - self._next)
        self._rows[self._next : self._next + first] = rows[:first]
        self._rows[: len(rows) - first] = rows[first:]
        self._next = (self._next + len(rows)) % size
        self._count = min(self._count + len(rows), size)

    def newest(self) -> FloatArray:
        """A copy of what is kept, oldest first."""
        if self._count < len(self._rows):
            return self._rows[: self._count].copy()
        return np.concatenate([self._rows[self._next :], self._rows[: self._next]])


class Traces:
    """What the preview and the traces on the screen show.

    Args:
        rate: samples per second.
        counts: the accelerometer's readings are raw counts, which may have an offset.
    """

    def __init__(self, rate: float, *, counts: bool = False) -> None:
        self._counts = counts
        self._step = max(1, math.floor(rate * SECONDS / _POINTS))
        self._thin = Ring(max(2, math.ceil(rate * SECONDS / self._step)), _CHANNELS)
        self._second = Ring(max(1, round(rate)), 3)
        self._index = 0
        self.accelerometer: tuple[float, float, float] | None = None
        self.gyroscope: tuple[float, float, float] | None = None
        self.magnetometer: tuple[float, float, float] | None = None
        self.temperature: float | None = None

    def feed(self, readings: Readings) -> None:
        """Take new samples; every so many of them, counted from the first, is drawn."""
        count = len(readings)
        if not count:
            return
        a = readings.accelerometer.values
        g = readings.gyroscope.values if readings.gyroscope is not None else None
        first = -self._index % self._step
        self._index += count
        self._second.add(a)
        drawn = a[first :: self._step]
        rates = np.full_like(drawn, np.nan) if g is None else g[first :: self._step]
        self._thin.add(np.hstack([drawn, rates]))
        self.accelerometer = _three(a[-1])
        self.gyroscope = None if g is None else _three(g[-1])
        field = readings.magnetometer
        if field is not None and len(field):  # slower than the others, it may not be in every piece
            self.magnetometer = _three(field.values[-1])
        if readings.temperature is not None and len(readings.temperature):
            self.temperature = float(readings.temperature.values[-1, 0])

    def drawn(self) -> FloatArray:
        """The newest seconds of all six channels, shape (n, 6); NaN where there is no gyroscope."""
        return self._thin.newest()

    @property
    def gravity(self) -> float | None:
        """Magnitude of the newest second's mean acceleration; None before the first sample.

        Counts that are centred at half the converter's range count from there.
        """
        if self.accelerometer is None:
            return None
        mean = self._second.newest().mean(axis=0)
        return float(np.linalg.norm(mean - (guessed_offset(mean) if self._counts else 0.0)))


def _three(row: FloatArray) -> tuple[float, float, float]:
    return float(row[0]), float(row[1]), float(row[2])
