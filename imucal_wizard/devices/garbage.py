"""Bytes that are no text: the wrong speed, or a binary protocol."""

BAUDS = (115200, 921600, 57600, 9600, 230400, 460800, 38400)
"""Speeds in the order in which they are worth trying; never 1200, which resets some boards."""

_BLOCK = 256
_SEEN = 16 * _BLOCK
"""How many of the newest bytes are judged together."""
_TOO_MANY = 0.15
_READABLE = bytes([*range(32, 127), 9, 10, 13])
_MAGIC: tuple[tuple[bytes, str], ...] = (
    (b"\xfa\xff\x36", "Xsens MTData2"),
    (b"\x75\x65\x80", "MicroStrain MIP"),
    (b"\x55\x51", "WitMotion"),
    (b"\x55\x61", "WitMotion"),
    (b"\xff\x5a", "SBG"),
    (b"\xfa\x14", "VectorNav binary"),
)
_OFTEN = 6


class Garbage:
    """Watches the share of bytes that no text contains, in blocks of equal size."""

    def __init__(self) -> None:
        self._block = b""
        self._seen = b""
        self._text_since_line = 0
        self.problem = ""

    def feed(self, data: bytes) -> None:
        """Look at what has come."""
        self._text_since_line = 0 if b"\n" in data else self._text_since_line + len(data)
        data = self._block + data
        whole = len(data) - len(data) % _BLOCK
        for start in range(0, whole, _BLOCK):
            self._seen = (self._seen + data[start : start + _BLOCK])[-_SEEN:]
            self._judge()
        self._block = data[whole:]

    def _judge(self) -> None:
        if unreadable(self._seen) > _TOO_MANY:
            protocol = binary_protocol(self._seen)
            self.problem = _binary(protocol) if protocol else wrong_speed(unreadable(self._seen))
        elif self._text_since_line > _SEEN:
            self.problem = (
                "Text arrives without line ends: print every sample with println or a newline."
            )
        else:
            self.problem = ""


def unreadable(data: bytes) -> float:
    """The share of bytes that no line of text contains, 0 to 1."""
    return len(data.translate(None, _READABLE)) / len(data) if data else 0.0


def binary_protocol(data: bytes) -> str:
    """The protocol whose start bytes come again and again; ``""`` when none do."""
    found = [(data.count(magic), name) for magic, name in _MAGIC]
    count, name = max(found)
    return name if count >= _OFTEN else ""


def wrong_speed(share: float, baud: int | None = None) -> str:
    """One sentence for bytes that are no text, with the speeds to try."""
    others = ", ".join(str(speed) for speed in BAUDS if speed != baud)
    at = f" at {baud} baud" if baud else ""
    return (
        f"What arrives{at} is no text ({share:.0%} unreadable): the speed is probably wrong. Set "
        f"the one in the device's program with --baud; usual ones are {others}."
    )


def _binary(protocol: str) -> str:
    return (
        f"This looks like the binary protocol of {protocol}, which is not read here: switch the "
        f"device to text (ASCII) output."
    )
