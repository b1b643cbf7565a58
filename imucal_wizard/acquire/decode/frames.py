"""Binary frames: cutting them out of a stream, recognising a protocol, decoding them to rows.

Checksums of 16 bits with the polynomial 0x1021 (CRC-CCITT) are in the standard library:
``binascii.crc_hqx``.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence

import numpy as np

from imucal_wizard.acquire.decode.base import Column, DecodedRows, MalformedLine
from imucal_wizard.core.records import dataclass


@dataclass(frozen=True)
class FrameShape:
    """The layout of the frames of a binary protocol.

    Attributes:
        sync: the bytes with which each frame begins.
        header: number of bytes that determine the length.
        length: length of the whole frame from its header; 0 if no frame has this header.
        valid: whether the checksum of a whole frame is correct.
    """

    sync: bytes
    header: int
    length: Callable[[bytes], int]
    valid: Callable[[bytes], bool]


class FrameCutter:
    """Cuts frames out of a stream; the pieces in which the bytes arrive make no difference.

    At most one unfinished frame is kept. Bytes that begin no valid frame are dropped one by one,
    so garbage, or a sync byte inside the data, costs only the frames that it damages.

    Args:
        shape: layout of the frames.
    """

    def __init__(self, shape: FrameShape) -> None:
        self._shape = shape
        self._rest = b""
        self._any = self._in_step = False

    def feed(self, data: bytes) -> list[tuple[bytes, bool]]:
        """The frames that these bytes complete, each with whether bytes were dropped before it."""
        shape, data = self._shape, self._rest + data
        frames: list[tuple[bytes, bool]] = []
        place = 0
        while len(data) - place >= shape.header:
            length = 0
            if data.startswith(shape.sync, place):
                length = shape.length(data[place : place + shape.header])
                if length and len(data) - place < length:
                    break  # the rest of the frame has not arrived
            frame = data[place : place + length]
            if not length or not shape.valid(frame):
                place += 1
                self._in_step = False
                continue
            frames.append((frame, self._any and not self._in_step))
            self._any = self._in_step = True
            place += length
        self._rest = data[place:]
        return frames

    def broken(self) -> None:
        """Drop the unfinished frame after a break of the link."""
        self._rest = b""
        self._any = self._in_step = False


class FrameDecoder(ABC):
    """A decoder of frames. A subclass turns each frame into a row, or several frames into one.

    Args:
        name: name of the format.
        shape: layout of the frames.
        columns: the columns of the rows; empty until they are known.
    """

    first_malformed: MalformedLine | None = None

    def __init__(self, name: str, shape: FrameShape, columns: tuple[Column, ...] = ()) -> None:
        self.name = name
        self.columns = columns
        self._cutter = FrameCutter(shape)
        self._rows: list[Sequence[float]] = []
        self._skipped: list[int] = []
        self._skip = 0
        self._malformed = 0

    def feed(self, data: bytes) -> DecodedRows:
        """Decode the rows that these bytes complete."""
        for frame, gap in self._cutter.feed(data):
            self._read(frame, gap)
        rows, self._rows = self._rows, []
        skipped, self._skipped = self._skipped, []
        malformed, self._malformed = self._malformed, 0
        values = np.array(rows, np.float64).reshape(len(rows), len(self.columns))
        return DecodedRows(values, malformed, (), tuple(skipped) if any(skipped) else ())

    def broken(self) -> None:
        """Drop the unfinished frame after a break of the link."""
        self._cutter.broken()

    @abstractmethod
    def _read(self, frame: bytes, gap: bool) -> None:
        """Read one valid frame: call ``_lost`` if samples were lost before it, then ``_row``.

        Args:
            frame: the whole frame.
            gap: bytes were dropped before it.
        """

    def _row(self, values: Sequence[float]) -> None:
        """Add one row."""
        self._rows.append(values)
        self._skipped.append(self._skip)
        self._skip = 0

    def _lost(self) -> None:
        """Count one lost sample before the next row."""
        self._malformed += 1
        self._skip += 1


class FrameDetector:
    """Recognises a protocol by consecutive valid frames without any bytes between them."""

    FRAMES_IN_A_ROW = 3

    def __init__(self, shape: FrameShape) -> None:
        self._cutter = FrameCutter(shape)
        self._row = 0

    def feed(self, data: bytes, _lines: object = ()) -> bool:
        """Whether enough frames have arrived in a row."""
        for _, gap in self._cutter.feed(data):
            self._row = 1 if gap else self._row + 1
        return self._row >= self.FRAMES_IN_A_ROW


def sum8(frame: bytes) -> bool:
    """Whether the last byte is the sum of all others, modulo 256."""
    return sum(frame[:-1]) & 0xFF == frame[-1]
