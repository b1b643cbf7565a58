"""Shapes in time: the smooth move of a hand, its wobble, its tremor. Each with its derivatives."""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.readings import FloatArray

PEAK_OF_MIN_JERK = 1.875
"""Largest slope of the minimum-jerk profile; peak rate = 1.875 · angle / duration."""

Derivatives = tuple[FloatArray, FloatArray, FloatArray]


def min_jerk(s: FloatArray) -> Derivatives:
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
    """What a hand adds to a turn about other axes: swings that begin and end in nothing.

    Attributes:
        amplitude: rad, shape (k, 3).
        phase: rad, shape (k, 3); swing ``j`` goes through ``j + 1`` periods.
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
    """A sum of sines in absolute time: the unrest of whoever holds the device.

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
