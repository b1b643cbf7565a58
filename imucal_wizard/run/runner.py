"""A thread that owns an engine: commands go in through a queue, frozen snapshots come out."""

import queue
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path

from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.description import Description
from imucal_wizard.core.errors import ImucalError
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.snapshot import Snapshot, StreamStatus

SNAPSHOT_SECONDS = 0.03
"""Seconds between two snapshots at least; they are made only on request."""
JOIN_SECONDS = 0.1
"""Seconds that ``stop`` waits for the thread."""
_ANSWER_SECONDS = 0.05
"""Seconds between two checks whether the thread still runs."""
FAULT_TEXT = (
    "reading has stopped because of a fault in this program; what was confirmed is in the session: "
    "quit, and resume it"
)
"""Message if the thread ends unexpectedly."""


class Stopped(Exception):  # noqa: N818  not an error
    """The work was interrupted on request."""


class Runner(ABC):
    """The common part of the reader of a port and the player of a recording.

    Attributes:
        live: whether the source is a device, from which new poses can be requested.

    Args:
        engine: the engine; once the thread runs, only the thread uses it.
        clock: seconds that never go back.
    """

    live = True

    def __init__(
        self,
        engine: Engine,
        *,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._engine = engine
        self._clock = clock
        self._orders: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._stopping = threading.Event()
        self._asked = threading.Event()
        self._published = Snapshot(stream=StreamStatus(source=engine.source))
        self._published_time = -SNAPSHOT_SECONDS
        self._thread: threading.Thread | None = None

    @property
    def finished(self) -> bool:
        """Whether nothing more will come."""
        return self._published.finished

    def start(self) -> None:
        """Begin to read."""
        self._thread = threading.Thread(target=self._live, name=type(self).__name__, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread; returns within 100 ms and may be called again."""
        self._stopping.set()
        self._orders.put(None)
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(JOIN_SECONDS)

    def snapshot(self) -> Snapshot:
        """The newest snapshot; requests the next one."""
        self._asked.set()
        return self._published

    def command(self, name: str, argument: str = "") -> None:
        """Pass a command to the procedure."""
        self._orders.put(lambda: self._command(name, argument))

    def set_setup(self, setup: StreamSetup) -> None:
        """Read the stream with another setup."""
        self._orders.put(lambda: self._set_setup(setup))

    def describe(self, description: Description) -> None:
        """State device, place and operator."""
        self._orders.put(lambda: self._engine.describe(description))

    def collected(self) -> Collected:
        """The measurements so far."""
        if not self._running:
            return self._engine.collected()
        answer: Future[Collected] = Future()
        self._orders.put(lambda: answer.set_result(self._collected()))
        while True:
            try:
                return answer.result(timeout=_ANSWER_SECONDS)
            except TimeoutError:
                if not self._running:
                    return self._engine.collected()

    def rescue(self, path: Path) -> None:
        """Write the whole session to another place, after its disk has failed.

        Raises:
            SessionError: the file exists already, or cannot be written.
        """
        self._engine.journal.rescue(path)

    @property
    def _running(self) -> bool:
        return self._thread is not None and self._thread.is_alive()

    def _command(self, name: str, argument: str) -> None:
        self._engine.command(name, argument)

    def _collected(self) -> Collected:
        return self._engine.collected()

    def _set_setup(self, setup: StreamSetup) -> None:
        self._engine.set_setup(setup)

    def _live(self) -> None:
        """The thread: work until stopped, then close everything."""
        problem = FAULT_TEXT
        try:
            self._work()
            problem = ""
        except Stopped:
            problem = ""
        except ImucalError as error:
            problem = str(error)
        finally:
            if problem:
                self._engine.link(problem)
            self._engine.close()
            self._published = self._engine.snapshot()

    @abstractmethod
    def _work(self) -> None:
        """Read or play until ``_stopping`` is set."""

    def _run_orders(self, wait: float = 0.0) -> None:
        """Carry out the waiting commands; wait a while for the first one."""
        try:
            order = self._orders.get(timeout=wait) if wait > 0.0 else self._orders.get_nowait()
            while order is not None:
                order()
                order = self._orders.get_nowait()
        except queue.Empty:
            return

    def _publish(self) -> None:
        """Make a snapshot if one is due and requested."""
        if self._due:
            self._publish_this(self._engine.snapshot())

    @property
    def _due(self) -> bool:
        """Whether a snapshot is requested and the last one is old enough."""
        return self._asked.is_set() and self._clock() - self._published_time >= SNAPSHOT_SECONDS

    def _publish_this(self, snapshot: Snapshot) -> None:
        self._asked.clear()
        self._published, self._published_time = snapshot, self._clock()
