"""The format of a session file: an SQLite database with the received bytes.

Tables: ``meta`` (settings as JSON), ``raw`` (bytes and their arrival times), ``command`` (the
operator's commands, each with the number of the last piece of bytes before it), ``hold``,
``rotation`` and ``event`` (results, for people and other programs; this program computes them
again from the bytes), ``checkpoint`` (the state of the procedure, so that this need not begin with
the first byte).
"""

import json
import math
import os
import shlex
import sqlite3
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any

from imucal_wizard.acquire.files import SUFFIX, Batch, is_session, log_of
from imucal_wizard.core.description import Description
from imucal_wizard.core.errors import DamagedSessionError, SessionError
from imucal_wizard.core.output import why_it_cannot_grow
from imucal_wizard.core.records import dataclass

APPLICATION_ID = 0x494D5543
"""``IMUC`` in the header of the file, which identifies sessions."""
SESSION_VERSION = 1
"""Version of the tables, in the file's ``user_version``."""
DESCRIBE_COMMAND = "describe"
"""Name of the command that states the device; it does not change the procedure."""
_ROWS_AT_ONCE = 256
_BUSY_SECONDS = 0.5
"""How long opening a session waits for another program that is writing it. A commit, the disk
included, usually ends sooner."""
_BETWEEN_TRIES = 0.005
"""Seconds between two tries of a lock."""

SESSION_TABLES = """
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE raw (id INTEGER PRIMARY KEY, arrival REAL NOT NULL, data BLOB NOT NULL);
CREATE TABLE command (id INTEGER PRIMARY KEY, after_raw INTEGER NOT NULL,
                      sample_index INTEGER NOT NULL, name TEXT NOT NULL, argument TEXT NOT NULL);
CREATE TABLE hold (id INTEGER PRIMARY KEY, start REAL NOT NULL, end REAL NOT NULL,
                   pose TEXT, value TEXT NOT NULL);
CREATE TABLE rotation (id INTEGER PRIMARY KEY, start REAL NOT NULL, end REAL NOT NULL,
                       axis TEXT, problem TEXT, value TEXT NOT NULL);
CREATE TABLE event (id INTEGER PRIMARY KEY, time REAL NOT NULL, kind TEXT NOT NULL,
                    text TEXT NOT NULL);
"""


@dataclass(frozen=True)
class Command:
    """A command of the operator and its position in the stream.

    Attributes:
        after_raw: number of the last piece of bytes taken before it.
        sample_index: number of samples that the procedure had received.
        name: the command.
        argument: its argument.
    """

    after_raw: int
    sample_index: int
    name: str
    argument: str


def connect(path: Path, *, writes: bool = False) -> sqlite3.Connection:
    """Open an existing session file and verify it.

    Args:
        path: the file.
        writes: it is to be continued; else it can be read where nobody can write.

    Raises:
        SessionError: it is missing, no session, damaged, or of another version.
    """
    try:
        there = path.exists()
    except OSError as error:  # a name that is too long, a folder without permission
        raise SessionError(
            f"{path} cannot be read ({error.strerror}); check the name and who owns its folder"
        ) from error
    if not there:
        raise SessionError(f"{path}: there is no such session; check the name")
    if not is_session(path):
        raise SessionError(f"{path} is not a session of this program; give an {SUFFIX} file")
    with explain_errors(path), ExitStack() as on_failure:
        if writes:
            _wait_for_writer(path)
        connection = sqlite3.connect(
            path.absolute().as_uri() if writes else _address(path),
            timeout=_BUSY_SECONDS,
            isolation_level=None,
            check_same_thread=False,
            uri=True,
        )
        on_failure.callback(connection.close)
        _identify(connection, path)
        on_failure.pop_all()
    return connection


def _wait_for_writer(path: Path) -> None:
    """Wait until no program writes a session.

    Raises:
        sqlite3.Error: one goes on writing it, or it cannot be read.
    """
    end = time.monotonic() + _BUSY_SECONDS
    while (refused := being_written(path)) is not None:
        if time.monotonic() > end:
            raise refused
        time.sleep(_BETWEEN_TRIES)


def being_written(path: Path) -> sqlite3.OperationalError | None:
    """The error that refuses a second writer while a program writes a session, or None.

    A writer releases its lock between two commits. While another connection to the session is open,
    the lock is therefore tried for as long as that takes.

    Args:
        path: a session; this program has no connection to it.

    Raises:
        sqlite3.Error: the file cannot be read.
    """
    if not os.access(path, os.W_OK):  # it can only be read here, whoever writes it
        return None
    end = time.monotonic() + _BUSY_SECONDS
    with closing(sqlite3.connect(_address(path), 0.0, isolation_level=None, uri=True)) as database:
        database.execute("PRAGMA locking_mode = EXCLUSIVE")
        if _refused(database, "SELECT count(*) FROM sqlite_master") is None:
            return None  # nobody else has it open
        database.execute("PRAGMA locking_mode = NORMAL")
        while (refused := _refused(database, "BEGIN IMMEDIATE")) is None:
            database.execute("ROLLBACK")
            if time.monotonic() > end:
                return None
            time.sleep(_BETWEEN_TRIES)
        return refused


def _refused(database: sqlite3.Connection, statement: str) -> sqlite3.OperationalError | None:
    """The error of a statement that another connection refuses.

    Raises:
        sqlite3.Error: it fails for another reason.
    """
    try:
        database.execute(statement)
    except sqlite3.OperationalError as error:
        if error.sqlite_errorcode & 0xFF != sqlite3.SQLITE_BUSY:
            raise
        return error
    return None


def _address(path: Path) -> str:
    """The file for reading; SQLite writes beside it, except where the folder refuses that."""
    log = log_of(path)
    still = not os.access(path.parent, os.W_OK) and not (log.exists() and log.stat().st_size)
    return path.absolute().as_uri() + ("?immutable=1" if still else "")


def _identify(connection: sqlite3.Connection, path: Path) -> None:
    application = connection.execute("PRAGMA application_id").fetchone()[0]
    version = connection.execute("PRAGMA user_version").fetchone()[0]
    known = application == APPLICATION_ID and version == SESSION_VERSION
    if not known and connection.execute("PRAGMA quick_check(1)").fetchone()[0] != "ok":
        raise sqlite3.DatabaseError("its header is garbled")
    if application != APPLICATION_ID:
        raise SessionError(f"{path} is a database of another program, not a session; give another")
    if version != SESSION_VERSION:
        newer = "a newer" if version > SESSION_VERSION else "an older"
        raise SessionError(
            f"{path} was written by {newer} imucal-wizard (session version {version}, this program"
            f" reads {SESSION_VERSION}); open it with that one, or update this one"
        )


_NOT_WRITTEN = dict.fromkeys(
    (
        "SQLITE_IOERR_WRITE",
        "SQLITE_IOERR_FSYNC",
        "SQLITE_IOERR_DIR_FSYNC",
        "SQLITE_IOERR_TRUNCATE",
        "SQLITE_IOERR_SHMOPEN",
        "SQLITE_IOERR_SHMSIZE",
    ),
    "the disk does not work",
)
"""The database's errors of writing, and their cause if no other is found."""


def no_room_error(path: Path, cause: str) -> SessionError:
    """The error of a session whose disk takes no more."""
    return SessionError(f"{path} cannot be written: {cause}", settings=("sessions",))


def session_error(path: Path, error: Exception) -> SessionError:
    """The error of the database as a message that says what to do."""
    if isinstance(error, sqlite3.OperationalError) and "locked" in str(error):
        return SessionError(
            f"{path} is being written by another imucal-wizard; close that one first"
        )
    if isinstance(error, sqlite3.OperationalError):
        name = getattr(error, "sqlite_errorname", "")
        if name == "SQLITE_FULL" or name in _NOT_WRITTEN:
            # SQLite does not distinguish a quota or a limit from a disk that does not work
            log = log_of(path)
            cause = why_it_cannot_grow(path, log) or _NOT_WRITTEN.get(name, "the disk is full")
            return no_room_error(path, cause)
        if "unable to open" in str(error):
            return SessionError(
                f"{path} cannot be opened; copy it, with the files beside it whose names begin like"
                " its own, to a folder that can be written"
            )
        if "readonly" in str(error):
            return SessionError(f"{path} cannot be written; check who owns the file and its folder")
    return DamagedSessionError(
        f"{path} is damaged ({str(error)[:80]}); write what can be read of it to a new file",
        settings=(f"repair {shlex.quote(str(path))}",),
    )


@contextmanager
def explain_errors(path: Path) -> Iterator[None]:
    """Convert errors of the database to errors that say what to do.

    Raises:
        SessionError: instead of an error of the database.
    """
    try:
        yield
    except (sqlite3.Error, UnicodeDecodeError) as error:  # a message may quote what is damaged
        raise session_error(path, error) from error


@contextmanager
def explain_damage(path: Path) -> Iterator[None]:
    """The same while values are read: a value of the wrong type is damage.

    Raises:
        SessionError: the file is damaged.
    """
    try:
        with explain_errors(path):
            yield
    except (TypeError, ValueError, OverflowError, AttributeError) as error:
        raise session_error(path, error) from error


def read_meta(connection: sqlite3.Connection) -> dict[str, Any]:
    """All settings by name."""
    rows = connection.execute("SELECT key, value FROM meta")
    try:
        return {key: json.loads(value) for key, value in rows}
    except (ValueError, TypeError, RecursionError) as error:
        raise sqlite3.DatabaseError(f"a setting is garbled: {error}") from error


def read_pieces(
    connection: sqlite3.Connection, after: int = 0
) -> Iterator[tuple[int, float, bytes]]:
    """Number, arrival time in seconds and bytes of each piece, in order, from the one after."""
    rows = connection.execute(
        "SELECT id, arrival, data FROM raw WHERE id > ? ORDER BY id", (after,)
    )
    while some := rows.fetchmany(_ROWS_AT_ONCE):
        _, arrivals, datas = zip(*some, strict=True)
        _check_pieces(arrivals, datas)
        yield from some


def read_batches(
    connection: sqlite3.Connection, size: int, longest_pause: Callable[[], float] = lambda: 0.0
) -> Iterator[Batch]:
    """Bytes and arrival time in seconds of each piece, in order.

    Args:
        connection: to a session.
        size: bytes of a batch, about.
        longest_pause: seconds between the arrivals of pieces that may come as one, which the
            database joins in a third of the time; asked before each batch.
    """
    last, count, length = 0, _ROWS_AT_ONCE, 0
    while True:
        pause = longest_pause() if length else 0.0
        joined = _joined_pieces(connection, last, count, pause) if pause else None
        if joined is not None:
            yield joined
            last, length = last + count, len(joined[0])
        else:
            some = connection.execute(
                "SELECT data, arrival, id FROM raw WHERE id > ? ORDER BY id LIMIT ?", (last, count)
            ).fetchall()
            if not some:
                return
            datas, arrivals, numbers = zip(*some, strict=True)
            _check_pieces(arrivals, datas)
            yield list(zip(datas, arrivals, strict=True))
            last, length = numbers[-1], sum(map(len, datas))
        count = max(1, count * size // max(length, 1))


def _joined_pieces(
    connection: sqlite3.Connection, last: int, count: int, longest_pause: float
) -> tuple[bytes, float, float] | None:
    """The next pieces as one.

    Args:
        connection: to a session.
        last: number of the last piece before them.
        count: how many.
        longest_pause: between two arrivals, s.

    Returns:
        Their bytes, the arrivals of the last and of the first; None if a piece is missing, garbled
        or empty, or came after a longer pause.
    """
    between = (last, last + count)
    found, pause, data = connection.execute(
        # in the order of values, a large number comes before all text and bytes, and empty bytes
        # come after all text; CROSS makes a the outer loop, which goes by its key
        "SELECT count(*), max(b.arrival - a.arrival), CAST(group_concat(b.data, '') AS BLOB)"
        " FROM raw a CROSS JOIN raw b ON b.id = a.id + 1 WHERE a.id >= ? AND a.id < ?"
        " AND b.data > x'' AND b.arrival < 1e300",
        between,
    ).fetchone()
    if found < count or not pause <= longest_pause:
        return None
    first, end = (
        connection.execute("SELECT arrival FROM raw WHERE id = ?", (number,)).fetchone()[0]
        for number in (last + 1, last + count)
    )
    return data, end, first


def _check_pieces(arrivals: Sequence[Any], datas: Sequence[Any]) -> None:
    if {*map(type, arrivals)} != {float} or {*map(type, datas)} != {bytes}:
        raise sqlite3.DatabaseError("a piece of the received bytes is garbled")
    if not (math.isfinite(sum(arrivals)) or all(map(math.isfinite, arrivals))):
        raise sqlite3.DatabaseError("the time of a piece of the received bytes is garbled")


def read_commands(connection: sqlite3.Connection) -> Iterator[Command]:
    """All commands of the operator, in order."""
    for row in connection.execute(
        "SELECT after_raw, sample_index, name, argument FROM command ORDER BY id"
    ):
        if [type(value) for value in row] != [int, int, str, str]:
            raise sqlite3.DatabaseError("a command is garbled")
        yield Command(*row)


def read_description(connection: sqlite3.Connection) -> Description:
    """Device, place and operator as they were stated last."""
    stated = connection.execute(
        "SELECT argument FROM command WHERE name = ? ORDER BY id DESC LIMIT 1", (DESCRIBE_COMMAND,)
    ).fetchone()
    loose = read_meta(connection).get("description") if stated is None else json.loads(stated[0])
    return Description.read(loose if isinstance(loose, dict) else {})
