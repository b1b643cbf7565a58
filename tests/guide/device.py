"""A device for tests: it lies, turns and trembles as told, and reads what the script says."""

from collections.abc import Iterable

import numpy as np

from imucal_wizard.core.poses import DIRECTIONS, NAMED
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.guide.kinds import EventKind, StepKind
from imucal_wizard.guide.plan import Procedure, standard
from imucal_wizard.guide.state import Event
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.measurement.holds import Hold, Rotation
from imucal_wizard.measurement.requests import MeasurementRequest

RATE = 100.0
UNIT_AXES = dict(zip("xyz", np.eye(3), strict=True))


def rotation_between(a: FloatArray, b: FloatArray) -> FloatArray:
    """Smallest body turn (rotation vector, rad) that brings ``b`` on top instead of ``a``."""
    axis = np.cross(b, a)
    size = float(np.linalg.norm(axis))
    angle = float(np.arctan2(size, a @ b))
    if size < 1e-9:
        across = np.cross(a, np.eye(3)[int(np.argmin(np.abs(a)))])
        return np.asarray(angle * across / np.linalg.norm(across), float)
    return np.asarray(angle * axis / size, float)


def turned(up: FloatArray, turn: FloatArray) -> FloatArray:
    """Up in the body frame after a body turn by a rotation vector (Rodrigues, −turn).

    Args:
        up: before the turn, shape (3,).
        turn: one or several, rad, shape (..., 3).
    """
    angle = np.linalg.norm(turn, axis=-1, keepdims=True)
    k = -turn / np.maximum(angle, 1e-12)
    along = (k @ up)[..., None] * k
    return np.asarray(along + (up - along) * np.cos(angle) + np.cross(k, up) * np.sin(angle), float)


class Device:
    """Writes down the readings of a device that is moved by a script.

    Args:
        rate: samples per second.
        noise: standard deviation of the accelerometer, m/s², and the gyroscope, rad/s.
        seed: of the noise.
        up: direction that is up at first.
    """

    def __init__(
        self,
        rate: float = RATE,
        noise: tuple[float, float] = (0.01, 0.001),
        seed: int = 1,
        up: str = "+z",
    ) -> None:
        self.rate = rate
        self.noise = noise
        self._rng = np.random.default_rng(seed)
        self.up = NAMED[up]
        self.time = 0.0
        self.gyro_bias = np.array([0.01, -0.02, 0.005])
        self._time: list[FloatArray] = []
        self._force: list[FloatArray] = []
        self._turning: list[FloatArray] = []

    def rest(self, seconds: float) -> "Device":
        """Lie still."""
        count = round(seconds * self.rate)
        self._write(np.tile(self.up, (count, 1)), np.zeros((count, 3)))
        return self

    def turn(self, turn: FloatArray, seconds: float | None = None) -> "Device":
        """Turn by a rotation vector, smoothly, with a peak near 110 °/s when not told."""
        angle = float(np.linalg.norm(turn))
        if seconds is None:
            seconds = max(0.5, angle)
        count = round(seconds * self.rate)
        phase = (np.arange(count) + 0.5) / count
        share = phase - np.sin(2.0 * np.pi * phase) / (2.0 * np.pi)
        speed = (1.0 - np.cos(2.0 * np.pi * phase)) / seconds
        self._write(turned(self.up, share[:, None] * turn), speed[:, None] * turn)
        self.up = turned(self.up, turn)
        return self

    def rotate(self, axis: str, degrees: float, seconds: float | None = None) -> "Device":
        """Turn about a body axis."""
        return self.turn(np.radians(degrees) * UNIT_AXES[axis], seconds)

    def place(self, pose: str) -> "Device":
        """Bring a pose on top the shortest way."""
        return self.turn(rotation_between(self.up, NAMED[pose]))

    def hold(self, pose: str, seconds: float = 3.2) -> "Device":
        """Place a pose and lie still in it."""
        return self.place(pose).rest(seconds)

    def poses(self, names: Iterable[str]) -> "Device":
        """Hold each of these poses."""
        for name in names:
            self.hold(name)
        return self

    def shake(self, seconds: float, force: float = 1.0, rate: float = 0.1) -> "Device":
        """Tremble: white noise of so many m/s² and rad/s."""
        count = round(seconds * self.rate)
        force_noise = self._rng.normal(0.0, force / STANDARD_GRAVITY, (count, 3))
        self._write(self.up + force_noise, self._rng.normal(0.0, rate, (count, 3)))
        return self

    def gap(self, seconds: float) -> "Device":
        """No samples for a while; negative: the time jumps back."""
        self.time += seconds
        return self

    def readings(
        self, *, counts: tuple[float, float] | None = None, offset: float = 0.0, gyro: bool = True
    ) -> Readings:
        """All that was written down; in SI, or in counts per m/s² and rad/s around an offset."""
        time = np.concatenate(self._time)
        force = np.concatenate(self._force) * STANDARD_GRAVITY
        turning = np.concatenate(self._turning) + self.gyro_bias
        force = force + self._rng.normal(0.0, 1.0, force.shape) * self.noise[0]
        turning = turning + self._rng.normal(0.0, 1.0, turning.shape) * self.noise[1]
        units = "m/s^2", "rad/s"
        if counts is not None:
            force = np.round(force * counts[0] + offset)
            turning = np.round(turning * counts[1] + offset)
            units = "count", "count"
        series = Series(time, turning, units[1]) if gyro else None
        return Readings(Series(time, force, units[0]), series)

    def taken(self) -> Readings:
        """The readings since the last call."""
        readings = self.readings()
        self._time, self._force, self._turning = [], [], []
        return readings

    def _write(self, ups: FloatArray, turning: FloatArray) -> None:
        count = len(ups)
        self._time.append(self.time + np.arange(count) / self.rate)
        self.time += count / self.rate
        self._force.append(ups)
        self._turning.append(turning)


def part(readings: Readings, first: int, last: int) -> Readings:
    """The samples with these numbers."""

    def cut(series: Series | None) -> Series | None:
        if series is None:
            return None
        return Series(series.time[first:last], series.values[first:last], series.unit)

    accelerometer = cut(readings.accelerometer)
    assert accelerometer is not None
    return Readings(accelerometer, cut(readings.gyroscope))


QUICK = standard(
    2, settle_seconds=3.0, hold_seconds=1.0, rotation_hold_seconds=1.0
)  # the same procedure, sooner done


def machine_at(step: StepKind, device: Device, procedure: Procedure = QUICK) -> StateMachine:
    """A machine that has settled on this device and stands at the beginning of a step.

    The device must not have been fed before; what it wrote down so far is used up.
    """
    machine = StateMachine(procedure, rate=device.rate)
    machine.command("start")
    machine.feed(device.rest(4.0).taken())
    assert machine.status().step is StepKind.UP_DOWN
    if step is not StepKind.UP_DOWN:
        machine.command("goto", step)
    return machine


def kinds(events: Iterable[Event]) -> list[EventKind]:
    """What happened, in order."""
    return [event.kind for event in events]


def texts(events: Iterable[Event], kind: EventKind) -> list[str]:
    """What was said with events of one kind."""
    return [event.text for event in events if event.kind is kind]


def pose_asked(pose: str, why: str = "", *, warm: bool = False) -> MeasurementRequest:
    """A named pose."""
    x, y, z = DIRECTIONS[pose].tolist()
    return MeasurementRequest((x, y, z), pose, why, warm)


def holds_of(machine: StateMachine, step: StepKind) -> list[Hold]:
    """The holds that count for a step, in time order."""
    return [kept.hold for kept in machine.context.measurements.holds if step in kept.ticks]


def rotations_of(machine: StateMachine) -> list[Rotation]:
    """The rotations that count, in time order."""
    return [kept.rotation() for kept in machine.context.measurements.rotations if kept.counts]
