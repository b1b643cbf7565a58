"""Sensor noise as inertial sensors have it: white, plus the slow unrest called bias instability.

White noise of density ``N`` sampled at rate ``r`` has the standard deviation ``N √(r/2)``. Flicker
noise, power ``h/f``, is a sum of first-order Gauss–Markov processes whose correlation times are
spaced by a constant ratio ``ρ``, each with the variance ``h ln ρ``; its Allan deviation is flat at
``√(2 ln 2 · h)`` (IEEE 952, annex C).
"""

import numpy as np

from imucal_wizard.readings import FloatArray

BLOCK = 64
"""Noise is drawn in blocks of so many samples, so that no caller's batches change it."""
RATIO = 3.0
TIMES: FloatArray = np.array([0.5 * RATIO**k for k in range(7)])
"""Correlation times, s: 0.5 to 365."""


class Noise:
    """An endless stream of noise on several channels.

    Args:
        rng: where chance comes from; nothing else may draw from it.
        rate: samples per second.
        density: white noise per channel, unit/√Hz, shape (c,).
        floor: Allan deviation of the bias instability per channel, unit, shape (c,).
    """

    def __init__(
        self, rng: np.random.Generator, rate: float, density: FloatArray, floor: FloatArray
    ) -> None:
        self._rng = rng
        self._white = density * np.sqrt(rate / 2.0)
        spread = floor * np.sqrt(np.log(RATIO) / (2.0 * np.log(2.0)))
        decay = np.exp(-1.0 / (rate * TIMES))
        steps = np.arange(BLOCK)
        lag = steps[:, None] - steps[None, :]
        powers = decay[:, None, None] ** np.maximum(lag, 0)
        self._spread = spread
        self._kernel = np.where(lag >= 0, powers, 0.0) * np.sqrt(1.0 - decay**2)[:, None, None]
        self._memory = (decay[:, None] ** (steps + 1))[:, :, None]
        self._slow = rng.standard_normal((len(TIMES), 1, len(floor)))
        self._left = np.zeros((0, len(floor)))

    def take(self, n: int) -> FloatArray:
        """The next ``n`` samples, shape (n, c)."""
        parts = [self._left]
        have = len(self._left)
        while have < n:
            parts.append(self._block())
            have += BLOCK
        whole = np.concatenate(parts) if len(parts) > 1 else self._left
        self._left = whole[n:]
        return whole[:n]

    def _block(self) -> FloatArray:
        channels = len(self._spread)
        white = self._rng.standard_normal((BLOCK, channels)) * self._white
        driven = self._rng.standard_normal((len(TIMES), BLOCK, channels))
        slow = self._kernel @ driven + self._memory * self._slow
        self._slow = slow[:, -1:]
        noise: FloatArray = white + self._spread * slow.sum(0)
        return noise
