"""The interface of a wire format: a detector that recognises it and a decoder that gives rows."""

from collections.abc import Callable, Sequence
from typing import Protocol

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass


@dataclass(frozen=True)
class Column:
    """One column of a stream or file.

    Attributes:
        channel: ``t``, ``ax`` … ``az``, ``gx`` … ``gz``, ``mx`` … ``mz``, ``temp``, ``current``,
            ``throttle``, ``counter``, or ``""`` for a column that is not used.
        unit: unit as in ``core.units``; ``""`` while unknown; a word that is not a unit of the
            channel stays as it was written.
        name: name given by the device, or its position ("column 3").
    """

    channel: str
    unit: str = ""
    name: str = ""


def axes(letter: str, unit: str) -> tuple[Column, ...]:
    """The three columns of a sensor in one unit, named ``ax``, ``ay``, ``az`` for ``a``."""
    return tuple(Column(letter + axis, unit, letter + axis) for axis in "xyz")


@dataclass(frozen=True, eq=False)
class DecodedRows:
    """The rows decoded from a piece of bytes.

    Attributes:
        values: shape (n, number of columns); NaN if a field was empty or not a number.
        malformed: number of dropped lines or frames.
        decimals: largest number of printed decimals per column; -1 if the column is not text.
        skipped: number of malformed lines directly before each row, shape (n,); empty if there were
            none. A stream without time or counter needs it to keep its time.
    """

    values: FloatArray
    malformed: int = 0
    decimals: tuple[int, ...] = ()
    skipped: tuple[int, ...] = ()


@dataclass(frozen=True)
class MalformedLine:
    """The first line that does not fit the format.

    Attributes:
        number: line number, from 1.
        line: its content.
        width: number of columns that it should have.
    """

    number: int
    line: bytes
    width: int


class Decoder(Protocol):
    """Converts bytes to rows. Keeps an unfinished line or frame; uses no port and no clock.

    The rows do not depend on how the bytes were divided.
    """

    @property
    def name(self) -> str:
        """Name of the format."""

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns of the rows; empty until they are known."""

    @property
    def first_malformed(self) -> MalformedLine | None:
        """The first malformed line; None if there is none, or if the format has no lines."""

    def feed(self, data: bytes) -> DecodedRows:
        """Decode the rows that these bytes complete."""

    def broken(self) -> None:
        """The link was interrupted: drop the unfinished line or frame."""


@dataclass(frozen=True)
class TextLine:
    """One whole line of a stream.

    Attributes:
        raw: its bytes without the line end.
        text: the same as text.
        first: whether the stream may have begun in the middle of the line.
    """

    raw: bytes
    text: str
    first: bool = False


def is_object(line: bytes) -> bool:
    """Whether a line looks like a JSON object."""
    return line.lstrip().startswith(b"{") and b":" in line


class FormatDetector(Protocol):
    """Recognises one format. The answer depends only on the bytes."""

    def feed(self, data: bytes, lines: Sequence[TextLine]) -> bool:
        """Whether the format is certain.

        Args:
            data: the next bytes, at most one line.
            lines: the readable lines that these bytes complete.
        """


@dataclass(frozen=True)
class Format:
    """One wire format.

    Attributes:
        name: name under which the user can choose it.
        title: devices or programs that use it.
        decoder: makes a decoder from the columns, if known, and whether the bytes begin with a
            whole line.
        detector: makes a detector from the columns, if known; None for a format that cannot be
            recognised and must be chosen by name.
        note: message to users of such a device, or ``""``.
        rank: formats of lower rank are tried first: a checksum (0) proves more than a keyword (1,
            2), a keyword more than numbers (3), numbers more than similar lines (4).
        binary: whether the bytes are frames and not lines.
    """

    name: str
    title: str
    decoder: Callable[[tuple[Column, ...], bool], Decoder]
    detector: Callable[[tuple[Column, ...]], FormatDetector] | None
    note: str = ""
    rank: int = 2
    binary: bool = False
