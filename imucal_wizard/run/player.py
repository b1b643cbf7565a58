"""The thread that plays a recording or session like a device, at any speed."""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Protocol

import numpy as np

from imucal_wizard.core.errors import RecordingError, UsageError
from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.core.statistics import true_on_all_axes
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.measurement.blocks import resample_gyroscope
from imucal_wizard.measurement.stillness import Noise
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.runner import Runner
from imucal_wizard.run.session_replay import RawPieces, SessionReplay
from imucal_wizard.sessions import Command


class Tape(Protocol):
    """A recording that is fed to an engine piece by piece."""

    def rewind(self) -> None:
        """Begin again."""

    def begin(self, engine: Engine) -> float | None:
        """Feed the tape up to the start of its procedure; None if the player must start it.

        Returns:
            The time at which it continues, s.
        """

    def close(self) -> None:
        """Close the recording."""

    def play(self, engine: Engine, until: float) -> bool:
        """Feed the data before ``until`` seconds; True if more are left."""


class ReadingsTape:
    """The samples of a recording.

    The gyroscope is interpolated to the accelerometer's times if it has its own, because the
    procedure uses both together.

    Raises:
        RecordingError: it has fewer than two samples, or two sensors that were never on together.
    """

    def __init__(self, readings: Readings) -> None:
        self._readings = _together(readings)
        self._rate = readings.accelerometer.rate
        if self._rate <= 0.0:
            raise RecordingError("it has too few samples to be played; record again")
        if len(self._readings) < 2:
            raise RecordingError(
                "accelerometer and gyroscope were never recorded at the same time, so the wizard "
                "cannot play it; record both together"
            )
        self._next = 0

    def rewind(self) -> None:
        """Begin again."""
        self._next = 0

    def begin(self, engine: Engine) -> float | None:  # noqa: ARG002 -- other tapes use it
        """A recording does not contain a start of the procedure."""
        return None

    def close(self) -> None:
        """Its samples are in memory."""

    def play(self, engine: Engine, until: float) -> bool:
        """Feed the samples before ``until`` seconds from the beginning; True if more are left."""
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
    """Both sensors at the same times, with a warning if the gyroscope was interpolated.

    As in a live stream, only samples of both together count.
    """
    together = resample_gyroscope(readings)
    if together is readings or together.gyroscope is None:
        return readings
    warnings = ["the gyroscope was interpolated to the accelerometer's times for the wizard"]
    own, rate = together.accelerometer, together.gyroscope
    there = true_on_all_axes(np.isfinite(rate.values))
    if not there.all():
        away = int((~there).sum()) / own.rate
        warnings.append(
            f"{away:.3g} s of the accelerometer are not played: the gyroscope is missing there"
        )
    return replace(
        together,
        accelerometer=Series(own.time[there], own.values[there], own.unit),
        gyroscope=Series(rate.time[there], rate.values[there], rate.unit),
        warnings=(*readings.warnings, *warnings),
    )


MAX_PAUSE_SECONDS = 2.0
"""Longest pause without data, s; longer ones, as between the runs of a session, are shortened."""


class SessionTape:
    """Plays a session with its commands; the engine reaches the state in which it was left.

    Args:
        replay: the session, open for reading; closed with the tape.
    """

    def __init__(self, replay: SessionReplay) -> None:
        self._replay = replay
        self._begun = False
        self.rewind()

    def rewind(self) -> None:
        """Begin again."""
        self._steps: Iterator[RawPieces | Command] = self._replay.steps()
        self._next: RawPieces | Command | None = next(self._steps, None)
        self._position = 0.0
        self._arrival: float | None = None

    def begin(self, engine: Engine) -> float | None:
        """Feed the session up to the start of its procedure at once.

        Returns:
            The time at which it continues, s; None if the procedure was never started.
        """
        while self._next is not None and engine.step is StepKind.SOURCE:
            self._happen(engine, self._next)
        self._begun = True
        return None if engine.step is StepKind.SOURCE else self._position

    def play(self, engine: Engine, until: float) -> bool:
        """Feed the data and commands before ``until`` seconds; True if more are left.

        As a preview it plays only up to the first command.
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
        self._replay.session.close()

    def _due(self) -> float:
        """Time of the next data or command, s from the beginning, with long pauses shortened."""
        if self._next is None or isinstance(self._next, Command) or self._arrival is None:
            return self._position
        passed = self._next[-1][1] - self._arrival
        return self._position + min(max(passed, 0.0), MAX_PAUSE_SECONDS)

    def _happen(self, engine: Engine, what: RawPieces | Command) -> None:
        self._position = self._due()
        if not isinstance(what, Command):
            self._arrival = what[-1][1]
        self._replay.replay_step(engine, what)
        self._next = next(self._steps, None)


PLAY_TICK_SECONDS = 0.02
"""Seconds between two pieces."""
FAST_PIECE_SECONDS = 0.5
"""Seconds of samples per piece at unlimited speed."""
_LONGEST_TICK = 0.25
"""Delay of the thread beyond which it does not catch up, s."""


_AGAIN = (
    "The recording has no rest as long as the settle step needs: the noise was taken from its "
    "longest rest so far, and the recording was played again from its beginning."
)


class Player(Runner):
    """Plays a tape through an engine.

    Until the procedure is started, the tape is a preview; ``start`` begins at its first sample, so
    the result does not depend on the length of the preview. A recording that does not begin with a
    rest would lose its first holds to the search for one; once the noise is known, it is played
    again from its first sample. A session contains its own start and is replayed as it was.

    Args:
        tape: the recording.
        engine: the engine that receives it.
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
            raise UsageError(f"a speed of {speed:g} is impossible; give one above 0")
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
        """Begin again with the noise of the longest rest, if the settle step had to use that."""
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
        """Seconds of the tape played in this time."""
        if math.isinf(self._speed):
            return FAST_PIECE_SECONDS
        return min(passed, _LONGEST_TICK) * self._speed
