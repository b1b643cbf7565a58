"""Random streams from seeds, and the noise of inertial sensors.

White noise of density ``N`` sampled at rate ``r`` has the standard deviation ``N √(r/2)``. Flicker
noise, power ``h/f``, is a sum of first-order Gauss–Markov processes whose correlation times are
spaced by a constant ratio ``ρ``, each with the variance ``h ln ρ``; its Allan deviation is flat at
``√(2 ln 2 · h)`` (IEEE 952, annex C).
"""

from enum import IntEnum

import numpy as np

from imucal_wizard.core.readings import FloatArray


class RandomStream(IntEnum):
    """The random quantities; each has its own independent stream."""

    HAND = 1
    TREMOR = 2
    SENSOR = 3
    NOISE = 4
    POSES = 5
    FIELD = 6
    FIELD_NOISE = 7
    LOAD = 8


def generator(seed: int, what: RandomStream) -> np.random.Generator:
    """The generator of one quantity for a seed; any integer is valid."""
    return np.random.default_rng([seed % 2**63, int(what)])


NOISE_BLOCK = 64
"""Noise is drawn in blocks of this many samples, so that the caller's batches do not change it."""
CORRELATION_TIME_RATIO = 3.0
"""Ratio ``ρ`` of successive correlation times."""
CORRELATION_TIMES: FloatArray = np.array([0.5 * CORRELATION_TIME_RATIO**k for k in range(7)])
"""Correlation times, s: 0.5 to 365."""


class SensorNoise:
    """An endless stream of noise on several channels.

    Args:
        rng: random generator, used for nothing else.
        rate: samples per second.
        density: white noise per channel, unit/√Hz, shape (c,).
        floor: Allan deviation of the bias instability per channel, unit, shape (c,).
    """

    def __init__(
        self, rng: np.random.Generator, rate: float, density: FloatArray, floor: FloatArray
    ) -> None:
        self._rng = rng
        self._white = density * np.sqrt(rate / 2.0)
        spread = floor * np.sqrt(np.log(CORRELATION_TIME_RATIO) / (2.0 * np.log(2.0)))
        decay = np.exp(-1.0 / (rate * CORRELATION_TIMES))
        steps = np.arange(NOISE_BLOCK)
        lag = steps[:, None] - steps[None, :]
        powers = decay[:, None, None] ** np.maximum(lag, 0)
        self._spread = spread
        self._kernel = np.where(lag >= 0, powers, 0.0) * np.sqrt(1.0 - decay**2)[:, None, None]
        self._memory = (decay[:, None] ** (steps + 1))[:, :, None]
        self._slow = rng.standard_normal((len(CORRELATION_TIMES), 1, len(floor)))
        self._left = np.zeros((0, len(floor)))

    def take(self, n: int) -> FloatArray:
        """The next ``n`` samples, shape (n, c)."""
        parts = [self._left]
        have = len(self._left)
        while have < n:
            parts.append(self._block())
            have += NOISE_BLOCK
        whole = np.concatenate(parts) if len(parts) > 1 else self._left
        self._left = whole[n:]
        return whole[:n]

    def _block(self) -> FloatArray:
        channels = len(self._spread)
        white = self._rng.standard_normal((NOISE_BLOCK, channels)) * self._white
        driven = self._rng.standard_normal((len(CORRELATION_TIMES), NOISE_BLOCK, channels))
        slow = self._kernel @ driven + self._memory * self._slow
        self._slow = slow[:, -1:]
        noise: FloatArray = white + self._spread * slow.sum(0)
        return noise
