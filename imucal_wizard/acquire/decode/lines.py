"""Lines of text formats: cutting bytes into lines, decoding lines to rows."""

import re
from abc import ABC, abstractmethod

import numpy as np

from imucal_wizard.acquire.decode.base import Column, DecodedRows, MalformedLine
from imucal_wizard.core.readings import FloatArray

MAX_LINE_BYTES = 65_536
"""Bytes; a longer line is not a sample and is replaced by an unreadable one."""
MAX_DECIMALS_ROWS = 100
"""First rows on which the printed decimals are counted."""
_UNREADABLE = b"\x01"
_LINE_FEED = ord("\n")
_MIN_TABLE = 2048
"""Bytes from which reading many lines at once is faster than reading them one by one."""
_PIECE_BYTES = 32_768
"""Bytes in which a spoilt line costs the fast way of reading."""
_WORD = re.compile(rb"[^-+0-9.eEnaNA \t,;|\n]")
"""What is in no line of plain numbers."""


class LineCutter:
    """Cuts bytes into lines and keeps the unfinished one. Lines end in LF, CR or CR LF."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> bytes:
        """The lines that these bytes complete, each ending in LF."""
        data = self._rest + data
        held = False
        if b"\r" in data:
            data = data.replace(b"\r\n", b"\n")
            held = data.endswith(b"\r")  # the line feed may be the next byte
            data = data[:-1].replace(b"\r", b"\n") if held else data.replace(b"\r", b"\n")
        end = data.rfind(b"\n") + 1
        self._rest = data[end : end + MAX_LINE_BYTES + 1] + (b"\r" if held else b"")
        return data[:end]


def split_lines(block: bytes) -> list[bytes]:
    """The lines of a block without their ends; lines that are too long become unreadable."""
    lines = block.split(b"\n")
    lines.pop()
    if len(block) > MAX_LINE_BYTES:
        lines = [line if len(line) <= MAX_LINE_BYTES else _UNREADABLE for line in lines]
    return lines


class TextDecoder(ABC):
    """A decoder of lines. A subclass converts one line to a row.

    Args:
        name: name of the format.
        columns: the columns, if known.
        whole: whether the bytes begin with a whole line; otherwise the first line is not trusted.

    Attributes:
        first_malformed: the first malformed line.
    """

    def __init__(self, name: str, columns: tuple[Column, ...] = (), *, whole: bool = False) -> None:
        self.name = name
        self.columns = columns
        self.first_malformed: MalformedLine | None = None
        self._cutter = LineCutter()
        self._first = not whole
        self._parts: list[FloatArray] = []
        self._rows: list[list[float]] = []
        self._skipped: list[int] = []
        self._malformed = 0
        self._skip = 0
        self._count = 0
        self._number = 0
        self._disproved = False
        self._decimals: list[int] = []

    def feed(self, data: bytes) -> DecodedRows:
        """Decode the lines that these bytes complete."""
        block = self._cutter.feed(data)
        start = 0
        while start < len(block) and self._count < MAX_DECIMALS_ROWS:
            end = end_of_lines(block, start + _MIN_TABLE)
            self._each_line(block[start:end])
            start = end
        block, start = block[start:], 0
        if block and self._table_of(block) is None:
            while start < len(block):
                end = end_of_lines(block, start + _PIECE_BYTES)
                piece = block[start:end]
                if len(piece) == len(block) or self._table_of(piece) is None:
                    self._between_words(piece)
                start = end
        return self._batch()

    def _between_words(self, block: bytes) -> None:
        """Read lines with words, like a header that comes again, one by one, the others at once."""
        start = 0
        while start < len(block):
            word = _WORD.search(block, start)
            place = len(block) if word is None else word.start()
            stop = max(start, block.rfind(b"\n", start, place) + 1)
            plain = block[start:stop]
            if len(plain) == len(block) or self._table_of(plain) is None:
                self._each_line(plain)
            # the line after a spoilt one tells how many samples were lost
            start = end_of_lines(block, end_of_lines(block, stop))
            self._each_line(block[stop:start])

    def _each_line(self, block: bytes) -> None:
        for line in split_lines(block):
            self._line(line)

    def broken(self) -> None:
        """The link was interrupted: drop the unfinished line; the next one may be incomplete."""
        self._cutter = LineCutter()
        self._break()

    def _break(self) -> None:
        """Mark the next line as possibly incomplete."""
        self._first = True

    def _table_of(self, block: bytes) -> FloatArray | None:
        """Read many lines at once if that gives the same rows; None to read them one by one."""
        if (
            len(block) < _MIN_TABLE
            or self._count < MAX_DECIMALS_ROWS
            or self._first
            or self._skip
            or (values := self._table(block)) is None
        ):
            return None
        self._collect()
        self._parts.append(values)
        self._skipped += [0] * len(values)
        self._count += len(values)
        self._number += int(np.count_nonzero(np.frombuffer(block, np.uint8) == _LINE_FEED))
        return values

    def _line(self, line: bytes) -> None:
        self._number += 1
        if not line:
            return
        if line.endswith(b"\x00"):  # sessions of earlier versions marked an interrupted link so
            self._break()
            return
        first, self._first = self._first, False
        self._read(line, first)

    @abstractmethod
    def _read(self, line: bytes, first: bool) -> None:
        """Read one line: call ``_row``, ``_spoilt`` or neither."""

    def _table(self, _block: bytes) -> FloatArray | None:
        """All lines of a block at once if the format can; None to read them one by one."""
        return None

    def _row(self, values: list[float], printed: list[int]) -> None:
        """Add one good row and the decimals with which its fields were printed."""
        if not self._count and not self._disproved:
            self.first_malformed = None  # earlier lines were a banner or the end of a line
        self._rows.append(values)
        self._skipped.append(self._skip)
        self._skip = 0
        self._count += 1
        if self._count <= MAX_DECIMALS_ROWS and printed:
            before = self._decimals or [-1] * len(printed)
            self._decimals = [max(pair) for pair in zip(before, printed, strict=True)]

    def _spoilt(self, line: bytes, *, sample: bool = True) -> None:
        """Count one malformed line; before the first good row it is a banner.

        Args:
            line: the line.
            sample: whether it should have been a row, so that the following rows are one sample
                later.
        """
        if self._count:
            self._malformed += 1
            self._skip += sample
            self.first_malformed = self.first_malformed or MalformedLine(
                self._number, line, len(self.columns)
            )

    def _collect(self) -> None:
        if self._rows:
            self._parts.append(np.array(self._rows, np.float64).reshape(-1, len(self.columns)))
            self._rows = []

    def _batch(self) -> DecodedRows:
        self._collect()
        parts, self._parts = self._parts, []
        empty = np.zeros((0, len(self.columns)))
        values = parts[0] if len(parts) == 1 else np.concatenate(parts) if parts else empty
        skipped = tuple(self._skipped) if any(self._skipped) else ()
        rows = DecodedRows(values, self._malformed, tuple(self._decimals), skipped)
        self._malformed = 0
        self._skipped = []
        return rows


def end_of_lines(block: bytes, place: int) -> int:
    """Where the line that holds a place ends."""
    return block.find(b"\n", place) + 1 or len(block)
