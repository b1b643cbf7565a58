"""A session to be watched again: what came and what was ordered, each when it was."""

from collections.abc import Iterator

from imucal_wizard.live.engine import Engine
from imucal_wizard.live.past import Past, Pieces
from imucal_wizard.procedure.state import StepKind
from imucal_wizard.sessions import Command

LONGEST_PAUSE = 2.0
"""Seconds without anything, as between the runs of a session, are played no longer than this."""


class SessionTape:
    """Plays a session with the commands in it; the engine comes to the state it was left in.

    Args:
        past: the session, open for reading; closed with the tape.
    """

    def __init__(self, past: Past) -> None:
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
        """Feed what came and was ordered before ``until`` seconds; whether more is left.

        As a preview it plays no further than to the first command.
        """
        while self._next is not None and self._due() <= until:
            self._begun |= engine.step is not StepKind.SOURCE
            if not self._begun and engine.samples > 0 and isinstance(self._next, Command):
                return True
            self._happen(engine, self._next)
        return self._next is not None

    def close(self) -> None:
        """Let go of the file."""
        self._steps = iter(())
        self._next = None
        self._past.session.close()

    def _due(self) -> float:
        """When the next of it happens, s from the beginning, long pauses shortened."""
        if self._next is None or isinstance(self._next, Command) or self._arrival is None:
            return self._position
        passed = self._next[-1][1] - self._arrival
        return self._position + min(max(passed, 0.0), LONGEST_PAUSE)

    def _happen(self, engine: Engine, what: Pieces | Command) -> None:
        self._position = self._due()
        if not isinstance(what, Command):
            self._arrival = what[-1][1]
        self._past.happen(engine, what)
        self._next = next(self._steps, None)
