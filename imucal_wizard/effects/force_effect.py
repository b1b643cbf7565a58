"""Effects of the specific force on the rate: a 3×3 matrix, output axis by input axis."""

from abc import abstractmethod

import numpy as np

from imucal_wizard.effects.axis_effect import AXES, Size
from imucal_wizard.effects.effect import Circumstances, Effect, EffectParameter
from imucal_wizard.readings import FloatArray


class ForceEffect(Effect):
    """``ε_i = Σ_j K_ij felt_j`` with the nine parameters ``xx``, ``xy`` … ``zz``."""

    size: Size

    @abstractmethod
    def felt(self, c: Circumstances) -> FloatArray:
        """What the force does, in data sheet units, shape (n, 3)."""

    def parameters(self, sensor: str) -> tuple[EffectParameter, ...]:
        """Output axis, then input axis."""
        del sensor
        return tuple(self.size.parameter(out + inp) for out in AXES for inp in AXES)

    def columns(self, sensor: str, c: Circumstances, variant: float | None = None) -> FloatArray:
        """Shape (n, 3, 9): output axis ``i`` has the three columns ``3i`` to ``3i + 2``."""
        del sensor, variant
        felt = self.size.si * self.felt(c)
        columns = np.zeros((len(c), 3, 9))
        for axis in range(3):
            columns[:, axis, 3 * axis : 3 * axis + 3] = felt
        return columns
