"""Scale factor asymmetry."""

from collections.abc import Mapping

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model import requirements
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    DEGREE,
    GYROSCOPE,
    MILLI_G,
    AxisEffect,
    Circumstances,
    Size,
    Story,
    sensed,
)


class Asymmetry(AxisEffect):
    """``ε_i = A |x_i|``: half the difference of the gains for + and −, K₁'/2 of IEEE 1293."""

    name = "asymmetry"
    sensors = (ACCELEROMETER, GYROSCOPE)
    family = "even-order"
    kind = "orientation"
    title = "scale factor asymmetry"
    equation = "ε_i = Aᵢ |x_i|"
    order = 11
    sizes: Mapping[str, Size] = {
        ACCELEROMETER: Size(
            "mg/g",
            MILLI_G,
            1.5,
            {"consumer": (0.5, 4.0), "industrial": (0.1, 0.5), "tactical": (0.01, 0.1)},
            chosen=("industrial", "tactical"),
        ),
        GYROSCOPE: Size(
            "1e-3",
            1e-3 * DEGREE,
            1.0,
            {"consumer": (0.2, 2.0), "industrial": (0.05, 0.2), "tactical": (0.005, 0.05)},
            chosen=("industrial", "tactical"),
        ),
    }
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="A push from one side is measured with a slightly larger gain than a push from "
            "the other: two springs, two electrode gaps or two halves of an amplifier that are "
            "not alike.",
            equation="error on an axis = coefficient × size of the force on that axis, whatever "
            "its sign",
            signature="Much like the second-order term: opposite signs at opposite faces. The "
            "difference is a kink where the axis is level, instead of a smooth bend.",
            needs="Faces, and several poses with the axis within 20° of level, where the kink is. "
            "Even so, 1 g hardly distinguishes it from the second-order term. The bench says "
            "whether it matters for the up direction which of the two is taken.",
            remedy="Add the term and apply it. The second-order term takes most of the same error.",
            confirm="Tilt the axis through level in steps of a few degrees on a dividing head: the "
            "slope of the reading changes at zero.",
            source="IEEE Std 1293, model equation of linear accelerometers (scale factor "
            "asymmetry).",
        ),
        GYROSCOPE: Story(
            what="A turn to the left is measured with a slightly larger gain than a turn to the "
            "right.",
            equation="error on an axis = coefficient × size of the rate, whatever its sense",
            signature="Turns in one sense come out too large, in the other too small, by the same "
            "share of the angle at any speed.",
            needs="Turns in both senses. Three speeds or more, to separate it from the "
            "second-order term, which grows with the speed.",
            remedy="Add the term and apply it: it gives each sense its own gain.",
            confirm="Turn the sensor on a rate table at one rate in both senses, and at a second "
            "rate: the gains of the two senses differ by the same share at both rates.",
            source="IEEE Std 1431, model equation of Coriolis vibratory gyroscopes (scale factor "
            "asymmetry).",
        ),
    }

    def shape(self, sensor: str, c: Circumstances, variant: float | None) -> FloatArray:
        """``|x_i|``, g or °/s."""
        del variant
        return np.abs(sensed(sensor, c))

    def c_shape(self, variant: float | None) -> str:
        """See ``AxisEffect``."""
        del variant
        return "fabsf({x})"

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """A gyroscope must have been turned in both senses."""
        return requirements.both_senses(sensor, c)
