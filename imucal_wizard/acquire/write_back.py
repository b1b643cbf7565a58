"""Sends a calibration to the board that uses it, until its echo confirms it."""

import time
from collections.abc import Callable, Sequence

from imucal_wizard.acquire.transport import Transport
from imucal_wizard.core.errors import LinkError

BOOT_SECONDS = 4.0
"""Seconds for a board that restarts when its port is opened."""
ECHO_SECONDS = 6.0
"""From the last byte sent to the echo: sketches read a byte in each of their loops and print the
echo in every hundredth."""
ATTEMPTS = 3
"""Packets sent; a busy board may lose a byte and then ignores the packet."""

Check = Callable[[Sequence[str]], str | None]
"""From the lines printed since the packet was sent: "" where they confirm it, None where the echo
is not complete, else what it says instead."""


def write_back(link: Transport, packet: bytes, check: Check) -> None:
    """Send a packet until the board echoes what is in it.

    Args:
        link: an open port.
        packet: the bytes.
        check: whether the lines of the board confirm it.

    Raises:
        LinkError: the board is gone, does not print, or echoes something else.
    """
    lines = _Lines(link)
    if not lines.until(BOOT_SECONDS, lambda found: "" if len(found) > 1 else None)[0]:
        raise LinkError(
            f"{link.port} prints no lines: check that the board runs its calibration sketch, and "
            "that no other program has the port"
        )
    said: str | None = None
    for _ in range(ATTEMPTS):
        lines.forget()
        link.write(packet)
        done, said = lines.until(ECHO_SECONDS, check)
        if done:
            return
    if said is None:
        raise LinkError(
            f"{link.port} does not echo its calibration: load the calibration sketch of the "
            "board's library, which receives it, and export again"
        )
    raise LinkError(f"{link.port} did not take the calibration: {said}. Export again")


class _Lines:
    """The whole lines that a board prints."""

    def __init__(self, link: Transport) -> None:
        self._link, self._rest = link, b""
        self._found: list[str] = []

    def forget(self) -> None:
        """Forget the lines so far."""
        self._found = []

    def until(self, seconds: float, check: Check) -> tuple[bool, str | None]:
        """Read until a check is satisfied; whether it was in time, and what it said last."""
        end, said = time.monotonic() + seconds, None
        while time.monotonic() < end:
            *whole, self._rest = (self._rest + self._link.read(0.05)).split(b"\n")
            self._found += [line.decode("ascii", "replace").strip() for line in whole]
            said = check(self._found) if whole else said
            if said == "":
                return True, said
        return False, said
