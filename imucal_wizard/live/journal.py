"""What the engine writes down, and what it says while that is not possible."""

import json
import time
from collections.abc import Callable, Sequence

from imucal_wizard.devices.setup import StreamSetup
from imucal_wizard.errors import SessionError
from imucal_wizard.procedure.collected import Collected
from imucal_wizard.procedure.state import Event
from imucal_wizard.sessions import Session

SETUP = "setup"
"""The command by which a changed setup of the stream is written down."""
RETRY = 5.0
"""Seconds between two attempts to write what could not be written."""
MOST_OWED = 1 << 26
"""Bytes from the device that wait in memory at most for a place on the disk."""

_Write = Callable[[Session], None]


class Journal:
    """Writes to a session; a full disk delays the writing and never stops the measuring.

    What is not on the disk yet is kept in memory, so that it can be written again.

    Args:
        session: where to write; None to write nothing.
        clock: seconds that never go back.

    Attributes:
        problem: why nothing is written at present, and what to do; "" while all is well, and after
            the end when all is on the disk.
    """

    def __init__(
        self, session: Session | None = None, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._session = session
        self._clock = clock
        self._step = ""
        self._owed: list[tuple[_Write, int]] = []
        self._written = 0
        self._size = 0
        self._commits = session.commits if session is not None else 0
        self._next = 0.0
        self._why = ""
        self.problem = ""

    def raw(self, arrival: float, data: bytes) -> None:
        """Bytes, before anything is made of them."""
        self._do(lambda session: session.write_raw(arrival, data), len(data))

    def command(self, sample_index: int, name: str, argument: str) -> None:
        """A command, before it is obeyed."""
        self._do(lambda session: session.write_command(sample_index, name, argument))

    def new_setup(self, sample_index: int, setup: StreamSetup) -> None:
        """Another way of reading the stream, before it is used."""
        self.command(sample_index, SETUP, json.dumps(setup.to_json()))

    def resolved(self, setup: StreamSetup) -> None:
        """How the stream is read now that everything about it is known."""
        self._do(lambda session: session.set_meta("setup", setup.to_json()))

    def found(self, collected: Collected, events: Sequence[Event]) -> None:
        """Finished holds and rotations, and what happened."""
        self._do(lambda session: session.write_findings(collected))
        self._do(lambda session: session.write_events(events))

    def step(self, step: str) -> None:
        """The step reached, when it has changed."""
        if step != self._step:
            self._step = step
            self._do(lambda session: session.set_meta("step", step))

    def idle(self) -> None:
        """Nothing came: bring what is written to the disk when it is time."""
        if self._session is not None and (self.problem or self._owed):
            self._go_on(self._session)

    def close(self) -> None:
        """Let go of the file, after a last attempt to write what is owed."""
        session = self._session
        if session is None:
            return
        if self.problem:
            self._next = self._clock()
            self._go_on(session)
        self._session = None
        try:
            session.close()
        except SessionError as error:
            self._why = str(error)
            self.problem = self._why
        if self.problem:
            self.problem = f"not written down: {self._why}"

    def _do(self, write: _Write, size: int = 0) -> None:
        if self._session is not None:
            self._owed.append((write, size))
            self._size += size
            self._go_on(self._session)

    def _go_on(self, session: Session) -> None:
        """Write what is owed; after a failure all of it once more, when it is time to try."""
        if self.problem and self._clock() < self._next:
            return
        try:
            if self.problem:
                session.roll_back()
                self._written = 0
            self._write(session)
            if self.problem:
                session.commit()
                self._settle(session)
            self.problem = ""
            session.commit_when_due()
            self._settle(session)
        except SessionError as error:
            self._settle(session)
            self._failed(error)

    def _write(self, session: Session) -> None:
        while self._written < len(self._owed):
            write, _ = self._owed[self._written]
            self._written += 1
            write(session)
            self._settle(session)

    def _settle(self, session: Session) -> None:
        """Forget what has come to the disk: a commit takes all that was written before it."""
        if session.commits != self._commits:
            self._commits = session.commits
            self._size -= sum(size for _, size in self._owed[: self._written])
            del self._owed[: self._written]
            self._written = 0

    def _failed(self, error: SessionError) -> None:
        self._next = self._clock() + RETRY
        self._why = str(error)
        if self._size <= MOST_OWED:
            self.problem = f"waiting in memory, tried again every {RETRY:.0f} s: {error}"
            return
        self.problem = f"nothing more is written down: {error}"
        self._session = None
        self._owed.clear()
