"""Q's static and dynamic approach beside the nine-parameter fit."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.procedure.rotations import Rotation
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.closure import Turns, errors
from imucal_wizard.solver.gyroscope import VectorFit
from imucal_wizard.solver.result import AxisComparison, SensorFit
from imucal_wizard.solver.single_axis import (
    AxisTurn,
    ScaleAndBias,
    dynamic_approach,
    static_approach,
    turn_angle,
)

SingleAxis = dict[str, tuple[int, ScaleAndBias | None, ScaleAndBias | None]]
"""Per axis: how many rotations, the static and the dynamic result."""


def integral(values: FloatArray, time: FloatArray) -> FloatArray:
    """Integral over time of each column by the trapezoidal rule, shape (columns,)."""
    return np.asarray(0.5 * (values[1:] + values[:-1]).T @ np.diff(time))


def single_axis(
    rotations: Sequence[Rotation], up: Mapping[int, FloatArray], vector: VectorFit
) -> SingleAxis:
    """Q's static and dynamic approach for each axis.

    Args:
        rotations: usable rotations, those about one axis named.
        up: up direction by the identity of the hold.
        vector: the nine-parameter fit, for counting whole turns.
    """
    by_axis: dict[str, list[AxisTurn]] = {axis: [] for axis in "xyz"}
    for rotation in rotations:
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
        by_axis[rotation.axis].append(
            AxisTurn(
                angle=angle,
                integral=float(integral(rotation.rate, rotation.time)[channel]),
                duration=float(rotation.time[-1] - rotation.time[0]),
                bias=float(rotation.before.gyroscope[channel]),
            )
        )
    return {
        axis: (len(turns), static_approach(turns), dynamic_approach(turns))
        for axis, turns in by_axis.items()
    }


def comparison(single: SingleAxis, vector: VectorFit) -> tuple[AxisComparison, ...]:
    """The three methods side by side, a row per axis (Q's table III).

    The scale and bias of a body axis are those of the sensor axis that feels it.
    """
    sigma = np.sqrt(np.diag(vector.covariance))
    rows = []
    for k, axis in enumerate("xyz"):
        count, static, dynamic = single[axis]
        channel = vector.nominal.channels[k]
        rows.append(
            AxisComparison(
                axis=axis,
                rotations=count,
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


def by_single_axis(
    turns: Turns,
    fit: SensorFit,
    single: SingleAxis,
    method: str,
    vector: VectorFit,
) -> SensorFit:
    """The result by Q's static or dynamic approach instead: three scales, cross-axis gains zero.

    Raises:
        DataError: an axis has too few rotations.
    """
    chosen = {axis: row[1] if method == "static" else row[2] for axis, row in single.items()}
    missing = ", ".join(axis for axis, row in chosen.items() if row is None)
    if missing:
        raise DataError(
            f"the {method} approach needs rotations about one axis at a time; too few about "
            f"{missing}. Use the method vector, or add such rotations"
        )
    rows = [row for row in chosen.values() if row is not None]
    channels = list(vector.nominal.channels)
    matrix, bias = np.zeros((3, 3)), np.zeros(3)
    matrix[range(3), channels] = [row.scale for row in rows]
    bias[channels] = [row.bias for row in rows]
    closure = errors(turns, matrix, bias)
    parameters = []
    for parameter in fit.parameters:
        if parameter.name.startswith("cross"):
            parameters.append(replace(parameter, value=0.0, standard_error=None, carried=False))
            continue
        axis = "xyz".index(parameter.name[-1])
        if parameter.name.startswith("sensitivity"):
            row = rows[axis]
            error = None if row.scale_error is None else row.scale_error / row.scale**2
            parameters.append(replace(parameter, value=1.0 / row.scale, standard_error=error))
        else:
            row = rows[channels.index(axis)]
            parameters.append(replace(parameter, value=row.bias, standard_error=row.bias_error))
    return replace(
        fit,
        model=("bias", "scale"),
        method=method,
        matrix=matrix,
        bias=bias,
        parameters=tuple(parameters),
        rms_fitted=float(np.sqrt(np.mean((closure**2).sum(axis=1)))),
        rms_held_out=None,
        residuals=np.linalg.norm(closure, axis=1),
        held_out=None,
        covariance=None,
        warnings=(f"the {method} approach leaves all cross-axis gains at their nominal value",),
        degrees_of_freedom=0,
        suspects=(),
    )
