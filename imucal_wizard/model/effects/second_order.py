"""Second-order non-linearity."""

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


class SecondOrder(AxisEffect):
    """``ε_i = K₂ x_i²``: the term K₂ of the model equations of IEEE 1293 and IEEE 1431."""

    name = "second-order"
    sensors = (ACCELEROMETER, GYROSCOPE)
    family = "even-order"
    kind = "orientation"
    title = "second-order non-linearity"
    equation = "ε_i = K₂ᵢ x_i²"
    order = 10
    # a best-fit-line specification e of full scale F bounds a pure parabola: K₂ ≤ 2e/F
    sizes: Mapping[str, Size] = {
        ACCELEROMETER: Size(
            "mg/g²",
            MILLI_G,
            2.0,
            {"consumer": (0.5, 5.0), "industrial": (0.1, 0.5), "tactical": (0.01, 0.1)},
            chosen=("industrial", "tactical"),
        ),
        GYROSCOPE: Size(
            "1e-5/(°/s)",
            1e-5 * DEGREE,
            0.8,
            {"consumer": (0.1, 1.6), "industrial": (0.02, 0.1), "tactical": (0.002, 0.02)},
            chosen=("industrial", "tactical"),
        ),
    }
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="The proof mass sits between two sets of electrodes. When it moves towards one of "
            "them, that gap narrows faster than the other widens, so the answer to a push is not "
            "quite a straight line: it bends the same way for a push from either side.",
            equation="error on an axis = coefficient × (force on that axis)²",
            signature="Plotted over the axis' own force the residual is an S: it rises at one "
            "face, falls at the opposite one, and crosses zero about 40° away from each face. Most "
            "of the bend looks like a bias and has been swallowed by the fit already.",
            needs="Both faces of the axis and poses half way between (edges, corners). At 1 g the "
            "asymmetry looks almost the same; only forces well over 1 g tell them apart.",
        ),
        GYROSCOPE: Story(
            what="The vibrating mass is driven harder and stiffer the more the Coriolis force "
            "bends it; if the two sides of the read-out are not alike, a fast turn reads too much "
            "in either sense.",
            equation="error on an axis = coefficient × (rate about that axis)²",
            signature="Turns to the left come out too large and turns to the right too small, or "
            "the other way round, and the more so the faster they are.",
            needs="Turns in both senses and at three speeds or more. With one sense only it hides "
            "in the scale; with one speed only it looks like the asymmetry.",
        ),
    }

    def shape(self, sensor: str, c: Circumstances, variant: float | None) -> FloatArray:
        """``x_i²``, g² or (°/s)²."""
        del variant
        return sensed(sensor, c) ** 2

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """A gyroscope must have been turned in both senses."""
        return requirements.both_senses(sensor, c)
