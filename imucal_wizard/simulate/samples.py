"""The samples of the virtual IMU: true motion in, readings out.

The samples depend only on the seed and on the actions of the hand, not on how many are requested at
a time or when.
"""

from collections.abc import Iterable

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.simulate.forward import STEP_TIME, TrueCircumstances
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.hidden import HIDDEN_TERMS, Hidden, parse_hidden
from imucal_wizard.simulate.magnetometer import VirtualMagnetometer
from imucal_wizard.simulate.motion import Motion
from imucal_wizard.simulate.noise import RandomStream, SensorNoise, generator
from imucal_wizard.simulate.sensor import DEGREE, SensorModel

MAX_CURRENT = 12.0
"""Current of the motors at full throttle, A."""
MOTORS_OFF_SHARE = 0.3
"""Share of the settings in which the motors are off."""
SETTING_SECONDS = (4.0, 12.0)
"""Shortest and longest duration of a setting, s."""
AMMETER_STEP = 0.01
"""Resolution of the ammeter, A."""


@dataclass(frozen=True, eq=False)
class VirtualSamples:
    """The readings of the virtual sensor.

    Attributes:
        time: device time, s, shape (n,).
        accelerometer: readings, shape (n, 3).
        gyroscope: readings, shape (n, 3).
        temperature: °C, shape (n,).
        magnetometer: readings, µT, shape (n, 3), NaN without a new one; None without a
            magnetometer.
        current: current of the motors, A, shape (n,); None without an ammeter.
    """

    time: FloatArray
    accelerometer: FloatArray
    gyroscope: FloatArray
    temperature: FloatArray
    magnetometer: FloatArray | None = None
    current: FloatArray | None = None


class VirtualLoad:
    """The motors of the board: a throttle that changes every few seconds, determined by the seed.

    Args:
        seed: seed of the settings.
    """

    def __init__(self, seed: int = 0) -> None:
        self._chance = generator(seed, RandomStream.LOAD)
        self._ends = np.zeros(0)
        self._amperes = np.zeros(0)

    def at(self, time: FloatArray) -> FloatArray:
        """Current at these times, A, shape (n,)."""
        last = float(time.max(initial=0.0))
        while not len(self._ends) or self._ends[-1] <= last:
            self._draw()
        return self._amperes[np.searchsorted(self._ends, time, side="right")]

    def _draw(self) -> None:
        lasts, amperes, off = self._chance.random(3)
        end = float(self._ends[-1]) if len(self._ends) else 0.0
        end += SETTING_SECONDS[0] + lasts * (SETTING_SECONDS[1] - SETTING_SECONDS[0])
        self._ends = np.append(self._ends, end)
        self._amperes = np.append(
            self._amperes, 0.0 if off < MOTORS_OFF_SHARE else MAX_CURRENT * amperes
        )


class VirtualStream:
    """An endless stream of samples.

    Args:
        hand: the hand that moves the device.
        sensor: the inertial sensors.
        hidden: additional effects of the sensor, parsed or as ``TERM:SIZE:AXIS``.
        rate: samples per second, as for the hand.
        seed: seed of the noise.
        step: time of a ``bias-step`` and a ``scale-step``, minutes.
        magnetometer: the magnetometer, or None.
        load: the motors, or None.
    """

    def __init__(
        self,
        hand: VirtualHand,
        sensor: SensorModel,
        hidden: Iterable[Hidden | str] = (),
        *,
        rate: float = 100.0,
        seed: int = 0,
        step: float = STEP_TIME,
        magnetometer: VirtualMagnetometer | None = None,
        load: VirtualLoad | None = None,
    ) -> None:
        self._load = load
        self._magnetometer = magnetometer
        self._hand = hand
        self._sensor = sensor
        self._hidden = [parse_hidden(h) if isinstance(h, str) else h for h in hidden]
        self._step = step
        self._interval, self._before = 1.0 / rate, np.zeros((1, 3))
        triads = sensor.accelerometer, sensor.gyroscope
        density = np.repeat([triad.density for triad in triads], 3)
        floor = np.repeat([triad.floor for triad in triads], 3)
        self._noise = SensorNoise(generator(seed, RandomStream.NOISE), rate, density, floor)

    def take(self, n: int) -> VirtualSamples:
        """The next ``n`` samples."""
        motion = self._hand.advance(n)
        earlier = np.concatenate([self._before, motion.rate])
        change = np.diff(earlier, axis=0) / (self._interval * DEGREE)
        self._before = earlier[-1:]
        noise = self._noise.take(n)
        temperature = self._sensor.thermal.at(motion.time)
        current = None if self._load is None else self._load.at(motion.time)
        error = {name: np.zeros((len(motion.time), 3)) for name in HIDDEN_TERMS}
        for effect in self._hidden:
            where = self._circumstances(motion, temperature, effect.sensor, current, change)
            error[effect.sensor] += effect.error(where)
        field = self._magnetometer
        return VirtualSamples(
            motion.time,
            self._sensor.accelerometer.reading(
                motion.specific_force + error["accelerometer"], noise[:, :3]
            ),
            self._sensor.gyroscope.reading(motion.rate + error["gyroscope"], noise[:, 3:]),
            _rounded(temperature, self._sensor.temperature_step),
            None if field is None else field.take(motion, error["magnetometer"]),
            None if current is None else _rounded(current, AMMETER_STEP),
        )

    def _circumstances(
        self,
        motion: Motion,
        temperature: FloatArray,
        sensor: str,
        current: FloatArray | None,
        change: FloatArray,
    ) -> TrueCircumstances:
        force, rate = motion.specific_force / STANDARD_GRAVITY, motion.rate / DEGREE
        sensed = force if sensor == "accelerometer" else rate
        if sensor == "magnetometer" and self._magnetometer is not None:
            sensed = self._magnetometer.model.seen(motion)
        return TrueCircumstances(
            force,
            rate,
            temperature,
            motion.time / 60.0,
            motion.previous,
            motion.acceleration / STANDARD_GRAVITY,
            motion.attitude,
            sensed,
            self._step,
            current=np.zeros(len(motion.time)) if current is None else current,
            warming=self._sensor.thermal.warming_at(motion.time),
            change=change,
        )


def _rounded(values: FloatArray, step: float) -> FloatArray:
    return np.round(values / step) * step if step > 0.0 else values
