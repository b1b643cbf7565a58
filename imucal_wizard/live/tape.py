"""A recording that can be played; a session is read like any recording first."""

from dataclasses import replace
from typing import Protocol

import numpy as np

from imucal_wizard.errors import RecordingError
from imucal_wizard.live.engine import Engine
from imucal_wizard.procedure.alignment import aligned
from imucal_wizard.readings import Readings


class Tape(Protocol):
    """Something recorded that goes through an engine piece by piece."""

    def rewind(self) -> None:
        """Begin again."""

    def begin(self, engine: Engine) -> float | None:
        """Go to where the procedure was started; None where that is for the player to do.

        Returns:
            The seconds from which it goes on.
        """

    def close(self) -> None:
        """Let go of what is read."""

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

    def rewind(self) -> None:
        """Begin again."""
        self._next = 0

    def begin(self, engine: Engine) -> float | None:  # noqa: ARG002 -- other tapes feed it
        """Nobody has started anything in a recording."""
        return None

    def close(self) -> None:
        """Its samples are in memory."""

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
        a, g, m, t = own.accelerometer, own.gyroscope, own.magnetometer, own.temperature
        begin = a.time[first] if first else -np.inf
        end = a.time[past] if past < len(a) else np.inf
        return Readings(
            a.part(first, past),
            None if g is None else g.part(first, past),
            None if m is None else m.between(begin, end),
            None if t is None else t.between(begin, end),
            own.warnings,
        )


def _together(readings: Readings) -> Readings:
    """Both sensors at the same times, and a word where that took something."""
    together = aligned(readings)
    if together is readings:
        return readings
    says = "the gyroscope's samples were brought to the accelerometer's times for the wizard"
    return replace(together, warnings=(*readings.warnings, says))
