"""Sensitivity of a gyroscope to the square of the force."""

from collections.abc import Mapping

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import ACCELERATION_UNITS
from imucal_wizard.model import requirements
from imucal_wizard.model.effect import DEGREE, GYROSCOPE, Circumstances, ForceEffect, Size, Story


class G2Sensitivity(ForceEffect):
    """``ε_i = Σ H_ij f_j²``: the acceleration-squared-sensitive drift of IEEE 1431.

    Under 1 g the three squares add up to a constant, so that for each axis one of its three
    coefficients is a bias.
    """

    name = "g2-sensitivity"
    sensors = (GYROSCOPE,)
    against = "force"
    kind = "orientation"
    title = "sensitivity of the rate to the square of the force"
    equation = "ε_i = Σ Hᵢⱼ f_j²"
    order = 2
    size = Size(
        "°/s/g²",
        DEGREE,
        0.01,
        {"consumer": (0.002, 0.02), "industrial": (2e-4, 0.002), "tactical": (1e-5, 2e-4)},
        chosen=("consumer", "industrial", "tactical"),
    )
    stories: Mapping[str, Story] = {
        GYROSCOPE: Story(
            what="Gravity displaces the vibrating mass in its gaps. The signal that leaks into "
            "the read-out does not change in proportion to the force; its quadratic part has the "
            "same sign for a force up and a force down, and is four times as large for twice the "
            "force. Springs of unequal stiffness (anisoelasticity) also cause products of two "
            "force components; those are a separate effect.",
            equation="error on an axis = sum over the three axes of coefficient × (force)²",
            signature="The readings at rest are the same in two opposite poses and differ from "
            "those with the axis level.",
            needs="Still poses at opposite faces and half way between them. Equal coefficients of "
            "all three force components are a bias and cannot be seen at 1 g.",
            remedy="Add the term and apply it with the accelerometer's force. On a vibrating "
            "device, damp the mounting as well: the square of a vibration does not average to "
            "zero.",
            confirm="Shake the resting device along one axis: the mean rate changes with the mean "
            "square of the vibration.",
            source="IEEE Std 1431, model equation of Coriolis vibratory gyroscopes; IEEE Std 528, "
            "acceleration-squared-sensitive drift rate (which counts products of components, too).",
        ),
    }

    def felt(self, c: Circumstances) -> FloatArray:
        """``f_j²``, g²."""
        return (c.force / ACCELERATION_UNITS["g"]) ** 2

    def c_felt(self) -> tuple[str, str, str]:
        """See ``ForceEffect``."""
        return ("f0 * f0", "f1 * f1", "f2 * f2")

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """More than one pose."""
        del sensor
        return requirements.directions(c)
