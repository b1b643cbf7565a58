"""Gyroscope against the joint bound: ``python -m benchmarks.gyroscope_bound SESSIONS SEED``.

With a third word only the devices with it in their names. Each session is one chain: every hold
ends one rotation and begins the next. The Cramér–Rao bound is numerical: differences of the
simulated readings of all holds and of the directions that the rotations carry, by every parameter
of the accelerometer, of the gyroscope, by the true direction of each hold and by the Earth's rate,
of which only the usual size is known, with the true variances. It shares no formula with the
estimator. The table shows for each group of parameters the rms error over its bound and the share
of 95 % intervals that hold the truth, with the worst single parameter; noise is drawn anew in each
session, truth and motion in each hundredth. A run of 5,000 sessions is the same as five of 1,000
with seeds 1,000 apart.

Where few directions leave angles of the accelerometer undetermined, the accelerometer is drawn anew
with errors of usual size, and the bound takes these sizes as known. Where the bias wanders, the
truth is its mean over the session and the bound is that without the wandering; so it is without
the steps where readings come in steps.

The last column is the share of sessions whose interval of the error held out holds the rms closure
of new rotations: their noise and, linear in the errors of both calibrations, what these make of it.
"""

import sys
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation as Attitude

from benchmarks.hold_sessions import STEP, Noise, wander
from benchmarks.measure import Wanted
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.estimate.distributions import quantile
from imucal_wizard.estimate.gyroscope_report import fit_gyroscope
from imucal_wizard.estimate.recording import fit_accelerometer
from imucal_wizard.estimate.rest_spectrum import rest_spectrum
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.measurement.blocks import BlockCutter
from imucal_wizard.measurement.holds import Hold, Rotation, hold_from
from imucal_wizard.simulate.sensor import Thermal
from tests.estimate.truth import (
    EIGHTEEN,
    SIX,
    TWENTY_SIX,
    Motion,
    Truth,
    tilted,
    turn,
    typical_gyroscope,
)

GRAVITY = 9.80665
RATE = 50.0
"""Samples/s."""
BATCHES = 5
AGAIN = 0.5
"""Time without readings on either side of a rotation, s."""
PER_CHAIN = 100
"""Sessions with the same truth and motion."""
MOVED = 4.0
"""Time between two holds beyond that, s."""
DAY = 2.0 * np.pi / 86164.1
"""The Earth's rate, rad/s."""
WARMING = Thermal(24.0, 5.0, 180.0)
"""Temperature of the chip."""
GROUPS = ("sensitivity", "cross", "bias")


@dataclass(frozen=True, eq=False)
class Device:
    """What is simulated.

    Attributes:
        name: in the table.
        poses: nominal up of the holds in order, shape (n, 3).
        turns: further rotations about level axes.
        samples: of each hold.
        force: noise of a sample of the accelerometer, mg.
        rate: noise of a sample of the gyroscope, °/s, per axis.
        drawn: each session has an accelerometer of its own.
        uneven: standard deviation of the logarithm of both noises from hold to hold.
        scatter: offset of the accelerometer from hold to hold, mg.
        jitter: the same of the gyroscope, °/s.
        flicker: Allan deviation at 10 s of the gyroscope's wandering bias, °/s.
        rest: a long rest after all, s.
        step: of the gyroscope's readings, °/s; in each session another one by up to 5 %, with zero
            anywhere in it.
        earth: the Earth turns, at a latitude and with a heading drawn for each session.
        broken: every so-th rotation was not recorded; 0 for none.
    """

    name: str
    poses: FloatArray
    turns: int
    samples: int
    force: float
    rate: tuple[float, float, float] = (0.03, 0.03, 0.03)
    drawn: bool = False
    uneven: float = 0.0
    scatter: float = 0.0
    jitter: float = 0.0
    flicker: float = 0.0
    rest: float = 0.0
    step: float = 0.0
    earth: bool = False
    broken: int = 0


_EIGHT = EIGHTEEN[[0, 6, 1, 2, 13, 3, 4, 5]]
"""Six faces and two edges."""
DEVICES = (
    Device("26 poses, 12 turns, 1 mg", TWENTY_SIX, 12, 150, 1.0),
    Device("26 poses, 12 turns, 6 mg", TWENTY_SIX, 12, 150, 6.0),
    Device("18 poses, 12 turns, 1 mg", EIGHTEEN, 12, 150, 1.0),
    Device("18 poses, 6 turns, 3 mg", EIGHTEEN, 6, 150, 3.0),
    Device("26 poses, 12 turns, 1 mg, 10 samples", TWENTY_SIX, 12, 10, 1.0),
    Device("26 poses, 12 turns, 1 mg, uneven axes", TWENTY_SIX, 12, 150, 1.0, (0.015, 0.03, 0.1)),
    Device("18 poses, 12 turns, uneven by 0.7", EIGHTEEN, 12, 150, 1.0, uneven=0.7),
    Device("18 poses, 12 turns, uneven by 1.0", EIGHTEEN, 12, 150, 1.0, uneven=1.0),
    Device("26 poses, 12 turns, 0.3 mg per hold", TWENTY_SIX, 12, 150, 1.0, scatter=0.3),
    Device("26 poses, 12 turns, 0.004 °/s per hold", TWENTY_SIX, 12, 150, 1.0, jitter=0.004),
    Device("18 poses, 12 turns, flicker 5 °/h", EIGHTEEN, 12, 150, 1.0, flicker=0.0015),
    Device("26 poses, 12 turns, flicker 20 °/h", TWENTY_SIX, 12, 150, 1.0, flicker=0.006),
    Device("18 poses, flicker 20 °/h, 2 min rest", EIGHTEEN, 12, 150, 1.0, flicker=0.006, rest=120),
    *(
        Device(f"18 poses, 12 turns, steps of {step:g} °/s", EIGHTEEN, 12, 150, 1.0, step=step)
        for step in (0.03, 0.075, 0.12, 0.24, 0.5, 1.2)
    ),
    *(
        Device(f"on Earth, {name}", poses, 12, 150, 0.2, 3 * (sigma,), earth=True, broken=broken)
        for name, poses, sigma, broken in (
            ("18 poses, 0.0005 °/s/√Hz", EIGHTEEN, 0.0025, 0),
            ("18 poses, 0.002 °/s/√Hz", EIGHTEEN, 0.01, 0),
            ("26 poses, 0.002 °/s/√Hz", TWENTY_SIX, 0.01, 0),
            ("26 poses, 0.002, chains of 3", TWENTY_SIX, 0.01, 3),
            ("18 poses, 0.006 °/s/√Hz", EIGHTEEN, 0.03, 0),
        )
    ),
    Device("6 directions, each 5 times, 1 mg", np.tile(SIX, (5, 1)), 0, 150, 1.0, drawn=True),
    Device("8 directions, each 4 times, 1 mg", np.tile(_EIGHT, (4, 1)), 0, 150, 1.0, drawn=True),
)


class WrongRate(ABC):
    """What a gyroscope may do beside bias, scale and angles."""

    @abstractmethod
    def error(self, time: FloatArray, rate: FloatArray, up: FloatArray) -> FloatArray:
        """Error of the rate, rad/s, shape (n, 3).

        Args:
            time: since the session began, s, shape (n,).
            rate: true rate, rad/s, shape (n, 3).
            up: true up, shape (n, 3).
        """


class Session:
    """Truth and motion of one device.

    Attributes:
        levels: noise of each hold over the usual one, shape (h,).
    """

    def __init__(self, device: Device, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.device = device
        self.accelerometer = usual_accelerometer(rng)
        self.gyroscope = typical_gyroscope()
        self.motions = _chain(device, rng)
        last = self.motions[-1].up[-1]
        self.up = np.array([*(motion.up[0] for motion in self.motions), last])
        self.levels = np.exp(device.uneven * rng.standard_normal(len(self.up)))

    def like(self, other: "Session") -> "Session":
        """These motions with the sensors of another one, and their noise."""
        self.accelerometer, self.gyroscope = other.accelerometer, other.gyroscope
        self.levels = np.resize(other.levels, len(self.up))
        return self

    @property
    def _starts(self) -> FloatArray:
        """Of each hold, s."""
        return np.arange(float(len(self.up))) * (self.device.samples / RATE + 2.0 * AGAIN + MOVED)

    @property
    def seconds(self) -> float:
        """Length of the session, s."""
        return float(self._starts[-1] + self.device.samples / RATE + self._rest)

    @property
    def _rest(self) -> float:
        """What the long rest makes the session longer, s."""
        return MOVED + self.device.rest if self.device.rest else 0.0

    def rested(self, rng: np.random.Generator, slow: FloatArray) -> tuple[Hold, Readings]:
        """The long rest after all, in the last direction, and its samples."""
        device, end = self.device, self.seconds
        time = np.arange(end - device.rest, end - 0.5 / RATE, 1.0 / RATE)
        force = self.accelerometer.sensitivity @ (GRAVITY * self.up[-1]) + self.accelerometer.bias
        noise = rng.standard_normal((2, len(time), 3))
        forces = force + 1e-3 * device.force * GRAVITY * noise[0]
        wandering = slow[np.minimum((time / STEP).astype(int), len(slow) - 1)]
        rates = self.gyroscope.bias + wandering + np.radians(device.rate) * noise[1]
        readings = Readings(Series(time, forces, "m/s^2"), Series(time, rates, "rad/s"))
        return hold_from(BlockCutter(RATE).feed(readings)), readings

    def wandering(self, rng: np.random.Generator) -> FloatArray:
        """The wandering of the gyroscope's bias, rad/s, every ``STEP`` seconds, shape (m, 3)."""
        noise = Noise(flicker=float(np.radians(self.device.flicker)))
        return wander(noise, round(self.seconds / STEP), rng)

    def recorded(
        self,
        rng: np.random.Generator,
        wrong: WrongRate | None = None,
        slow: FloatArray | None = None,
    ) -> tuple[list[Hold], list[Rotation]]:
        """The session with noise, with one more error, and with a bias that wanders."""
        device, sigma, samples = self.device, np.radians(self.device.rate), self.device.samples
        slow = np.zeros((1, 3)) if slow is None else slow
        force = np.full(3, 1e-3 * device.force * GRAVITY)
        seconds, holds, rotations = samples / RATE, [], []

        def added(time: FloatArray) -> FloatArray:
            return np.asarray(slow[np.minimum((time / STEP).astype(int), len(slow) - 1)])

        earth, turning = self._earth(rng)
        places = zip(self._starts, self.up, self.levels, earth, strict=True)
        for start, up, level, turned in places:
            true = self.accelerometer.sensitivity @ (GRAVITY * up) + self.accelerometer.bias
            true = true + 1e-3 * device.scatter * GRAVITY * rng.standard_normal(3)
            mean, covariance, within = _averaged(true, level * force, samples, rng)
            batched = samples // BATCHES * BATCHES
            during = added(start + np.arange(batched) / RATE).reshape(BATCHES, -1, 3).mean(axis=1)
            during = during + np.radians(device.jitter) * rng.standard_normal(3)
            still = self.gyroscope.bias + self.gyroscope.sensitivity @ turned + during
            middle = np.array([start + 0.5 * seconds])
            if wrong is not None:
                felt = wrong.error(middle, np.zeros((1, 3)), up[None])[0]
                still = still + self.gyroscope.sensitivity @ felt
            rate, rates, inside = _averaged(still, level * sigma, samples, rng)
            end = start + seconds
            holds.append(
                Hold(
                    start,
                    end,
                    mean,
                    covariance,
                    rate,
                    rates,
                    samples,
                    float(WARMING.at(middle)[0]),
                    accelerometer_scatter=within,
                    gyroscope_scatter=inside,
                )
            )
        pairs = zip(self.motions, turning, holds[:-1], holds[1:], strict=True)
        for number, (motion, turned, before, after) in enumerate(pairs, 1):
            time = before.end + AGAIN + motion.time - motion.time[0]
            felt = motion.rate + turned
            if wrong is not None:
                felt = felt + wrong.error(time, motion.rate, motion.up)
            reading = felt @ self.gyroscope.sensitivity.T + self.gyroscope.bias
            reading = reading + added(time) + sigma * rng.standard_normal(reading.shape)
            inside = GRAVITY * motion.up @ self.accelerometer.sensitivity.T
            inside = inside + self.accelerometer.bias
            lost = "not recorded" if device.broken and number % device.broken == 0 else None
            rotations.append(Rotation(before, after, time, reading, None, lost, inside))
        return self._in_steps(holds, rotations, earth, rng) if device.step else (holds, rotations)

    def _earth(self, rng: np.random.Generator) -> tuple[FloatArray, list[FloatArray]]:
        """The Earth's rate in the body, in each hold and during each rotation, rad/s."""
        if not self.device.earth:
            return np.zeros((len(self.up), 3)), [np.zeros(3) for _ in self.motions]
        latitude = np.radians(rng.uniform(-65.0, 65.0))
        day = DAY * np.array([np.cos(latitude), 0.0, np.sin(latitude)])
        lying, _ = Attitude.align_vectors([[0.0, 0.0, 1.0]], [self.up[0]])
        heading = Attitude.from_rotvec([0.0, 0.0, rng.uniform(0.0, 2.0 * np.pi)])
        at, still, turning = heading * lying, [], []
        for motion in self.motions:
            course = at * attitudes(motion.time, motion.rate)
            turning.append(course.inv().apply(day))
            still.append(turning[-1][0])
            at = course[-1]
        return np.array([*still, turning[-1][-1]]), turning

    def _in_steps(
        self,
        holds: list[Hold],
        rotations: list[Rotation],
        earth: FloatArray,
        rng: np.random.Generator,
    ) -> tuple[list[Hold], list[Rotation]]:
        """The session with the gyroscope's readings in steps, its rests drawn anew."""
        step = np.radians(self.device.step) * rng.uniform(0.95, 1.05)
        zero, found = step * rng.uniform(size=3), []

        def rounded(values: FloatArray) -> FloatArray:
            return np.asarray(zero + step * np.round((values - zero) / step))

        for hold, level, turned in zip(holds, self.levels, earth, strict=True):
            noise = level * np.radians(self.device.rate) * rng.standard_normal((hold.samples, 3))
            still = self.gyroscope.bias + self.gyroscope.sensitivity @ turned
            values = rounded(still + noise)
            each = hold.samples // BATCHES
            batches = values[: each * BATCHES].reshape(BATCHES, each, 3).mean(axis=1)
            covariance = np.cov(batches.T) / BATCHES
            single = values.var(axis=0, ddof=1) / hold.samples
            mean = values.mean(axis=0)
            found.append(
                replace(
                    hold,
                    gyroscope=mean,
                    gyroscope_covariance=covariance,
                    gyroscope_scatter=single,
                )
            )
        pairs = zip(rotations, found[:-1], found[1:], strict=True)
        return found, [replace(r, before=a, after=b, rate=rounded(r.rate)) for r, a, b in pairs]

    @property
    def _tilts(self) -> FloatArray:
        """Two directions across the up of each hold, shape (h, 2, 3)."""
        return np.array([np.linalg.svd(up[None])[2][1:] for up in self.up])

    @property
    def _readings(self) -> list[FloatArray]:
        """Of the gyroscope in each rotation, without noise."""
        bias = self.gyroscope.bias
        return [one.rate @ self.gyroscope.sensitivity.T + bias for one in self.motions]

    def _rate_noise(self) -> list[FloatArray]:
        """Covariance of each closure by the noise of the rates, (2, 2) each.

        Each sample turns the direction by its own error.
        """
        rate, gains = np.radians(self.device.rate), np.linalg.inv(self.gyroscope.sensitivity)
        out = []
        parts = zip(self.motions, self._readings, self._tilts[1:], self.up[1:], strict=True)
        for motion, reading, tilt, up in parts:
            course = attitudes(motion.time, (reading - self.gyroscope.bias) @ gains.T)
            # a turn by ε at a sample, seen in the frame of the end
            seen = (course[-1].inv() * course).as_matrix() @ (gains * rate)
            across = tilt @ np.cross(up, seen, axisb=1, axisc=1)
            across *= motion.time[1] - motion.time[0]
            out.append((across @ np.swapaxes(across, 1, 2)).sum(axis=0))
        return out

    def new_closures(self) -> tuple[FloatArray, float]:
        """Closures of these rotations where others calibrated both sensors.

        Returns:
            Their derivative by the errors of the gyroscope's M by rows and b, then of the
            accelerometer's, shape (2 m, 24), and the mean square of a closure by noise alone.
        """
        known = [(one.matrix, one.bias) for one in (self.gyroscope, self.accelerometer)]
        forces = GRAVITY * self.up @ self.accelerometer.sensitivity.T + self.accelerometer.bias

        def closures(change: FloatArray) -> FloatArray:
            (gains, bias), (triangle, offset) = (
                (matrix + part[:9].reshape(3, 3), vector + part[9:])
                for (matrix, vector), part in zip(known, (change[:12], change[12:]), strict=True)
            )
            up = (forces - offset) @ triangle.T
            up /= np.linalg.norm(up, axis=1)[:, None]
            parts = zip(self.motions, self._readings, self._tilts[1:], up, up[1:], strict=False)
            return np.concatenate(
                [
                    tilt @ (attitudes(m.time, (y - bias) @ gains.T)[-1].inv().apply(u) - after)
                    for m, y, tilt, u, after in parts
                ]
            )

        steps = 1e-5 * np.eye(24)
        slopes = np.array([(closures(step) - closures(-step)) / 2e-5 for step in steps]).T
        device = self.device
        force = np.hypot(device.force * self.levels / np.sqrt(device.samples), device.scatter)
        tilted_by = 2.0 * (1e-3 * force) ** 2  # in both directions
        by_rates = np.mean([np.trace(one) for one in self._rate_noise()])
        return slopes, float(by_rates + (tilted_by[1:] + tilted_by[:-1]).mean())

    def bound(self) -> FloatArray:
        """Smallest covariance of the gyroscope's parameters, in the order of ``NAMES``, (12, 12).

        A closure is the direction carried by the noise-free readings less the direction after; its
        noise is that of the samples.
        """
        device, count = self.device, len(self.up)
        rate, resting = np.radians(device.rate), self.levels[:, None] / np.sqrt(device.samples)
        force = np.hypot(1e-3 * device.force * GRAVITY * resting, 1e-3 * device.scatter * GRAVITY)
        still = np.hypot(rate * resting, np.radians(device.jitter))
        gains = np.linalg.inv(self.gyroscope.sensitivity)
        triangle = np.linalg.inv(self.accelerometer.sensitivity)
        tilts, readings = self._tilts, self._readings
        roots = [np.linalg.inv(np.linalg.cholesky(one)) for one in self._rate_noise()]
        axes = np.array([self.up[0], *tilts[0]])
        usual = DAY * np.sqrt([0.5, 0.25, 0.25])  # of its parts, at a latitude of 45°
        lying = [Attitude.identity()]
        for motion in self.motions:
            lying.append(lying[-1] * attitudes(motion.time, motion.rate)[-1])

        def predicted(gyroscope: FloatArray, others: FloatArray) -> FloatArray:
            """All whitened readings, for changes of the parameters."""
            matrix, bias = gains + gyroscope[:9].reshape(3, 3), self.gyroscope.bias + gyroscope[9:]
            upper = triangle.copy()
            upper[np.triu_indices(3)] += others[:6]
            offset = self.accelerometer.bias + others[6:9]
            shifts, earth = others[9:-3].reshape(count, 1, 2), others[-3:] @ axes
            turning = np.array([one.inv().apply(earth) for one in lying])
            up = self.up + (shifts @ tilts)[:, 0]
            up /= np.linalg.norm(up, axis=1)[:, None]
            whole = carried
            if gyroscope.any() or earth.any():
                parts = zip(self.motions, readings, courses, turning[:-1], strict=True)
                whole = [
                    attitudes(m.time, (y - bias) @ matrix.T - course.inv().apply(day))[-1]
                    for m, y, course, day in parts
                ]
            return np.concatenate(
                [
                    ((GRAVITY * up @ np.linalg.inv(upper).T + offset) / force).ravel(),
                    ((bias + turning @ np.linalg.inv(matrix).T) / still).ravel(),
                    others[:9] / USUAL * device.drawn,
                    others[-3:] / usual,
                    *(
                        root @ tilt @ (turned.inv().apply(before) - after)
                        for root, tilt, turned, before, after in zip(
                            roots, tilts[1:], whole, up[:-1], up[1:], strict=True
                        )
                    ),
                ]
            )

        pairs = zip(self.motions, readings, strict=True)
        courses = [attitudes(m.time, (y - self.gyroscope.bias) @ gains.T) for m, y in pairs]
        carried = [course[-1] for course in courses]
        columns = []
        for step in 1e-5 * np.eye(24 + 2 * count):
            ends = [predicted(sign * step[:12], sign * step[12:]) for sign in (1.0, -1.0)]
            columns.append((ends[0] - ends[1]) / 2e-5)
        table = np.array(columns).T
        scale = np.linalg.norm(table, axis=0)
        information = (table / scale).T @ (table / scale)
        entries = (np.linalg.inv(information) / np.outer(scale, scale))[:12, :12]
        at = np.concatenate([gains.ravel(), self.gyroscope.bias])
        slope = np.array(
            [(named(at + step) - named(at - step)) / 2e-6 for step in 1e-6 * np.eye(12)]
        ).T
        return np.asarray(slope @ entries @ slope.T)


NAMES = (
    *(f"sensitivity_{axis}" for axis in "xyz"),
    *(f"cross_{a}{b}" for a in "xyz" for b in "xyz" if a != b),
    *(f"bias_{axis}" for axis in "xyz"),
)


USUAL = np.array([0.02, 0.015, 0.015, 0.02, 0.015, 0.02, *[0.03 * GRAVITY] * 3])
"""Errors of an accelerometer: M's xx, xy, xz, yy, yz, zz, and biases in m/s²."""


def usual_accelerometer(rng: np.random.Generator) -> Truth:
    """An accelerometer with errors of usual size."""
    error = USUAL * rng.standard_normal(9)
    matrix = np.eye(3)
    matrix[np.triu_indices(3)] += error[:6]
    return Truth(np.asarray(np.linalg.inv(matrix), float), error[6:])


def named(entries: FloatArray) -> FloatArray:
    """The parameters in the order of ``NAMES`` from M by rows and b."""
    matrix = entries[:9].reshape(3, 3)
    cross = [matrix[i, j] / matrix[j, j] for i in range(3) for j in range(3) if i != j]
    return np.array([*(1.0 / np.diag(matrix)), *cross, *entries[9:]])


def _chain(device: Device, rng: np.random.Generator) -> list[Motion]:
    """From pose to pose with a twist about the vertical, then turns about level axes."""
    motions, up = [], tilted(device.poses[:1], 2.0, rng)[0]
    for target in tilted(device.poses[1:], 2.0, rng):
        twist = Attitude.from_rotvec(rng.uniform(-1.5, 1.5) * up)
        axis = np.cross(target, up)
        if np.linalg.norm(axis) < 0.1:
            axis = np.cross(up, np.eye(3)[np.abs(up).argmin()])
        angle = np.arccos(np.clip(target @ up, -1.0, 1.0))
        tilt = Attitude.from_rotvec(angle * axis / np.linalg.norm(axis))
        motions.append(_turn(up, (twist * tilt).as_rotvec(), rng))
        up = motions[-1].up[-1]
    for index in range(device.turns):
        along = np.eye(3)[index % 3]
        if abs(up @ along) > 0.5:  # bring that axis level first
            across = np.cross(up, np.eye(3)[(index + 1) % 3])
            motions.append(_turn(up, 0.5 * np.pi * across / np.linalg.norm(across), rng))
            up = motions[-1].up[-1]
        angle = np.radians((100.0, -140.0, 160.0, -80.0)[index // 3 % 4])
        motions.append(_turn(up, angle * along, rng))
        up = motions[-1].up[-1]
    return motions


def _turn(up: FloatArray, vector: FloatArray, rng: np.random.Generator) -> Motion:
    seconds = float(rng.uniform(1.2, 2.5))
    wobble = 0.05 * rng.standard_normal(3)
    return turn(up, vector, seconds=seconds, wobble=wobble, rate=RATE)


def _averaged(
    true: FloatArray, sigma: FloatArray, samples: int, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean of samples with white noise, its covariance as batch means tell it, and as samples do.

    The truth is one for all samples, shape (3,), or one for each batch, shape (BATCHES, 3).
    """
    each = samples // BATCHES
    batches = true + sigma * rng.standard_normal((BATCHES, 3)) / np.sqrt(each)
    scatter = batches - batches.mean(axis=0)
    inside = sigma**2 * rng.chisquare(BATCHES * (each - 1), 3) / each
    single = (inside + (scatter**2).sum(axis=0)) * each / (samples * (samples - 1.0))
    covariance = scatter.T @ scatter / (BATCHES * (BATCHES - 1))
    return batches.mean(axis=0), covariance, single


def attitudes(time: FloatArray, rate: FloatArray) -> Attitude:
    """From the beginning to each sample, by the mean rate of each interval."""
    steps = Attitude.from_rotvec(0.5 * (rate[1:] + rate[:-1]) * np.diff(time)[:, None]).as_matrix()
    whole = [np.eye(3)]
    for step in steps:
        whole.append(whole[-1] @ step)
    return Attitude.from_matrix(np.array(whole))


@dataclass(frozen=True, eq=False)
class Outcome:
    """Of many sessions, per parameter in the order of ``NAMES``.

    Attributes:
        ratio: rms error over its bound, shape (12,).
        held: share of 95 % intervals that hold the truth, shape (12,).
        closed: share of sessions whose interval holds the rms closure of new rotations.
    """

    ratio: FloatArray
    held: FloatArray
    closed: float

    def group(self, name: str) -> tuple[float, float, float, float]:
        """Mean and largest ratio, least and largest share of one group of parameters."""
        own = [name in one for one in NAMES]
        ratio, held = self.ratio[own], self.held[own]
        mean = float(np.sqrt((ratio**2).mean()))
        return mean, float(ratio.max()), float(held.min()), float(held.max())


def studied(device: Device, sessions: int, seed: int) -> Outcome:
    """Many sessions of one device, in chains of their own."""
    errors, held, closed = [], [], []
    for place in range(sessions):
        if place % PER_CHAIN == 0:
            session, rng = Session(device, seed + place), np.random.default_rng([seed + place])
            bound = np.sqrt(np.diag(session.bound()))
            gyroscope = session.gyroscope
            truth = named(np.concatenate([gyroscope.matrix.ravel(), gyroscope.bias]))
            slopes, noise = Session(device, seed + place + 1).like(session).new_closures()
        if device.drawn:
            session.accelerometer = usual_accelerometer(rng)
        slow = session.wandering(rng) if device.flicker else None
        holds, rotations = session.recorded(rng, slow=slow)
        readings = None
        if slow is not None and device.rest:
            rest, readings = session.rested(rng, slow)
            holds.append(rest)
        known = fit_accelerometer(holds, GRAVITY, "m/s^2", readings=readings)
        found = fitted(holds, rotations, known, readings)
        own = {one.name: one for one in found.parameters}
        off = np.array([own[name].value for name in NAMES]) - truth
        if slow is not None:
            off[9:] -= slow.mean(axis=0)
        reach = quantile(0.95, found.degrees_of_freedom)
        sigma = np.array([own[name].standard_error or np.inf for name in NAMES])
        errors.append(off / bound)
        held.append(np.abs(off) < reach * sigma)
        changes = [
            np.concatenate([(fit.matrix - true.matrix).ravel(), fit.bias - true.bias])
            for fit, true in ((found, gyroscope), (known, session.accelerometer))
        ]
        square = 2.0 * ((slopes @ np.concatenate(changes)) ** 2).mean() + noise
        low, high = found.held_out_interval or (np.inf, -np.inf)
        closed.append(low <= np.sqrt(square) <= high)
    ratio = np.sqrt((np.array(errors) ** 2).mean(axis=0))
    return Outcome(ratio, np.array(held).mean(axis=0), float(np.mean(closed)))


def fitted(
    holds: list[Hold],
    rotations: list[Rotation],
    known: SensorFit | None = None,
    readings: Readings | None = None,
) -> SensorFit:
    """The gyroscope by the whole way from the holds."""
    known = known or fit_accelerometer(holds, GRAVITY, "m/s^2")
    args, spectrum = (holds, rotations, known, "rad/s"), rest_spectrum(readings, holds)
    fit = fit_gyroscope(*args, readings=readings, spectrum=spectrum).fit
    if fit is None:
        raise SystemExit("a simulated gyroscope was not fitted")
    return fit


def main(sessions: int, seed: int, only: str = "") -> None:
    """Print the table."""
    spread = 1.0 / np.sqrt(2.0 * sessions)
    doubt, doubt_closed = (np.sqrt(one * (1.0 - one) / sessions) for one in (0.95, 0.9))
    wanted = Wanted()
    print(
        f"{sessions} sessions each, seed {seed}; a ratio is known to {100 * spread:.1f} %, a share "
        f"of 95 % to {100 * doubt:.1f} %, one of 90 % to {100 * doubt_closed:.1f} %"
    )
    head = f"{'error/bound':>12}{'worst':>8}{'inside 95 %':>16}{'held out 90 %':>15}"
    print(f"{'device':40}{'parameters':14}{head}")
    for device in DEVICES:
        if only not in device.name:
            continue
        outcome = studied(device, sessions, seed)
        # the bound knows of none of these
        beyond = device.flicker or device.step or device.broken
        closed = "–" if beyond or device.earth else f"{100 * outcome.closed:.1f} %"
        for group in GROUPS:
            mean, worst, least, most = outcome.group(group)
            inside = f"{100 * least:.1f}–{100 * most:.1f} %"
            line = f"{device.name:40}{group:14}{mean:12.3f}{worst:8.3f}{inside:>16}{closed:>15}"
            print(line, flush=True)
            closed = ""
            name = f"{device.name}, {group}"
            if not beyond:
                limit = 1.12 if device.samples < 20 else 1.05
                wanted.figure(f"{name}: error/bound", mean, 0.0, limit, spread)
            slow = device.flicker and not device.rest and group == "bias"
            limits = (90.0, 99.0) if slow else (93.0, 97.0)
            for share in (least, most):
                wanted.figure(f"{name}: inside", 100.0 * share, *limits, 100.0 * doubt)
        if not (beyond or device.earth):
            share = 100.0 * outcome.closed
            wanted.figure(f"{device.name}: held out", share, 87.0, 93.0, 100.0 * doubt_closed)
    print(wanted)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), *sys.argv[3:4])
