"""The thread that reads a port: it writes down, decodes, decides, and waits for a lost device."""

import time
from collections.abc import Callable

from imucal_wizard.devices.link import LINK_BREAK
from imucal_wizard.errors import LinkError
from imucal_wizard.live.engine import Engine
from imucal_wizard.live.pump import Link, Pump
from imucal_wizard.live.runner import Runner, Stopped
from imucal_wizard.procedure.state import EventKind
from imucal_wizard.procedure.steps import Listener

RETRY = 0.25
"""Seconds between two looks for a device that is missing."""
_READ = 0.04
"""Seconds a read waits; an order waits no longer."""
Prepare = Callable[[Engine, Callable[[float], None]], float]
"""Brings an engine to where a session ended, telling the share done; the time it goes on at, s."""


class Reader(Runner):
    """Reads a device until it is stopped.

    Args:
        transport: the port, not yet open.
        engine: what its bytes go through.
        prepare: run first by the thread, before the port is opened (a session is read again).
        listener: told of the status after each block of samples, by the thread.
        clock: seconds that never go back.
    """

    def __init__(
        self,
        transport: Link,
        engine: Engine,
        *,
        prepare: Prepare | None = None,
        listener: Listener | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(engine, clock=clock)
        engine.listen(listener)
        self._transport = Pump(transport)
        self._prepare = prepare
        self._resumed = prepare is not None
        self._started = 0.0
        engine.link("opening the port …")

    def _work(self) -> None:
        try:
            if self._prepare is not None:
                self._progress(0.0)
                self._started = self._prepare(self._engine, self._progress)
            self._started -= self._clock()
            if self._open():
                self._read_on()
        finally:
            self._transport.close()

    def _progress(self, share: float) -> None:
        """Say how far the reading again has come; the procedure is shown once it is done."""
        if self._stopping.is_set():
            raise Stopped
        if self._due:
            text = f"Reading again what was measured before: {share:.0%} done."
            self._publish_this(self._engine.busy(text))

    @property
    def _now(self) -> float:
        """Seconds on the session's own clock, which goes on where an earlier run ended."""
        return self._started + self._clock()

    def _open(self) -> bool:
        """Open the port, however long that takes; False when told to stop before."""
        while not self._stopping.is_set():
            try:
                self._transport.open()
            except LinkError as error:
                self._engine.link(str(error))
                self._publish()
                self._obey(RETRY)
            else:
                self._engine.connected(self._transport.description)
                if self._resumed:
                    self._engine.receive(LINK_BREAK, self._now)
                self._opened()
                return True
        return False

    @property
    def _resting(self) -> bool:
        """Whether the device is known to have nothing to say now."""
        return False

    def _opened(self) -> None:
        """The port is open for the first time; nothing has been read from it yet."""

    def _read_on(self) -> None:
        while not self._stopping.is_set():
            try:
                data = self._transport.read(_READ)
            except LinkError as error:
                self._wait_for_return(str(error))
                continue
            if data:
                self._engine.receive(data, self._now)
            else:
                self._engine.idle(self._now, expected=self._resting)
            self._obey()
            self._publish()

    def _wait_for_return(self, problem: str) -> None:
        """The device is gone: what is complete is kept; look for it until it is back."""
        self._engine.link(problem)
        self._engine.tell(EventKind.LINK_LOST, "The connection is lost; plug it in again.")
        while not self._stopping.is_set():
            self._engine.journal.idle()
            self._publish()
            self._obey(RETRY)
            if self._transport.reopen():
                self._engine.connected(self._transport.description)
                self._engine.tell(EventKind.LINK_BACK, "The device is back; it goes on.")
                return
