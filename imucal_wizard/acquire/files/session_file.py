"""The format of a session file: an SQLite database with the received bytes.

Tables: ``meta`` (settings as JSON), ``raw`` (bytes and their arrival times), ``command`` (the
operator's commands, each with the number of the last piece of bytes before it), ``hold``,
``rotation`` and ``event`` (results, for people and other programs; this program computes them
again from the bytes).
"""

import json
import math
import shlex
import sqlite3
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any

from imucal_wizard.acquire.files import is_session
from imucal_wizard.core.errors import SessionError
from imucal_wizard.core.output import without_control_characters
from imucal_wizard.core.quantities import times_in_words
from imucal_wizard.core.records import dataclass

SUFFIX = ".imucal"
APPLICATION_ID = 0x494D5543
"""``IMUC`` in the header of the file, which identifies sessions."""
SESSION_VERSION = 1
"""Version of the tables, in the file's ``user_version``."""
_BUSY_SECONDS = 0.5
"""How long opening a session waits for another program that is writing it."""

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


def connect(path: Path) -> sqlite3.Connection:
    """Open an existing session file and verify it.

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
        connection = sqlite3.connect(
            path, timeout=_BUSY_SECONDS, isolation_level=None, check_same_thread=False
        )
        on_failure.callback(connection.close)
        _identify(connection, path)
        on_failure.pop_all()
    return connection


def _identify(connection: sqlite3.Connection, path: Path) -> None:
    application = connection.execute("PRAGMA application_id").fetchone()[0]
    version = connection.execute("PRAGMA user_version").fetchone()[0]
    if application != APPLICATION_ID:
        raise SessionError(f"{path} is a database of another program, not a session; give another")
    if version != SESSION_VERSION:
        newer = "a newer" if version > SESSION_VERSION else "an older"
        raise SessionError(
            f"{path} was written by {newer} imucal-wizard (session version {version}, this program"
            f" reads {SESSION_VERSION}); open it with that one, or update this one"
        )


def session_error(path: Path, error: Exception) -> SessionError:
    """The error of the database as a message that says what to do."""
    if isinstance(error, sqlite3.OperationalError) and "locked" in str(error):
        return SessionError(
            f"{path} is being written by another imucal-wizard; close that one first"
        )
    if isinstance(error, sqlite3.OperationalError) and "full" in str(error):
        return SessionError(
            f"{path}: the disk is full; free some space, the measurements so far are safe"
        )
    if isinstance(error, sqlite3.OperationalError) and "readonly" in str(error):
        return SessionError(f"{path} cannot be written; check who owns the file and its folder")
    return SessionError(
        f"{path} is damaged ({str(error)[:80]}); save what can be read with"
        f" sqlite3 {shlex.quote(str(path))} .recover, or measure again"
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
    except ValueError as error:
        raise sqlite3.DatabaseError(f"a setting is garbled: {error}") from error


def read_pieces(connection: sqlite3.Connection) -> Iterator[tuple[int, float, bytes]]:
    """Number, arrival time in seconds and bytes of each piece, in order."""
    for number, arrival, data in connection.execute(
        "SELECT id, arrival, data FROM raw ORDER BY id"
    ):
        good = isinstance(arrival, float) and math.isfinite(arrival) and isinstance(data, bytes)
        if not good:
            raise sqlite3.DatabaseError(f"piece {number} of the received bytes is garbled")
        yield number, arrival, data


def read_commands(connection: sqlite3.Connection) -> Iterator[Command]:
    """All commands of the operator, in order."""
    for row in connection.execute(
        "SELECT after_raw, sample_index, name, argument FROM command ORDER BY id"
    ):
        if [type(value) for value in row] != [int, int, str, str]:
            raise sqlite3.DatabaseError("a command is garbled")
        yield Command(*row)


def corrections_note(path: Path) -> tuple[str, ...]:
    """A warning if the operator withdrew or repeated measurements; their samples are in the file.

    Raises:
        SessionError: the file is a session that cannot be read.
    """
    if not is_session(path):
        return ()
    with explain_damage(path), closing(connect(path)) as connection:
        connection.execute("PRAGMA query_only = 1")
        (count,) = connection.execute(
            "SELECT COUNT(*) FROM command WHERE name IN ('undo', 'repeat')"
        ).fetchone()
    if not count:
        return ()
    message = (
        f"in the wizard something was taken back or repeated {times_in_words(count)}; here all "
        f"samples of {without_control_characters(path.name)} count, those as well"
    )
    return (message,)


def read_setup_and_pieces(path: Path) -> tuple[dict[str, Any], list[tuple[float, bytes]]]:
    """The settings of a session and its bytes with their arrival times.

    Raises:
        SessionError: the file cannot be read.
    """
    with explain_damage(path), closing(connect(path)) as connection:
        connection.execute("PRAGMA query_only = 1")
        return read_meta(connection), [
            (arrival, data) for _, arrival, data in read_pieces(connection)
        ]
