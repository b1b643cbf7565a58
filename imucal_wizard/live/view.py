"""What is drawn of the stream, made only when somebody looks."""

from collections.abc import Callable
from dataclasses import replace

from imucal_wizard.live.attitude import Attitude
from imucal_wizard.live.snapshot import Snapshot, StreamStatus
from imucal_wizard.live.traces import Traces
from imucal_wizard.procedure.state import Event, Status
from imucal_wizard.readings import Readings, join
from imucal_wizard.units import COUNT

_GATHERED = 64
"""Pieces of the stream that wait to be drawn at most."""


class View:
    """Gathers samples cheaply and makes snapshots of them.

    Args:
        serial: number of the last snapshot that another view has made.
    """

    def __init__(self, serial: int = 0) -> None:
        self.rate = 0.0
        self._traces: Traces | None = None
        self._attitude = Attitude()
        self._unseen: list[Readings] = []
        self._units = ("m/s^2", "rad/s", "uT")
        self._dirty = True
        self._latest = Snapshot(serial)

    def begin(self, rate: float, readings: Readings) -> None:
        """Rate and units are known."""
        self.rate = rate
        self._traces = Traces(rate, counts=readings.accelerometer.unit == COUNT)
        gyroscope, magnetometer = readings.gyroscope, readings.magnetometer
        self._units = (
            readings.accelerometer.unit,
            "rad/s" if gyroscope is None else gyroscope.unit,
            "uT" if magnetometer is None else magnetometer.unit,
        )

    def feed(self, readings: Readings) -> None:
        """Take new samples."""
        self._unseen.append(readings)
        self._dirty = True
        if len(self._unseen) >= _GATHERED:
            self._draw(None)

    def changed(self) -> None:
        """Something else than the samples is new."""
        self._dirty = True

    def snapshot(
        self,
        stream: Callable[[], StreamStatus],
        status: Callable[[], Status],
        events: tuple[tuple[Event, ...], int],
        finished: bool,
    ) -> Snapshot:
        """A picture of everything; the last one again when nothing is new."""
        if not self._dirty:
            return self._latest
        now = status()
        self._draw(now.up)
        self._latest = Snapshot(
            serial=self._latest.serial + 1,
            stream=self._with_values(stream()),
            status=now,
            events=events[0],
            event_count=events[1],
            traces=self._latest.traces if self._traces is None else self._traces.drawn(),
            attitude=self._attitude.matrix,
            finished=finished,
        )
        self._dirty = False
        return self._latest

    def bare(self, stream: StreamStatus) -> Snapshot:
        """A picture of the stream alone, whatever is known of the rest."""
        self._latest, self._dirty = Snapshot(self._latest.serial + 1, stream), True
        return self._latest

    @property
    def serial(self) -> int:
        """Number of the newest snapshot."""
        return self._latest.serial

    def _draw(self, up: tuple[float, float, float] | None) -> None:
        unseen, self._unseen = self._unseen, []
        if unseen and self._traces is not None:
            readings = join(unseen)
            self._traces.feed(readings)
            self._attitude.feed(readings, up)

    def _with_values(self, stream: StreamStatus) -> StreamStatus:
        if self._traces is None:
            return stream
        return replace(
            stream,
            temperature=self._traces.temperature,
            accelerometer=self._traces.accelerometer,
            gyroscope=self._traces.gyroscope,
            magnetometer=self._traces.magnetometer,
            accelerometer_unit=self._units[0],
            gyroscope_unit=self._units[1],
            magnetometer_unit=self._units[2],
            gravity=self._traces.gravity,
        )
