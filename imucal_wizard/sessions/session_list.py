"""What a session file says in a list: device, date, and the step that it has reached."""

import dataclasses
import datetime as dt
import os
import sqlite3
from collections.abc import Mapping
from contextlib import closing, suppress
from pathlib import Path

from imucal_wizard.acquire.files import SUFFIX, session_file
from imucal_wizard.acquire.files.session_file import explain_damage
from imucal_wizard.core.description import Description
from imucal_wizard.core.errors import SessionError
from imucal_wizard.core.output import numbered_names, sanitise, without_control_characters
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
        holds: number of holds, without those of the validation where the file tells them apart.
        problem: the reason why it cannot be resumed, or "".
        busy: another program writes it, which is the reason.
        description: device, place and operator, as far as known.
        grades: of each sensor of its newest calibration, by sensor; ``saved`` where a sensor was
            saved without a verdict; empty where nothing was saved.
        recheck: verdict of the recheck that it is, as far as it was kept; or "".
    """

    path: Path
    created: float = 0.0
    source: str = ""
    step: str = ""
    seconds: float = 0.0
    holds: int = 0
    problem: str = ""
    busy: bool = False
    description: Description = Description()
    grades: Mapping[str, str] = dataclasses.field(default_factory=dict)
    recheck: str = ""

    @property
    def finished(self) -> bool:
        """Whether its result was reached or saved, so that no measurement is left."""
        return self.step in ("result", "validate", "save", "verdict")

    @property
    def empty(self) -> bool:
        """Whether nothing has been measured in it yet; its bytes may be of use nevertheless."""
        return not self.holds and self.step in ("", "source", "settle")


def default_directory() -> Path:
    """The folder of this user's sessions."""
    from platformdirs import user_data_path

    return user_data_path("imucal-wizard", appauthor=False) / "sessions"


def new_session_path(directory: Path, now: dt.datetime) -> Path:
    """An unused file name for a new session in the folder."""
    names = numbered_names(directory / f"{now:%Y-%m-%d_%H%M%S}{SUFFIX}")
    return next(path for path in names if not _taken(path))


def _taken(path: Path) -> bool:
    """Whether a file of this name exists; if unknown, creating the file reports the cause."""
    try:
        return os.path.lexists(path)
    except OSError:
        return False


def remove_session(path: Path) -> None:
    """Remove a session into which nothing was measured."""
    for end in ("", "-wal", "-shm"):
        with suppress(OSError):  # an empty file that stays is listed without holds
            path.with_name(path.name + end).unlink(missing_ok=True)


def session_info(path: Path) -> SessionInfo:
    """What one session file says; if it cannot be read, the reason."""
    try:
        with explain_damage(path), closing(session_file.connect(path)) as connection:
            return _read(path, connection)
    except SessionError as error:
        return SessionInfo(path, created=_changed(path), problem=_in_words(error))


def to_be_resumed(path: Path) -> SessionInfo:
    """The same; while a program writes it, the reason why it cannot be resumed.

    Args:
        path: a file to which this program has no connection.
    """
    info = session_info(path)
    if info.problem:
        return info
    try:
        with explain_damage(path):
            writer = session_file.being_written(path)
    except SessionError as error:
        return dataclasses.replace(info, problem=_in_words(error))
    if writer is None:
        return info
    problem = _in_words(session_file.session_error(path, writer))
    return dataclasses.replace(info, problem=problem, busy=True)


def _in_words(error: SessionError) -> str:
    return without_control_characters(str(error))


def _changed(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:  # deleted since the folder was read
        return 0.0


def _read(path: Path, connection: sqlite3.Connection) -> SessionInfo:
    about = session_file.read_meta(connection)
    ends = [
        connection.execute(f"SELECT arrival FROM raw ORDER BY id {way} LIMIT 1").fetchone()  # noqa: S608 - own words
        for way in ("ASC", "DESC")
    ]
    first, last = (None if one is None else float(one[0]) for one in ends)
    # as the result counts them: those of the validation are not fitted
    holds = connection.execute(
        "SELECT count(*) FROM hold WHERE NOT json_valid(value) "
        "OR NOT coalesce(json_extract(value, '$.validation'), 0)"
    ).fetchone()[0]
    created = float(about.get("created", 0.0))
    dt.datetime.fromtimestamp(created, dt.UTC)  # an impossible time is damage
    return SessionInfo(
        path,
        created,
        sanitise(str(about.get("source", ""))),
        sanitise(str(about.get("step", ""))),
        0.0 if first is None or last is None else max(0.0, last - first),
        holds,
        description=session_file.read_description(connection),
    )
