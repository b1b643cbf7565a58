"""Bytes to frames: sync bytes, length, checksum; back in step after garbage; bounded memory."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class FrameShape:
    """How the frames of a binary protocol are built.

    Attributes:
        sync: the bytes with which each frame begins.
        header: how many bytes tell the length.
        length: length of the whole frame by its header, 0 where no frame has such a header.
        valid: whether the checksum of a whole frame is right.
    """

    sync: bytes
    header: int
    length: Callable[[bytes], int]
    valid: Callable[[bytes], bool]


class FrameCutter:
    """Cuts frames out of a stream, independently of how the bytes were cut.

    At most one unfinished frame is kept. Bytes that begin no valid frame are dropped one by one,
    so that garbage, or a sync byte inside the data, costs only the frames it spoilt.

    Args:
        shape: how the frames are built.

    Attributes:
        gaps: how often bytes were dropped between two frames.
    """

    def __init__(self, shape: FrameShape) -> None:
        self._shape = shape
        self._rest = b""
        self._any = self._in_step = False
        self.gaps = 0

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
            gap = self._any and not self._in_step
            self.gaps += gap
            frames.append((frame, gap))
            self._any = self._in_step = True
            place += length
        self._rest = data[place:]
        return frames

    def broken(self) -> None:
        """Drop the unfinished frame: the link broke in it."""
        self._rest = b""
        self._any = self._in_step = False


class FrameDetector:
    """Recognises a protocol by some valid frames in a row, with nothing between them."""

    FRAMES_IN_A_ROW = 3

    def __init__(self, shape: FrameShape) -> None:
        self._cutter = FrameCutter(shape)
        self._row = 0

    def feed(self, data: bytes, _lines: object = ()) -> bool:
        """Whether so many frames have come in a row."""
        for _, gap in self._cutter.feed(data):
            self._row = 1 if gap else self._row + 1
        return self._row >= self.FRAMES_IN_A_ROW


def sum8(frame: bytes) -> bool:
    """Whether the last byte is the sum of all others, modulo 256."""
    return sum(frame[:-1]) & 0xFF == frame[-1]
