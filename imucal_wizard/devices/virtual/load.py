"""The motors of the virtual board: a throttle that is set anew every few seconds."""

import numpy as np

from imucal_wizard.devices.virtual.chance import Chance, generator
from imucal_wizard.readings import FloatArray

LARGEST = 12.0
"""A."""
OFF = 0.3
"""Share of the settings at which the motors stand still."""
SECONDS = (4.0, 12.0)
"""How long a setting lasts."""
STEP = 0.01
"""Resolution of the ammeter, A."""


class VirtualLoad:
    """Current over time; depends on the seed alone.

    Args:
        seed: of the settings.
    """

    def __init__(self, seed: int = 0) -> None:
        self._chance = generator(seed, Chance.LOAD)
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
        end += SECONDS[0] + lasts * (SECONDS[1] - SECONDS[0])
        self._ends = np.append(self._ends, end)
        self._amperes = np.append(self._amperes, 0.0 if off < OFF else LARGEST * amperes)
