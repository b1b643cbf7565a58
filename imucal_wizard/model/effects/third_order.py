"""Third-order non-linearity."""

from collections.abc import Mapping

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


class ThirdOrder(AxisEffect):
    """``ε_i = K₃ x_i³``: the term K₃ of the model equations of IEEE 1293 and IEEE 1431."""

    name = "third-order"
    sensors = (ACCELEROMETER, GYROSCOPE)
    family = "odd-order"
    kind = "orientation"
    title = "third-order non-linearity"
    equation = "ε_i = K₃ᵢ x_i³"
    order = 20
    aliases = ("cubic-cross",)
    # a best-fit-line specification e of full scale F bounds a pure cubic: K₃ ≤ 4e/F²
    sizes: Mapping[str, Size] = {
        ACCELEROMETER: Size(
            "mg/g³",
            MILLI_G,
            2.0,
            {"consumer": (0.5, 5.0), "industrial": (0.1, 0.5), "tactical": (0.01, 0.1)},
            chosen=("industrial", "tactical"),
        ),
        GYROSCOPE: Size(
            "1e-7/(°/s)²",
            1e-7 * DEGREE,
            0.3,
            {"consumer": (0.05, 0.5), "industrial": (0.01, 0.05), "tactical": (0.001, 0.01)},
            chosen=("industrial", "tactical"),
        ),
    }
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="The spring stiffens near the end of the travel of the proof mass, or the "
            "amplifier begins to saturate: the response to large forces flattens, equally for "
            "both directions.",
            equation="error on an axis = coefficient × (force on that axis)³",
            signature="The residual has one sign at both faces of the axis and where the axis is "
            "level, and the other sign at 45°. The scale absorbs three quarters of the error.",
            needs="Faces, edges and corners. At 1 g it can hardly be distinguished from the odd "
            "quadratic term; measurements at several g separate them.",
            remedy="Add the term for use up to 1 g, or choose a larger range setting if the sensor "
            "has one. Do not extrapolate it to several g.",
            confirm="Measure at several g, on a centrifuge or a shaker: the error grows with the "
            "third power of the force.",
            source="IEEE Std 1293, model equation of linear accelerometers (K₃).",
        ),
        GYROSCOPE: Story(
            what="At high rates the response of the read-out flattens, equally in both senses.",
            equation="error on an axis = coefficient × (rate about that axis)³",
            signature="Fast rotations are measured too small in both senses and slow ones a "
            "little too large, because the fitted scale is a compromise between them.",
            needs="Rotations at three speeds or more, the fastest near the end of the range. At "
            "one speed the effect cannot be separated from the scale.",
            remedy="Add the term and apply it, or choose a larger range setting.",
            confirm="Turn the sensor on a rate table from slow to nearly the full range: the error "
            "grows with the third power of the rate, with opposite signs in the two senses.",
            source="IEEE Std 1431, model equation of Coriolis vibratory gyroscopes.",
        ),
    }

    def shape(self, sensor: str, c: Circumstances, variant: float | None) -> FloatArray:
        """``x_i³``, g³ or (°/s)³."""
        del variant
        own = sensed(sensor, c)
        return own * own * own  # a power takes twenty times as long

    def c_shape(self, variant: float | None) -> str:
        """See ``AxisEffect``."""
        del variant
        return "{x} * {x} * {x}"

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """A gyroscope must have been turned."""
        return requirements.rotations(sensor, c)
