"""Odd quadratic non-linearity."""

from collections.abc import Mapping

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    MILLI_G,
    AxisEffect,
    Circumstances,
    Size,
    Story,
    sensed,
)


class OddQuadratic(AxisEffect):
    """``ε_i = K_oq a_i |a_i|``: the odd quadratic coefficient of IEEE 1293."""

    name = "odd-quadratic"
    sensors = (ACCELEROMETER,)
    family = "odd-order"
    kind = "orientation"
    title = "odd quadratic non-linearity"
    equation = "ε_i = K_oqᵢ x_i |x_i|"
    order = 21
    sizes: Mapping[str, Size] = {
        ACCELEROMETER: Size(
            "mg/g²",
            MILLI_G,
            2.0,
            {"consumer": (0.5, 5.0), "industrial": (0.1, 0.5), "tactical": (0.01, 0.1)},
            chosen=("industrial", "tactical"),
        ),
    }
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="The spring or the electrostatic force in the gap becomes stiffer or softer as "
            "the proof mass moves, equally for both directions: large forces of either sign read "
            "too small, or too large.",
            equation="error on an axis = coefficient × force × magnitude of the force",
            signature="The residual has one sign at both faces of the axis and the other sign "
            "around 45°. The scale absorbs nearly nine tenths of the error, so little of it is "
            "visible.",
            needs="Faces, edges and corners, and low noise. At 1 g it can hardly be distinguished "
            "from the third-order term; measurements at several g, on a shaker or a centrifuge, "
            "separate them.",
            remedy="Add the term for use up to 1 g. Do not extrapolate it to several g: there it "
            "differs from the third-order term, and data at 1 g cannot show which of the two is "
            "correct.",
            confirm="Measure at several g, on a centrifuge or a shaker: the error grows with the "
            "square of the force.",
            source="IEEE Std 1293, model equation of linear accelerometers (odd quadratic "
            "coefficient).",
        ),
    }

    def shape(self, sensor: str, c: Circumstances, variant: float | None) -> FloatArray:
        """``x_i |x_i|``, g²."""
        del variant
        x = sensed(sensor, c)
        return x * np.abs(x)

    def c_shape(self, variant: float | None) -> str:
        """See ``AxisEffect``."""
        del variant
        return "{x} * fabsf({x})"
