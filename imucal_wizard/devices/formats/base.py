"""What every wire format gives: rows of numbers under named columns."""

from dataclasses import dataclass
from typing import Protocol

from imucal_wizard.readings import FloatArray


@dataclass(frozen=True)
class Column:
    """One column of a stream.

    Attributes:
        channel: ``t``, ``ax`` … ``az``, ``gx`` … ``gz``, ``mx`` … ``mz``, ``temp``, ``current``,
            ``throttle``, ``counter``, or ``""`` for a column nobody needs.
        unit: unit word as in ``units.py``; ``""`` where it is not known yet.
        name: what the device called it, or its place ("column 3").
    """

    channel: str
    unit: str = ""
    name: str = ""


@dataclass(frozen=True, eq=False)
class Rows:
    """What one piece of bytes decoded to.

    Attributes:
        values: shape (n, number of columns); NaN where a field was empty or not a number.
        malformed: how many lines or frames were thrown away.
        decimals: the largest number of decimals printed, per column; -1 where not text.
        skipped: how many malformed lines came directly before each row, shape (n,); empty when
            none did. A stream without time or counter needs it to stay in step.
    """

    values: FloatArray
    malformed: int = 0
    decimals: tuple[int, ...] = ()
    skipped: tuple[int, ...] = ()


class Decoder(Protocol):
    """Turns bytes into rows. Keeps an unfinished line between calls; touches no port and no clock.

    The rows do not depend on how the bytes were cut into pieces.
    """

    @property
    def name(self) -> str:
        """Name of the format as ``--format`` takes it."""

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns of the rows; empty until they are known."""

    def feed(self, data: bytes) -> Rows:
        """Decode what these bytes complete."""
