"""The list of sessions, each with the step that it has reached."""

import datetime as dt
import os
import sqlite3
from contextlib import closing
from pathlib import Path

from imucal_wizard.acquire.files import session_file
from imucal_wizard.acquire.files.session_file import SUFFIX, explain_damage
from imucal_wizard.core.errors import SessionError
from imucal_wizard.core.records import dataclass


@dataclass(frozen=True)
class SessionInfo:
    """Summary of a session file.

    Attributes:
        path: the file.
        created: start of the session, seconds since 1970.
        source: description of the source.
        step: name of the step reached, or "".
        seconds: duration of the recording, s.
        holds: number of holds.
        problem: the reason why it cannot be resumed, or "".
    """

    path: Path
    created: float = 0.0
    source: str = ""
    step: str = ""
    seconds: float = 0.0
    holds: int = 0
    problem: str = ""

    @property
    def finished(self) -> bool:
        """Whether its result was reached or saved, so that no measurement is left."""
        return self.step in ("result", "validate", "save")


def default_directory() -> Path:
    """The folder of this user's sessions."""
    from platformdirs import user_data_path

    return user_data_path("imucal-wizard", appauthor=False) / "sessions"


def new_session_path(directory: Path, now: dt.datetime) -> Path:
    """An unused file name for a new session in the folder."""
    stem = f"{now:%Y-%m-%d_%H%M%S}"
    path, number = directory / f"{stem}{SUFFIX}", 2
    while _taken(path):
        path, number = directory / f"{stem}-{number}{SUFFIX}", number + 1
    return path


def _taken(path: Path) -> bool:
    """Whether a file of this name exists; if unknown, creating the file reports the cause."""
    try:
        return os.path.lexists(path)
    except OSError:
        return False


def list_sessions(directory: Path) -> list[SessionInfo]:
    """The sessions in a folder, newest first; those that cannot be resumed have the reason."""
    try:
        paths = sorted(directory.glob(f"*{SUFFIX}"), reverse=True)
    except OSError:  # an unreadable folder; writing a session there reports the cause
        return []
    found = [_info(path) for path in paths]
    return sorted(found, key=lambda info: info.created, reverse=True)


def _info(path: Path) -> SessionInfo:
    try:
        with explain_damage(path), closing(session_file.connect(path)) as connection:
            return _read(path, connection)
    except SessionError as error:
        return SessionInfo(path, created=_changed(path), problem=str(error))


def _changed(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:  # deleted since the folder was read
        return 0.0


def _read(path: Path, connection: sqlite3.Connection) -> SessionInfo:
    connection.execute("PRAGMA busy_timeout = 0")
    connection.execute("BEGIN IMMEDIATE")  # refused while it is being written, here or elsewhere
    connection.execute("ROLLBACK")
    about = session_file.read_meta(connection)
    first, last = connection.execute("SELECT min(arrival), max(arrival) FROM raw").fetchone()
    holds = connection.execute("SELECT count(*) FROM hold").fetchone()[0]
    created = float(about.get("created", 0.0))
    dt.datetime.fromtimestamp(created, dt.UTC)  # an impossible time is damage
    return SessionInfo(
        path,
        created,
        str(about.get("source", "")),
        str(about.get("step", "")),
        0.0 if first is None else last - first,
        holds,
    )
