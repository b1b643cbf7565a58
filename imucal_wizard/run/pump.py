"""The thread that only fetches bytes, so that none is lost while others are decoded.

The buffer of a serial line holds a few milliseconds of a fast stream. Some decisions take longer: a
format is recognised, a step ends, the disk is slow.
"""

import sys
import threading
from typing import Protocol

from imucal_wizard.core.errors import LinkError
from imucal_wizard.core.instruction import Instruction

MAX_WAITING_BYTES = 1 << 18
"""Bytes that wait at most (a third of a second at 8,000 lines/s); then the sender has to wait."""
_FETCH_SECONDS = 0.02
"""Seconds that a read waits, and that ``close`` takes at most."""
_TURN = 0.001
"""Seconds after which a computing thread yields to the fetching one."""


class Link(Protocol):
    """The part of ``acquire.transport.Transport`` that the pump needs."""

    @property
    def description(self) -> str:
        """Description of the source for the user."""

    def open(self) -> None:
        """Open, or raise LinkError."""

    def read(self, timeout: float = 0.05) -> bytes:
        """The bytes that have arrived, or raise LinkError."""

    def reopen(self) -> bool:
        """Search once for the same device."""

    def close(self) -> None:
        """Close the port."""


class Pump:
    """A port as a source that is read immediately, even if the reader is busy.

    Args:
        link: the port, not yet open; from then on only the pump uses it.

    Attributes:
        hand: None: a real device is moved by a person.
        waiting: False: a real device is never expected to be silent.
    """

    hand = None
    waiting = False

    def __init__(self, link: Link) -> None:
        self._link = link
        self._changed = threading.Condition()
        self._pieces: list[bytes] = []
        self._size = 0
        self._lost: LinkError | None = None
        self._closing = False
        self._thread: threading.Thread | None = None

    @property
    def description(self) -> str:
        """Description of the source for the user."""
        return self._link.description

    def open(self) -> None:
        """Open the port and begin to fetch.

        Raises:
            LinkError: it cannot be opened.
        """
        self.close()
        self._link.open()
        self._begin()

    def reopen(self) -> bool:
        """Search once for the same device; continue to fetch if it is found."""
        self.close()
        if not self._link.reopen():
            return False
        self._begin()
        return True

    def read(self, timeout: float = 0.05) -> bytes:
        """All fetched bytes; waits at most ``timeout`` seconds for some.

        Raises:
            LinkError: the device is gone, and all its bytes have been returned.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._pieces or self._lost, timeout)
            data = b"".join(self._pieces)
            self._pieces, self._size = [], 0
            self._changed.notify_all()
            if not data and self._lost is not None:
                raise self._lost
            return data

    def rest(self) -> bytes:
        """Always empty: a real device does not stop by itself."""
        return b""

    def follow(self, instruction: Instruction, samples: int) -> None:
        """A person follows the instruction."""

    def close(self) -> None:
        """Stop fetching and close the port."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        self._link.close()

    def _begin(self) -> None:
        # Python's 5 ms are too long: a read takes two switches, and a terminal holds 5 ms at 8,000
        # lines/s
        sys.setswitchinterval(min(sys.getswitchinterval(), _TURN))
        self._closing, self._lost = False, None
        self._thread = threading.Thread(target=self._fetch, name="Pump", daemon=True)
        self._thread.start()

    def _fetch(self) -> None:
        """The thread: fetch until the port is closed or lost."""
        while not self._closing:
            try:
                data = self._link.read(_FETCH_SECONDS)
            except LinkError as error:
                self._put(b"", error)
                return
            except BaseException:
                self._put(
                    b"", LinkError("reading the port has a fault; quit, and resume the session")
                )
                raise
            if data:
                self._put(data)

    def _put(self, data: bytes, lost: LinkError | None = None) -> None:
        with self._changed:
            self._changed.wait_for(lambda: self._size < MAX_WAITING_BYTES or self._closing)
            self._lost = lost
            if data:
                self._pieces.append(data)
                self._size += len(data)
            self._changed.notify_all()
