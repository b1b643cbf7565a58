"""Cubic terms of two axes."""

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
_PAIRS = tuple((i, j) for i in range(3) for j in range(3) if i != j)


class CubicCross(Effect):
    """``ε_i = Σ C_ijj x_i x_j²``: a gain that changes with the square of another axis's force.

    At rest under 1 g ``x_i x_j²`` on axis i and ``x_j x_i²`` on axis j are one and the same, and
    the three that are left are the third-order terms up to a scale: ``x⁴ = x² − x²y² − x²z²``.
    """

    name = "cubic-cross"
    sensors = (ACCELEROMETER,)
    family = "odd-order"
    kind = "orientation"
    title = "cubic cross-axis term"
    equation = "ε_i = Σ Cᵢⱼⱼ x_i x_j²"
    order = 23
    aliases = ("third-order",)
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="A force across the axis bends the beams that guide the proof mass, to either "
            "side alike, and stiffens or softens them: the gain of the axis changes with the "
            "square of the other axis's force.",
            equation="error on an axis = coefficient × force on that axis × (force on another)²",
            signature="Nothing at faces, most on the edges between the two axes, with the same "
            "sign on all four of them; scale errors take up a part, so that faces and edges end "
            "up with opposite errors.",
            needs="Faces, edges and corners. Still poses at 1 g cannot tell it from third-order "
            "terms on several axes, whatever their number: the squares of the three components "
            "add up to 1.",
            remedy="Add the term, or the third-order term in its place, for use up to 1 g: there "
            "both correct alike. Do not extrapolate to several g.",
            confirm="On a centrifuge or shaker, force along the axis alone: a cubic cross-axis "
            "term makes no error there, a third-order term its largest.",
            source="IEEE Std 1293, model equation of linear accelerometers (higher-order "
            "cross-coupling).",
        ),
    }

    def parameters(self, sensor: str) -> tuple[EffectParameter, ...]:
        """``xyy`` (x feels x·y²), ``xzz``, ``yxx``, ``yzz``, ``zxx``, ``zyy``."""
        del sensor
        return tuple(_SIZE.parameter(AXES[i] + 2 * AXES[j]) for i, j in _PAIRS)

    def columns(self, sensor: str, c: Circumstances, variant: float | None = None) -> FloatArray:
        """Shape (n, 3, 6): two products on each axis."""
        del variant
        x = sensed(sensor, c)
        columns = np.zeros((len(c), 3, len(_PAIRS)))
        for place, (i, j) in enumerate(_PAIRS):
            columns[:, i, place] = _SIZE.si * x[:, i] * x[:, j] ** 2
        return columns

    def c_columns(
        self, sensor: str, variant: float | None = None
    ) -> tuple[tuple[int, int, str], ...]:
        """See ``Effect``."""
        del variant
        del sensor
        factor = c_number(_SIZE.si)
        return tuple(
            (i, place, f"{factor} * x{i} * x{j} * x{j}") for place, (i, j) in enumerate(_PAIRS)
        )
