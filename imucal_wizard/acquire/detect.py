"""Detection of the format of a stream, or of the reason why it cannot be read."""

from imucal_wizard.acquire.decode import formats
from imucal_wizard.acquire.decode.base import Column, TextLine
from imucal_wizard.acquire.decode.lines import LineCutter, split_lines

MIN_UNKNOWN_LINES = 60
"""Unknown lines after which the stream is reported as unreadable."""
_SIMILAR_LINES_RANK = 4
"""Rank of the formats that are recognised only by similar lines."""
_MAX_LINE_UNREADABLE = 0.2
"""Share of unprintable bytes in a line of text; a few degree signs are allowed."""
BAUDS = (115200, 921600, 57600, 9600, 230400, 460800, 38400)
"""Baud rates in the order in which they are tried; 1200 is excluded because it resets some
boards."""

_BLOCK_BYTES = 256
"""Bytes after which the stream is judged again."""
_JUDGED_BYTES = 16 * _BLOCK_BYTES
"""Number of the newest bytes that are judged together."""
MAX_UNREADABLE_SHARE = 0.15
"""Share of unreadable bytes above which the stream is not text."""
_READABLE = bytes([*range(32, 127), 9, 10, 13])
_MAGIC: tuple[tuple[bytes, str], ...] = (
    (b"\xfa\xff\x36", "Xsens MTData2"),
    (b"\x75\x65\x80", "MicroStrain MIP"),
    (b"\x55\x61", "WitMotion BLE"),
    (b"\xff\x5a", "SBG"),
    (b"\xfa\x14", "VectorNav binary"),
)
_MIN_MAGIC_COUNT = 6
"""Occurrences of start bytes that identify a protocol; random bytes contain hardly any."""


class GarbageDetector:
    """Tracks the share of bytes that do not occur in text, in blocks of equal size."""

    def __init__(self) -> None:
        self._block = b""
        self._seen = b""
        self._text_since_line = 0
        self.problem = ""

    def feed(self, data: bytes) -> None:
        """Add received bytes."""
        self._text_since_line = 0 if b"\n" in data else self._text_since_line + len(data)
        data = self._block + data
        whole = len(data) - len(data) % _BLOCK_BYTES
        for start in range(0, whole, _BLOCK_BYTES):
            self._seen = (self._seen + data[start : start + _BLOCK_BYTES])[-_JUDGED_BYTES:]
            self._judge()
        self._block = data[whole:]

    def _judge(self) -> None:
        if unreadable_share(self._seen) > MAX_UNREADABLE_SHARE:
            protocol = binary_protocol(self._seen)
            self.problem = (
                _binary(protocol) if protocol else wrong_speed_text(unreadable_share(self._seen))
            )
        elif self._text_since_line > _JUDGED_BYTES:
            self.problem = (
                "Text arrives without line ends: print every sample with println or a newline."
            )
        else:
            self.problem = ""


def unreadable_share(data: bytes) -> float:
    """The share of bytes that do not occur in text, 0 to 1."""
    return len(data.translate(None, _READABLE)) / len(data) if data else 0.0


def binary_protocol(data: bytes) -> str:
    """The protocol whose start bytes occur repeatedly; ``""`` if none does."""
    found = [(data.count(magic), name) for magic, name in _MAGIC]
    count, name = max(found)
    return name if count >= _MIN_MAGIC_COUNT else ""


def wrong_speed_text(share: float, baud: int | None = None) -> str:
    """Message about bytes that are not text, with the speeds to try."""
    others = ", ".join(str(speed) for speed in BAUDS if speed != baud)
    at = f" at {baud} baud" if baud else ""
    return (
        f"The received data{at} are not text ({share:.0%} unreadable): the speed is probably "
        f"wrong. Set the speed of the device's program; common ones are {others}."
    )


def _binary(protocol: str) -> str:
    return (
        f"This looks like the binary protocol of {protocol}, which is not supported: switch the "
        f"device to text (ASCII) output."
    )


class Detector:
    """Feeds lines to the detectors of all formats until one is certain.

    The answer depends only on the bytes, not on how they were divided.

    Args:
        columns: the columns, if known.
        whole: whether the bytes begin with a whole line.
    """

    def __init__(self, columns: tuple[Column, ...] = (), *, whole: bool = False) -> None:
        self._detectors = {
            name: one.detector(columns) for name, one in formats().items() if one.detector
        }
        self._cutter = LineCutter()
        self._garbage = GarbageDetector()
        self._first = not whole
        self._lines = 0

    @property
    def problem(self) -> str:
        """The reason why nothing can be read and what to do, or ``""``."""
        if self._garbage.problem:
            return self._garbage.problem
        if self._lines < MIN_UNKNOWN_LINES:
            return ""
        return (
            "The lines are in no known format: print the samples as "
            "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s],gz[rad/s], or choose the "
            "format."
        )

    def feed(self, data: bytes) -> str:
        """The name of the format; ``""`` while it is not certain.

        Args:
            data: at most one line.
        """
        self._garbage.feed(data)
        lines = []
        for raw in filter(None, split_lines(self._cutter.feed(data))):
            self._lines += 1
            if unreadable_share(raw) <= _MAX_LINE_UNREADABLE:
                text = raw.decode("utf-8", errors="replace").strip()
                lines.append(TextLine(raw, text, self._first))
            self._first = False
        found = [name for name, one in self._detectors.items() if one.feed(data, lines)]
        if self._garbage.problem:  # similar lines between unreadable bytes are not a format
            found = [name for name in found if formats()[name].rank < _SIMILAR_LINES_RANK]
        return found[0] if found else ""
