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
            what="The gain for a force in one direction is slightly larger than the gain for the "
            "opposite force, because two springs, two electrode gaps or two halves of an "
            "amplifier differ.",
            equation="error on an axis = coefficient × magnitude of the force on that axis",
            signature="The residual is an S, as that of the second-order term: it has opposite "
            "signs at opposite faces and crosses zero about 40° away from each face and where the "
            "axis is level. The gain changes where the axis is level, but there the axis adds "
            "nothing to the magnitude of gravity.",
            needs="Faces, edges, and several poses with the axis tilted by 10° to 25° from level, "
            "which help to tell it from the second-order term: at 1 g the two can hardly be "
            "distinguished. The bench states whether the choice between the two changes "
            "the up direction.",
            remedy="Add the term and apply it. The second-order term corrects most of the same "
            "error.",
            confirm="Tilt the axis through level in steps of a few degrees on a dividing head: the "
            "slope of the reading changes at zero.",
            source="IEEE Std 1293, model equation of linear accelerometers (scale factor "
            "asymmetry).",
        ),
        GYROSCOPE: Story(
            what="The gain for positive rates differs slightly from the gain for negative rates.",
            equation="error on an axis = coefficient × magnitude of the rate about that axis",
            signature="Rotations in one sense are measured too large and those in the other sense "
            "too small, by the same share of the angle at any speed.",
            needs="Rotations in both senses, at three speeds or more: the second-order term grows "
            "with the speed, the asymmetry does not.",
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
