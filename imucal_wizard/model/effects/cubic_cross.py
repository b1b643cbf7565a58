"""Cubic terms of two or three axes."""

from collections.abc import Mapping

import numpy as np

from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    MILLI_G,
    Circumstances,
    Effect,
    EffectParameter,
    Size,
    Story,
    c_number,
    sensed,
)

_SIZE = Size(
    "mg/g³",
    MILLI_G,
    2.0,
    {"consumer": (0.5, 5.0), "industrial": (0.1, 0.5), "tactical": (0.01, 0.1)},
    chosen=("consumer", "industrial", "tactical"),
)
_TERMS = tuple(
    (i, j, k) for i in range(3) for j in range(3) for k in range(j, 3) if (i, i) != (j, k)
)
"""Output axis, and the two factors of its gain: all cubic terms in which the axis itself takes
part, but for ``x_i³``."""


class CubicCross(Effect):
    """``ε_i = x_i Σ C_ijk x_j x_k``: a gain that changes with the product of two forces.

    At rest under 1 g ``x_i x_j²`` on axis i and ``x_j x_i²`` on axis j are one and the same, and
    the three that are left are the third-order terms up to a scale: ``x⁴ = x² − x²y² − x²z²``.
    ``x² y`` on x, ``x y²`` on y and ``x y z`` on z make ``x³y``, ``x y³`` and ``x y z²`` along
    gravity, which add up to a cross-axis sensitivity: one of the three cannot be determined.
    """

    name = "cubic-cross"
    sensors = (ACCELEROMETER,)
    family = "odd-order"
    kind = "orientation"
    title = "cubic cross-axis term"
    equation = "ε_i = x_i Σ Cᵢⱼₖ x_j x_k"
    order = 23
    aliases = ("third-order",)
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="A force across the axis bends the beams that guide the proof mass and stiffens "
            "or softens them, equally for both signs of the force: the gain of the axis changes "
            "with the square of the force on the other axis. Skew beams bend more to one side "
            "than to the other, and the gain changes with the product of two forces.",
            equation="error on an axis = coefficient × force on that axis × product of two forces "
            "(xyy: of x by y², xxy: of x by x·y, xyz: of x by y·z)",
            signature="The error is zero at faces. For a square of the force on another axis it "
            "is largest on the four edges between the two axes, with the same sign; the scales "
            "absorb a part, so faces and edges keep opposite errors. For a product of two forces, "
            "edges and corners differ; the cross-axis sensitivity absorbs the part that appears "
            "on edges.",
            needs="Faces, edges and corners. Still poses at 1 g cannot separate the terms by "
            "squares (xyy and the like) from third-order terms on several axes, nor xyy from yxx, "
            "whatever the number of poses: the squares of the three components add up to 1. "
            "Products need corners and tilts between faces and edges: poses at edges and corners "
            "alone show only one sum of xxy, yxy and zxy. Tilts between faces and edges also "
            "tell a square from another power of the force on the other axis.",
            remedy="Add the term for use up to 1 g. For squares the third-order term corrects the "
            "same error up to 1 g. Do not extrapolate to several g.",
            confirm="On a centrifuge or shaker, apply a force along the axis alone: a cubic "
            "cross-axis term causes no error then, a third-order term its largest.",
            source="IEEE Std 1293, model equation of linear accelerometers (higher-order "
            "cross-coupling).",
        ),
    }

    def parameters(self, sensor: str) -> tuple[EffectParameter, ...]:
        """``xxy`` (x feels x·x·y), ``xxz``, ``xyy``, ``xyz``, ``xzz``, then those of y and z."""
        del sensor
        return tuple(_SIZE.parameter(AXES[i] + AXES[j] + AXES[k]) for i, j, k in _TERMS)

    def columns(self, sensor: str, c: Circumstances, variant: float | None = None) -> FloatArray:
        """Shape (n, 3, 15): five products on each axis."""
        del variant
        x = sensed(sensor, c)
        columns = np.zeros((len(c), 3, len(_TERMS)))
        for place, (i, j, k) in enumerate(_TERMS):
            columns[:, i, place] = _SIZE.si * x[:, i] * x[:, j] * x[:, k]
        return columns

    def c_columns(
        self, sensor: str, variant: float | None = None
    ) -> tuple[tuple[int, int, str], ...]:
        """See ``Effect``."""
        del sensor, variant
        factor = c_number(_SIZE.si)
        return tuple(
            (i, place, f"{factor} * x{i} * x{j} * x{k}") for place, (i, j, k) in enumerate(_TERMS)
        )
