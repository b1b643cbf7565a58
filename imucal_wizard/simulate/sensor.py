"""The forward model of the virtual sensor.

``y = S·(x + ε) + b + noise``, then rounded to the step of the converter and clipped to its range.
The body frame is the accelerometer's: its x axis is the x axis of the body and ``S`` is upper
triangular, so a triangular calibration should find the true ``M = S⁻¹``.
"""

from dataclasses import replace

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.simulate import attitude
from imucal_wizard.simulate.noise import RandomStream, generator

MILLI_G = STANDARD_GRAVITY / 1000.0
DEGREE = np.pi / 180.0


@dataclass(frozen=True, eq=False)
class Triad:
    """A sensor with three axes.

    Attributes:
        sensitivity: ``S``, reading unit per SI unit, shape (3, 3).
        bias: ``b``, reading unit, shape (3,).
        unit: ``m/s^2``, ``rad/s`` or ``count``.
        density: white noise, SI unit/√Hz, referred to the input.
        floor: Allan deviation of the bias instability, SI unit.
        step: least significant bit, reading unit; 0 for none.
        lowest: smallest possible reading.
        highest: largest possible reading.
    """

    sensitivity: FloatArray
    bias: FloatArray
    unit: str
    density: float = 0.0
    floor: float = 0.0
    step: float = 0.0
    lowest: float = -np.inf
    highest: float = np.inf

    def reading(self, felt: FloatArray, noise: FloatArray | float = 0.0) -> FloatArray:
        """Readings of the input ``x + ε``.

        Args:
            felt: ``x + ε``, SI unit, shape (n, 3).
            noise: referred to the input through the nominal gain, SI unit, shape (n, 3).
        """
        gain = float(np.mean(np.diag(self.sensitivity)))
        exact = (felt[:, None, :] * self.sensitivity).sum(-1) + self.bias + gain * noise
        if self.step > 0.0:
            exact = np.round(exact / self.step) * self.step
        return np.asarray(np.clip(exact, self.lowest, self.highest), np.float64)

    def with_noise(self, times: float) -> "Triad":
        """The same triad with noise, bias instability and step so many times as large."""
        return replace(
            self,
            density=self.density * times,
            floor=self.floor * times,
            step=self.step * times,
        )


@dataclass(frozen=True)
class Thermal:
    """Self-heating after power-on: ``T(t) = ambient + rise·(1 − exp(−t/τ))``, °C and s."""

    ambient: float = 24.0
    rise: float = 4.0
    tau: float = 180.0

    def at(self, time: FloatArray) -> FloatArray:
        """Temperature of the chip at these times, °C."""
        return self.ambient + self.rise * -np.expm1(-time / self.tau)

    def warming_at(self, time: FloatArray) -> FloatArray:
        """Its rate of change, °C/s."""
        return self.rise / self.tau * np.exp(-time / self.tau)


@dataclass(frozen=True, eq=False)
class SensorModel:
    """A virtual sensor.

    Attributes:
        accelerometer: sensor of specific force.
        gyroscope: sensor of angular rate; its matrix includes scale, non-orthogonality and the
            misalignment to the accelerometer's frame.
        thermal: the temperature of the chip.
        temperature_step: resolution of the thermometer, °C.
    """

    accelerometer: Triad
    gyroscope: Triad
    thermal: Thermal = Thermal()
    temperature_step: float = 1.0 / 16.0

    @classmethod
    def drawn(cls, seed: int = 0) -> "SensorModel":
        """Draw a sensor of the class of the BNO055.

        Bias 15–60 mg and 0.3–1 °/s, scale 1–3 % and 1–2 %, non-orthogonality 0.5–1.2°, the
        gyroscope turned against the accelerometer by 0.3–1° per axis; noise 150 µg/√Hz and
        0.014 °/s/√Hz; 14 bits over ±4 g, steps of 1/16 °/s, ±2000 °/s.
        """
        rng = generator(seed, RandomStream.SENSOR)
        force = np.eye(3) + np.diag(_signed(rng, 0.01, 0.03))
        force[np.triu_indices(3, 1)] = _signed(rng, 0.5, 1.2) * DEGREE
        turned = attitude.to_world(
            attitude.rotation_quaternion(_signed(rng, 0.3, 1.0) * DEGREE), np.eye(3)
        ).T
        skew = np.eye(3) + np.diag(_signed(rng, 0.01, 0.02))
        skew[np.tril_indices(3, -1)] = _signed(rng, 0.1, 0.5) * DEGREE
        accelerometer = Triad(
            force,
            _signed(rng, 15.0, 60.0) * MILLI_G,
            "m/s^2",
            density=0.150 * MILLI_G,
            floor=0.030 * MILLI_G,
            step=8.0 * STANDARD_GRAVITY / 2**14,
            lowest=-4.0 * STANDARD_GRAVITY,
            highest=4.0 * STANDARD_GRAVITY,
        )
        gyroscope = Triad(
            skew @ turned,
            _signed(rng, 0.3, 1.0) * DEGREE,
            "rad/s",
            density=0.014 * DEGREE,
            floor=0.0015 * DEGREE,
            step=DEGREE / 16.0,
            lowest=-2000.0 * DEGREE,
            highest=2000.0 * DEGREE,
        )
        return cls(accelerometer, gyroscope)

    def with_noise(self, times: float) -> "SensorModel":
        """The same sensor with the noise of both triads so many times as large."""
        return replace(
            self,
            accelerometer=self.accelerometer.with_noise(times),
            gyroscope=self.gyroscope.with_noise(times),
        )


def _signed(rng: np.random.Generator, smallest: float, largest: float) -> FloatArray:
    """Three random magnitudes in a range, with random signs."""
    size: FloatArray = rng.uniform(smallest, largest, 3)
    sign: FloatArray = rng.choice(np.array([-1.0, 1.0]), 3)
    return np.multiply(size, sign)
