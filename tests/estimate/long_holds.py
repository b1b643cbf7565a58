"""Long holds of a device that lies on a table, under white noise and slow noise.

The slow noise is made by its spectrum, with no formula of the package.
"""

import math

import numpy as np

from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.measurement.blocks import BlockCutter
from imucal_wizard.measurement.holds import Hold, hold_from

RATE = 25.0
MOVED = 6.0
"""Seconds from one hold to the next."""
SIGMA = 1e-4
"""Standard deviation of the white noise of a hold's mean, m/s²."""


def flicker(count: int, instability: float, rng: np.random.Generator) -> FloatArray:
    """Noise of power B²/(2 ln 2 f), by its spectrum, three axes, shape (count, 3)."""
    length = 4 * count
    frequency = np.fft.rfftfreq(length, 1.0 / RATE)
    power = np.zeros(len(frequency))
    power[1:] = instability**2 / (2.0 * math.log(2.0) * frequency[1:])
    parts = rng.standard_normal((2, 3, len(frequency)))
    waves = np.sqrt(power * length * RATE / 4.0) * (parts[0] + 1j * parts[1])
    return np.fft.irfft(waves, length)[:, :count].T


def holds_of(
    up: FloatArray,
    seconds: float,
    rng: np.random.Generator,
    instability: float = 0.0,
    drift: float = 0.0,
    turning: float = 0.0,
    error: FloatArray | None = None,
) -> list[Hold]:
    """Holds of a device on a table; noise in units of the white noise of a hold's mean.

    Args:
        up: true directions, shape (n, 3).
        seconds: of each hold.
        rng: where chance comes from.
        instability: of flicker noise.
        drift: of the bias in each hold.
        turning: instability of the direction, as flicker noise across gravity.
        error: of the sensor in each hold, shape (n, 3).
    """
    period, rest = int((seconds + MOVED) * RATE), int(seconds * RATE)
    count = period * len(up)
    noise = SIGMA * np.sqrt(rest) * rng.standard_normal((count, 3))
    noise += flicker(count, instability * SIGMA, rng)
    noise += drift * SIGMA * (np.arange(count) / rest)[:, None]
    turns = flicker(count, turning * SIGMA, rng)
    wrong = np.zeros_like(up) if error is None else SIGMA * error
    holds = []
    for place, (true, off) in enumerate(zip(up, wrong, strict=True)):
        inside = slice(place * period, place * period + rest)
        values = STANDARD_GRAVITY * true + off + noise[inside] + np.cross(turns[inside], true)
        time = np.arange(inside.start, inside.stop) / RATE
        holds.append(hold_from(BlockCutter(RATE).feed(Readings(Series(time, values, "m/s^2")))))
    return holds
