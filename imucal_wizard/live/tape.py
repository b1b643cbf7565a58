"""Recordings that can be played: samples of a file, or the bytes of a session."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from imucal_wizard.errors import RecordingError
from imucal_wizard.live.engine import Engine
from imucal_wizard.readings import Readings, Series


class Tape(Protocol):
    """Something recorded that goes through an engine piece by piece."""

    @property
    def duration(self) -> float:
        """Length, s."""

    def rewind(self) -> None:
        """Begin again."""

    def play(self, engine: Engine, until: float) -> bool:
        """Feed what was recorded before ``until`` seconds; whether more is left."""


class ReadingsTape:
    """The samples of a recording.

    The gyroscope is brought to the accelerometer's times where it has its own: the procedure looks
    at both together.

    Raises:
        RecordingError: it holds no two samples.
    """

    def __init__(self, readings: Readings) -> None:
        self._readings = _together(readings)
        self._rate = readings.accelerometer.rate
        if self._rate <= 0.0:
            raise RecordingError("it holds too few samples to be played; record again")
        self._next = 0

    @property
    def duration(self) -> float:
        """Length, s."""
        time = self._readings.accelerometer.time
        return float(time[-1] - time[0])

    def rewind(self) -> None:
        """Begin again."""
        self._next = 0

    def play(self, engine: Engine, until: float) -> bool:
        """Feed the samples before ``until`` seconds from the beginning; whether more are left."""
        time = self._readings.accelerometer.time
        past = int(np.searchsorted(time, time[0] + until))
        if past > self._next:
            engine.receive_readings(self._part(self._next, past), self._rate)
            self._next = past
        return past < len(time)

    def _part(self, first: int, past: int) -> Readings:
        own = self._readings
        a, g, t = own.accelerometer, own.gyroscope, own.temperature
        begin = a.time[first] if first else -np.inf
        end = a.time[past] if past < len(a) else np.inf
        return Readings(
            Series(a.time[first:past], a.values[first:past], a.unit),
            None if g is None else Series(g.time[first:past], g.values[first:past], g.unit),
            None,
            None if t is None else t.between(begin, end),
            own.warnings,
        )


class BytesTape:
    """The bytes of a session with their arrival times."""

    def __init__(self, pieces: Sequence[tuple[float, bytes]]) -> None:
        self._pieces = pieces
        self._next = 0

    @property
    def duration(self) -> float:
        """Length, s."""
        return self._pieces[-1][0] - self._pieces[0][0] if self._pieces else 0.0

    def rewind(self) -> None:
        """Begin again."""
        self._next = 0

    def play(self, engine: Engine, until: float) -> bool:
        """Feed the pieces that came before ``until`` seconds; whether more are left."""
        while self._next < len(self._pieces):
            arrival, data = self._pieces[self._next]
            if arrival - self._pieces[0][0] >= until:
                return True
            engine.receive(data, arrival)
            self._next += 1
        return False


def _together(readings: Readings) -> Readings:
    """The gyroscope at the accelerometer's times, where it has its own."""
    own, gyroscope = readings.accelerometer, readings.gyroscope
    if gyroscope is None or np.array_equal(own.time, gyroscope.time):
        return readings
    columns = [np.interp(own.time, gyroscope.time, column) for column in gyroscope.values.T]
    says = "the gyroscope's samples were brought to the accelerometer's times for the wizard"
    return Readings(
        own,
        Series(own.time, np.column_stack(columns), gyroscope.unit),
        readings.magnetometer,
        readings.temperature,
        (*readings.warnings, says),
    )
