"""Recovery of a damaged session: what can still be read, as a new session."""

import hashlib
import json
import math
import shutil
import sqlite3
from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

from imucal_wizard.acquire.files import SUFFIX, Batch, is_session, session_file
from imucal_wizard.acquire.files.file_bytes import read_bytes
from imucal_wizard.acquire.files.session_file import (
    APPLICATION_ID,
    SESSION_TABLES,
    SESSION_VERSION,
    explain_damage,
    explain_errors,
)
from imucal_wizard.acquire.files.sqlite_pages import PageReader, Row
from imucal_wizard.core.errors import DamagedSessionError, SessionError
from imucal_wizard.core.output import numbered_names, replacing, without_control_characters
from imucal_wizard.core.quantities import times_in_words
from imucal_wizard.core.records import dataclass

_T = TypeVar("_T")
_Tables = dict[str, dict[int, tuple[Any, ...]]]
_CLASSES = {"INTEGER": (int,), "REAL": (float, int), "TEXT": (str,), "BLOB": (bytes,)}
"""Types of stored values by declared type; SQLite stores a whole number as an integer."""
_USUAL_SETTINGS = {"asked": "{}", "setup": "{}", "settings": "{}"}
"""Settings for a session whose own settings are lost."""
_SHOWN_GAPS = 5


@dataclass(frozen=True, eq=False)
class Salvaged:
    """The readable part of a damaged session.

    Attributes:
        connection: a database with the tables of a session, in a temporary file of SQLite.
        pieces: number of pieces of bytes that were read.
        lost: number of pieces that are missing.
        gaps: times before and after what is missing, s on the session's clock.
        commands: number of commands that were read.
        lost_commands: number of commands that are missing.
        settings: whether the settings were read.
    """

    connection: sqlite3.Connection
    pieces: int
    lost: int
    gaps: tuple[tuple[float, float], ...]
    commands: int
    lost_commands: int
    settings: bool

    @property
    def says(self) -> str:
        """What was read and what is lost."""
        lost, count = [], self.pieces + self.lost
        if self.lost:
            gaps = [f"{before:.1f} to {after:.1f} s" for before, after in self.gaps]
            more = len(gaps) - _SHOWN_GAPS
            where = ", ".join(gaps[:_SHOWN_GAPS]) + (f" and {more} more" if more > 0 else "")
            lost.append(f"{self.lost} of {count} pieces of the received bytes (from {where})")
        if self.lost_commands:
            lost.append(f"{self.lost_commands} of {self.commands + self.lost_commands} commands")
        if not self.settings:
            lost.append("the settings, for which the usual ones are taken")
        if not lost:
            return (
                f"the session is damaged; all {count} pieces of the received bytes that the file "
                "still has were read"
            )
        return f"the session is damaged; lost are {'; '.join(lost)}; all else was read"


def salvage(path: Path) -> Salvaged:
    """Read what can be read of a damaged session.

    Raises:
        SessionError: the file cannot be opened, or nothing that was received can be read.
    """
    try:
        tables = _sorted_by_table(PageReader(path))
        changed = path.stat().st_mtime
    except OSError as error:
        raise SessionError(f"{path} cannot be read: {error.strerror or error}") from error
    raw = tables["raw"] = _in_order(tables["raw"])
    if not raw:
        raise SessionError(f"{path} is damaged, and nothing that was received can be read of it")
    meta = {key: value for key, value in tables["meta"].values() if _is_json(value)}
    kept = _USUAL_SETTINGS.keys() <= meta.keys()
    meta = {**_USUAL_SETTINGS, "created": str(changed), **meta}
    tables["meta"] = dict(enumerate(meta.items()))
    pieces, commands = len(raw), len(tables["command"])
    lost_commands = max(tables["command"], default=0) - commands
    gaps = _bridged(raw)
    with explain_errors(path):
        connection = _database(tables)
    return Salvaged(
        connection, pieces, max(raw) - pieces, gaps, commands, lost_commands, settings=kept
    )


def read_session(
    path: Path,
    decode: Callable[[dict[str, Any], Iterator[Batch]], _T],
    size: int,
    longest_pause: Callable[[], float] = lambda: 0.0,
) -> tuple[_T, str]:
    """Decode a session; also returns what of it is lost, in words.

    Args:
        path: the file.
        decode: called with the settings and with batches of pieces and their arrival times, s;
            called again where damage is found on the way.
        size: bytes of a batch, about.
        longest_pause: between pieces that may come as one, s, see ``session_file.read_batches``.

    Raises:
        SessionError: the file cannot be read.
    """
    return _read_or_salvage(
        path,
        lambda one: decode(
            session_file.read_meta(one), session_file.read_batches(one, size, longest_pause)
        ),
    )


def fingerprint(paths: Sequence[Path]) -> str:
    """SHA-256 of the measured data: the bytes received in a session, or whole files.

    A session continues after its result, so its fingerprint includes the number of bytes:
    ``sha256:… of the first 12345 bytes received``.

    Raises:
        InputError: a file cannot be read.
    """
    digest, received = hashlib.sha256(), 0

    def read(connection: sqlite3.Connection) -> tuple["hashlib._Hash", int]:
        so_far, count = digest.copy(), 0
        for _, _, data in session_file.read_pieces(connection):
            so_far.update(data)
            count += len(data)
        return so_far, count

    for path in paths:
        if is_session(path):
            (digest, count), _ = _read_or_salvage(path, read)
            received += count
        else:
            digest.update(read_bytes(path))
    end = f" of the first {received} bytes received" if received else ""
    return f"sha256:{digest.hexdigest()}{end}"


def corrections_note(path: Path) -> tuple[str, ...]:
    """A warning if the operator withdrew or repeated measurements; their samples are in the file.

    Raises:
        SessionError: the file is a session that cannot be read.
    """
    if not is_session(path):
        return ()
    commands, _ = _read_or_salvage(path, lambda one: list(session_file.read_commands(one)))
    count = sum(command.name in ("undo", "repeat") for command in commands)
    if not count:
        return ()
    message = (
        f"in the wizard something was taken back or repeated {times_in_words(count)}; here all "
        f"samples of {without_control_characters(path.name)} count, those as well"
    )
    return (message,)


def _read_or_salvage(path: Path, read: Callable[[sqlite3.Connection], _T]) -> tuple[_T, str]:
    """Read a session, or what can be salvaged of it; also returns what is lost, in words."""
    try:
        with explain_errors(path), closing(session_file.connect(path)) as connection:
            connection.execute("PRAGMA query_only = 1")
            return read(connection), ""
    except DamagedSessionError:
        found = salvage(path)
        with explain_errors(path), closing(found.connection):
            return read(found.connection), found.says


def repair(path: Path) -> tuple[Path, str] | None:
    """Write what can be read of a damaged session to a new file beside it.

    Returns:
        The new file, and what was read and lost; None if the session is whole.

    Raises:
        SessionError: the session is being written, or nothing can be read of it.
        UsageError: the new file cannot be written.
    """
    if _is_whole(path):
        return None
    found = salvage(path)
    names = numbered_names(path.with_name(f"{path.stem}-repaired{SUFFIX}"))
    new = next(one for one in names if not one.exists())
    with closing(found.connection), TemporaryDirectory() as folder, replacing(new) as file:
        draft = Path(folder) / new.name
        with explain_errors(new):
            found.connection.execute("VACUUM INTO ?", (str(draft),))
        with draft.open("rb") as written:
            shutil.copyfileobj(written, file)
    return new, found.says


def _is_whole(path: Path) -> bool:
    """Whether SQLite finds no damage, and every row holds what it must.

    Raises:
        SessionError: the session is being written.
    """
    try:
        with explain_errors(path), closing(session_file.connect(path)) as connection:
            connection.execute("BEGIN IMMEDIATE")
            checked = connection.execute("PRAGMA integrity_check(1)").fetchone()[0]
            with explain_damage(path):
                about = session_file.read_meta(connection)
                deque(session_file.read_pieces(connection), maxlen=0)
                deque(session_file.read_commands(connection), maxlen=0)
            return checked == "ok" and _USUAL_SETTINGS.keys() <= about.keys()
    except DamagedSessionError:
        return False


def _is_json(text: str) -> bool:
    try:
        json.loads(text)
    except (ValueError, RecursionError):
        return False
    return True


def _sorted_by_table(pages: PageReader) -> _Tables:
    """The rows of each table by number.

    A page belongs to the table whose columns fit all its rows. If no table fits, because a part of
    the page is damaged, each row is assigned by itself. If two rows have the same number, the one
    with neighbours in its page counts; the number of the other one is garbled.
    """
    kinds = _columns()
    tables: _Tables = {name: {} for name in kinds}
    alone: list[tuple[dict[int, tuple[Any, ...]], int, tuple[Any, ...]]] = []
    for rows in pages.leaves():
        whole = [name for name, types in kinds.items() if all(_fits(row, types) for row in rows)]
        numbers = {number for number, _ in rows}
        for number, values in rows:
            row = number, values
            fitting = whole or [name for name, types in kinds.items() if _fits(row, types)]
            if fitting:
                table = tables[_of_two(fitting, values)]
                values = (number, *values[1:]) if values[0] is None else values
                if {number - 1, number + 1} & numbers:
                    table.setdefault(number, values)
                else:
                    alone.append((table, number, values))
    for table, number, values in alone:
        table.setdefault(number, values)
    return tables


def _columns() -> dict[str, list[tuple[tuple[type, ...], bool]]]:
    """Of each table, the types of its columns' values and whether None is one of them."""
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript(SESSION_TABLES)
        names = [
            one
            for (one,) in connection.execute("SELECT name FROM sqlite_schema WHERE sql NOT NULL")
        ]
        return {
            name: [
                (
                    (type(None),) if number and of == "INTEGER" else _CLASSES[of],
                    not needed and not number,
                )
                for _, _, of, needed, _, number in connection.execute(f"PRAGMA table_info({name})")
            ]
            for name in names
        }


def _fits(row: Row, types: list[tuple[tuple[type, ...], bool]]) -> bool:
    _, values = row
    return len(values) == len(types) and all(
        isinstance(value, known) or (value is None and may_lack)
        for value, (known, may_lack) in zip(values, types, strict=True)
    )


def _of_two(names: list[str], values: tuple[Any, ...]) -> str:
    """The table of a row that fits ``command`` and ``hold``, as a hold of whole seconds does."""
    if len(names) > 1 and str(values[3])[:1] in ("+", "-"):  # a pose; no command begins so
        return names[-1]
    return names[0]


def _in_order(raw: dict[int, tuple[Any, ...]]) -> dict[int, tuple[Any, ...]]:
    """The most pieces whose arrival times do not decrease: a longest non-decreasing subsequence.

    Others are garbled rows of damaged pages.
    """
    ends: list[float] = []
    last: list[int] = []
    before: dict[int, int] = {}
    for number in sorted(number for number in raw if number > 0):
        arrival = float(raw[number][1])
        if math.isfinite(arrival):
            place = bisect_right(ends, arrival)
            ends[place : place + 1] = [arrival]
            last[place : place + 1] = [number]
            before[number] = last[place - 1] if place else 0
    kept, number = [], last[-1] if last else 0
    while number:
        kept.append(number)
        number = before[number]
    return {number: raw[number] for number in reversed(kept)}


def _bridged(raw: dict[int, tuple[Any, ...]]) -> tuple[tuple[float, float], ...]:
    """Put an empty piece, which marks an interrupted link, where pieces are missing.

    Returns:
        The times before and after each gap, s.
    """
    there = [0, *raw]
    gaps = []
    for number, after in pairwise(there):
        if after > number + 1:
            end = float(raw[after][1])
            gaps.append((float(raw[number][1]) if number else 0.0, end))
            raw[after - 1] = (after - 1, gaps[-1][0], b"")
    return tuple(gaps)


def _database(tables: _Tables) -> sqlite3.Connection:
    """A session of these rows, in a temporary file that ends with the connection."""
    with ExitStack() as on_failure:
        connection = sqlite3.connect("", isolation_level=None, check_same_thread=False)
        on_failure.callback(connection.close)
        connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        connection.execute(f"PRAGMA user_version = {SESSION_VERSION}")
        connection.executescript(SESSION_TABLES)
        connection.execute("BEGIN")
        for name, rows in tables.items():
            if rows:
                marks = ", ".join("?" * len(next(iter(rows.values()))))
                insert = f"INSERT INTO {name} VALUES ({marks})"  # noqa: S608 - own names
                connection.executemany(insert, [rows[number] for number in sorted(rows)])
        connection.execute("COMMIT")
        on_failure.pop_all()
    return connection
