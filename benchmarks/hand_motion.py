"""Recordings of a device in a hand, on a table, or waved slowly: a simulator of its own.

It shares nothing with ``imucal_wizard.simulate``: attitudes are SciPy's, the motion is made of sums
of sines and raised cosines, and the sensor is filtered, noisy, coarse and limited.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.core.readings import FloatArray, Readings, Series

G = 9.80665
POSES = np.array(
    [
        (x, y, z)
        for x in (-1, 0, 1)
        for y in (-1, 0, 1)
        for z in (-1, 0, 1)
        if 0 < abs(x) + abs(y) + abs(z) < 3
    ],
    float,
)
"""Up directions of the 18 poses: 6 faces and 12 edges."""


@dataclass(frozen=True)
class Device:
    """What is between the motion and the file.

    Attributes:
        rate: samples per second.
        noise: white noise of the accelerometer, mg per √Hz.
        flicker: its flicker noise, mg per decade of frequency.
        rate_noise: white noise of the gyroscope, °/s per √Hz.
        rate_flicker: its flicker noise, °/s per decade of frequency.
        bits: of the converter.
        force_range: full scale of the accelerometer, g.
        rate_range: full scale of the gyroscope, °/s.
        smooth: samples over which the device averages before the converter.
        smooth_after: samples over which it averages after the sensor has clipped.
        gyroscope: whether it has one.
    """

    rate: float = 100.0
    noise: float = 0.1
    flicker: float = 0.02
    rate_noise: float = 0.005
    rate_flicker: float = 0.001
    bits: int = 16
    force_range: float = 4.0
    rate_range: float = 1000.0
    smooth: int = 1
    smooth_after: int = 1
    gyroscope: bool = True


def drawn_device(rng: np.random.Generator, *, gyroscope: bool | None = None) -> Device:
    """A device by chance: noise times 0.1 to 10, 12 to 20 bits, 25 Hz to 1.6 kHz."""
    times = 10.0 ** rng.uniform(-1.0, 1.0)
    return Device(
        rate=float(rng.choice([25.0, 50.0, 100.0, 200.0, 400.0, 833.0, 1600.0])),
        noise=0.1 * times,
        flicker=0.02 * times,
        rate_noise=0.005 * times,
        rate_flicker=0.001 * times,
        bits=int(rng.integers(12, 21)),
        force_range=float(rng.choice([2.0, 4.0, 8.0])),
        smooth=int(rng.choice([1, 1, 3])),
        gyroscope=bool(rng.random() < 0.5) if gyroscope is None else gyroscope,
    )


@dataclass(frozen=True, eq=False)
class Motion:
    """What truly happens.

    Attributes:
        time: of each sample, s.
        attitude: body to world.
        force: specific force in the body, m/s².
        rate: in the body, rad/s.
        resting: 1 where the device is put down or held.
    """

    time: FloatArray
    attitude: Attitude
    force: FloatArray
    rate: FloatArray
    resting: FloatArray


def recorded(
    motion: Motion, device: Device, rng: np.random.Generator, bias: FloatArray | None = None
) -> Readings:
    """The motion as the device records it, with bias, scale and cross axes by chance.

    Args:
        motion: what happens.
        device: what records it.
        rng: of its errors.
        bias: of an accelerometer without other errors, m/s², shape (3,); None for one by chance.
    """
    force = motion.force @ (np.eye(3) + 0.01 * rng.standard_normal((3, 3))).T
    force = force + 0.03 * G * rng.standard_normal(3)
    force = force if bias is None else motion.force + bias
    rate = motion.rate @ (np.eye(3) + 0.01 * rng.standard_normal((3, 3))).T
    rate = rate + np.radians(0.5) * rng.standard_normal(3)
    white, slow = 1e-3 * G * device.noise, 1e-3 * G * device.flicker
    force = force + _noise(rng, len(force), device.rate, white, slow)
    white, slow = np.radians([device.rate_noise, device.rate_flicker])
    rate = rate + _noise(rng, len(rate), device.rate, white, slow)
    series = [
        Series(motion.time, _converted(force, device.force_range * G, device), "m/s^2"),
        Series(motion.time, _converted(rate, np.radians(device.rate_range), device), "rad/s"),
    ]
    return Readings(series[0], series[1] if device.gyroscope else None)


def _noise(
    rng: np.random.Generator, count: int, rate: float, white: float, slow: float
) -> FloatArray:
    """White noise and flicker noise, shape (count, 3)."""
    frequency = np.fft.rfftfreq(count, 1.0 / rate)
    frequency[0] = np.inf
    spectrum = np.fft.rfft(rng.standard_normal((count, 3)), axis=0)
    spectrum *= np.sqrt(rate / 2.0 / frequency)[:, None]
    flicker = np.fft.irfft(spectrum, count, axis=0) / np.sqrt(rate / 2.0)
    return np.asarray(
        white * np.sqrt(rate / 2.0) * rng.standard_normal((count, 3))
        + slow * np.sqrt(rate / 4.0) * flicker / np.sqrt(np.log(10.0))
    )


def _converted(values: FloatArray, full: float, device: Device) -> FloatArray:
    step = 2.0 * full / 2.0**device.bits
    values = uniform_filter1d(values, device.smooth, axis=0)
    values = np.clip(values, -full, full - step)
    values = uniform_filter1d(values, device.smooth_after, axis=0)
    return np.asarray(step * np.round(values / step))


def waved(seconds: float, speed: float, rate: float, rng: np.random.Generator) -> Motion:
    """A device that is turned slowly and never put down.

    Args:
        seconds: how long.
        speed: rms of the angular rate, °/s.
        rate: samples per second.
        rng: of the motion.
    """
    time = np.arange(round(seconds * rate)) / rate
    lowest, highest = ((0.003, 0.05), (0.01, 0.15), (0.03, 0.4))[rng.integers(3)]
    frequency = rng.uniform(lowest, highest, (6, 3))
    phase = rng.uniform(0.0, 2.0 * np.pi, (6, 3))
    size = rng.uniform(0.3, 1.0, (6, 3))
    waves = size * np.sin(2.0 * np.pi * frequency * time[:, None, None] + phase)
    rates = waves.sum(axis=1)
    if rng.random() < 0.5:  # at constant speed back and forth
        rates = np.tanh(4.0 * rates)
    rates *= np.radians(speed) / np.sqrt((rates**2).sum(axis=1).mean())
    start = Attitude.random(random_state=np.random.RandomState(rng.integers(2**31)))
    return _moved(time, start, rates, 0.002 * rng.uniform(0.0, 1.0), rng, np.zeros(len(time)))


def placed(
    device: Device,
    rng: np.random.Generator,
    *,
    hold: float = 3.0,
    tremor: float = 0.0,
    sway: float = 0.0,
    restless: float = 0.0,
    rocking: float = 0.0,
    settling: float = 0.0,
    speed: float = 120.0,
    turns: int = 0,
    first: float = 6.0,
    steady: bool = False,
) -> Motion:
    """An honest session: a first rest, 18 poses with a move to each, and turns about each axis.

    Args:
        device: its sampling rate is used.
        rng: of the motion.
        hold: length of a hold, s.
        tremor: acceleration of a hand that trembles at 8 to 12 Hz, mg rms, with a turning of
            0.005° for each mg.
        sway: wandering of the direction below 1 Hz, degrees rms.
        restless: the same by a white acceleration that acts on a damped arm, which no frequency is
            free of: above 3 Hz its power falls with the fourth power of the frequency.
        rocking: the same between 1 and 9 Hz.
        settling: what the reading still lacks when a hold begins, mg, dying out in half a second.
        speed: largest rate of a move, °/s.
        turns: full turns about each axis.
        first: the first rest, s.
        steady: a turntable moves the device, at one constant rate but for 0.1 s at either end.
    """
    dt = 1.0 / device.rate
    order = rng.permutation(len(POSES))
    up = POSES[order] / np.linalg.norm(POSES[order], axis=1)[:, None]
    rates: list[FloatArray] = []
    resting: list[FloatArray] = []
    now = Attitude.identity()

    def rest(seconds: float) -> None:
        count = round(seconds / dt)
        rates.append(np.zeros((count, 3)))
        resting.append(np.ones(count))

    def turn(vector: FloatArray) -> None:
        nonlocal now
        angle = float(np.linalg.norm(vector))
        seconds = max(2.0 * angle / np.radians(speed), 0.6)
        count = round(seconds / dt)
        part = (np.arange(count) + 0.5) / count
        shape = 1.0 - np.cos(2.0 * np.pi * part)
        if steady:
            count = max(round((angle / np.radians(speed) + 0.1) / dt), 3)
            part = np.minimum(np.arange(count) + 0.5, count - 0.5 - np.arange(count)) * dt
            shape = np.minimum(part / 0.1, 1.0)
            shape = shape / shape.mean()
        rates.append(shape[:, None] * vector / (count * dt))
        resting.append(np.zeros(count))
        now = now * Attitude.from_rotvec(vector)

    rest(first)
    for direction in up:
        wanted = Attitude.from_rotvec(np.radians(2.0) * rng.standard_normal(3)).apply(direction)
        seen = now.inv().apply([0.0, 0.0, 1.0])
        axis = np.cross(wanted, seen)
        size = float(np.linalg.norm(axis))
        axis = axis / size if size > 1e-6 else np.array([1.0, 0.0, 0.0])
        turn(axis * np.arctan2(size, float(wanted @ seen)))
        rest(hold * rng.uniform(0.9, 1.3))
    for axis in np.eye(3):
        seen = now.inv().apply([0.0, 0.0, 1.0])
        wanted = np.roll(axis, 1)
        cross = np.cross(wanted, seen)
        size = float(np.linalg.norm(cross))
        turn(cross / max(size, 1e-9) * np.arctan2(size, float(wanted @ seen)))
        rest(hold)
        for index in range(turns):
            turn(2.0 * np.pi * axis * (-1.0) ** index)
            rest(hold)
    rate, still = np.concatenate(rates), np.concatenate(resting)
    time = np.linspace(0.0, (len(rate) - 1) * dt, len(rate))
    unrest = _band(rng, time, 8.0, 12.0) * np.radians(0.005) * tremor * 2.0 * np.pi * 10.0
    unrest += _band(rng, time, 0.1, 1.0) * np.radians(sway) * 2.0 * np.pi * 0.5
    if rocking:
        angle = _band(rng, time, 1.0, 9.0) * np.radians(rocking)
        unrest += np.gradient(angle, dt, axis=0)
    if restless:
        unrest += _restless(rng, dt, len(time), np.radians(restless))
    motion = _moved(time, Attitude.identity(), rate + unrest, 0.02, rng, still)
    force = motion.force + 1e-3 * G * tremor * _band(rng, time, 8.0, 12.0)
    begins = np.flatnonzero(np.diff(still, prepend=1.0) > 0.0)
    for begin in begins if settling else ():
        rising = np.arange(int(min(5.0 / dt, len(time) - int(begin))))
        sign = rng.standard_normal(3)
        sign /= np.linalg.norm(sign) / np.sqrt(3.0)
        force[begin : begin + len(rising)] += (
            1e-3 * G * settling * np.exp(-rising * dt / 0.5)[:, None] * sign
        )
    return replace(motion, force=force)


def settling_alike(motion: Motion, amplitude: FloatArray, seconds: float) -> Motion:
    """The same with an accelerometer that reads too much when a hold begins, the same in each.

    Args:
        motion: what happens.
        amplitude: on each axis, mg, shape (3,).
        seconds: time constant, s.
    """
    force = motion.force.copy()
    edges = np.flatnonzero(np.diff(np.concatenate([[0.0], motion.resting, [0.0]])))
    for first, past in edges.reshape(-1, 2):
        since = motion.time[first:past] - motion.time[first]
        force[first:past] += 1e-3 * G * np.exp(-since / seconds)[:, None] * amplitude
    return replace(motion, force=force)


def _band(rng: np.random.Generator, time: FloatArray, low: float, high: float) -> FloatArray:
    """Random waves of rms 1 between two frequencies, shape (n, 3)."""
    frequency = rng.uniform(low, high, (8, 3))
    phase = rng.uniform(0.0, 2.0 * np.pi, (8, 3))
    waves = np.zeros((len(time), 3))
    for one, shift in zip(frequency, phase, strict=True):
        waves += np.sin(2.0 * np.pi * one * time[:, None] + shift)
    return np.asarray(waves / 2.0)


def _restless(rng: np.random.Generator, dt: float, count: int, size: float) -> FloatArray:
    """Rates of a direction with this rms that wanders at all frequencies, rad/s, shape (n, 3)."""
    keeps = np.exp(-2.0 * np.pi * 3.0 * dt)
    push = rng.standard_normal((count, 3))
    angle = lfilter([1.0], np.convolve([1.0, -keeps], [1.0, -keeps]), push, axis=0)
    return np.asarray(size * np.gradient(angle / angle.std(), dt, axis=0))


def _moved(
    time: FloatArray,
    start: Attitude,
    rate: FloatArray,
    lever: float,
    rng: np.random.Generator,
    resting: FloatArray,
) -> Motion:
    """The motion of a sensor off the centre of rotation by ``lever`` m."""
    dt = float(time[1] - time[0])
    steps = Attitude.from_rotvec(rate * dt)
    quaternions = np.empty((len(time), 4))
    now = start.as_quat()
    for index, step in enumerate(steps.as_quat()):
        quaternions[index] = now
        x, y, z, w = now
        a, b, c, d = step
        now = np.array([
            w * a + x * d + y * c - z * b,
            w * b - x * c + y * d + z * a,
            w * c + x * b - y * a + z * d,
            w * d - x * a - y * b - z * c,
        ])  # fmt: skip
        if index % 1000 == 0:
            now /= np.linalg.norm(now)
    attitude = Attitude.from_quat(quaternions)
    arm = lever * rng.standard_normal(3)
    change = np.gradient(rate, dt, axis=0)
    force = attitude.inv().apply([0.0, 0.0, G])
    force = force + np.cross(change, arm) + np.cross(rate, np.cross(rate, arm))
    return Motion(time, attitude, force, rate, resting)


def trembling(motion: Motion, tremor: float, rng: np.random.Generator) -> Motion:
    """The same with the acceleration of a hand that trembles at 8 to 12 Hz, mg rms."""
    shaken = motion.force + 1e-3 * G * tremor * _band(rng, motion.time, 8.0, 12.0)
    return replace(motion, force=shaken)
