"""A recording of hours, read in pieces in constant memory.

Plain text, text compressed by gzip, binary frames and sessions are decoded while they are read.
Text that must be rewritten first (two bytes per character, timestamps of a serial monitor, one JSON
list) is read whole.
"""

import zlib
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path

from imucal_wizard.acquire.decode import is_binary
from imucal_wizard.acquire.decode.vocabulary import SENSOR_CHANNELS
from imucal_wizard.acquire.files import RecordingOptions, is_session
from imucal_wizard.acquire.files.file_bytes import (
    MAX_BYTES,
    NotTextError,
    decode_text,
    read_bytes,
    read_start,
)
from imucal_wizard.acquire.files.recording_files import (
    FED_BYTES,
    binary_format,
    line_pieces,
    misfits,
    named_by_file,
    naming_file,
    session_setup,
    setup_of_file,
    unreadable,
)
from imucal_wizard.acquire.intake import Intake
from imucal_wizard.acquire.silent_samples import (
    MAX_SILENT_SHARE,
    SilenceFilter,
    sends_zeros,
    series_of,
    silent_note,
)
from imucal_wizard.acquire.stream_corrections import with_signs
from imucal_wizard.core.errors import RecordingError
from imucal_wizard.core.input import is_file, open_unpacked, unpacked
from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.core.units import COUNT
from imucal_wizard.measurement.unsigned_counts import SignWatch, changed_sign, signs_note


class LongRecording:
    """One file of a recording; iterating reads it.

    Args:
        path: the file.
        options: the user's statements about it.
        place: number of the file in a pair of imu_tk's files.

    Attributes:
        warnings: messages to the user; complete at the end of the iteration.
    """

    def __init__(self, path: Path, options: RecordingOptions, place: int = 0) -> None:
        self._path, self._options, self._place = path, options, place
        self.warnings: tuple[str, ...] = ()

    def __iter__(self) -> Iterator[Readings]:
        """The readings, piece by piece.

        Raises:
            RecordingError: the file cannot be read, or something of it is not known.
        """
        with naming_file(self._path):
            if self._options.as_format is None and is_session(self._path):
                yield from self._session()
            else:
                yield from self._file()

    def _file(self) -> Iterator[Readings]:
        setup = setup_of_file(self._options, self._place)
        # a pipe can be read once only
        whole = None if is_file(self._path) else unpacked(read_bytes(self._path), MAX_BYTES)
        start = read_start(self._path) if whole is None else whole
        lines = start[: start.rfind(b"\n") + 1] or start
        binary = is_binary(setup.format)
        notes: tuple[str, ...] = ()
        text = lines
        try:
            if not binary:
                text, notes = decode_text(lines)
        except NotTextError:
            found = binary_format(start)
            if not found:
                raise
            binary, setup = True, replace(setup, format=found)
        pieces = partial(_pieces_of_file, self._path, text=not binary)
        if text != lines or whole is not None:
            whole = unpacked(read_bytes(self._path), MAX_BYTES) if whole is None else whole
            text, notes = (whole, ()) if binary else decode_text(whole)
            pieces = partial(line_pieces, text)
        beginning = Intake(setup, recording=True)
        beginning.feed(text, 0.0)
        named = named_by_file(setup, beginning, self._path.name)
        signs = _signs(_heard(_decoded(Intake(named, recording=True), pieces()), {}))
        intake, told = Intake(named, recording=True), dict[str, str]()
        silent = dict[str, int]()
        for readings in _heard(_decoded(intake, pieces()), silent):
            signed = with_signs(readings, signs)
            for name in signs.keys() - told.keys():
                changed = changed_sign(getattr(readings, name).values, getattr(signed, name).values)
                if changed is not None:
                    told[name] = signs_note(name, *changed)
            yield signed
        if not intake.samples:
            raise unreadable(intake, setup)
        left_out = (silent_note(*one) for one in silent.items())
        self.warnings = (*notes, *intake.warnings, *left_out, *told.values(), *misfits(intake))

    def _session(self) -> Iterator[Readings]:
        from imucal_wizard.acquire.files.session_file import (
            connect,
            explain_damage,
            read_meta,
            read_pieces,
        )

        with explain_damage(self._path), closing(connect(self._path)) as connection:
            connection.execute("PRAGMA query_only = 1")
            setup = session_setup(self._path, read_meta(connection), self._options)

            def decoded(intake: Intake) -> Iterator[Readings]:
                pieces = read_pieces(connection)
                return _decoded(intake, ((data, arrival) for _, arrival, data in pieces))

            first, intake = Intake(setup), Intake(setup)
            for readings in decoded(first):
                if first.signs or not _counts(readings):
                    break  # a stream shows its signs once, and only counts have any to show
            for readings in decoded(intake):
                yield with_signs(readings, first.signs)
        if not intake.samples:
            raise RecordingError("nothing that can be read was received in this session")
        self.warnings = intake.warnings


def _counts(readings: Readings) -> dict[str, Series]:
    """The sensors that are read in counts."""
    each = {name: getattr(readings, name, None) for name in SENSOR_CHANNELS}
    return {name: one for name, one in each.items() if one is not None and one.unit == COUNT}


def _signs(parts: Iterator[Readings]) -> dict[str, int]:
    """Bits of the counts of a file that were written as unsigned numbers, by sensor."""
    watches, bits = dict[str, SignWatch](), dict[str, int]()
    for readings in parts:
        for name, series in _counts(readings).items():
            if len(series):
                found = watches.setdefault(name, SignWatch()).add(series.values)
                bits[name] = int(found[-1])
        if not any(one.possible for one in watches.values()):
            break
    return {name: one for name, one in bits.items() if one}


def _heard(parts: Iterator[Readings], left_out: dict[str, int]) -> Iterator[Readings]:
    """The readings without silent samples, but of sensors whose zeros the first piece explains.

    Args:
        parts: the readings of a file.
        left_out: receives the number of samples that are left out, by sensor.
    """
    silence: SilenceFilter | None = None
    for readings in parts:
        if silence is None:
            own = series_of(readings)
            silence = SilenceFilter(
                name for name in MAX_SILENT_SHARE if not sends_zeros(name, own[name])
            )
        yield silence.feed(readings)
    left_out |= {} if silence is None else silence.left_out


def _decoded(intake: Intake, pieces: Iterator[tuple[bytes, float]]) -> Iterator[Readings]:
    for data, arrival in pieces:
        readings = intake.feed(data, arrival)
        if readings is not None:
            yield readings
    last = intake.flush()
    if last is not None:
        yield last


def _pieces_of_file(path: Path, *, text: bool) -> Iterator[tuple[bytes, float]]:
    """The bytes of a file, unpacked; the last line of a text only if it is whole.

    Raises:
        RecordingError: the file cannot be read or is damaged.
    """
    try:
        with open_unpacked(path) as file:
            before = b""
            while len(piece := file.read(FED_BYTES)) == FED_BYTES:
                if before:
                    yield before, 0.0
                before = piece
            end = before + piece
            yield decode_text(end)[0] if text else end, 0.0
    except (OSError, EOFError, zlib.error) as error:
        raise RecordingError(f"{path} cannot be read to its end: {error}") from error
