"""The thread that plays a recording as if it came from a device, at any speed."""

import math
import time
from collections.abc import Callable

from imucal_wizard.errors import UsageError
from imucal_wizard.live.engine import Engine
from imucal_wizard.live.runner import Runner
from imucal_wizard.live.tape import Tape
from imucal_wizard.procedure.state import StepKind
from imucal_wizard.procedure.stillness import Noise

TICK = 0.02
"""Seconds between two pieces."""
PIECE = 0.5
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
        noise = self._engine.makeshift
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
            self._obey(0.0 if math.isinf(self._speed) and not idle else TICK)
            self._publish()

    def _step(self, passed: float) -> float:
        """How far the tape goes in this time, s."""
        if math.isinf(self._speed):
            return PIECE
        return min(passed, _LONGEST_TICK) * self._speed
