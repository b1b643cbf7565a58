"""The virtual magnetometer: the Earth's field through the iron of a board, at its own rate.

``y = A·(m + ε + soft iron·m) + hard iron + noise`` in the magnetometer's own axes, which are
slightly rotated against the accelerometer's. A sample appears in the line of the next IMU sample.
"""

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.simulate import attitude
from imucal_wizard.simulate.motion import Motion
from imucal_wizard.simulate.noise import RandomStream, generator
from imucal_wizard.simulate.sensor import DEGREE

FIELD_RATE = 80.0
"""Samples per second, the fastest rate of the MAG3110."""
FIELD_NOISE = 0.4
"""µT rms at that rate (MAG3110's data sheet)."""
FIELD_STEP = 0.1
"""Resolution, µT."""


@dataclass(frozen=True, eq=False)
class TrueField:
    """A place and a magnetometer.

    Attributes:
        world: field at the place, µT: east, north, up.
        gain: symmetric matrix of soft iron, scale and cross-axis, shape (3, 3).
        hard_iron: µT, shape (3,).
        misalignment: rotation vector from the accelerometer's axes to its own, rad, shape (3,).
    """

    world: FloatArray
    gain: FloatArray
    hard_iron: FloatArray
    misalignment: FloatArray

    @classmethod
    def drawn(cls, seed: int = 0) -> "TrueField":
        """Draw hard iron up to ±60 µT, gains within 8 % and cross terms within 5 %.

        The misalignment is up to 3° per axis. The place is in the middle latitudes: 45 to 52 µT, 60
        to 70° of dip.
        """
        rng = generator(seed, RandomStream.FIELD)
        size, dip = rng.uniform(45.0, 52.0), rng.uniform(60.0, 70.0) * DEGREE
        cross = rng.uniform(-0.05, 0.05, 3)
        gain = np.diag(rng.uniform(0.92, 1.08, 3))
        for value, (i, j) in zip(cross, ((0, 1), (0, 2), (1, 2)), strict=True):
            gain[i, j] = gain[j, i] = value
        return cls(
            size * np.array([0.0, np.cos(dip), -np.sin(dip)]),
            gain,
            rng.uniform(-60.0, 60.0, 3),
            rng.uniform(-3.0, 3.0, 3) * DEGREE,
        )

    def seen(self, motion: Motion) -> FloatArray:
        """The field in the magnetometer's own axes, µT, shape (n, 3)."""
        own = attitude.hamilton_product(
            motion.attitude, attitude.rotation_quaternion(self.misalignment)
        )
        return attitude.to_body(own, self.world + motion.disturbance)

    def reading(self, motion: Motion, error: FloatArray | float = 0.0) -> FloatArray:
        """Readings without noise at the motion's samples, µT, shape (n, 3).

        Args:
            motion: the true motion.
            error: ``ε`` of the hidden effects, µT, shape (n, 3).
        """
        felt = self.seen(motion) + error
        exact = (felt[:, None, :] * self.gain).sum(-1) + self.hard_iron
        return np.asarray(exact, np.float64)


class VirtualMagnetometer:
    """Samples of the field, one after the other.

    Args:
        model: place and sensor.
        seed: seed of the noise.
    """

    def __init__(self, model: TrueField, seed: int = 0) -> None:
        self.model = model
        self._noise = generator(seed, RandomStream.FIELD_NOISE)
        self._next = 0.0

    def take(self, motion: Motion, error: FloatArray | None = None) -> FloatArray:
        """Readings at the motion's samples, µT, shape (n, 3); NaN without a new one.

        Args:
            motion: the true motion.
            error: ``ε`` of the hidden effects at the same samples, µT, shape (n, 3).
        """
        count = np.floor(motion.time * FIELD_RATE + 1e-9)
        new = np.diff(count, prepend=self._next - 1.0) > 0.0
        self._next = float(count[-1]) + 1.0 if len(count) else self._next
        out = np.full((len(motion.time), 3), np.nan)
        noise = FIELD_NOISE * self._noise.standard_normal((int(new.sum()), 3))
        own = 0.0 if error is None else error
        exact = self.model.reading(motion, own)[new]
        out[new] = np.round((exact + noise) / FIELD_STEP) * FIELD_STEP
        return out
