"""What all text formats share: cutting lines, not trusting the first, counting the spoilt."""

from abc import ABC, abstractmethod

import numpy as np

from imucal_wizard.devices.formats.base import Column, Rows
from imucal_wizard.devices.formats.lines import LineCutter
from imucal_wizard.readings import FloatArray

DECIMALS_FROM = 100
"""The printed decimals are counted on this many first rows."""


class TextDecoder(ABC):
    """A decoder of lines. Subclasses turn one line into a row; rows never depend on the cuts."""

    def __init__(self, name: str, columns: tuple[Column, ...] = ()) -> None:
        self._name = name
        self._columns = columns
        self._cutter = LineCutter()
        self._first = True
        self._rows: list[list[float]] = []
        self._skipped: list[int] = []
        self._malformed = 0
        self._skip = 0
        self._count = 0
        self._decimals: list[int] = []

    @property
    def name(self) -> str:
        """Name of the format as ``--format`` takes it."""
        return self._name

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns of the rows; empty until they are known."""
        return self._columns

    def feed(self, data: bytes) -> Rows:
        """Decode the lines that these bytes complete."""
        lines = self._cutter.feed(data)
        if not lines:
            return self._batch(np.zeros((0, len(self._columns))))
        values = self._fast(lines)
        if values is not None:
            self._count += len(values)
            return self._batch(values)
        for line in lines:
            self._line(line)
        rows, self._rows = self._rows, []
        width = len(self._columns)
        return self._batch(np.array(rows, dtype=np.float64).reshape(len(rows), width))

    def _line(self, line: bytes) -> None:
        if line.endswith(b"\x00"):
            self._broken()
            return
        first, self._first = self._first, False
        self._read(line, first)

    @abstractmethod
    def _read(self, line: bytes, first: bool) -> None:
        """Read one line: call ``_row``, ``_spoilt`` or neither."""

    def _broken(self) -> None:
        """The link broke here: the next line may be half of one."""
        self._first = True

    def _fast(self, _lines: list[bytes]) -> FloatArray | None:
        """All lines at once where a format can; None to have them read one by one."""
        return None

    def _row(self, values: list[float], printed: list[int]) -> None:
        """One good row, and the decimals its fields were printed with."""
        self._rows.append(values)
        self._skipped.append(self._skip)
        self._skip = 0
        self._count += 1
        if self._count <= DECIMALS_FROM and printed:
            before = self._decimals or [-1] * len(printed)
            self._decimals = [max(pair) for pair in zip(before, printed, strict=True)]

    def _spoilt(self) -> None:
        """One line that should have been a row; before the first good row it is a banner."""
        if self._count:
            self._malformed += 1
            self._skip += 1

    def _batch(self, values: FloatArray) -> Rows:
        skipped = tuple(self._skipped) if any(self._skipped) else ()
        rows = Rows(values, self._malformed, tuple(self._decimals), skipped)
        self._malformed = 0
        self._skipped = []
        return rows
