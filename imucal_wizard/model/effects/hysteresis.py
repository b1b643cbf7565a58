"""Dependence of the reading on the pose before."""

from collections.abc import Mapping

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import ACCELERATION_UNITS
from imucal_wizard.model import requirements
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    MILLI_G,
    AxisEffect,
    Circumstances,
    Size,
    Story,
)


class Hysteresis(AxisEffect):
    """``ε_i = h f_i of the hold before``; nothing on the first hold.

    Hysteresis as IEEE 1293 understands it, a reading that depends on which input came before, in
    its plainest linear form.
    """

    name = "hysteresis"
    sensors = (ACCELEROMETER,)
    against = "previous"
    kind = "hold"
    title = "dependence on the pose before"
    equation = "ε_i = hᵢ x_i of the hold before"
    order = 50
    sizes: Mapping[str, Size] = {
        ACCELEROMETER: Size(
            "mg/g",
            MILLI_G,
            0.5,
            {"consumer": (0.1, 1.0), "industrial": (0.02, 0.1), "tactical": (0.002, 0.02)},
            chosen=("industrial", "tactical"),
        ),
    }
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="Glue and package creep: after a pose, the proof mass returns to a rest position "
            "that is shifted towards its previous displacement. A soft support of the board "
            "causes the same error.",
            equation="error on an axis = coefficient × force on that axis in the hold before",
            signature="A pose reads differently when it is reached from another side. This looks "
            "like poor repeatability until the residuals are plotted over the pose before.",
            needs="The same poses reached from different sides, in random order.",
            remedy="Let the device rest for some seconds in each pose, and take poses in a mixed "
            "order. Fasten the board firmly. The term can be applied only where the pose before is "
            "known.",
            confirm="Reach one pose ten times, alternately from one side and the other: the "
            "readings form two groups.",
            source="IEEE Std 528, inertial sensor terminology (hysteresis error).",
        ),
    }

    def shape(self, sensor: str, c: Circumstances, variant: float | None) -> FloatArray:
        """``f_i`` of the hold before, g; 0 where there was none."""
        del sensor, variant
        return np.nan_to_num(c.previous, nan=0.0) / ACCELERATION_UNITS["g"]

    def c_shape(self, variant: float | None) -> str:
        """See ``AxisEffect``."""
        del variant
        return "{before}"

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """Known poses before that differ."""
        del sensor
        return requirements.previous_poses(c)
