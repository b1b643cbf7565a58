"""The file of a session: what arrived, as it arrived, and what was made of it.

Bytes and commands are enough to come back to the same state; holds, rotations and events are
written beside them as they are finished. A crash loses at most what came in the last half second.
"""

import json
import sqlite3
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from imucal_wizard import __version__
from imucal_wizard.errors import SessionError
from imucal_wizard.procedure.collected import Collected
from imucal_wizard.procedure.state import Event
from imucal_wizard.recordings import session_file
from imucal_wizard.sessions.findings import Findings
from imucal_wizard.sessions.kept import KeptSession

COMMIT_SECONDS = 0.5
"""How far the file on disk may lie behind what has arrived."""


class Session(KeptSession):
    """A session file being written. Used by one thread at a time.

    Every method raises ``SessionError`` when the file can no longer be read or written.

    Attributes:
        commits: how often what was written has been brought to the disk.
    """

    def __init__(
        self, path: Path, connection: sqlite3.Connection, clock: Callable[[], float]
    ) -> None:
        super().__init__(path, connection)
        self._clock = clock
        self._committed = clock()
        self._findings = Findings()
        self.commits = 0

    @classmethod
    def create(
        cls, path: Path, about: dict[str, Any], *, clock: Callable[[], float] = time.monotonic
    ) -> "Session":
        """A new file.

        Args:
            path: where; its folder is made when it is missing.
            about: first settings, values that JSON can hold.
            clock: seconds, by which the commits are spaced.

        Raises:
            SessionError: it exists already or cannot be written.
        """
        try:
            if path.exists():
                raise SessionError(f"{path} exists already; resume it, or give another name")
            path.parent.mkdir(parents=True, exist_ok=True)
            connection = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
        except (OSError, sqlite3.Error) as error:
            raise SessionError(
                f"{path} cannot be written ({getattr(error, 'strerror', None) or error}); give"
                " another folder with --sessions"
            ) from error
        session = cls(path, connection, clock)
        with session._explaining(), ExitStack() as on_failure:
            on_failure.callback(connection.close)
            session._set_up()
            on_failure.pop_all()
        for key, value in {"program": __version__, "created": time.time(), **about}.items():
            session.set_meta(key, value)
        session.commit()
        return session

    @classmethod
    def open(cls, path: Path, *, clock: Callable[[], float] = time.monotonic) -> "Session":
        """An existing file, to be continued.

        Raises:
            SessionError: it cannot be read, or another program is writing it.
        """
        session = cls(path, session_file.connect(path), clock)
        with session._explaining(), ExitStack() as on_failure:
            on_failure.callback(session._connection.close)
            session._write_ahead()
            session._begin()
            on_failure.pop_all()
        return session

    def _set_up(self) -> None:
        self._connection.execute(f"PRAGMA application_id = {session_file.APPLICATION_ID}")
        self._connection.execute(f"PRAGMA user_version = {session_file.VERSION}")
        self._write_ahead()
        self._connection.executescript(session_file.SCHEMA)
        self._connection.execute("BEGIN IMMEDIATE")

    def _begin(self) -> None:
        """Write on after what is on the disk."""
        self._connection.execute("BEGIN IMMEDIATE")
        self._seek()

    def _write_ahead(self) -> None:
        self._connection.execute("PRAGMA journal_mode = WAL")
        self._connection.execute("PRAGMA synchronous = NORMAL")

    def write_raw(self, arrival: float, data: bytes) -> None:
        """Write down what has come, before anything is made of it.

        Args:
            arrival: seconds on the session's own clock, which never goes back.
            data: the bytes.
        """
        with self._explaining():
            self.last_raw += 1
            self._connection.execute(
                "INSERT INTO raw VALUES (?, ?, ?)", (self.last_raw, arrival, data)
            )
        self.last_arrival = arrival
        self.commit_when_due()

    def write_command(self, sample_index: int, name: str, argument: str = "") -> None:
        """Write down what the operator asked for, before it is obeyed."""
        with self._explaining():
            self._connection.execute(
                "INSERT INTO command VALUES (NULL, ?, ?, ?, ?)",
                (self.last_raw, sample_index, name, argument),
            )
        self.commit()

    def write_findings(self, collected: Collected) -> None:
        """Write down the holds and rotations finished so far; those taken back are forgotten."""
        with self._explaining():
            self._findings.write(self._connection, collected)

    def write_events(self, events: Sequence[Event]) -> None:
        """Write down what happened."""
        rows = [(event.time, str(event.kind), event.text) for event in events]
        with self._explaining():
            self._connection.executemany("INSERT INTO event VALUES (NULL, ?, ?, ?)", rows)

    def set_meta(self, key: str, value: Any) -> None:
        """Set one setting to a value that JSON can hold."""
        with self._explaining():
            self._connection.execute(
                "INSERT OR REPLACE INTO meta VALUES (?, ?)", (key, json.dumps(value))
            )

    def commit_when_due(self) -> None:
        """Bring what was written to the disk when half a second has passed."""
        if self._clock() - self._committed >= COMMIT_SECONDS:
            self.commit()

    def commit(self) -> None:
        """Bring what was written to the disk."""
        with self._explaining():
            if self._connection.in_transaction:
                self._connection.execute("COMMIT")
                self.commits += 1
            self._connection.execute("BEGIN IMMEDIATE")
        self._committed = self._clock()

    def roll_back(self) -> None:
        """Forget what is not on the disk, after a failure, so that it can be written once more."""
        with self._explaining():
            if self._connection.in_transaction:
                self._connection.execute("ROLLBACK")
            self._begin()
        self._findings = Findings()

    def close(self) -> None:
        """Write everything and let go of the file."""
        try:
            with self._explaining():
                if self._connection.in_transaction:
                    self._connection.execute("COMMIT")
        finally:
            self._connection.close()
