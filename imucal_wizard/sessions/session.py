"""The file of a session: the received bytes, the commands, and the results.

Bytes and commands are sufficient to restore the state; finished holds, rotations and events are
stored as well. What has been committed survives a crash of the program and a loss of power.
"""

import json
import os
import sqlite3
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, suppress
from pathlib import Path
from typing import Any, Self, TypeVar

from imucal_wizard.acquire.files import session_file
from imucal_wizard.acquire.files.session_file import Command, explain_errors
from imucal_wizard.core import VERSION
from imucal_wizard.core.errors import DamagedSessionError, SessionError, SessionTakenError
from imucal_wizard.core.output import cause_of, why_it_cannot_grow
from imucal_wizard.guide.state import Event
from imucal_wizard.measurement.holds import Collected, Hold, Rotation
from imucal_wizard.sessions.checkpoint import Checkpoint
from imucal_wizard.sessions.session_list import remove_session

_T = TypeVar("_T")
SPARE_BYTES = 1 << 18
"""Room that is left for the index of the log (32 KiB for each 16 MiB) and for tables."""


class KeptSession:
    """A session file, read only. Used by one thread at a time.

    Every method raises ``SessionError`` if the file can no longer be read.

    Attributes:
        path: the file.
        last_raw: number of the newest piece of bytes; 0 before the first.
        last_arrival: arrival of the newest piece, s; None before the first one.
        damage: what was read and what is lost of a damaged file; "" of any other.
    """

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self.last_raw = 0
        self.last_arrival: float | None = None
        self.damage = ""
        self._connection = connection

    @classmethod
    def look(cls, path: Path) -> "KeptSession":
        """Open an existing file, also one that is being written; of a damaged one, what is left.

        Raises:
            SessionError: it cannot be read.
        """
        try:
            session = KeptSession(path, session_file.connect(path))
        except DamagedSessionError:
            session = KeptSession(path, sqlite3.connect(":memory:"))
            session._salvage()
            return session
        with ExitStack() as on_failure:
            on_failure.callback(session.close)
            session._reading(_read_only)
            session._reading(lambda _: session._seek())
            on_failure.pop_all()
        return session

    def _seek(self) -> None:
        newest = "SELECT id, arrival FROM raw ORDER BY id DESC LIMIT 1"
        last = self._connection.execute(newest).fetchone()
        self.last_raw, self.last_arrival = (0, None) if last is None else last

    def _explaining(self) -> AbstractContextManager[None]:
        return explain_errors(self.path)

    def _salvage(self) -> None:
        """Continue with what can be read of a damaged file.

        Raises:
            SessionError: nothing can, or the file is being continued.
        """
        from imucal_wizard.acquire.files.session_salvage import salvage

        found = salvage(self.path)
        self._connection.close()
        self._connection, self.damage = found.connection, found.says
        self._seek()

    def _reading(self, read: Callable[[sqlite3.Connection], _T]) -> _T:
        """What is read of the file, or of what can be salvaged of it."""
        try:
            with self._explaining():
                return read(self._connection)
        except DamagedSessionError:
            if self.damage:
                raise
        self._salvage()
        with self._explaining():
            return read(self._connection)

    def meta(self) -> dict[str, Any]:
        """All settings."""
        return self._reading(session_file.read_meta)

    def raw(self, after: int = 0) -> Iterator[tuple[int, float, bytes]]:
        """Number, arrival and bytes of each piece, in order, from the one after ``after``."""
        last = after
        try:
            with self._explaining():
                for piece in session_file.read_pieces(self._connection, after):
                    last = piece[0]
                    yield piece
                return
        except DamagedSessionError:
            if self.damage:
                raise
        self._salvage()
        with self._explaining():
            for piece in session_file.read_pieces(self._connection):
                if piece[0] > last:
                    yield piece

    def commands(self) -> list[Command]:
        """All commands, in order."""
        return self._reading(lambda connection: list(session_file.read_commands(connection)))

    def checkpoint(self) -> Checkpoint | None:
        """The newest state that may be loaded in place of a replay; None if there is none."""
        row = "SELECT after_raw, commands, state, seal FROM checkpoint"
        try:
            *found, seal = self._connection.execute(row).fetchone() or (0, 0, b"", b"")
            kept = Checkpoint(*found)
            valid = kept.fits(seal, self._created()) and kept.after_raw <= self.last_raw
        except (sqlite3.Error, TypeError):  # no such table, or damage: the replay reports it
            return None
        if not valid:
            return None
        # the replay does not read what is before it: damage of the pages there must show now
        self._reading(lambda connection: connection.execute("SELECT count(*) FROM raw").fetchone())
        return kept

    def _created(self) -> float:
        return float(self.meta().get("created", 0.0))

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def _read_only(connection: sqlite3.Connection) -> None:
    connection.execute("PRAGMA query_only = 1")


_Row = tuple[Any, ...]


class FindingTables:
    """Updates the tables of holds and rotations, writing only changed rows."""

    def __init__(self) -> None:
        self._written: dict[str, list[_Row]] = {"hold": [], "rotation": []}

    def write(self, connection: sqlite3.Connection, collected: Collected) -> None:
        """Write the rows that differ from last time; delete those that were withdrawn."""
        holds = [_hold_row(hold) for hold in collected.holds]
        holds += [_hold_row(hold, validation=True) for hold in collected.validation]
        self._equal(connection, "hold", holds)
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


def _hold_row(hold: Hold, *, validation: bool = False) -> _Row:
    gyroscope = hold.gyroscope
    value = {
        "mean_accelerometer": hold.accelerometer.tolist(),
        "covariance_accelerometer": hold.accelerometer_covariance.tolist(),
        "mean_gyroscope": None if gyroscope is None else gyroscope.tolist(),
        "samples": hold.samples,
        "temperature": hold.temperature,
        "hand_held": hold.hand_held,
        "validation": validation,
    }
    return hold.start, hold.end, hold.pose, json.dumps(value)


def _rotation_row(rotation: Rotation) -> _Row:
    start, end = rotation.before.end, rotation.after.start
    value = json.dumps({"samples": len(rotation.time)})
    return start, end, rotation.axis, rotation.problem, value


class Session(KeptSession):
    """A session file being written. Used by one thread at a time.

    Every method raises ``SessionError`` when the file can no longer be read or written.
    """

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        super().__init__(path, connection)
        self._findings = FindingTables()
        self._files: list[tuple[int, int] | None] = []
        self._uncommitted = 0
        self._reader: sqlite3.Connection | None = None

    @classmethod
    def create(cls, path: Path, about: dict[str, Any]) -> "Session":
        """A new file.

        Args:
            path: path of the file; its folder is created if it is missing.
            about: initial settings, values that JSON can hold.

        Raises:
            SessionTakenError: it exists already.
            SessionError: it cannot be written.
        """
        session = cls(path, _empty(path))
        with ExitStack() as on_failure, session._explaining():
            on_failure.callback(session._discard)  # once the error is explained
            session._set_up()
            for key, value in {"program": VERSION, "created": time.time(), **about}.items():
                session.set_meta(key, value)
            session.commit()
            on_failure.pop_all()
        return session

    def _discard(self) -> None:
        """Close a new file that could not be filled, and remove it: nothing can be resumed."""
        self._connection.close()
        remove_session(self.path)

    @classmethod
    def open(cls, path: Path) -> "Session":
        """Open an existing file to continue it.

        Raises:
            SessionError: it cannot be read, or another program is writing it.
        """
        return cls(path, session_file.connect(path, writes=True))._continued()

    def copied(self, path: Path) -> "Session":
        """A copy of everything that is committed, open for writing.

        Args:
            path: a new file.

        Raises:
            SessionTakenError: it exists already.
            SessionError: it cannot be written.
        """
        copy = Session(path, _empty(path))
        with ExitStack() as on_failure, copy._explaining():
            on_failure.callback(copy._discard)  # once the error is explained
            self._connection.backup(copy._connection)
            on_failure.pop_all()
        return copy._continued()

    def _continued(self) -> "Session":
        """The same session, ready to continue after its last committed row."""
        with self._explaining(), ExitStack() as on_failure:
            on_failure.callback(self._connection.close)
            self._write_ahead()
            self._connection.execute("BEGIN IMMEDIATE")
            self._seek()
            on_failure.pop_all()
        return self

    def _salvage(self) -> None:
        with self._explaining():
            raise sqlite3.DatabaseError("a part of it cannot be read")

    def _set_up(self) -> None:
        self._connection.execute(f"PRAGMA application_id = {session_file.APPLICATION_ID}")
        self._connection.execute(f"PRAGMA user_version = {session_file.SESSION_VERSION}")
        self._write_ahead()
        self._connection.executescript(f"BEGIN IMMEDIATE; {session_file.SESSION_TABLES}")

    def _write_ahead(self) -> None:
        """Write so that a commit ends when its data are on the disk, whatever happens to it."""
        self._connection.execute("PRAGMA journal_mode = WAL")
        self._connection.execute("PRAGMA synchronous = FULL")
        self._connection.execute("PRAGMA fullfsync = ON")  # macOS: the disk's own buffer as well

    def write_pieces(self, pieces: Sequence[tuple[float, bytes]]) -> None:
        """Write pieces of bytes before they are decoded.

        Args:
            pieces: each with its arrival on the session's own monotonic clock, s.
        """
        rows = [(self.last_raw + n, *piece) for n, piece in enumerate(pieces, start=1)]
        with self._explaining():
            self._connection.executemany("INSERT INTO raw VALUES (?, ?, ?)", rows)
        self.last_raw, self.last_arrival, _ = rows[-1]
        self._uncommitted += sum(len(data) for _, data in pieces)

    def write_command(self, sample_index: int, name: str, argument: str = "") -> None:
        """Write a command before it is carried out."""
        with self._explaining():
            self._connection.execute(
                "INSERT INTO command VALUES (NULL, ?, ?, ?, ?)",
                (self.last_raw, sample_index, name, argument),
            )

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

    def write_checkpoint(self, state: bytes) -> None:
        """Keep the state after everything written so far, in place of an earlier one."""
        with self._explaining():
            (commands,) = self._connection.execute("SELECT count(*) FROM command").fetchone()
            kept = Checkpoint(self.last_raw, commands, state)
            seal = kept.seal(self._created())
            if seal is None:
                return
            self._connection.execute(
                "CREATE TABLE IF NOT EXISTS checkpoint (id INTEGER PRIMARY KEY, after_raw INTEGER,"
                " commands INTEGER, state BLOB, seal BLOB)"
            )
            self._connection.execute(
                "INSERT OR REPLACE INTO checkpoint VALUES (1, ?, ?, ?, ?)",
                (kept.after_raw, commands, state, seal),
            )
        self._uncommitted += len(state)

    def commit(self) -> None:
        """Commit to the disk.

        Raises:
            SessionError: the file is no longer there, so what is written would be lost at the end;
                or there is no room, and nothing was committed.
        """
        self._find_room()
        with self._explaining():
            self._connection.execute("COMMIT")
            self._connection.execute("BEGIN IMMEDIATE")
        self._uncommitted = 0
        there = [_identity(self.path.with_name(f"{self.path.name}{end}")) for end in ("", "-wal")]
        self._files = self._files or there
        if there != self._files:
            raise SessionError(
                f"{self.path} was removed or replaced by another program while it was written",
                settings=("sessions",),
            )

    def _find_room(self) -> None:
        """Find out whether the disk has room for what is committed and for the index of the log.

        SQLite writes that index through a mapped file. Where a file system copies on write (btrfs),
        each change of it needs room, and without room the system kills the process (SIGBUS).
        """
        room = SPARE_BYTES + 2 * self._uncommitted
        if cause := why_it_cannot_grow(self.path, by=room, whole=False):
            raise session_file.no_room_error(self.path, cause)

    def roll_back(self) -> None:
        """Drop uncommitted rows after a failure; the file can only be read and copied then.

        A second reader keeps SQLite from moving the log to the file when that is closed: there may
        be no room for it.
        """
        with suppress(sqlite3.Error):
            if self._connection.in_transaction:
                self._connection.execute("ROLLBACK")
            address = self.path.absolute().as_uri() + "?mode=ro"
            self._reader = sqlite3.connect(address, uri=True, check_same_thread=False)
            self._reader.execute("SELECT count(*) FROM sqlite_master").fetchone()

    def close(self) -> None:
        """Commit and close the file."""
        try:
            with self._explaining():
                if self._connection.in_transaction:
                    self._connection.execute("COMMIT")
        finally:
            self._connection.close()
            if self._reader is not None:
                self._reader.close()


def _identity(path: Path) -> tuple[int, int] | None:
    """What distinguishes a file from another of the same name; None where there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def _empty(path: Path) -> sqlite3.Connection:
    """A new, empty database.

    Raises:
        SessionTakenError: the file exists already.
        SessionError: it cannot be written.
    """
    try:
        _make_folder(path.parent)
        try:
            path.open("xb").close()  # of two programs that create it at once, one succeeds
        except FileExistsError as error:
            raise SessionTakenError(
                f"{path} exists already; resume it, or give another name"
            ) from error
        return sqlite3.connect(path, isolation_level=None, check_same_thread=False)
    except (OSError, sqlite3.Error) as error:
        raise SessionError(
            f"{path} cannot be written: {cause_of(error) if isinstance(error, OSError) else error};"
            " give another folder for sessions",
            settings=("sessions",),
        ) from error


def _make_folder(folder: Path) -> None:
    """Make a folder that a loss of power does not take away; SQLite syncs only its last level."""
    missing = [one for one in (folder, *folder.parents) if not one.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    for one in missing:
        with suppress(OSError):  # not every system opens a folder
            place = os.open(one.parent, os.O_RDONLY)
            try:
                os.fsync(place)
            finally:
                os.close(place)
