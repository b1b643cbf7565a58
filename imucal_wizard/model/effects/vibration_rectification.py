"""Offset by vibration."""

from collections.abc import Mapping

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import ACCELERATION_UNITS
from imucal_wizard.model import requirements
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    MILLI_G,
    BiasEffect,
    Circumstances,
    Size,
    Story,
)


class VibrationRectification(BiasEffect):
    """``ε_i = K_v ⟨|a_vibration|²⟩``: the vibration rectification error of IEEE 1293.

    The mean square is summed over the three axes.
    """

    name = "vibration-rectification"
    sensors = (ACCELEROMETER,)
    against = "vibration"
    kind = "hold"
    title = "offset by vibration"
    equation = "ε_i = K_vᵢ ⟨vibration²⟩"
    order = 51
    sizes: Mapping[str, Size] = {
        ACCELEROMETER: Size(
            "mg/g²",
            MILLI_G,
            100.0,
            {"consumer": (10.0, 300.0), "industrial": (1.0, 60.0), "tactical": (0.02, 1.0)},
            chosen=("consumer", "industrial", "tactical"),
        ),
    }
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="A sensor with a slightly non-linear response converts vibration into an offset: "
            "each swing to one side reads larger than the swing back, so the mean is wrong. "
            "Vibration that is clipped at the end of the range has the same effect.",
            equation="error on an axis = coefficient × mean square of the vibration",
            signature="A pose reads differently while it vibrates. Plotted over the mean square "
            "of the vibration, the residuals lie on straight lines that rise at one face of the "
            "axis and fall at the other.",
            needs="The same poses on a quiet and on a vibrating support. In a recording, the "
            "gyroscope shows that a shaken device does not turn; without one such holds are left "
            "out. A hand-held pose also moves, which looks similar.",
            remedy="Damp the mounting, or take the poses on a quiet support. In use, choose a "
            "larger range, so that vibration is not clipped.",
            confirm="Fix the device to a loudspeaker or a running motor and switch it on and off "
            "without moving it: the mean changes with the square of the vibration.",
            source="IEEE Std 1293, model equation of linear accelerometers (vibration "
            "rectification).",
        ),
    }

    def course(self, c: Circumstances, variant: float | None) -> FloatArray:
        """Mean square vibration, g²; 0 where it is unknown."""
        del variant
        return np.nan_to_num(c.vibration, nan=0.0) / ACCELERATION_UNITS["g"] ** 2

    def c_shape(self, variant: float | None) -> str:
        """See ``AxisEffect``."""
        del variant
        return "vibration"

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """Quiet and shaky poses."""
        del sensor
        return requirements.vibrations(c)
