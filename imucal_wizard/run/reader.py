"""The two threads that read a port: one fetches bytes, the other stores, decodes and decides.

The buffer of a serial line holds a few milliseconds of a fast stream. Some decisions take longer: a
format is recognised, a step ends, the disk is slow. So a thread of its own only fetches bytes.
"""

import sys
import threading
import time
from collections.abc import Callable
from typing import Protocol

from imucal_wizard.acquire.intake import LINK_BREAK
from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.errors import LinkError
from imucal_wizard.core.instruction import Instruction
from imucal_wizard.guide.kinds import EventKind
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.runner import Runner, Stopped

MAX_WAITING_BYTES = 1 << 18
"""Bytes that wait at most (a third of a second at 8,000 lines/s); then the sender has to wait."""
_FETCH_SECONDS = 0.02
"""Seconds that a read waits, and that ``close`` takes at most."""
_TURN = 0.001
"""Seconds after which a computing thread yields to the fetching one."""
REOPEN_RETRY_SECONDS = 0.25
"""Seconds between two searches for a missing device."""
_READ_SECONDS = 0.04
"""Seconds that a read, and thus a command, waits."""
Prepare = Callable[[Engine, Callable[[float], None]], float]
"""Restores the engine to the end of a session, reporting the share done; returns the time at which
the session continues, s."""


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


class ByteSource(Protocol):
    """A source of bytes: a port (``Pump``) or the virtual IMU. Only the thread uses it."""

    @property
    def hand(self) -> object | None:
        """The object that moves a virtual device; None for a real one."""

    @property
    def description(self) -> str:
        """Description of the source for the user."""

    @property
    def waiting(self) -> bool:
        """Whether it stands still until the next instruction, so that silence is not a fault."""

    def open(self) -> None:
        """Open it, or raise LinkError."""

    def read(self, timeout: float = 0.05) -> bytes:
        """The next bytes; waits at most ``timeout`` seconds for some. Raises LinkError."""

    def rest(self) -> bytes:
        """All bytes until it stands still; empty if it does not."""

    def follow(self, instruction: Instruction, samples: int) -> None:
        """Receive the instruction after ``samples`` of the source's samples."""

    def reopen(self) -> bool:
        """Look once for the same device."""

    def close(self) -> None:
        """Close it."""


class Reader(Runner):
    """Reads a source until it is stopped.

    Args:
        source: the source, not yet open.
        engine: the engine that receives the bytes.
        prepare: run by the thread before the source is opened (a session is restored).
        silent: called at the end if the source never sent a byte.
        clock: seconds that never go back.

    Attributes:
        hand: the object that moves the device, or None.
    """

    def __init__(
        self,
        source: ByteSource,
        engine: Engine,
        *,
        prepare: Prepare | None = None,
        silent: Callable[[], None] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(engine, clock=clock)
        engine.listen(self._hear)
        self.hand = source.hand
        self._source = source
        self._first: int | None = None
        self._prepare = prepare
        self._silent = silent
        self._heard = False
        self._resumed = prepare is not None
        self._started = 0.0
        engine.link("opening the port …", busy=True)

    def _live(self) -> None:
        super()._live()
        if not self._heard and self._silent is not None:
            self._silent()

    def _work(self) -> None:
        try:
            if self._prepare is not None:
                self._progress(0.0)
                self._started = self._prepare(self._engine, self._progress)
            self._started -= self._clock()
            if self._open():
                self._read_on()
        finally:
            self._source.close()

    def _progress(self, share: float) -> None:
        """Show the progress of restoring a session; the procedure is shown once it is done."""
        if self._stopping.is_set():
            raise Stopped
        if self._due:
            text = f"Restoring the session: {share:.0%} done."
            self._publish_this(self._engine.busy(text))

    @property
    def _now(self) -> float:
        """Time of the session's own clock, s, which continues where an earlier run ended."""
        return self._started + self._clock()

    def _open(self) -> bool:
        """Open the port, with retries; False if stopped before."""
        while not self._stopping.is_set():
            try:
                self._source.open()
            except LinkError as error:
                self._engine.link(str(error))
                self._publish()
                self._run_orders(REOPEN_RETRY_SECONDS)
            else:
                self._engine.connected(self._source.description)
                if self._resumed:
                    self._engine.receive(LINK_BREAK, self._now)
                self._first = self._engine.samples
                return True
        return False

    def _hear(self, instruction: Instruction, samples: int) -> None:
        """Pass on an instruction, in the source's own count of samples."""
        if self._first is not None:
            self._source.follow(instruction, samples - self._first)

    def _catch_up(self) -> None:
        """Read until the source stands still: commands fall on the same sample in every run."""
        while self._first is not None and (data := self._source.rest()):
            self._receive(data)

    def _receive(self, data: bytes) -> None:
        self._heard = True
        self._engine.receive(data, self._now)

    def _command(self, name: str, argument: str) -> None:
        self._catch_up()
        super()._command(name, argument)

    def _collected(self) -> Collected:
        self._catch_up()
        return super()._collected()

    def _set_setup(self, setup: StreamSetup) -> None:
        if self._first is not None:
            self._first = 0  # the source is read again from its first byte
        super()._set_setup(setup)

    def _read_on(self) -> None:
        while not self._stopping.is_set():
            try:
                data = self._source.read(_READ_SECONDS)
            except LinkError as error:
                self._wait_for_return(str(error))
                continue
            if data:
                self._receive(data)
            else:
                self._engine.idle(self._now, expected=self._source.waiting)
            self._run_orders()
            self._publish()

    def _wait_for_return(self, problem: str) -> None:
        """Search for the lost device until it is back or the reader is stopped."""
        self._engine.link(problem)
        text = "The connection is lost; finished measurements are kept."
        self._engine.emit(EventKind.LINK_LOST, text)
        while not self._stopping.is_set():
            self._engine.journal.check()
            self._publish()
            self._run_orders(REOPEN_RETRY_SECONDS)
            if self._source.reopen():
                self._engine.connected(self._source.description)
                self._engine.receive(LINK_BREAK, self._now)
                text = "The device is back; an unfinished measurement begins again."
                self._engine.emit(EventKind.LINK_BACK, text)
                return
