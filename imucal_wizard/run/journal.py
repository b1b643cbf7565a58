"""The journal of a session: everything the engine writes, and the reason while it cannot write."""

import json
import time
from collections.abc import Callable, Sequence

from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.errors import SessionError
from imucal_wizard.guide.state import Event
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.sessions import Session

SETUP_COMMAND = "setup"
"""Name of the command that records a changed setup of the stream."""
WRITE_RETRY_SECONDS = 5.0
"""Seconds between two attempts to write after a failure."""
MAX_PENDING_BYTES = 1 << 26
"""Largest number of bytes that wait in memory for room on the disk."""

_Write = Callable[[Session], None]


class Journal:
    """Writes to a session; a full disk delays the writing and never stops the measurement.

    Data that are not yet on the disk are kept in memory, so that they can be written again.

    Args:
        session: where to write; None to write nothing.
        clock: seconds that never go back.

    Attributes:
        problem: the reason why nothing is written at present, and what to do; "" if there is no
            problem, and after the end if everything is on the disk.
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
        """Write bytes before they are decoded."""
        self._do(lambda session: session.write_raw(arrival, data), len(data))

    def command(self, sample_index: int, name: str, argument: str) -> None:
        """Write a command before it is carried out."""
        self._do(lambda session: session.write_command(sample_index, name, argument))

    def new_setup(self, sample_index: int, setup: StreamSetup) -> None:
        """Write another setup of the stream before it is used."""
        self.command(sample_index, SETUP_COMMAND, json.dumps(setup.to_json()))

    def resolved(self, setup: StreamSetup) -> None:
        """Write the setup of the stream once it is complete."""
        self._do(lambda session: session.set_meta("setup", setup.to_json()))

    def found(self, collected: Collected, events: Sequence[Event]) -> None:
        """Write finished holds, rotations and events."""
        self._do(lambda session: session.write_findings(collected))
        self._do(lambda session: session.write_events(events))

    def step(self, step: str) -> None:
        """Write the current step if it has changed."""
        if step != self._step:
            self._step = step
            self._do(lambda session: session.set_meta("step", step))

    def idle(self) -> None:
        """Retry and commit if due; called while no data arrive."""
        if self._session is not None and (self.problem or self._owed):
            self._go_on(self._session)

    def close(self) -> None:
        """Close the file after a last attempt to write what is pending."""
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
            self.problem = f"not saved: {self._why}"

    def _do(self, write: _Write, size: int = 0) -> None:
        if self._session is not None:
            self._owed.append((write, size))
            self._size += size
            self._go_on(self._session)

    def _go_on(self, session: Session) -> None:
        """Write what is pending; after a failure, retry all of it when the time has come."""
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
        """Drop what a commit has written to the disk."""
        if session.commits != self._commits:
            self._commits = session.commits
            self._size -= sum(size for _, size in self._owed[: self._written])
            del self._owed[: self._written]
            self._written = 0

    def _failed(self, error: SessionError) -> None:
        self._next = self._clock() + WRITE_RETRY_SECONDS
        self._why = str(error)
        if self._size <= MAX_PENDING_BYTES:
            self.problem = (
                f"waiting in memory, tried again every {WRITE_RETRY_SECONDS:.0f} s: {error}"
            )
            return
        self.problem = f"no longer being saved: {error}"
        self._session = None
        self._owed.clear()
