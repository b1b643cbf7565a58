"""Sensitivity of a gyroscope to gravity."""

from collections.abc import Mapping

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import ACCELERATION_UNITS
from imucal_wizard.model import requirements
from imucal_wizard.model.effect import DEGREE, GYROSCOPE, Circumstances, ForceEffect, Size, Story


class GSensitivity(ForceEffect):
    """``ε_i = Σ G_ij f_j``: the acceleration-sensitive drift of IEEE 1431, nine coefficients."""

    name = "g-sensitivity"
    sensors = (GYROSCOPE,)
    against = "force"
    kind = "orientation"
    title = "sensitivity of the rate to gravity"
    equation = "ε_i = Σ Gᵢⱼ f_j"
    order = 1
    size = Size(
        "°/s/g",
        DEGREE,
        0.1,
        {"consumer": (0.01, 0.1), "industrial": (0.001, 0.015), "tactical": (1e-4, 0.001)},
        chosen=("tactical",),
    )
    stories: Mapping[str, Story] = {
        GYROSCOPE: Story(
            what="Gravity displaces the vibrating mass. Its gaps and its balance change, and the "
            "read-out takes a part of the drive motion for a rotation.",
            equation="error on an axis = sum over the three axes of coefficient × force",
            signature="The readings at rest differ from pose to pose; plotted over a force "
            "component, they lie on a straight line. The closure error of rotations depends on "
            "which way is up.",
            needs="Still poses in all directions: their mean rates show the effect ten times "
            "better than rotations do. If each axis follows its own force component with the same "
            "slope of a few °/h per g, it is the rotation of the Earth.",
            remedy="Add the term and apply it with the accelerometer's force. Do not only average "
            "the bias over poses: it differs from pose to pose.",
            confirm="Turn the device upside down on a table several times and compare the mean "
            "rates at rest: their difference is twice the error of 1 g.",
            source="IEEE Std 1431, model equation of Coriolis vibratory gyroscopes "
            "(acceleration-sensitive drift); data sheets: linear acceleration effect on bias.",
        ),
    }

    def felt(self, c: Circumstances) -> FloatArray:
        """``f_j``, g."""
        return c.force / ACCELERATION_UNITS["g"]

    def c_felt(self) -> tuple[str, str, str]:
        """See ``ForceEffect``."""
        return ("f0", "f1", "f2")

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """More than one pose."""
        del sensor
        return requirements.directions(c)
