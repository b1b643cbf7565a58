"""Sensitivity of a gyroscope to products of two force components."""

from collections.abc import Mapping

import numpy as np

from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import ACCELERATION_UNITS
from imucal_wizard.model import requirements
from imucal_wizard.model.effect import (
    DEGREE,
    GYROSCOPE,
    Circumstances,
    EffectParameter,
    ForceEffect,
    Size,
    Story,
)

_PAIRS = ((0, 1), (0, 2), (1, 2))


class Anisoelastic(ForceEffect):
    """``ε_i = Σ A_ijk f_j f_k`` (j < k): the anisoelastic drift of IEEE 1431.

    With the squares of ``g2-sensitivity`` it makes every quadratic form of the force.
    """

    name = "anisoelastic"
    sensors = (GYROSCOPE,)
    against = "force"
    kind = "orientation"
    title = "sensitivity of the rate to products of two forces"
    equation = "ε_i = Σ Aᵢⱼₖ f_j f_k"
    order = 3
    size = Size(
        "°/s/g²",
        DEGREE,
        0.01,
        {"consumer": (0.002, 0.02), "industrial": (2e-4, 0.002), "tactical": (1e-5, 2e-4)},
        chosen=("consumer", "industrial", "tactical"),
    )
    stories: Mapping[str, Story] = {
        GYROSCOPE: Story(
            what="The springs that carry the vibrating mass are not equally stiff in all "
            "directions. A force along one direction displaces the mass sideways, and a force "
            "along a second direction then exerts a torque on it. The error is proportional to "
            "the product of both forces.",
            equation="error on an axis = sum over pairs of axes of coefficient × force on one × "
            "force on the other",
            signature="The readings at rest are correct with a face on top and wrong with an edge "
            "on top, with opposite signs on neighbouring edges around an axis.",
            needs="Still poses on edges or corners. Faces alone do not show it.",
            remedy="Add the term and apply it with the accelerometer's force. On a vibrating "
            "device, damp the mounting as well: the product of two vibrations in phase does not "
            "average to zero.",
            confirm="Rest the device with the force between two axes, then on the mirrored edge: "
            "the mean rates differ by twice the error. The mean rates on the faces lie half way "
            "between them.",
            source="IEEE Std 1431, model equation of Coriolis vibratory gyroscopes "
            "(acceleration-squared-sensitive drift, cross terms).",
        ),
    }

    def felt(self, c: Circumstances) -> FloatArray:
        """``f_x f_y``, ``f_x f_z``, ``f_y f_z``, g²."""
        force = c.force / ACCELERATION_UNITS["g"]
        return np.stack([force[:, j] * force[:, k] for j, k in _PAIRS], axis=1)

    def parameters(self, sensor: str) -> tuple[EffectParameter, ...]:
        """Output axis, then both input axes: ``xxy``, ``xxz``, ``xyz``, ``yxy`` … ``zyz``."""
        del sensor
        pairs = [AXES[j] + AXES[k] for j, k in _PAIRS]
        return tuple(self.size.parameter(out + pair) for out in AXES for pair in pairs)

    def c_felt(self) -> tuple[str, str, str]:
        """See ``ForceEffect``."""
        return ("f0 * f1", "f0 * f2", "f1 * f2")

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """More than one pose."""
        del sensor
        return requirements.directions(c)
