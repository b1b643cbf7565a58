"""An IMU that does not exist, on a port that does: a thread that writes its lines."""

import math
import socket
import threading
import time
from collections.abc import Iterable
from contextlib import suppress
from types import TracebackType
from typing import Self

from imucal_wizard.devices.virtual.endpoint import Endpoint, open_endpoint
from imucal_wizard.devices.virtual.hand import VirtualHand
from imucal_wizard.devices.virtual.hidden import (
    Hidden,
    check_sensors,
    draws_current,
    needs_shaking,
    parse_hidden,
)
from imucal_wizard.devices.virtual.line import HEADER_EVERY, LinePrinter
from imucal_wizard.devices.virtual.load import VirtualLoad
from imucal_wizard.devices.virtual.magnetometer import FieldModel, VirtualMagnetometer
from imucal_wizard.devices.virtual.sensor import SensorModel
from imucal_wizard.devices.virtual.stream import VirtualStream
from imucal_wizard.errors import LinkError, UsageError

TICK = 0.02
"""How often lines are written, s of the wall clock."""
LARGEST_BATCH = 512
GRACE = 0.3
"""Whoever opens a port sets it up and empties it; that is waited for before the first line, s."""
DEAF = 10.0
"""A wizard that says nothing for so long, s of the wall clock, is not waited for."""
BACKLOG = 0.25
"""A reader that falls behind by more, s of the wall clock, is not chased: the device slows down."""


class VirtualImu:
    """A virtual IMU on a pseudo-terminal, or on a loopback socket where there is none.

    Time stands still while nobody listens or the reader is slow, so no sample is ever lost.

    Args:
        rate: samples per second of device time.
        seed: of the sensor's errors, the noise and the hand.
        speed: device seconds per second of the wall clock; ``inf`` for as fast as it is read.
        sensor: the sensor; drawn from the seed when not given.
        hidden: effects that the sensor has besides, parsed or as ``TERM:SIZE:AXIS``.
        magnetometer: it has a magnetometer, drawn from the seed.
        ammeter: it measures the board's current, whatever is hidden.
        loopback: use the socket even where there are pseudo-terminals.
        patience: how long a wizard that the hand follows is waited for, s of the wall clock.

    Attributes:
        hand: moves the device.
        speed: may be changed at any time.
        sensor: the sensor's true parameters.

    Raises:
        UsageError: a hidden effect that cannot be read or belongs to a sensor that is not there,
            or a rate or speed that cannot be.
    """

    def __init__(
        self,
        rate: float = 100.0,
        seed: int = 0,
        speed: float = 1.0,
        sensor: SensorModel | None = None,
        hidden: Iterable[Hidden | str] = (),
        loopback: bool = False,
        patience: float = DEAF,
        magnetometer: bool = False,
        ammeter: bool = False,
    ) -> None:
        if not speed > 0.0:
            raise UsageError(f"a speed of {speed:g} stands still; give one like 1 or 20")
        self.speed = speed
        self.sensor = SensorModel.drawn(seed) if sensor is None else sensor
        effects = [parse_hidden(h) if isinstance(h, str) else h for h in hidden]
        check_sensors(effects, magnetometer=magnetometer)
        self.hand = VirtualHand(rate, seed, shaken=needs_shaking(effects))
        load = VirtualLoad(seed) if ammeter or draws_current(effects) else None
        field = VirtualMagnetometer(FieldModel.drawn(seed), seed) if magnetometer else None
        self._stream = VirtualStream(
            self.hand, self.sensor, effects, rate=rate, seed=seed, magnetometer=field, load=load
        )
        self._printer = LinePrinter(self.sensor, field=magnetometer, load=load is not None)
        self._rate = rate
        self._loopback = loopback
        self._patience = patience
        self._header_in = 0
        self._pending = b""
        self._cut = False
        self._thread: threading.Thread | None = None
        self._stopping = threading.Event()

    def start(self) -> str:
        """Begin to write; what to open: a device path or a ``socket://`` URL.

        Raises:
            LinkError: the system gives no pseudo-terminal or socket, or it runs already.
        """
        if self._thread is not None:
            raise LinkError("the virtual IMU runs already; stop it first")
        try:
            endpoint = open_endpoint(self._loopback)
        except OSError as error:
            raise LinkError(f"no line for the virtual IMU ({error}); close some programs") from None
        self._stopping.clear()
        self._wake, far = socket.socketpair()
        self._thread = threading.Thread(
            target=self._run, args=(endpoint, far), name="virtual-imu", daemon=True
        )
        self._thread.start()
        return endpoint.url

    def stop(self) -> None:
        """End the thread and close the line; at once, and again without harm."""
        if self._thread is None:
            return
        self._stopping.set()
        with suppress(OSError):  # the thread may have seen it already and be gone
            self._wake.send(b"x")
        self._thread.join()
        self._wake.close()
        self._thread = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    def _run(self, endpoint: Endpoint, wake: socket.socket) -> None:
        with wake:
            try:
                while not self._stopping.is_set():
                    if endpoint.connected():
                        self._serve(endpoint, wake)
                    else:
                        endpoint.wait(wake, TICK)
            finally:
                endpoint.close()

    def _serve(self, endpoint: Endpoint, wake: socket.socket) -> None:
        """Write to one listener until it goes."""
        endpoint.settle(wake, GRACE)
        # the rest of a cut line may still be in the buffer of whoever opened the port meanwhile
        self._pending, self._header_in = b"\r\n" if self._cut else b"", 0
        pace = _Pace()
        while not self._stopping.is_set():
            if endpoint.read():
                self._header_in = 0
            if not endpoint.connected():
                return
            if not self._pending:
                self._pending = self._batch(self._allowed(pace))
            sent = endpoint.write(self._pending) if self._pending else 0
            if sent:
                self._cut = self._pending[sent - 1 : sent] != b"\n"
            self._pending = self._pending[sent:]
            if self._pending or not sent or not math.isinf(self.speed):
                endpoint.wait(wake, TICK, to_write=bool(self._pending))

    def _allowed(self, pace: "_Pace") -> int:
        """How many samples are due now and not further than the wizard has asked for."""
        due = pace.due(self._rate, self.speed)
        ahead = self.hand.ahead
        if ahead is None:
            return pace.take(due)
        if ahead == 0 and not self.hand.standing and pace.deaf(self._patience):
            self.hand.unhand()
        return pace.take(min(due, ahead))

    def _batch(self, n: int) -> bytes:
        """The next ``n`` lines, with the header where it is due."""
        parts = []
        while n > 0:
            if self._header_in <= 0:
                parts.append(self._printer.header)
                self._header_in = max(1, round(HEADER_EVERY * self._rate))
            count = min(n, self._header_in)
            parts.append(self._printer.lines(self._stream.take(count)))
            self._header_in -= count
            n -= count
        return b"".join(parts)


class _Pace:
    """How many samples the wall clock asks for."""

    def __init__(self) -> None:
        self._last = time.monotonic()
        self._taken = self._last
        self._owed = 0.0

    def due(self, rate: float, speed: float) -> int:
        now = time.monotonic()
        if math.isinf(speed):
            return LARGEST_BATCH
        passed = (now - self._last) * rate * speed
        self._last = now
        self._owed = min(self._owed + passed, max(1.0, BACKLOG * rate * speed))
        return min(int(self._owed), LARGEST_BATCH)

    def take(self, n: int) -> int:
        if n:
            self._owed = max(0.0, self._owed - n)
            self._taken = time.monotonic()
        return n

    def deaf(self, patience: float) -> bool:
        return time.monotonic() - self._taken > patience
