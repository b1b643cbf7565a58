"""The journal of a session: a thread writes to the disk, and reading never waits for it.

The engine passes on what it receives and decides; the thread writes it in the same order and
commits. Nothing is announced before it is committed, so a program that is killed has confirmed
nothing that is not in the file.
"""

import atexit
import json
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.errors import SessionError
from imucal_wizard.core.records import dataclass
from imucal_wizard.guide.state import Event
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.sessions import Session

SETUP_COMMAND = "setup"
"""Name of the command that records a changed setup of the stream."""
COMMIT_SECONDS = 0.5
"""Seconds after which received bytes are committed at the latest, if the disk keeps up."""
MAX_WAITING_BYTES = 1 << 26
"""Received bytes that wait for the disk at most; a disk that is slower than that has failed."""
MAX_DELAY_SECONDS = 2.0
"""Seconds that the disk may need before the screen says that it waits for the disk."""

MAX_CLOSE_SECONDS = 10.0
"""Seconds that the end of the program waits for the disk."""

_Write = Callable[[Session], None]

_open: list["Journal"] = []
"""Journals whose session is not closed yet."""


def close_journals() -> None:
    """Close every session, for an end of the process that runs no exit functions."""
    for journal in _open.copy():  # closing one takes it from the list
        journal.close()


@dataclass(eq=False)
class _Waiting:
    """A write that waits for the disk, its size in bytes, and since when, s."""

    write: _Write
    size: int
    since: float


class Journal:
    """Passes what the engine receives and decides to the thread that writes the session.

    Every method that writes raises ``SessionError`` once the disk has failed; what the disk did not
    take stays in memory for ``rescue``.

    Args:
        session: where to write; None to write nothing. Only the thread uses it until the end.
        clock: seconds that never go back.

    Attributes:
        passed: number of writes passed on.
        written: number of writes committed to the disk.
    """

    def __init__(
        self, session: Session | None = None, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._session = session
        self._clock = clock
        self._step = ""
        self._changed = threading.Condition()
        self._waiting: list[_Waiting] = []
        self._pieces: list[tuple[float, bytes]] | None = None
        self._size = 0
        self._urgent = False
        self._closing = False
        self._failure: SessionError | None = None
        self._thread: threading.Thread | None = None
        self.passed = self.written = 0
        if session is not None:
            _open.append(self)
            atexit.register(self.close)  # also if the program is left while the source is opened

    def raw(self, arrival: float, data: bytes) -> None:
        """Write bytes before they are decoded."""
        if self._session is None:
            return
        with self._changed:
            if self._pieces is not None and self._failure is None:
                self._pieces.append((arrival, data))
                self._add_size(len(data))
                return
        pieces = [(arrival, data)]
        self._pass(lambda session: session.write_pieces(pieces), len(data), pieces)

    def command(self, sample_index: int, name: str, argument: str) -> None:
        """Write a command before it is carried out, and commit it."""
        self._pass(lambda session: session.write_command(sample_index, name, argument))
        self._commit()

    def new_setup(self, sample_index: int, setup: StreamSetup) -> None:
        """Write another setup of the stream before it is used."""
        self.command(sample_index, SETUP_COMMAND, json.dumps(setup.to_json()))

    def resolved(self, setup: StreamSetup) -> None:
        """Write the setup of the stream once it is complete."""
        self._pass(lambda session: session.set_meta("setup", setup.to_json()))

    def decided(
        self, events: Sequence[Event], collect: Callable[[], Collected] | None, step: str
    ) -> None:
        """Write and commit what was decided.

        Args:
            events: the events.
            collect: returns the measurements; None if they have not changed.
            step: the present step.
        """
        if self._session is None:
            return
        self._pass(lambda session: session.write_events(events))
        if collect is not None:
            collected = collect()
            self._pass(lambda session: session.write_findings(collected))
        if step != self._step:
            self._step = step
            self._pass(lambda session: session.set_meta("step", step))
        self._commit()

    def checkpoint(self, make: Callable[[], bytes]) -> int:
        """Write the engine's state after everything passed on so far.

        Args:
            make: makes the state; called only if there is a session.

        Returns:
            Its size, bytes.
        """
        if self._session is None:
            return 0
        state = make()
        self._pass(lambda session: session.write_checkpoint(state))
        return len(state)

    @property
    def problem(self) -> str:
        """Why what was received is not on the disk yet, or ``""``."""
        if self._failure is not None:
            return f"no longer being saved: {self._failure}"
        with self._changed:
            since = self._waiting[0].since if self._waiting else None
        delay = 0.0 if since is None else self._clock() - since
        return f"waiting for the disk for {delay:.0f} s" if delay > MAX_DELAY_SECONDS else ""

    def check(self) -> None:
        """Raise SessionError if the disk has failed; called while no data arrive."""
        if self._failure is not None:
            raise self._failure

    def close(self) -> None:
        """Wait until everything is on the disk and the file is closed."""
        with self._changed:
            closed, self._closing = self._closing, True
            self._changed.notify()
        if self._thread is not None:
            self._thread.join(0.0 if self._failure is not None else MAX_CLOSE_SECONDS)
        elif self._session is not None and not closed:
            self._finish(self._session)
        # not before: the end of the program waits, too
        atexit.unregister(self.close)
        if self in _open:
            _open.remove(self)

    def rescue(self, path: Path) -> None:
        """Write the whole session to another place after the disk has failed.

        Args:
            path: a new file.

        Raises:
            SessionError: it exists already, or cannot be written.
        """
        if self._session is None:
            return
        if self._thread is not None:
            self._thread.join(MAX_CLOSE_SECONDS)  # a slow disk may still take some of it
        with self._session.copied(path) as copy:
            for one in self._waiting:
                one.write(copy)

    def _pass(
        self, write: _Write, size: int = 0, pieces: list[tuple[float, bytes]] | None = None
    ) -> None:
        """Pass on a write.

        Args:
            write: the write.
            size: its size, bytes.
            pieces: the pieces that it writes; those that follow at once are added to them.
        """
        session = self._session
        if session is None:
            return
        self.check()
        with self._changed:
            self._waiting.append(_Waiting(write, 0, self._clock()))
            self._pieces = pieces
            self._add_size(size)
            self.passed += 1
        if self._thread is None:
            self._thread = threading.Thread(
                target=self._work, args=(session,), name="Journal", daemon=True
            )
            self._thread.start()

    def _add_size(self, size: int) -> None:
        """Count bytes of the newest write."""
        self._waiting[-1].size += size
        self._size += size
        if self._size > MAX_WAITING_BYTES and self._session is not None:
            self._failure = SessionError(
                f"{self._session.path} is on a disk that is too slow; use another disk"
            )

    def _commit(self) -> None:
        """Commit at once everything that was passed on."""
        with self._changed:
            self._urgent = True
            self._changed.notify()

    def _work(self, session: Session) -> None:
        """The thread: write and commit until the journal is closed or the disk fails."""
        try:
            while batch := self._batch():
                for one in batch:
                    one.write(session)
                session.commit()
                with self._changed:
                    del self._waiting[: len(batch)]
                    self._size -= sum(one.size for one in batch)
                    self.written += len(batch)
            self._finish(session)
        except SessionError as error:
            self._fail(session, error)
        except BaseException as error:
            self._fail(session, SessionError(f"{session.path} cannot be written ({error!r})"))
            raise

    def _batch(self) -> list[_Waiting]:
        """Everything to be written next; empty at the end."""
        with self._changed:
            while True:
                self._changed.wait_for(lambda: self._urgent or self._closing, COMMIT_SECONDS)
                self._urgent = False
                if self._waiting or self._closing:
                    self._pieces = None
                    return self._waiting.copy()

    def _finish(self, session: Session) -> None:
        try:
            session.close()
        except SessionError as error:
            self._failure = error

    def _fail(self, session: Session, error: SessionError) -> None:
        session.roll_back()
        self._failure = self._failure or error
