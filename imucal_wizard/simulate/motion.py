"""Segments of true motion, known exactly at every instant.

A segment is ``q(t) = q0 ⊗ exp(φ(t)) ⊗ exp(δ(t))``: a smooth rotation ``φ`` with its wobble, and the
tremor ``δ`` of a hand. Both are closed forms, so rate and specific force at the sample times are
exact derivatives and not differences of samples.
"""

import numpy as np

from imucal_wizard.core.readings import FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.simulate import attitude

MINIMUM_JERK_PEAK = 1.875
"""Largest slope of the minimum-jerk profile; peak rate = 1.875 · angle / duration."""

Derivatives = tuple[FloatArray, FloatArray, FloatArray]


def minimum_jerk(s: FloatArray) -> Derivatives:
    """Minimum-jerk path from 0 to 1 (Flash & Hogan 1985): value, slope, curvature at ``s``."""
    value = s**3 * (10.0 + s * (-15.0 + 6.0 * s))
    slope = 30.0 * s**2 * (1.0 - s) ** 2
    curvature = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
    return value, slope, curvature


def bump(s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """``64 s³(1−s)³``: 0 at both ends with two vanishing derivatives, 1 in the middle; slope."""
    inner = s * (1.0 - s)
    return 64.0 * inner**3, 192.0 * inner**2 * (1.0 - 2.0 * s)


@dataclass(frozen=True, eq=False)
class Wobble:
    """The wobble of a rotation by hand about other axes; it begins and ends at zero.

    Attributes:
        amplitude: rad, shape (k, 3).
        phase: rad, shape (k, 3); component ``j`` completes ``j + 1`` periods.
    """

    amplitude: FloatArray
    phase: FloatArray

    def at(self, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Turn and its derivative with respect to ``s``, both (n, 3)."""
        envelope, slope = bump(s)
        frequency = 2.0 * np.pi * np.arange(1, len(self.amplitude) + 1)[:, None]
        argument = frequency * s[:, None, None] + self.phase
        swing = (self.amplitude * np.sin(argument)).sum(1)
        change = (self.amplitude * frequency * np.cos(argument)).sum(1)
        return envelope[:, None] * swing, slope[:, None] * swing + envelope[:, None] * change


@dataclass(frozen=True, eq=False)
class Tremor:
    """The tremor of the hand that holds the device: a sum of sines in absolute time.

    Attributes:
        frequency: Hz, shape (k, 3).
        amplitude: shape (k, 3).
        phase: rad, shape (k, 3).
    """

    frequency: FloatArray
    amplitude: FloatArray
    phase: FloatArray

    def at(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Value and time derivative, both (n, 3)."""
        circular = 2.0 * np.pi * self.frequency
        argument = circular * time[:, None, None] + self.phase
        value = (self.amplitude * np.sin(argument)).sum(1)
        return value, (self.amplitude * circular * np.cos(argument)).sum(1)

    @classmethod
    def drawn(
        cls, rng: np.random.Generator, frequencies: tuple[float, ...], rms: tuple[float, ...]
    ) -> "Tremor":
        """Sines near the given frequencies (Hz), each with the given rms per axis."""
        shape = (len(frequencies), 3)
        near = np.array(frequencies)[:, None] * rng.uniform(0.85, 1.15, shape)
        amplitude = np.sqrt(2.0) * np.array(rms)[:, None] * rng.uniform(0.8, 1.2, shape)
        return cls(near, amplitude, rng.uniform(0.0, 2.0 * np.pi, shape))


@dataclass(frozen=True, eq=False)
class Motion:
    """The true motion of the device at the sample times.

    Attributes:
        time: s, shape (n,).
        specific_force: ``f``, body frame, m/s², shape (n, 3); ``g·u`` at rest.
        rate: ``w``, body frame, rad/s, shape (n, 3).
        attitude: quaternion body to world, shape (n, 4).
        acceleration: acceleration of the device in the world, m/s², shape (n, 3).
        previous: up direction of the previous pose, body frame, shape (n, 3).
        disturbance: contribution of a steel object to the magnetic field, world, µT, shape (n, 3).
    """

    time: FloatArray
    specific_force: FloatArray
    rate: FloatArray
    attitude: FloatArray
    acceleration: FloatArray
    previous: FloatArray
    disturbance: FloatArray


@dataclass(frozen=True, eq=False)
class HandVibration:
    """The tremor of the hand and the vibration of the support, at level 1.

    Attributes:
        angular: tremor of the attitude, rad.
        linear: tremor of the acceleration, m/s².
        support: vibration of the support, 1 m/s² rms per axis.
    """

    angular: Tremor
    linear: Tremor
    support: Tremor

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> "HandVibration":
        """Draw sway near 1 Hz, physiological tremor near 9 Hz, an idling machine above 50 Hz."""
        degree = np.pi / 180.0
        return cls(
            Tremor.drawn(rng, (0.7, 2.3, 9.0), (0.25 * degree, 0.06 * degree, 0.02 * degree)),
            Tremor.drawn(rng, (1.1, 5.0, 9.5), (0.03, 0.05, 0.10)),
            Tremor.drawn(rng, (55.0, 68.0, 80.0), (3**-0.5, 3**-0.5, 3**-0.5)),
        )


@dataclass(frozen=True, eq=False)
class MotionSegment:
    """One move or one rest of ``count`` samples from sample ``first`` on.

    Attributes:
        first: index of its first sample.
        count: number of samples.
        start: attitude without tremor at its beginning, shape (4,).
        previous: up direction of the previous pose, body frame, shape (3,).
        turn: rotation vector of the whole move, rad, shape (3,); None at rest.
        wobble: wobble of the hand; None at rest.
        shift: displacement in the world, m, shape (3,).
        tremor: level of the hand's tremor at the beginning and the end.
        shake: rms of the support's vibration, m/s².
    """

    first: int
    count: int
    start: FloatArray
    previous: FloatArray
    turn: FloatArray | None = None
    wobble: Wobble | None = None
    shift: FloatArray | None = None
    tremor: tuple[float, float] = (0.0, 0.0)
    shake: float = 0.0

    @property
    def end(self) -> FloatArray:
        """Attitude without tremor at its end."""
        if self.turn is None:
            return self.start
        last = attitude.hamilton_product(self.start, attitude.rotation_quaternion(self.turn))
        return np.asarray(last / np.sqrt((last * last).sum()), np.float64)

    def at(self, samples: IntArray, rate: float, unrest: HandVibration) -> Motion:
        """The motion at these sample indices, ``rate`` samples per second."""
        n = len(samples)
        time = samples / rate
        s = (samples - self.first) / self.count
        q = np.broadcast_to(self.start, (n, 4))
        w = np.zeros((n, 3))
        acceleration = np.zeros((n, 3))
        duration = self.count / rate
        if self.turn is not None:
            q, w, acceleration = self._moved(self.turn, s, duration)
        if self.turn is not None or any(self.tremor):
            q, w, trembling = self._trembled(q, w, time, s, duration, unrest)
            acceleration = acceleration + trembling
        if self.shake:
            acceleration = acceleration + self.shake * unrest.support.at(time)[0]
        force = attitude.to_body(q, acceleration + STANDARD_GRAVITY * attitude.WORLD_UP)
        previous = np.broadcast_to(self.previous, (n, 3))
        return Motion(time, force, w, q, acceleration, previous, np.zeros((n, 3)))

    def _moved(
        self, whole: FloatArray, s: FloatArray, duration: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Attitude, rate and acceleration of the rotation with its wobble."""
        value, slope, curvature = minimum_jerk(s)
        turn, turn_rate = value[:, None] * whole, slope[:, None] * whole
        if self.wobble is not None:
            extra, extra_rate = self.wobble.at(s)
            turn, turn_rate = turn + extra, turn_rate + extra_rate
        q = attitude.hamilton_product(self.start, attitude.rotation_quaternion(turn))
        w = attitude.body_rate(turn, turn_rate / duration)
        shift = np.zeros(3) if self.shift is None else self.shift
        return q, w, curvature[:, None] * shift / duration**2

    def _trembled(
        self,
        q: FloatArray,
        w: FloatArray,
        time: FloatArray,
        s: FloatArray,
        duration: float,
        unrest: HandVibration,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Attitude and rate with the hand's tremor, and the tremor's acceleration in the world."""
        before, after = self.tremor
        value, slope, _ = minimum_jerk(s)
        level = before + (after - before) * value
        change = (after - before) * slope
        if self.turn is not None:
            more, more_slope = bump(s)
            level, change = level + more, change + more_slope
        level, change = level[:, None], change[:, None] / duration
        sway, sway_rate = unrest.angular.at(time)
        delta, delta_rate = level * sway, change * sway + level * sway_rate
        step = attitude.rotation_quaternion(delta)
        w = attitude.to_body(step, w) + attitude.body_rate(delta, delta_rate)
        return attitude.hamilton_product(q, step), w, level * unrest.linear.at(time)[0]
