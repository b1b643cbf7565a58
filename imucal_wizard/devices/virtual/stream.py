"""The samples of the virtual IMU, one after the other: true motion in, readings out.

The samples depend on the seed and on what the hand does, and on nothing else: not on how many are
asked for at a time, nor on when.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from imucal_wizard.devices.virtual.chance import Chance, generator
from imucal_wizard.devices.virtual.forward import STEP_TIME, Circumstances
from imucal_wizard.devices.virtual.hand import VirtualHand
from imucal_wizard.devices.virtual.hidden import TERMS, Hidden, parse_hidden
from imucal_wizard.devices.virtual.load import STEP as AMMETER_STEP
from imucal_wizard.devices.virtual.load import VirtualLoad
from imucal_wizard.devices.virtual.magnetometer import VirtualMagnetometer
from imucal_wizard.devices.virtual.motion import Motion
from imucal_wizard.devices.virtual.noise import Noise
from imucal_wizard.devices.virtual.sensor import DEGREE, SensorModel
from imucal_wizard.readings import FloatArray
from imucal_wizard.units import STANDARD_GRAVITY


@dataclass(frozen=True, eq=False)
class Samples:
    """What the sensor puts out.

    Attributes:
        time: device time, s, shape (n,).
        accelerometer: readings, shape (n, 3).
        gyroscope: readings, shape (n, 3).
        temperature: °C, shape (n,).
        magnetometer: readings, µT, shape (n, 3), NaN where there is no new one; None without one.
        current: what the motors draw, A, shape (n,); None without an ammeter.
    """

    time: FloatArray
    accelerometer: FloatArray
    gyroscope: FloatArray
    temperature: FloatArray
    magnetometer: FloatArray | None = None
    current: FloatArray | None = None


class VirtualStream:
    """An endless stream of samples.

    Args:
        hand: what moves the device.
        sensor: what feels it.
        hidden: effects that the sensor has besides, parsed or as ``TERM:SIZE:AXIS``.
        rate: samples per second, the hand's.
        seed: of the noise.
        step: when a ``bias-step`` happens, minutes.
        magnetometer: what feels the field, or None.
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
        triads = sensor.accelerometer, sensor.gyroscope
        density = np.repeat([triad.density for triad in triads], 3)
        floor = np.repeat([triad.floor for triad in triads], 3)
        self._noise = Noise(generator(seed, Chance.NOISE), rate, density, floor)

    def take(self, n: int) -> Samples:
        """The next ``n`` samples."""
        motion = self._hand.advance(n)
        noise = self._noise.take(n)
        temperature = self._sensor.thermal.at(motion.time)
        current = None if self._load is None else self._load.at(motion.time)
        error = {name: np.zeros((len(motion.time), 3)) for name in TERMS}
        for effect in self._hidden:
            where = self._circumstances(motion, temperature, effect.sensor, current)
            error[effect.sensor] += effect.error(where)
        field = self._magnetometer
        return Samples(
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
        self, motion: Motion, temperature: FloatArray, sensor: str, current: FloatArray | None
    ) -> Circumstances:
        force, rate = motion.specific_force / STANDARD_GRAVITY, motion.rate / DEGREE
        sensed = force if sensor == "accelerometer" else rate
        if sensor == "magnetometer" and self._magnetometer is not None:
            sensed = self._magnetometer.model.seen(motion)
        return Circumstances(
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
        )


def _rounded(values: FloatArray, step: float) -> FloatArray:
    return np.round(values / step) * step if step > 0.0 else values
