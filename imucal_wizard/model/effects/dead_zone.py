"""Dead zone of an axis around zero."""

from collections.abc import Mapping

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    DATA_SHEET_UNIT,
    MILLI_G,
    AxisEffect,
    Circumstances,
    Size,
    Story,
    sensed,
)

USUAL_WIDTH = 2e-3
"""Half width of the zone inside which the error grows with the force, g: that of the usual size.
Poses are placed ten times less exactly, so that another width makes no difference to a fit."""

MAX_AXIS_ERROR = 0.03
"""Angle between an axis of the sensor, whose zone it is, and that of the body, rad; the force
across it then moves the zone by as many g."""


class DeadZone(AxisEffect):
    """``ε_i = −D sign(x_i)`` beyond ``±D``, ``−x_i`` within: nothing answers to less than ``D``.

    The dead band of IEEE 528. Linear in its size except within the zone itself.
    """

    name = "dead-zone"
    sensors = (ACCELEROMETER,)
    family = "odd-order"
    kind = "orientation"
    title = "dead zone around zero"
    equation = "ε_i = −Dᵢ sign(x_i)"
    order = 24
    hides = True
    sizes: Mapping[str, Size] = {
        ACCELEROMETER: Size(
            "mg",
            MILLI_G,
            1000.0 * USUAL_WIDTH,
            {"consumer": (0.5, 5.0), "industrial": (0.1, 0.5), "tactical": (0.01, 0.1)},
            chosen=("consumer", "industrial", "tactical"),
        ),
    }
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="Friction holds the proof mass, or a converter has crossover distortion. A force "
            "below a threshold causes no reading, and a larger force reads too small by this "
            "threshold.",
            equation="error on an axis = threshold, with the sign opposite to the force on that "
            "axis",
            signature="The error changes its sign where the axis is level; in the magnitude this "
            "is a kink. The scale absorbs most of the error: the rest has one sign at both faces "
            "and where the axis is level, and the other sign around 45°, similar to an odd-order "
            "term.",
            needs="Poses with the axis level, tilted by a few degrees to either side, and at 45°. "
            "Without them the odd quadratic and the third-order term explain the data equally "
            "well.",
            remedy="Add the term for forces beyond the zone; inside the zone nothing can be "
            "corrected. Dither (a small vibration) frees a mass that sticks.",
            confirm="Tilt the axis slowly through level, in steps of a tenth of a degree: the "
            "reading stays constant inside the zone and then follows the tilt again.",
            source="IEEE Std 528, inertial sensor terminology (dead band, threshold).",
        ),
    }

    def shape(self, sensor: str, c: Circumstances, variant: float | None) -> FloatArray:
        """``−sign(x_i)``, softened within the usual zone."""
        del variant
        return -np.clip(sensed(sensor, c) / USUAL_WIDTH, -1.0, 1.0)

    def hidden(self, sensor: str, c: Circumstances, sizes: FloatArray) -> FloatArray:
        """See ``Effect``: within the zone the input may be anything from end to end.

        The correction puts a reading within the zone at one of its ends.
        """
        width = np.abs(sizes) * self.sizes[sensor].si / DATA_SHEET_UNIT[sensor]
        inside = np.abs(sensed(sensor, c)) <= width + MAX_AXIS_ERROR
        return np.asarray(inside * 2.0 * width * DATA_SHEET_UNIT[sensor])

    def c_shape(self, variant: float | None) -> str:
        """See ``AxisEffect``."""
        del variant
        return f"-fminf(fmaxf({{x}} / {USUAL_WIDTH!r}f, -1.0f), 1.0f)"
