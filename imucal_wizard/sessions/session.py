"""The file of a session: the received bytes, the commands, and the results.

Bytes and commands are sufficient to restore the state; finished holds, rotations and events are
stored as well. A crash loses at most the last half second.
"""

import json
import sqlite3
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path
from typing import Any, Self

from imucal_wizard.acquire.files import session_file
from imucal_wizard.acquire.files.session_file import Command, explain_errors
from imucal_wizard.core import VERSION
from imucal_wizard.core.errors import SessionError, SessionTakenError
from imucal_wizard.guide.state import Event
from imucal_wizard.measurement.holds import Collected, Hold, Rotation


class KeptSession:
    """A session file, read only. Used by one thread at a time.

    Every method raises ``SessionError`` if the file can no longer be read.

    Attributes:
        path: the file.
        last_raw: number of the newest piece of bytes; 0 before the first.
        last_arrival: arrival of the newest piece, s; None before the first one.
    """

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self.last_raw = 0
        self.last_arrival: float | None = None
        self._connection = connection

    @classmethod
    def look(cls, path: Path) -> "KeptSession":
        """Open an existing file, also one that is being written.

        Raises:
            SessionError: it cannot be read.
        """
        session = KeptSession(path, session_file.connect(path))
        with session._explaining(), ExitStack() as on_failure:
            on_failure.callback(session._connection.close)
            session._connection.execute("PRAGMA query_only = 1")
            session._seek()
            on_failure.pop_all()
        return session

    def _seek(self) -> None:
        last = self._connection.execute("SELECT max(id), max(arrival) FROM raw").fetchone()
        self.last_raw, self.last_arrival = last[0] or 0, last[1]

    def _explaining(self) -> AbstractContextManager[None]:
        return explain_errors(self.path)

    def meta(self) -> dict[str, Any]:
        """All settings."""
        with self._explaining():
            return session_file.read_meta(self._connection)

    def raw(self) -> Iterator[tuple[int, float, bytes]]:
        """Number, arrival and bytes of each piece, in order."""
        with self._explaining():
            yield from session_file.read_pieces(self._connection)

    def commands(self) -> list[Command]:
        """All commands, in order."""
        with self._explaining():
            return list(session_file.read_commands(self._connection))

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


_Row = tuple[Any, ...]


class FindingTables:
    """Updates the tables of holds and rotations, writing only changed rows."""

    def __init__(self) -> None:
        self._written: dict[str, list[_Row]] = {"hold": [], "rotation": []}

    def write(self, connection: sqlite3.Connection, collected: Collected) -> None:
        """Write the rows that differ from last time; delete those that were withdrawn."""
        holds = (*collected.holds, *collected.validation)
        self._equal(connection, "hold", [_hold_row(hold) for hold in holds])
        self._equal(connection, "rotation", [_rotation_row(one) for one in collected.rotations])

    def _equal(self, connection: sqlite3.Connection, table: str, rows: list[_Row]) -> None:
        before = self._written[table]
        for index, row in enumerate(rows):
            if index >= len(before) or before[index] != row:
                places = ", ".join("?" * (len(row) + 1))
                connection.execute(
                    f"INSERT OR REPLACE INTO {table} VALUES ({places})",  # noqa: S608 - own names
                    (index, *row),
                )
        if len(rows) < len(before) or not before:
            connection.execute(
                f"DELETE FROM {table} WHERE id >= ?",  # noqa: S608 - one of two own names
                (len(rows),),
            )
        self._written[table] = rows


def _hold_row(hold: Hold) -> _Row:
    gyroscope = hold.gyroscope
    value = {
        "mean_accelerometer": hold.accelerometer.tolist(),
        "covariance_accelerometer": hold.accelerometer_covariance.tolist(),
        "mean_gyroscope": None if gyroscope is None else gyroscope.tolist(),
        "samples": hold.samples,
        "temperature": hold.temperature,
        "hand_held": hold.hand_held,
    }
    return hold.start, hold.end, hold.pose, json.dumps(value)


def _rotation_row(rotation: Rotation) -> _Row:
    start, end = rotation.before.end, rotation.after.start
    value = json.dumps({"samples": len(rotation.time)})
    return start, end, rotation.axis, rotation.problem, value


COMMIT_SECONDS = 0.5
"""Seconds by which the file on disk may lag behind the received data."""


class Session(KeptSession):
    """A session file being written. Used by one thread at a time.

    Every method raises ``SessionError`` when the file can no longer be read or written.

    Attributes:
        commits: number of commits.
    """

    def __init__(
        self, path: Path, connection: sqlite3.Connection, clock: Callable[[], float]
    ) -> None:
        super().__init__(path, connection)
        self._clock = clock
        self._committed = clock()
        self._findings = FindingTables()
        self.commits = 0

    @classmethod
    def create(
        cls, path: Path, about: dict[str, Any], *, clock: Callable[[], float] = time.monotonic
    ) -> "Session":
        """A new file.

        Args:
            path: path of the file; its folder is created if it is missing.
            about: initial settings, values that JSON can hold.
            clock: clock for the interval between commits, s.

        Raises:
            SessionTakenError: it exists already.
            SessionError: it cannot be written.
        """
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            try:
                path.open("xb").close()  # of two programs that create it at once, one succeeds
            except FileExistsError as error:
                raise SessionTakenError(
                    f"{path} exists already; resume it, or give another name"
                ) from error
            connection = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
        except (OSError, sqlite3.Error) as error:
            raise SessionError(
                f"{path} cannot be written ({getattr(error, 'strerror', None) or error}); give"
                " another folder for sessions",
                settings=("sessions",),
            ) from error
        session = cls(path, connection, clock)
        with session._explaining(), ExitStack() as on_failure:
            on_failure.callback(connection.close)
            session._set_up()
            on_failure.pop_all()
        for key, value in {"program": VERSION, "created": time.time(), **about}.items():
            session.set_meta(key, value)
        session.commit()
        return session

    @classmethod
    def open(cls, path: Path, *, clock: Callable[[], float] = time.monotonic) -> "Session":
        """Open an existing file to continue it.

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
        self._connection.execute(f"PRAGMA user_version = {session_file.SESSION_VERSION}")
        self._write_ahead()
        self._connection.executescript(session_file.SESSION_TABLES)
        self._connection.execute("BEGIN IMMEDIATE")

    def _begin(self) -> None:
        """Continue after the last committed row."""
        self._connection.execute("BEGIN IMMEDIATE")
        self._seek()

    def _write_ahead(self) -> None:
        self._connection.execute("PRAGMA journal_mode = WAL")
        self._connection.execute("PRAGMA synchronous = NORMAL")

    def write_raw(self, arrival: float, data: bytes) -> None:
        """Write bytes before they are decoded.

        Args:
            arrival: arrival on the session's own monotonic clock, s.
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
        """Write a command before it is carried out."""
        with self._explaining():
            self._connection.execute(
                "INSERT INTO command VALUES (NULL, ?, ?, ?, ?)",
                (self.last_raw, sample_index, name, argument),
            )
        self.commit()

    def write_findings(self, collected: Collected) -> None:
        """Write the finished holds and rotations; delete those that were withdrawn."""
        with self._explaining():
            self._findings.write(self._connection, collected)

    def write_events(self, events: Sequence[Event]) -> None:
        """Write events."""
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
        """Commit if half a second has passed since the last commit."""
        if self._clock() - self._committed >= COMMIT_SECONDS:
            self.commit()

    def commit(self) -> None:
        """Commit to the disk."""
        with self._explaining():
            if self._connection.in_transaction:
                self._connection.execute("COMMIT")
                self.commits += 1
            self._connection.execute("BEGIN IMMEDIATE")
        self._committed = self._clock()

    def roll_back(self) -> None:
        """Drop uncommitted rows after a failure, so that they can be written again."""
        with self._explaining():
            if self._connection.in_transaction:
                self._connection.execute("ROLLBACK")
            self._begin()
        self._findings = FindingTables()

    def close(self) -> None:
        """Commit and close the file."""
        try:
            with self._explaining():
                if self._connection.in_transaction:
                    self._connection.execute("COMMIT")
        finally:
            self._connection.close()
