"""What every wire format provides: a detector that recognises it, a decoder that gives rows."""

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
        unit: unit word as in ``core.units``; ``""`` where it is not known yet; a word that is no
            unit of the channel stays as it was written.
        name: what the device called it, or its place ("column 3").
    """

    channel: str
    unit: str = ""
    name: str = ""


@dataclass(frozen=True, eq=False)
class DecodedRows:
    """What one piece of bytes decoded to.

    Attributes:
        values: shape (n, number of columns); NaN where a field was empty or not a number.
        malformed: how many lines or frames were dropped.
        decimals: the largest number of decimals printed, per column; -1 where not text.
        skipped: how many malformed lines came directly before each row, shape (n,); empty when
            none did. A stream without time or counter needs it to stay in step.
    """

    values: FloatArray
    malformed: int = 0
    decimals: tuple[int, ...] = ()
    skipped: tuple[int, ...] = ()


@dataclass(frozen=True)
class MalformedLine:
    """The first line that does not fit its format.

    Attributes:
        number: number of the line, from 1.
        line: what it contains.
        width: how many columns it should have.
    """

    number: int
    line: bytes
    width: int


class Decoder(Protocol):
    """Turns bytes into rows. Keeps an unfinished line or frame; touches no port and no clock.

    The rows do not depend on how the bytes were cut into pieces.
    """

    @property
    def name(self) -> str:
        """Name of the format."""

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns of the rows; empty until they are known."""

    @property
    def first_malformed(self) -> MalformedLine | None:
        """The first malformed line; None where there is none, or no lines."""

    def feed(self, data: bytes) -> DecodedRows:
        """Decode the rows that these bytes complete."""

    def broken(self) -> None:
        """The link broke here: an unfinished line or frame will not be completed."""


@dataclass(frozen=True)
class Line:
    """One whole line of a stream.

    Attributes:
        raw: its bytes without the line end.
        text: the same as text.
        first: the stream may have begun in the middle of it.
    """

    raw: bytes
    text: str
    first: bool = False


class FormatDetector(Protocol):
    """Recognises one format. The answer depends on the bytes alone."""

    def feed(self, data: bytes, lines: Sequence[Line]) -> bool:
        """Whether the format is certain.

        Args:
            data: the next bytes, at most one line.
            lines: the readable lines that they complete.
        """


@dataclass(frozen=True)
class Format:
    """One wire format.

    Attributes:
        name: the name under which the user can choose it.
        title: which devices speak it.
        decoder: makes a decoder from the columns, where they are known, and whether the bytes
            begin with a whole line.
        detector: makes a detector from the columns, where they are known; None for a format that
            has no signs of its own and must be chosen by name.
        note: what the user of such a device should know, or ``""``.
        rank: formats of lower rank are tried first: a checksum (0) proves more than a word (1, 2),
            a word more than numbers (3), numbers more than lines that are alike (4).
        binary: the bytes are frames, not lines.
    """

    name: str
    title: str
    decoder: Callable[[tuple[Column, ...], bool], Decoder]
    detector: Callable[[tuple[Column, ...]], FormatDetector] | None
    note: str = ""
    rank: int = 2
    binary: bool = False
