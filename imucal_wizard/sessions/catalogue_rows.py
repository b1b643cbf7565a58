"""The tables of the catalogue, and their rows for each file in its folder."""

import hashlib
import json
import os
import sqlite3
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from imucal_wizard.acquire.files import SUFFIX
from imucal_wizard.core.dates import seconds_of
from imucal_wizard.core.input import MAX_DOCUMENT_BYTES
from imucal_wizard.core.output import encode_json, sanitise
from imucal_wizard.sessions.session_list import to_be_resumed

CALIBRATIONS = b"imucal-wizard/calibration/"
"""Beginning of the schema of calibration files."""
RECHECKS = b"imucal-wizard/recheck/"
"""Beginning of the schema of results of rechecks."""
_HEAD_BYTES = 4096
"""Bytes at the beginning of a file that show its kind."""

_TABLES = """
CREATE TABLE file (name TEXT PRIMARY KEY, changed INTEGER, size INTEGER, problem TEXT);
CREATE TABLE device (id INTEGER PRIMARY KEY, name TEXT, serial TEXT, chip TEXT, format TEXT);
CREATE TABLE label (file TEXT PRIMARY KEY, time REAL, name TEXT, serial TEXT, chip TEXT,
    format TEXT, device INTEGER);
CREATE TABLE calibration (file TEXT PRIMARY KEY, measured REAL, saved REAL, session TEXT,
    measurement TEXT, temperature_low REAL, temperature_high REAL, place TEXT, operator TEXT,
    note TEXT);
CREATE TABLE sensor (file TEXT, sensor TEXT, model TEXT, unit TEXT, bias_unit TEXT, verdict TEXT,
    grade TEXT, error REAL, as_found REAL, as_found_by TEXT, freedom INTEGER, covariance TEXT);
CREATE TABLE parameter (file TEXT, sensor TEXT, name TEXT, value REAL, standard_error REAL,
    unit TEXT, determined INTEGER);
CREATE TABLE recheck (file TEXT PRIMARY KEY, checked REAL, verdict TEXT, calibration TEXT,
    session TEXT, document TEXT);
CREATE TABLE session (file TEXT PRIMARY KEY, created REAL, source TEXT, step TEXT, seconds REAL,
    holds INTEGER, problem TEXT, busy INTEGER, description TEXT);
CREATE TABLE digest (value TEXT);
"""
CATALOGUE_VERSION = zlib.crc32(_TABLES.encode()) >> 1
"""Stands in ``user_version``; a catalogue with other tables is made again."""
_RECORDS = ("label", "calibration", "sensor", "parameter", "recheck", "session")
"""The tables with what a file says, by its name."""


class _Value(msgspec.Struct):
    value: float
    unit: str
    standard_error: float | None = None
    carried: bool = True


class _AsFound(msgspec.Struct):
    error: float | None
    by: str | None = None


class _Sensor(msgspec.Struct):
    parameters: dict[str, _Value]
    unit: str
    bias_unit: str
    model: list[str] = []
    rms_fitted: float | None = None
    rms_held_out: float | None = None
    rms_before: float | None = None
    verdict: str | None = None
    grade: str | None = None
    degrees_of_freedom: int | None = None
    parameter_covariance: list[list[float]] | None = None
    as_found: _AsFound | None = None


class NamedDevice(msgspec.Struct):
    """What a file says of its device.

    Attributes:
        name: given by the user.
        serial: serial number.
        chip: kind of chip.
        format: of its readings.
    """

    name: str | None = None
    serial: str | None = None
    chip: str | None = None
    format: str | None = None


class Document(msgspec.Struct):
    """What the catalogue needs of a calibration file or of a recheck."""

    schema: str
    created: str = ""
    measured: str | None = None
    session: str | None = None
    device: NamedDevice | None = None
    temperature: tuple[float, float] | None = None
    place: dict[str, str] = {}
    operator: str | None = None
    note: str | None = None
    sensors: dict[str, Any] = {}
    hold_means: list[Any] = []
    field_means: list[Any] = []
    table_means: list[Any] = []
    verdict: str = ""
    calibration: str | None = None


def make_tables(connection: sqlite3.Connection) -> None:
    """Empty tables of this version; those of another are dropped."""
    names = connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall()
    for (name,) in names:
        connection.execute(f'DROP TABLE "{name.replace(chr(34), chr(34) * 2)}"')
    for statement in _TABLES.split(";"):
        connection.execute(statement)
    connection.execute(f"PRAGMA user_version = {CATALOGUE_VERSION}")
    connection.execute("INSERT INTO digest VALUES (?)", (_digest(connection),))


def _digest(connection: sqlite3.Connection) -> str:
    """Digest of all rows; SQLite itself does not notice a changed number."""
    made = hashlib.blake2b(digest_size=16)
    for table in ("file", "device", *_RECORDS):
        for row in connection.execute(f"SELECT * FROM {table} ORDER BY rowid"):  # noqa: S608 - own names
            made.update(repr(row).encode("utf-8", "surrogatepass"))
    return made.hexdigest()


def is_sound(connection: sqlite3.Connection) -> bool:
    """Whether every row is what was written."""
    return connection.execute("SELECT value FROM digest").fetchall() == [(_digest(connection),)]


def update_rows(connection: sqlite3.Connection, folder: Path) -> list[str]:
    """Bring the tables in step with the files of a folder.

    Returns:
        Why files that should be listed are not.
    """
    known = {
        name: (changed, size)
        for name, changed, size in connection.execute("SELECT name, changed, size FROM file")
    }
    there = _listed_files(folder)
    changed = [name for name, state in there.items() if known.get(name) != state]
    gone = [name for name in known if name not in there]
    for name in (*changed, *gone):
        _forget(connection, name)
    for name in sorted(changed):
        path, state, problem = folder / os.fsdecode(name), there[name], ""
        if name.endswith(os.fsencode(SUFFIX)):
            if not _add_session(connection, name, path):
                state = (-1, -1)  # it is read again next time
        elif state[1] <= MAX_DOCUMENT_BYTES:
            problem = _add_document(connection, name, path)
        connection.execute("INSERT INTO file VALUES (?, ?, ?, ?)", (name, *state, problem))
    if changed or gone:
        _list_devices(connection)
        connection.execute("UPDATE digest SET value = ?", (_digest(connection),))
    problems = connection.execute("SELECT problem FROM file WHERE problem != '' ORDER BY name")
    return [problem for (problem,) in problems]


def _listed_files(folder: Path) -> dict[bytes, tuple[int, int]]:
    """Sessions and documents of a folder by name, with the time of their last change and size.

    A session that a program is writing, or that one has left without closing it, has its newest
    rows in a second file, whose size counts.
    """
    found: dict[bytes, tuple[int, int]] = {}
    try:
        with os.scandir(folder) as entries:
            there = {os.fsencode(one.name): one for one in entries}
    except OSError:  # no folder yet, or one without permission; writing there reports the cause
        return found
    for name, entry in there.items():
        if not name.endswith((b".json", os.fsencode(SUFFIX))) or name.startswith(b"."):
            continue
        try:
            if entry.is_file():
                state = entry.stat()
                beside = there.get(name + b"-wal")
                more = beside.stat().st_size if beside is not None else 0
                found[name] = (state.st_mtime_ns, state.st_size + more)
        except OSError:  # deleted since the folder was read
            continue
    return found


def _forget(connection: sqlite3.Connection, name: bytes) -> None:
    connection.execute("DELETE FROM file WHERE name = ?", (name,))
    for table in _RECORDS:
        connection.execute(f"DELETE FROM {table} WHERE file = ?", (name,))  # noqa: S608 - own names


def _add_session(connection: sqlite3.Connection, name: bytes, path: Path) -> bool:
    """Read a session; False if another program writes it, or it cannot be read."""
    info = to_be_resumed(path)
    connection.execute(
        "INSERT INTO session VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
        (
            name,
            info.created,
            info.source,
            info.step,
            info.seconds,
            info.holds,
            info.problem,
            info.busy,
            json.dumps(info.description.stated()),
        ),
    )
    about = info.description
    _add_label(connection, name, info.created, NamedDevice(about.device, about.serial, about.chip))
    return not info.problem


def _add_label(
    connection: sqlite3.Connection, name: bytes, time: float, device: NamedDevice | None
) -> None:
    """Which device a file belongs to; found out once all files are read."""
    known = device or NamedDevice()
    said = [sanitise(one or "") for one in (known.name, known.serial, known.chip, known.format)]
    connection.execute("INSERT INTO label VALUES (?, ?, ?, ?, ?, ?, NULL)", (name, time, *said))


def _add_document(connection: sqlite3.Connection, name: bytes, path: Path) -> str:
    """Read a calibration or a recheck.

    Returns:
        Why a file that should be one cannot be read, or "".
    """
    shown = sanitise(name)
    try:
        data = path.read_bytes()
    except OSError as error:
        return f"{shown} cannot be read ({error.strerror or error}); it is not listed"
    if not any(mark in data[:_HEAD_BYTES] for mark in (CALIBRATIONS, RECHECKS)):
        return ""  # a file of another kind
    try:
        found = msgspec.json.decode(data, type=Document)
        if CALIBRATIONS.decode() in found.schema:
            _add_calibration(connection, name, path, found)
        elif RECHECKS.decode() in found.schema:
            _add_recheck(connection, name, path, found, data)
    except (msgspec.MsgspecError, ValueError, OverflowError, RecursionError) as error:
        _forget(connection, name)
        return f"{shown} is damaged ({sanitise(str(error), 80)}); it is not listed"
    return ""


def _add_calibration(
    connection: sqlite3.Connection, name: bytes, path: Path, found: Document
) -> None:
    saved = seconds_of(found.created) or path.stat().st_mtime
    measured = seconds_of(found.measured or "") or saved
    low, high = found.temperature or (None, None)
    means = found.hold_means, found.field_means, found.table_means
    measurement = measurement_key(found.session, *means)
    place = found.place.get("name", "")
    connection.execute(
        "INSERT INTO calibration VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        (
            name,
            measured,
            saved,
            found.session or "",
            measurement or sanitise(name),
            low,
            high,
            *(sanitise(one or "") for one in (place, found.operator, found.note)),
        ),
    )
    for sensor, loose in found.sensors.items():
        one = msgspec.convert(loose, _Sensor)
        error = one.rms_fitted if one.rms_held_out is None else one.rms_held_out
        before = one.as_found or _AsFound(one.rms_before)  # the nominal conversion
        connection.execute(
            "INSERT INTO sensor VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            (
                name,
                sensor,
                json.dumps(one.model),
                one.unit,
                one.bias_unit,
                one.verdict or "",
                one.grade or "",
                error,
                before.error,
                before.by or "",
                one.degrees_of_freedom,
                json.dumps(one.parameter_covariance),
            ),
        )
        connection.executemany(
            "INSERT INTO parameter VALUES (?, ?, ?, ?, ?, ?, ?)",
            [
                (name, sensor, key, p.value, p.standard_error, p.unit, p.carried)
                for key, p in one.parameters.items()
            ],
        )
    _add_label(connection, name, measured, found.device)


def measurement_key(
    session: str | None,
    hold_means: Sequence[Any],
    field_means: Sequence[Any],
    table_means: Sequence[Any],
) -> str:
    """What calibrations of one measurement have in common: the session, else the readings.

    Args:
        session: name of the session's file, or None.
        hold_means: of the calibration file.
        field_means: of the calibration file.
        table_means: of the calibration file.

    Returns:
        "" where neither is known.
    """
    means = [hold_means, field_means, table_means]
    if session or not any(means):
        return session or ""
    return hashlib.blake2b(encode_json(means), digest_size=16).hexdigest()


def _add_recheck(
    connection: sqlite3.Connection, name: bytes, path: Path, found: Document, data: bytes
) -> None:
    checked = seconds_of(found.created) or path.stat().st_mtime
    calibration = sanitise(found.calibration or "")
    connection.execute(
        "INSERT INTO recheck VALUES (?, ?, ?, ?, ?, ?)",
        (
            name,
            checked,
            sanitise(found.verdict),
            calibration,
            found.session or "",
            data.decode(),
        ),
    )
    _add_label(connection, name, checked, found.device)


def _list_devices(connection: sqlite3.Connection) -> None:
    """Find out which files belong to one device: by serial number, else by name.

    A file with a name alone belongs to the device with a serial number that has, or had, this
    name, if there is one only.
    """
    connection.execute("DELETE FROM device")
    rows = connection.execute(
        "SELECT file, name, serial, chip, format FROM label WHERE name || serial != ''"
        " ORDER BY time, length(file), file"
    ).fetchall()
    serials: dict[str, set[str]] = {}
    for _, name, serial, *_ in rows:
        if name and serial:
            serials.setdefault(name.casefold(), set()).add(serial.casefold())
    numbers: dict[tuple[str, str], int] = {}
    for file, name, serial, chip, form in rows:
        known = serials.get(name.casefold(), set())
        own = serial.casefold() or (next(iter(known)) if len(known) == 1 else "")
        key = (own, "" if own else name.casefold())
        number = numbers.setdefault(key, len(numbers) + 1)
        connection.execute("UPDATE label SET device = ? WHERE file = ?", (number, file))
        connection.execute(
            "INSERT INTO device VALUES (?1, ?2, ?3, ?4, ?5) ON CONFLICT (id) DO UPDATE SET"
            " name = coalesce(nullif(?2, ''), name), serial = coalesce(nullif(?3, ''), serial),"
            " chip = coalesce(nullif(?4, ''), chip), format = coalesce(nullif(?5, ''), format)",
            (number, name, serial, chip, form),
        )
    connection.execute("UPDATE device SET name = serial WHERE name = ''")


def has_name(device: NamedDevice | None) -> bool:
    """Whether a device has a name or serial number."""
    return device is not None and bool(sanitise(f"{device.name or ''}{device.serial or ''}"))
