"""The list of sessions with the step that each has reached."""

import datetime as dt
import sqlite3
from contextlib import closing
from pathlib import Path

from imucal_wizard.acquire.files import session_file
from imucal_wizard.acquire.files.session_file import SUFFIX, explain_damage
from imucal_wizard.core.errors import SessionError
from imucal_wizard.core.records import dataclass


@dataclass(frozen=True)
class SessionInfo:
    """One session file at a glance.

    Attributes:
        path: the file.
        created: when it was begun, seconds since 1970.
        source: what was read, in words.
        step: name of the step it had reached, or "".
        seconds: how long bytes were taken down.
        holds: how many holds it has.
        problem: why it cannot be taken up again, or "".
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
        """Whether its result was reached or saved, so that nothing is left to measure."""
        return self.step in ("result", "validate", "save")


def default_directory() -> Path:
    """The folder of this user's sessions."""
    from platformdirs import user_data_path

    return user_data_path("imucal-wizard", appauthor=False) / "sessions"


def new_session_path(directory: Path, now: dt.datetime) -> Path:
    """A name for a session begun now that no file in the folder has."""
    stem = f"{now:%Y-%m-%d_%H%M%S}"
    path, number = directory / f"{stem}{SUFFIX}", 2
    while _taken(path):
        path, number = directory / f"{stem}-{number}{SUFFIX}", number + 1
    return path


def _taken(path: Path) -> bool:
    """Whether a file has this name; if that is unknown, creating the file reports the cause."""
    try:
        return path.exists()
    except OSError:
        return False


def list_sessions(directory: Path) -> list[SessionInfo]:
    """The sessions in a folder, newest first; each that cannot be resumed has the reason."""
    try:
        paths = sorted(directory.glob(f"*{SUFFIX}"), reverse=True)
    except OSError:  # a folder that cannot be looked into; who writes a session there is told why
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
    except OSError:  # taken away since the folder was looked at
        return 0.0


def _read(path: Path, connection: sqlite3.Connection) -> SessionInfo:
    connection.execute("PRAGMA busy_timeout = 0")
    connection.execute("BEGIN IMMEDIATE")  # refused where it is being written, here or elsewhere
    connection.execute("ROLLBACK")
    about = session_file.read_meta(connection)
    first, last = connection.execute("SELECT min(arrival), max(arrival) FROM raw").fetchone()
    holds = connection.execute("SELECT count(*) FROM hold").fetchone()[0]
    created = float(about.get("created", 0.0))
    dt.datetime.fromtimestamp(created, dt.UTC)  # a time that is none is damage like any other
    return SessionInfo(
        path,
        created,
        str(about.get("source", "")),
        str(about.get("step", "")),
        0.0 if first is None else last - first,
        holds,
    )
