"""Bytes to lines: whole ones only, however the bytes were cut."""

MAX_LINE = 4096
"""A longer line is no line of samples; it is replaced by one that nobody can read."""

_UNREADABLE = b"\x01"


class LineCutter:
    """Keeps the unfinished line between calls. Lines end in LF, CR or CR LF; empty ones vanish."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[bytes]:
        """The lines that these bytes complete, without their ends."""
        data = self._rest + data
        if b"\r" in data:
            data = data.replace(b"\r\n", b"\n")
            held = data.endswith(b"\r")  # its line feed may be the next byte
            data = data[:-1].replace(b"\r", b"\n") if held else data.replace(b"\r", b"\n")
        else:
            held = False
        lines = data.split(b"\n")
        rest = lines.pop()
        self._rest = rest[: MAX_LINE + 1] + (b"\r" if held else b"")
        if len(data) > MAX_LINE:
            lines = [line if len(line) <= MAX_LINE else _UNREADABLE for line in lines]
        return [line for line in lines if line] if b"" in lines else lines
