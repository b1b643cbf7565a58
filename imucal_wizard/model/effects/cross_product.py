"""Products of the inputs of two axes."""

from collections.abc import Mapping

import numpy as np

from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model import requirements
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    DEGREE,
    GYROSCOPE,
    MILLI_G,
    Circumstances,
    Effect,
    EffectParameter,
    Size,
    Story,
    c_number,
    sensed,
)

_PAIRS = ((0, 1), (0, 2), (1, 2))
_SIZES: Mapping[str, Size] = {
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
        0.5,
        {"consumer": (0.1, 0.8), "industrial": (0.02, 0.1), "tactical": (0.002, 0.02)},
        chosen=("industrial", "tactical"),
    ),
}


class CrossProduct(Effect):
    """``ε_i = Σ K_ijk x_j x_k`` (j < k): K_ip, K_io and K_op of IEEE 1293 for each axis.

    At rest under 1 g the nine coefficients show in only seven combinations (``u_y u_z`` on x, ``u_x
    u_z`` on y and ``u_x u_y`` on z are one and the same ``xyz``), and these hold the second-order
    term and the squares of the other axes as well, up to a bias: ``x³ = x − xy² − xz²``.
    """

    name = "cross-product"
    sensors = (ACCELEROMETER, GYROSCOPE)
    family = "even-order"
    kind = "orientation"
    title = "cross-axis product"
    equation = "ε_i = Σ Kᵢⱼₖ x_j x_k"
    order = 12
    aliases = ("axis-delay",)
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="A force along one direction displaces the proof mass. Its beams twist and its "
            "electrodes overlap a little less, so the gain for a force along a second direction "
            "changes.",
            equation="error on an axis = coefficient × force on one axis × force on another",
            signature="The product of two axes acts on edges and is zero at faces. The fit "
            "absorbs about 40 % of that as a bias, so faces and edges keep opposite errors. "
            "The product of all three axes appears at corners only, with opposite signs at "
            "adjacent corners.",
            needs="Edges, and all eight corners: without corners the product of all three axes "
            "cannot be seen. Several coefficients cause the same error of the magnitude, so the "
            "poses determine only their sum; a gyroscope's rotations may show how it is split.",
            remedy="Add the term and apply it. Without a gyroscope, do not read single "
            "coefficients as properties of the sensor: other sets of coefficients give the same "
            "magnitude at 1 g, and another direction.",
            confirm="Measure on a centrifuge with the force between +x and +y, then between +x "
            "and −y: the part of the error proportional to x·y changes its sign.",
            source="IEEE Std 1293, model equation of linear accelerometers (cross-coupling "
            "coefficients).",
        ),
        GYROSCOPE: Story(
            what="A rotation about one axis displaces the vibrating mass a little, which changes "
            "the gain for a rotation about a second axis.",
            equation="error on an axis = coefficient × rate about one axis × rate about another",
            signature="Only rotations about a tilted axis show the error; rotations about a "
            "single sensor axis are correct.",
            needs="Rotations about axes half way between two sensor axes, in both senses and at "
            "different speeds.",
            remedy="Add the term and apply it, if the device rotates about tilted axes in use.",
            confirm="Mount the sensor with the axis of a rate table between +x and +y, then "
            "between +x and −y: the part of the error proportional to x·y changes its sign.",
            source="IEEE Std 1431, model equation of Coriolis vibratory gyroscopes.",
        ),
    }

    def parameters(self, sensor: str) -> tuple[EffectParameter, ...]:
        """``xxy`` (x feels x·y), ``xxz``, ``xyz``, ``yxy`` … ``zyz``."""
        names = [f"{axis}{AXES[j]}{AXES[k]}" for axis in AXES for j, k in _PAIRS]
        return tuple(_SIZES[sensor].parameter(name) for name in names)

    def columns(self, sensor: str, c: Circumstances, variant: float | None = None) -> FloatArray:
        """Shape (n, 3, 9): three products on each axis."""
        del variant
        x = sensed(sensor, c)
        products = _SIZES[sensor].si * np.stack([x[:, j] * x[:, k] for j, k in _PAIRS], axis=1)
        columns = np.zeros((len(c), 3, 9))
        for axis in range(3):
            columns[:, axis, 3 * axis : 3 * axis + 3] = products
        return columns

    def c_columns(
        self, sensor: str, variant: float | None = None
    ) -> tuple[tuple[int, int, str], ...]:
        """See ``Effect``."""
        del variant
        factor = c_number(_SIZES[sensor].si)
        return tuple(
            (axis, 3 * axis + place, f"{factor} * x{j} * x{k}")
            for axis in range(3)
            for place, (j, k) in enumerate(_PAIRS)
        )

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """A gyroscope must have been turned."""
        return requirements.rotations(sensor, c)
