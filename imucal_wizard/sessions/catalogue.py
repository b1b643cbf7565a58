"""The catalogue: devices, calibrations, rechecks and sessions of a folder, in one SQLite file.

The files in the folder are the record: sessions, calibrations and results of rechecks, each
complete by itself. The catalogue only lists them, so that a list opens at once; opening it reads
the files that are new or changed. A damaged or missing catalogue is made again from the files.
Files of one second are listed by their names: ``A.json`` before ``A-2.json``, the shorter first.

>>> with Catalogue(folder) as catalogue:  # doctest: +SKIP
...     kept = catalogue.add_calibration(Path("my.json"))
...     history = catalogue.history("IMU 7")
"""

import datetime as dt
import json
import os
import sqlite3
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self, TypeVar

import msgspec

from imucal_wizard.core.dates import iso_now, seconds_of
from imucal_wizard.core.description import Description
from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.output import encode_json, numbered_names, sanitise, write_atomically
from imucal_wizard.sessions import catalogue_rows as rows_of
from imucal_wizard.sessions.history import (
    DeviceHistory,
    KnownDevice,
    PastCalibration,
    PastParameter,
    PastRecheck,
    PastSensor,
    distinct_names,
)
from imucal_wizard.sessions.session_list import SessionInfo

_T = TypeVar("_T")
CATALOGUE_NAME = "catalogue.sqlite"
_LOCK_SECONDS = 3.0
"""Seconds to wait for another program that changes the catalogue."""
_NOT_NOW = (
    sqlite3.SQLITE_PERM,
    sqlite3.SQLITE_BUSY,
    sqlite3.SQLITE_LOCKED,
    sqlite3.SQLITE_READONLY,
    sqlite3.SQLITE_IOERR,
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_CANTOPEN,
)
"""Errors that do not mean damage: another program, the disk or a permission."""
_MADE_AGAIN = "was damaged; it has been made again from the files: nothing is lost"
_NAMED = 8
"""Devices that an error names."""


class Catalogue:
    """The catalogue of a folder. Used by one thread at a time.

    It never refuses to open: where its file cannot be used (a read-only folder, a full disk,
    another program that holds it), it is made in memory from the files.

    Args:
        folder: of the sessions; it need not exist.

    Attributes:
        folder: the same.
        notes: what the user should know: damage, files that cannot be read.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.notes: tuple[str, ...] = ()
        self._path = folder / CATALOGUE_NAME
        self._connection = self._opened()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def _opened(self) -> sqlite3.Connection:
        """The catalogue, in step with the files; in memory where its own file cannot be used."""
        reason = ""
        for place in (self._path, self._path, None):
            if place is None or not os.path.isdir(self.folder):  # noqa: PTH112 - a name too long is none
                break
            try:
                return self._in_step(str(place))
            except (sqlite3.Error, ValueError, OverflowError) as error:
                reason = str(error)
                code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR) & 0xFF
                if code in _NOT_NOW:
                    break
                if self._removed():
                    self.notes = (f"{self._path} {_MADE_AGAIN}",)
        made = self._in_step(":memory:")
        if reason:
            self.notes = (
                f"{self._path} cannot be used ({reason}); the files themselves were listed",
                *self.notes,
            )
        return made

    def _removed(self) -> bool:
        """Remove a damaged file; another program that has it open goes on with its own copy."""
        try:
            for end in ("", "-journal"):
                self._path.with_name(CATALOGUE_NAME + end).unlink(missing_ok=True)
        except OSError:
            return False
        return True

    def _in_step(self, place: str) -> sqlite3.Connection:
        """Check the catalogue and read the files that are new or changed.

        Raises:
            sqlite3.Error: it is damaged or cannot be used.
        """
        connection = sqlite3.connect(
            place, timeout=_LOCK_SECONDS, isolation_level=None, check_same_thread=False
        )
        with ExitStack() as on_failure:
            on_failure.callback(connection.close)
            connection.execute("BEGIN IMMEDIATE")  # one program at a time
            version = connection.execute("PRAGMA user_version").fetchone()[0]
            if version != rows_of.CATALOGUE_VERSION:
                rows_of.make_tables(connection)
            elif not rows_of.is_sound(connection):
                raise sqlite3.DatabaseError("its digest is another")
            problems = rows_of.update_rows(connection, self.folder)
            connection.execute("COMMIT")
            on_failure.pop_all()
        self.notes += tuple(problems)
        return connection

    def add_calibration(self, path: Path) -> Path:
        """Keep a saved calibration in the history of its device.

        A copy is placed in the folder unless the file or an equal one is there.

        Args:
            path: a calibration file.

        Returns:
            The file in the folder.

        Raises:
            UsageError: it cannot be read, names no device, or the folder cannot be written.
        """
        try:
            data = path.read_bytes()
            document = msgspec.json.decode(data, type=rows_of.Document)
        except (OSError, msgspec.MsgspecError) as error:
            raise UsageError(f"{path} cannot be kept in a history: {error}") from error
        if not rows_of.has_name(document.device):
            raise UsageError(
                f"{path} names no device, so that it belongs to no history", settings=("device",)
            )
        if path.resolve().parent == self.folder.resolve():
            kept = path
        else:
            when = seconds_of(document.measured or document.created) or path.stat().st_mtime
            kept = self._kept(when, "calibration", data)
        self._look_again()
        return kept

    def add_recheck(self, device: Mapping[str, Any], document: Mapping[str, Any]) -> Path:
        """Keep the result of a recheck in the history of a device.

        Args:
            device: ``name`` and ``serial``, as in the calibration file; one of them may be None.
            document: the result, ``imucal-wizard/recheck/1``; ``created`` (ISO 8601) is added
                where it is missing.

        Returns:
            The file in the folder.

        Raises:
            UsageError: the device has neither name nor serial number, or the folder cannot be
                written.
        """
        names = {key: sanitise(device.get(key) or "") or None for key in ("name", "serial")}
        if not rows_of.has_name(rows_of.NamedDevice(**names)):
            raise UsageError("the device has no name, so that it has no history")
        whole = {"created": iso_now(), **document, "device": names}
        when = seconds_of(str(whole["created"])) or time.time()
        kept = self._kept(when, "recheck", encode_json(whole))
        self._look_again()
        return kept

    def _kept(self, when: float, kind: str, data: bytes) -> Path:
        """Write a file of the history under a name of its own; an equal one is kept."""
        stem = f"{dt.datetime.fromtimestamp(when).astimezone():%Y-%m-%d_%H%M%S}.{kind}"
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            for path in numbered_names(self.folder / f"{stem}.json"):
                try:
                    path.open("xb").close()  # of two programs, one gets the name
                except FileExistsError:
                    if path.read_bytes() == data:
                        return path
                else:
                    write_atomically(path, data)
                    break
        except OSError as error:
            raise UsageError(
                f"{self.folder} cannot be written ({error.strerror or error}); give another folder"
                " for sessions",
                settings=("sessions",),
            ) from error
        return path

    def _look_again(self) -> None:
        self._connection.close()
        self.notes = ()
        self._connection = self._opened()

    def _asked(self, question: Callable[[], _T]) -> _T:
        """An answer from the catalogue; a damage that shows only now is mended first."""
        try:
            return question()
        except sqlite3.DatabaseError as error:
            self._connection.close()
            if error.sqlite_errorcode & 0xFF in _NOT_NOW:
                self._connection = self._in_step(":memory:")
            else:
                self._removed()
                self._connection = self._opened()
                self.notes = (*self.notes, f"{self._path} {_MADE_AGAIN}")
            return question()

    def devices(self) -> list[KnownDevice]:
        """All devices, the one that was measured last first."""
        return self._asked(lambda: [device for _, device in self._devices()])

    def _devices(self) -> list[tuple[int, KnownDevice]]:
        rows = self._connection.execute(
            "SELECT id, device.name, device.serial, device.chip, device.format,"
            " count(DISTINCT measurement), count(recheck.file), count(session.file), max(time)"
            " FROM device JOIN label ON label.device = device.id LEFT JOIN calibration USING (file)"
            " LEFT JOIN recheck USING (file) LEFT JOIN session USING (file)"
            " GROUP BY id ORDER BY max(time) DESC, id"
        )
        return [(row[0], KnownDevice(*row[1:])) for row in rows]

    def history(self, device: str | KnownDevice) -> DeviceHistory:
        """The history of a device.

        Args:
            device: its name or serial number, in capitals or not; or one of ``devices``, which
                distinguishes devices of one name.

        Raises:
            UsageError: there is no such device, or there are several.
        """
        return self._asked(lambda: self._history(device))

    def _history(self, device: str | KnownDevice) -> DeviceHistory:
        known = self._devices()
        if isinstance(device, KnownDevice):
            number, found = self._listed(device, known)
        else:
            number, found = self._named(device, known)
        return DeviceHistory(
            found,
            tuple(self._calibrations(number)),
            tuple(self._rechecks(number)),
            tuple(reversed(self._sessions("WHERE device = ?", number))),
        )

    @staticmethod
    def _listed(
        device: KnownDevice, known: list[tuple[int, KnownDevice]]
    ) -> tuple[int, KnownDevice]:
        """The device of the list that has this name and serial number."""
        for number, one in known:
            if (one.name, one.serial) == (device.name, device.serial):
                return number, one
        raise UsageError(
            f"the device {device.name} is no longer in the catalogue; list the devices again"
        )

    def _named(self, device: str, known: list[tuple[int, KnownDevice]]) -> tuple[int, KnownDevice]:
        """The device of this name or serial number."""
        wanted = sanitise(device).casefold()
        same = [one for one in known if one[1].serial.casefold() == wanted] or [
            one for one in known if one[1].name.casefold() == wanted
        ]
        if not same:
            rows = self._connection.execute("SELECT device, name FROM label")
            before = {number for number, name in rows if name.casefold() == wanted}
            same = [one for one in known if one[0] in before]
        if not same:
            listed = distinct_names([one for _, one in known])
            names = ", ".join(listed[:_NAMED]) or "none"
            more = f" and {len(known) - _NAMED} more" if len(known) > _NAMED else ""
            raise UsageError(f"there is no device {sanitise(device)!r} here; known: {names}{more}")
        if len(same) > 1:
            serials = ", ".join(one.serial or "none" for _, one in same)
            raise UsageError(
                f"{len(same)} devices have the name {sanitise(device)!r}: give one of their serial"
                f" numbers, {serials}"
            )
        return same[0]

    def sessions(self) -> list[SessionInfo]:
        """All sessions, newest first; those that cannot be resumed have the reason."""
        return self._asked(lambda: self._sessions(""))

    def _sessions(self, which: str, *values: int) -> list[SessionInfo]:
        grades: dict[str, dict[str, str]] = {}
        for session, sensor, grade in self._connection.execute(
            "SELECT session, sensor, grade FROM calibration JOIN sensor USING (file)"
            " WHERE session != '' ORDER BY saved, length(file), file"
        ):
            grades.setdefault(session, {})[sensor] = grade or "saved"
        rechecks = dict(
            self._connection.execute(
                "SELECT session, verdict FROM recheck WHERE session != ''"
                " ORDER BY checked, length(file), file"
            )
        )
        rows = self._connection.execute(
            "SELECT file, created, source, step, seconds, holds, problem, busy, description"  # noqa: S608 - own words
            f" FROM session JOIN label USING (file) {which}"
            " ORDER BY created DESC, length(file) DESC, file DESC",
            values,
        )
        return [
            SessionInfo(
                self.folder / os.fsdecode(file),
                created,
                source,
                step,
                seconds,
                holds,
                problem,
                bool(busy),
                Description.read(json.loads(description)),
                grades.get(os.fsdecode(file), {}),
                rechecks.get(os.fsdecode(file), ""),
            )
            for file, created, source, step, seconds, holds, problem, busy, description in rows
        ]

    def _calibrations(self, device: int) -> Iterator[PastCalibration]:
        rows = self._connection.execute(
            "SELECT calibration.* FROM calibration JOIN label USING (file) WHERE device = ?"
            " ORDER BY saved, length(file), file",
            (device,),
        )
        newest = {row[4]: row for row in rows}  # of each measurement the one saved last
        for row in sorted(newest.values(), key=lambda row: (row[1], row[2], len(row[0]), row[0])):
            file, measured, saved, session, measurement, low, high, place, operator, note = row
            yield PastCalibration(
                path=self.folder / os.fsdecode(file),
                measured=measured,
                saved=saved,
                session=session,
                measurement=measurement,
                temperature=None if low is None else (low, high),
                place=place,
                operator=operator,
                note=note,
                sensors=self._sensors(file),
            )

    def _sensors(self, file: bytes) -> dict[str, PastSensor]:
        found = {}
        rows = self._connection.execute("SELECT * FROM sensor WHERE file = ?", (file,)).fetchall()
        for row in rows:
            _, name, model, unit, bias_unit, verdict, grade, error, as_found, by, freedom, joint = (
                row
            )
            values = self._connection.execute(
                "SELECT name, value, standard_error, unit, determined FROM parameter"
                " WHERE file = ? AND sensor = ? ORDER BY rowid",
                (file, name),
            )
            found[name] = PastSensor(
                model=tuple(json.loads(model)),
                unit=unit,
                bias_unit=bias_unit,
                verdict=verdict,
                grade=grade,
                error=error,
                as_found=as_found,
                as_found_by=by,
                freedom=freedom,
                parameters={
                    parameter: PastParameter(value, deviation, of, bool(determined))
                    for parameter, value, deviation, of, determined in values
                },
                covariance=json.loads(joint),
            )
        return found

    def _rechecks(self, device: int) -> Iterator[PastRecheck]:
        for file, checked, verdict, calibration, session, document in self._connection.execute(
            "SELECT recheck.* FROM recheck JOIN label USING (file) WHERE device = ?"
            " ORDER BY checked, length(file), file",
            (device,),
        ):
            path = self.folder / os.fsdecode(file)
            yield PastRecheck(path, checked, verdict, calibration, session, json.loads(document))
