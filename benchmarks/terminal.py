"""A terminal around the program, as cheap as it can be: it keeps what is drawn, and when."""

import fcntl
import os
import pty
import select
import signal
import struct
import termios
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Self

FRAME_ENDS = b"\x1b[?2026l"
"""A program that is told that the terminal shows frames whole ends each of them with this."""
_ASKED = b"\x1b[?2026$p"
_ANSWER = b"\x1b[?2026;2$y"
_TICKS = os.sysconf("SC_CLK_TCK")


class Terminal:
    """Runs a program in a pseudo-terminal of a given size and drains it.

    Args:
        command: program and arguments.
        columns: width.
        rows: height.
        environment: variables of the program, this process's where none are given.

    Attributes:
        started: when the program was started, on ``time.monotonic``.
        drawn: what came, and when.
    """

    def __init__(
        self,
        command: Sequence[str],
        columns: int,
        rows: int,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self.drawn: list[tuple[float, bytes]] = []
        self._size = struct.pack("HHHH", rows, columns, 0, 0)
        self._all = bytearray()
        self.started = time.monotonic()
        self._pid, self._fd = pty.fork()
        if self._pid == 0:
            fcntl.ioctl(0, termios.TIOCSWINSZ, self._size)
            colours = {"TERM": "xterm-256color", "COLORTERM": "truecolor"}
            variables = {**(os.environ if environment is None else environment), **colours}
            os.execvpe(command[0], list(command), variables)  # noqa: S606 - the command is this project's own

    @property
    def cpu(self) -> float:
        """Seconds of CPU that the program has used, all its threads (Linux)."""
        fields = Path(f"/proc/{self._pid}/stat").read_text().rpartition(") ")[2].split()
        return (int(fields[11]) + int(fields[12])) / _TICKS

    def press(self, keys: str) -> None:
        """Type these characters."""
        os.write(self._fd, keys.encode())

    def pump(self, seconds: float) -> None:
        """Take what is drawn for so long."""
        self.pump_until(time.monotonic() + seconds)

    def pump_until(self, end: float) -> None:
        """Take what is drawn until this moment on ``time.monotonic``."""
        while (left := end - time.monotonic()) > 0.0:
            self._take(left)

    def wait_for(self, text: str, timeout: float = 60.0) -> float:
        """When this text was drawn, the first time since the program was started.

        Raises:
            SystemExit: it never was; what was drawn last is shown.
        """
        wanted, end = text.encode(), time.monotonic() + timeout
        while wanted not in self._all:
            if time.monotonic() > end:
                raise SystemExit(f"the program never showed {text!r}: {bytes(self._all[-2000:])!r}")
            self._take(0.1)
        return self.drawn[-1][0]

    def _take(self, seconds: float) -> None:
        if not select.select([self._fd], [], [], seconds)[0]:
            return
        try:
            data = os.read(self._fd, 65536)
        except OSError as error:  # the program has closed the terminal
            raise SystemExit(f"the program ended: {bytes(self._all[-2000:])!r}") from error
        self.drawn.append((time.monotonic(), data))
        self._all += data
        if _ASKED in data:
            os.write(self._fd, _ANSWER)

    def close(self) -> None:
        """End the program and the terminal."""
        os.kill(self._pid, signal.SIGKILL)
        os.waitpid(self._pid, 0)
        os.close(self._fd)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
