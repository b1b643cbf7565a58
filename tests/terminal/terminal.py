"""A pseudo-terminal with a screen that can be read, and a program in it."""

import fcntl
import os
import pty
import re
import select
import signal
import struct
import sys
import termios
import time
from collections.abc import Callable, Sequence
from typing import Any, Self

import pyte

POLL = 0.02
PAGE_DOWN = "\x1b[6~"
FRAMES_ASKED = b"\x1b[?2026$p"
FRAMES_KNOWN = b"\x1b[?2026;2$y"
FRAME_START, FRAME_END = b"\x1b[?2026h", b"\x1b[?2026l"
"""Synchronized output: the terminal says that it knows it, and a frame is drawn as a whole."""
FRAME_SECONDS = 2.0
"""Seconds after which a frame without an end is drawn, as terminals do: its program was stopped."""


class Terminal:
    """Runs a program in a pseudo-terminal of a given size and keeps its screen.

    Args:
        command: program and arguments.
        columns: width of the terminal.
        rows: height.
        environment: variables beyond the present ones.
    """

    def __init__(
        self,
        command: Sequence[str],
        columns: int = 80,
        rows: int = 24,
        environment: dict[str, str] | None = None,
    ) -> None:
        self.screen = pyte.Screen(columns, rows)
        self.bells = 0
        self.received = bytearray()
        """Everything that the program has sent to the terminal."""
        self.dead = False
        """The keyboard is dead: what is typed or answered does not reach the program."""
        self._stream = pyte.ByteStream(self.screen)
        self._text = ""
        self._undrawn = b""
        self._begun = 0.0
        self._status: int | None = None
        self.pid, self._fd = pty.fork()
        if self.pid == 0:  # the child becomes the program
            extra = {"TERM": "xterm-256color", "COLORTERM": "truecolor", **(environment or {})}
            os.execvpe(command[0], list(command), {**os.environ, **extra})  # noqa: S606 - the command is this project's own
        size = struct.pack("HHHH", rows, columns, 0, 0)
        fcntl.ioctl(self._fd, termios.TIOCSWINSZ, size)

    def resize(self, columns: int, rows: int) -> None:
        """Change the terminal's size as a person dragging its corner does."""
        self.screen.resize(rows, columns)
        fcntl.ioctl(self._fd, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        os.kill(self.pid, signal.SIGWINCH)

    @property
    def text(self) -> str:
        """The screen as it stands, a line per row."""
        if self.screen.dirty:  # lines drawn since then; to put them together takes 2 ms
            self._text = "\n".join(line.rstrip() for line in self.screen.display)
            self.screen.dirty.clear()
        return self._text

    @property
    def settings(self) -> list[Any]:
        """The terminal's settings, as ``stty`` shows them."""
        return termios.tcgetattr(self._fd)

    @property
    def modes(self) -> dict[int, bool]:
        """The modes that a program has set or reset, and whether they are on."""
        found = re.findall(rb"\x1b\[\?([\d;]+)([hl])", bytes(self.received))
        return {int(one): on == b"h" for numbers, on in found for one in numbers.split(b";")}

    def press(self, keys: str) -> None:
        """Type these characters."""
        if not self.dead:
            os.write(self._fd, keys.encode())

    def pump(self, seconds: float = 0.0) -> None:
        """Read what the program draws, for at most this long (at least one piece)."""
        deadline = time.monotonic() + seconds
        while True:
            left = max(deadline - time.monotonic(), 0.0)
            if self.pump_piece(min(left, POLL)) is None or left <= 0.0:
                return

    def pump_piece(self, timeout: float) -> bool | None:
        """Read the next piece that the program draws, as soon as it comes.

        Returns:
            Whether something was drawn in time; None if the program has closed the terminal.
        """
        if self._undrawn and time.monotonic() - self._begun > FRAME_SECONDS:
            self._stream.feed(self._undrawn)
            self._undrawn = b""
        if not select.select([self._fd], [], [], timeout)[0]:
            return False
        try:
            data = os.read(self._fd, 65536)
        except OSError:  # the program has closed the terminal
            data = b""
        if not data:
            self._stream.feed(self._undrawn)
            self._undrawn = b""
            return None
        self.bells += data.count(b"\x07")
        self.received += data
        if FRAMES_ASKED in data and not self.dead:
            os.write(self._fd, FRAMES_KNOWN)
        self._draw(data)
        return True

    def _draw(self, data: bytes) -> None:
        """Draw what has come; a frame that has begun waits for its end."""
        if not self._undrawn:
            self._begun = time.monotonic()
        self._undrawn += data
        begun, ended = self._undrawn.rfind(FRAME_START), self._undrawn.rfind(FRAME_END)
        escape = self._undrawn.rfind(b"\x1b")
        if escape > begun and FRAME_START.startswith(self._undrawn[escape:]):
            begun = escape
        whole = begun if begun > ended else len(self._undrawn)
        self._stream.feed(self._undrawn[:whole])
        self._undrawn = self._undrawn[whole:]

    def wait_for(self, what: str | Callable[[str], bool], timeout: float = 30.0) -> str:
        """The screen once it shows a text, or meets a condition.

        Raises:
            AssertionError: it has not come in time; the message holds the screen.
        """
        meets = (lambda text: what in text) if isinstance(what, str) else what
        deadline = time.monotonic() + timeout
        while time.monotonic() < deadline:
            self.pump(POLL)
            if meets(self.text):
                return self.text
            if self.status() is not None:
                self.pump(POLL)
                if meets(self.text):
                    return self.text
                break
        wanted = what if isinstance(what, str) else "the condition"
        raise AssertionError(f"the screen never showed {wanted!r}; it shows:\n{self.text}")

    def scroll_to(self, text: str, pages: int = 12) -> None:
        """Press page down until a text is on the screen.

        Raises:
            AssertionError: it is on none of the pages.
        """
        for _ in range(pages):
            self.pump(0.5)
            if text in self.text:
                return
            self.press(PAGE_DOWN)
        raise AssertionError(f"no page shows {text!r}; the last one is:\n{self.text}")

    def status(self) -> int | None:
        """Exit status of the program, or None while it runs; minus the number of a signal."""
        if self._status is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self._status = os.waitstatus_to_exitcode(status)
        return self._status

    def wait(self, timeout: float = 30.0) -> int:
        """Exit status once the program has ended.

        Raises:
            AssertionError: it still runs; the message holds the screen.
        """
        deadline = time.monotonic() + timeout
        while time.monotonic() < deadline:
            self.pump(POLL)
            if (status := self.status()) is not None:
                self.pump(POLL)
                return status
        raise AssertionError(f"the program still runs; its screen shows:\n{self.text}")

    def hang_up(self) -> None:
        """Take the terminal away from the program, as a window that is closed does."""
        os.close(self._fd)
        self._fd = -1

    def close(self) -> None:
        """End the program if it still runs, and the terminal."""
        if self.status() is None:
            os.kill(self.pid, signal.SIGKILL)
            os.waitpid(self.pid, 0)
            self._status = -signal.SIGKILL
        if self._fd >= 0:
            os.close(self._fd)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def program(*arguments: str) -> list[str]:
    """The command line of the program under the present interpreter."""
    return [sys.executable, "-m", "imucal_wizard", *arguments]
