"""Traces, attitude and snapshots for the screen, built only on request."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from imucal_wizard.core.quaternions import matrices, quaternions
from imucal_wizard.core.readings import FloatArray, Readings, join_readings
from imucal_wizard.core.units import COUNT
from imucal_wizard.guide.instruction import present
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.operator_view import matrix_of
from imucal_wizard.guide.state import Event, Status
from imucal_wizard.guide.up_direction import guessed_offset
from imucal_wizard.run.snapshot import Snapshot, StreamStatus

_TILT_SECONDS = 0.3
"""Time constant with which the drawn attitude follows gravity while the gyroscope rotates it, s."""
_TILT_SECONDS_ALONE = 0.05
"""The same without a gyroscope in rad/s, s."""
_RATE_PIECE_SECONDS = 0.01
"""Seconds over which the rate is averaged."""
_MAX_RATE_PIECES = 200
"""Pieces of the rate integrated at most after a pause: two seconds."""
_UP = np.array([0.0, 0.0, 1.0])


class AttitudeFilter:
    """The attitude for the drawing: a complementary filter of gyroscope and accelerometer.

    Attributes:
        matrix: body to world, shape (3, 3); None before the up direction is known.
    """

    def __init__(self) -> None:
        self.matrix: FloatArray | None = None
        self._resting_rate = np.zeros(3)

    def feed(
        self,
        readings: Readings,
        up: tuple[float, float, float] | None,
        *,
        at_rest: bool = False,
    ) -> None:
        """Update the attitude by new samples.

        Args:
            readings: samples of all sensors at the same times.
            up: up direction in the body frame from the procedure, for accelerations in counts,
                which do not show it directly; None while unknown.
            at_rest: the device rests, so its rate is the gyroscope's bias and turns nothing.
        """
        if not len(readings):
            return
        turned = self._turn(readings, at_rest=at_rest)
        measured = _up_from(readings) if readings.accelerometer.unit == "m/s^2" else None
        if measured is None and up is not None:
            measured = np.array(up)
        if measured is not None:
            time = readings.accelerometer.time
            seconds = float(time[-1] - time[0]) + _RATE_PIECE_SECONDS
            self._lean(measured, seconds / (_TILT_SECONDS if turned else _TILT_SECONDS_ALONE))

    def _turn(self, readings: Readings, *, at_rest: bool) -> bool:
        """Rotate by the rate; False without a gyroscope in rad/s."""
        gyroscope = readings.gyroscope
        if gyroscope is None or gyroscope.unit != "rad/s" or len(gyroscope) < 2:
            return False
        if at_rest:
            self._resting_rate = gyroscope.values.mean(axis=0)
        if self.matrix is None or at_rest:
            return True
        step = float(gyroscope.time[-1] - gyroscope.time[0]) / (len(gyroscope) - 1)
        size = max(1, round(_RATE_PIECE_SECONDS / step)) if step > 0 else len(gyroscope)
        starts = np.arange(0, len(gyroscope), size)[-_MAX_RATE_PIECES:]
        rate = gyroscope.values - self._resting_rate
        vectors = np.nan_to_num(np.add.reduceat(rate, starts, axis=0) * step)
        for turn in _rotations(vectors):
            self.matrix = self.matrix @ turn
        return True

    def _lean(self, up: FloatArray, time_constants: float) -> None:
        """Rotate the drawing about a level axis until ``up`` points up, or part of the way."""
        if self.matrix is None:
            self.matrix, time_constants = np.eye(3), np.inf
        shown = self.matrix @ up
        level = np.cross(shown, _UP)
        sine = float(np.linalg.norm(level))
        axis = level / sine if sine > 1e-9 else np.array([1.0, 0.0, 0.0])
        angle = float(np.arctan2(sine, shown[2])) * (1.0 - float(np.exp(-time_constants)))
        self.matrix = _rotations((axis * angle)[None])[0] @ self.matrix


def _rotations(vectors: FloatArray) -> FloatArray:
    """Rotation matrices, shape (n, 3, 3), of rotation vectors, shape (n, 3)."""
    return np.moveaxis(matrices(quaternions(vectors.T)), -1, 0)


def _up_from(readings: Readings) -> FloatArray | None:
    mean = readings.accelerometer.values.mean(axis=0)
    size = float(np.linalg.norm(mean))
    return mean / size if size > 0.0 else None


TRACE_SECONDS = 10.0
"""Duration of the traces, s."""
_POINTS = 500
"""Approximate number of points of a trace: more than the widest terminal can show."""
_CHANNELS = 6
"""Axes of accelerometer and gyroscope."""


class Ring:
    """A ring buffer of the newest rows of a table.

    Args:
        rows: number of rows kept.
        columns: number of columns.
    """

    def __init__(self, rows: int, columns: int) -> None:
        self._rows = np.zeros((rows, columns))
        self._next = 0
        self._count = 0

    def add(self, rows: FloatArray) -> None:
        """Add rows, shape (n, columns)."""
        size = len(self._rows)
        rows = rows[-size:]
        first = min(len(rows), size - self._next)
        self._rows[self._next : self._next + first] = rows[:first]
        self._rows[: len(rows) - first] = rows[first:]
        self._next = (self._next + len(rows)) % size
        self._count = min(self._count + len(rows), size)

    def newest(self) -> FloatArray:
        """A copy of the rows, oldest first."""
        if self._count < len(self._rows):
            return self._rows[: self._count].copy()
        return np.concatenate([self._rows[self._next :], self._rows[: self._next]])


class Traces:
    """The newest readings for the preview and the traces.

    Args:
        rate: samples per second.
        counts: whether the accelerometer's readings are raw counts, which may have an offset.
    """

    def __init__(self, rate: float, *, counts: bool = False) -> None:
        self._counts = counts
        self._step = max(1, math.floor(rate * TRACE_SECONDS / _POINTS))
        self._thin = Ring(max(2, math.ceil(rate * TRACE_SECONDS / self._step)), _CHANNELS)
        self._second = Ring(max(1, round(rate)), 3)
        self._index = 0
        self.accelerometer: tuple[float, float, float] | None = None
        self.gyroscope: tuple[float, float, float] | None = None
        self.magnetometer: tuple[float, float, float] | None = None
        self.temperature: float | None = None

    def feed(self, readings: Readings) -> None:
        """Add samples; only every n-th one, counted from the first, is drawn."""
        count = len(readings)
        if not count:
            return
        a = readings.accelerometer.values
        g = readings.gyroscope.values if readings.gyroscope is not None else None
        first = -self._index % self._step
        self._index += count
        self._second.add(a)
        drawn = a[first :: self._step]
        rates = np.full_like(drawn, np.nan) if g is None else g[first :: self._step]
        self._thin.add(np.hstack([drawn, rates]))
        self.accelerometer = _three(a[-1])
        self.gyroscope = None if g is None else _three(g[-1])
        field = readings.magnetometer
        if field is not None and len(field):  # a slower sensor may be absent in a piece
            self.magnetometer = _three(field.values[-1])
        if readings.temperature is not None and len(readings.temperature):
            self.temperature = float(readings.temperature.values[-1, 0])

    def drawn(self) -> FloatArray:
        """The newest seconds of all six channels, shape (n, 6); NaN without a gyroscope."""
        return self._thin.newest()

    @property
    def gravity(self) -> float | None:
        """Magnitude of the newest second's mean acceleration; None before the first sample.

        Counts that are centred at half the converter's range are measured from there.
        """
        if self.accelerometer is None:
            return None
        mean = self._second.newest().mean(axis=0)
        return float(np.linalg.norm(mean - (guessed_offset(mean) if self._counts else 0.0)))


def _three(row: FloatArray) -> tuple[float, float, float]:
    return float(row[0]), float(row[1]), float(row[2])


_MAX_UNDRAWN_PIECES = 64
"""Pieces of the stream that wait to be drawn at most."""


class SnapshotMaker:
    """Collects samples cheaply and makes snapshots of them.

    Args:
        serial: number of the last snapshot of an earlier maker.
    """

    def __init__(self, serial: int = 0) -> None:
        self.rate = 0.0
        self._traces: Traces | None = None
        self._attitude = AttitudeFilter()
        self._unseen: list[Readings] = []
        self._units = ("m/s^2", "rad/s", "uT")
        self._dirty = True
        self._latest = Snapshot(serial)

    def begin(self, rate: float, readings: Readings) -> None:
        """Start, now that rate and units are known."""
        self.rate = rate
        self._traces = Traces(rate, counts=readings.accelerometer.unit == COUNT)
        gyroscope, magnetometer = readings.gyroscope, readings.magnetometer
        self._units = (
            readings.accelerometer.unit,
            "rad/s" if gyroscope is None else gyroscope.unit,
            "uT" if magnetometer is None else magnetometer.unit,
        )

    def feed(self, readings: Readings) -> None:
        """Add samples."""
        self._unseen.append(readings)
        self._dirty = True
        if len(self._unseen) >= _MAX_UNDRAWN_PIECES:
            self._draw(None, at_rest=False)

    def changed(self) -> None:
        """Mark the snapshot as outdated for another reason than samples."""
        self._dirty = True

    def snapshot(
        self,
        stream: Callable[[], StreamStatus],
        status: Callable[[], Status],
        events: tuple[tuple[Event, ...], int],
        finished: bool,
    ) -> Snapshot:
        """A snapshot of everything; the same object again if nothing is new."""
        if not self._dirty:
            return self._latest
        now = status()
        # no device is drawn before the start
        self._draw(now.up, at_rest=now.still.still or now.step is StepKind.SOURCE)
        source, drawn = stream(), self._attitude.matrix
        attitude = None if drawn is None else matrix_of(drawn.tolist())
        self._latest = Snapshot(
            serial=self._latest.serial + 1,
            stream=self._with_values(source),
            status=present(now, attitude, source.flow(ended=finished)),
            events=events[0],
            event_count=events[1],
            traces=self._latest.traces if self._traces is None else self._traces.drawn(),
            attitude=drawn,
            finished=finished,
        )
        self._dirty = False
        return self._latest

    def bare(self, stream: StreamStatus) -> Snapshot:
        """A snapshot of the stream alone."""
        self._latest, self._dirty = Snapshot(self._latest.serial + 1, stream), True
        return self._latest

    def count_from(self, serial: int) -> None:
        """Give the next snapshot a number after ``serial``."""
        self._latest, self._dirty = replace(self._latest, serial=serial), True

    @property
    def serial(self) -> int:
        """Number of the newest snapshot."""
        return self._latest.serial

    def _draw(self, up: tuple[float, float, float] | None, *, at_rest: bool) -> None:
        unseen, self._unseen = self._unseen, []
        if unseen and self._traces is not None:
            readings = join_readings(unseen)
            self._traces.feed(readings)
            self._attitude.feed(readings, up, at_rest=at_rest)

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
