"""Q's static and dynamic approach beside the nine-parameter fit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from imucal_wizard.procedure.rotations import Rotation
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.gyroscope import VectorFit
from imucal_wizard.solver.result import AxisComparison
from imucal_wizard.solver.single_axis import (
    AxisTurn,
    ScaleAndBias,
    dynamic_approach,
    static_approach,
    turn_angle,
)


@dataclass(frozen=True, eq=False)
class AxisTurns:
    """The rotations about one body axis.

    Attributes:
        turns: what Q's approaches take of each.
        places: which of the usable rotations each is.
    """

    turns: tuple[AxisTurn, ...]
    places: tuple[int, ...]

    def __len__(self) -> int:
        return len(self.turns)

    def fit(self, method: str, without: int | None = None) -> ScaleAndBias | None:
        """Scale and bias by one approach; None where the rotations do not carry them.

        Args:
            method: ``static`` or ``dynamic``.
            without: the usable rotation to leave out.
        """
        pairs = zip(self.turns, self.places, strict=True)
        kept = [turn for turn, place in pairs if place != without]
        return static_approach(kept) if method == "static" else dynamic_approach(kept)


SingleAxis = dict[str, AxisTurns]
"""The rotations about each body axis."""


def integral(values: FloatArray, time: FloatArray) -> FloatArray:
    """Integral over time of each column by the trapezoidal rule, shape (columns,)."""
    return np.asarray(0.5 * (values[1:] + values[:-1]).T @ np.diff(time))


def single_axis(
    rotations: Sequence[Rotation], up: Mapping[int, FloatArray], vector: VectorFit
) -> SingleAxis:
    """The rotations about one axis each, as Q's two approaches take them.

    Args:
        rotations: usable rotations, those about one axis named.
        up: up direction by the identity of the hold.
        vector: the nine-parameter fit, for counting whole turns.
    """
    found: dict[str, list[tuple[AxisTurn, int]]] = {axis: [] for axis in "xyz"}
    for place, rotation in enumerate(rotations):
        if rotation.axis is None or rotation.before.gyroscope is None:
            continue
        k = "xyz".index(rotation.axis)
        channel = vector.nominal.channels[k]
        rate = (rotation.rate - vector.bias) @ vector.matrix.T
        angle = turn_angle(
            up[id(rotation.before)],
            up[id(rotation.after)],
            k,
            float(integral(rate, rotation.time)[k]),
        )
        turn = AxisTurn(
            angle=angle,
            integral=float(integral(rotation.rate, rotation.time)[channel]),
            duration=float(rotation.time[-1] - rotation.time[0]),
            bias=float(rotation.before.gyroscope[channel]),
        )
        found[rotation.axis].append((turn, place))
    return {
        axis: AxisTurns(tuple(turn for turn, _ in rows), tuple(place for _, place in rows))
        for axis, rows in found.items()
    }


def comparison(single: SingleAxis, vector: VectorFit) -> tuple[AxisComparison, ...]:
    """The three methods side by side, a row per axis (Q's table III).

    The scale and bias of a body axis are those of the sensor axis that feels it.
    """
    sigma = np.sqrt(np.diag(vector.covariance))
    rows = []
    for k, axis in enumerate("xyz"):
        turns = single[axis]
        static, dynamic = turns.fit("static"), turns.fit("dynamic")
        channel = vector.nominal.channels[k]
        rows.append(
            AxisComparison(
                axis=axis,
                rotations=len(turns),
                static_bias=static.bias if static else None,
                static_scale=static.scale if static else None,
                static_scale_error=static.scale_error if static else None,
                dynamic_bias=dynamic.bias if dynamic else None,
                dynamic_bias_error=dynamic.bias_error if dynamic else None,
                dynamic_scale=dynamic.scale if dynamic else None,
                dynamic_scale_error=dynamic.scale_error if dynamic else None,
                vector_bias=float(vector.bias[channel]),
                vector_scale=float(vector.matrix[k, channel]),
                vector_scale_error=float(sigma[3 * k + channel]),
            )
        )
    return tuple(rows)
