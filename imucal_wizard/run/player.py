"""The thread that plays a recording or session as if it came from a device, at any speed."""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Protocol

import numpy as np

from imucal_wizard.core.errors import RecordingError, UsageError
from imucal_wizard.core.readings import Readings
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.measurement.blocks import resample_gyroscope
from imucal_wizard.measurement.stillness import Noise
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.runner import Runner
from imucal_wizard.run.session_replay import Pieces, SessionReplay
from imucal_wizard.sessions import Command


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
        """Close the recording."""

    def play(self, engine: Engine, until: float) -> bool:
        """Feed the data before ``until`` seconds; whether more are left."""


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
        """A recording holds no start of the procedure."""
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
    """Both sensors at the same times, with a warning if the gyroscope was resampled."""
    together = resample_gyroscope(readings)
    if together is readings:
        return readings
    message = "the gyroscope's samples were brought to the accelerometer's times for the wizard"
    return replace(together, warnings=(*readings.warnings, message))


MAX_PAUSE_SECONDS = 2.0
"""Seconds without anything, as between the runs of a session, are played no longer than this."""


class SessionTape:
    """Plays a session with the commands in it; the engine comes to the state it was left in.

    Args:
        past: the session, open for reading; closed with the tape.
    """

    def __init__(self, past: SessionReplay) -> None:
        self._past = past
        self._begun = False
        self.rewind()

    def rewind(self) -> None:
        """Begin again."""
        self._steps: Iterator[Pieces | Command] = self._past.steps()
        self._next: Pieces | Command | None = next(self._steps, None)
        self._position = 0.0
        self._arrival: float | None = None

    def begin(self, engine: Engine) -> float | None:
        """Go at once to where the session was started.

        Returns:
            The seconds from which it goes on; None where it never was started.
        """
        while self._next is not None and engine.step is StepKind.SOURCE:
            self._happen(engine, self._next)
        self._begun = True
        return None if engine.step is StepKind.SOURCE else self._position

    def play(self, engine: Engine, until: float) -> bool:
        """Feed the data and commands before ``until`` seconds; whether more are left.

        As a preview it plays no further than to the first command.
        """
        while self._next is not None and self._due() <= until:
            self._begun |= engine.step is not StepKind.SOURCE
            if not self._begun and engine.samples > 0 and isinstance(self._next, Command):
                return True
            self._happen(engine, self._next)
        return self._next is not None

    def close(self) -> None:
        """Close the file."""
        self._steps = iter(())
        self._next = None
        self._past.session.close()

    def _due(self) -> float:
        """Time of the next data or command, s from the beginning, with long pauses shortened."""
        if self._next is None or isinstance(self._next, Command) or self._arrival is None:
            return self._position
        passed = self._next[-1][1] - self._arrival
        return self._position + min(max(passed, 0.0), MAX_PAUSE_SECONDS)

    def _happen(self, engine: Engine, what: Pieces | Command) -> None:
        self._position = self._due()
        if not isinstance(what, Command):
            self._arrival = what[-1][1]
        self._past.replay_step(engine, what)
        self._next = next(self._steps, None)


PLAY_TICK_SECONDS = 0.02
"""Seconds between two pieces."""
FAST_PIECE_SECONDS = 0.5
"""Seconds of samples in a piece when it goes as fast as it can."""
_LONGEST_TICK = 0.25
"""A thread that was held up does not catch up more than this, s."""


_AGAIN = (
    "The recording has no rest as long as the settle step wants: the noise is that of its longest "
    "rest so far, and it was played again from its beginning with that."
)


class Player(Runner):
    """Plays a tape through an engine.

    Until the procedure is started the tape is a preview; ``start`` begins at its first sample, so
    that the result does not depend on how long somebody looked. A recording that does not begin
    with a rest loses its first holds to the search for one: once the noise is known all the same,
    it is played again from its first sample. A session has its own start in it, and is what it was.

    Args:
        tape: what is played.
        engine: what it goes through.
        speed: seconds of the recording per second; ``inf`` for as fast as possible.
        clock: seconds that never go back.

    Raises:
        UsageError: the speed is not positive.
    """

    live = False

    def __init__(
        self,
        tape: Tape,
        engine: Engine,
        speed: float = 1.0,
        *,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        if not speed > 0.0:
            raise UsageError(f"a speed of {speed:g} plays nothing; give one above 0")
        super().__init__(engine, clock=clock)
        self._tape = tape
        self._speed = speed
        self._position = 0.0
        self._second = False

    def _command(self, name: str, argument: str) -> None:
        if name == "start" and self._engine.step is StepKind.SOURCE:
            begun = self._tape.begin(self._engine)
            if begun is not None:
                self._position, self._second = begun, True
                return
            self._rewind()
        super()._command(name, argument)

    def _rewind(self, noise: Noise | None = None) -> None:
        self._tape.rewind()
        self._position = 0.0
        self._engine.restart(noise)
        self._second = False

    def _once_more(self) -> bool:
        """Begin again with the noise of the longest rest, where the settle step had to make do."""
        noise = self._engine.provisional_noise
        if noise is None or self._second:
            return False
        self._rewind(noise)
        self._second = True
        self._engine.command("start")
        self._engine.note(_AGAIN)
        return True

    def _work(self) -> None:
        try:
            self._play()
        finally:
            self._tape.close()

    def _play(self) -> None:
        last, idle = self._clock(), False
        while not self._stopping.is_set():
            if not self._engine.finished:
                now = self._clock()
                self._position += self._step(now - last)
                last = now
                more = self._tape.play(self._engine, self._position)
                more |= self._once_more()
                if not more and self._engine.step is not StepKind.SOURCE:
                    self._engine.end()
                idle = not more
            self._run_orders(0.0 if math.isinf(self._speed) and not idle else PLAY_TICK_SECONDS)
            self._publish()

    def _step(self, passed: float) -> float:
        """How far the tape goes in this time, s."""
        if math.isinf(self._speed):
            return FAST_PIECE_SECONDS
        return min(passed, _LONGEST_TICK) * self._speed
