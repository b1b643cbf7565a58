"""The gyroscope's result by Q's static or dynamic approach: three scales, no cross-axis gain."""

from dataclasses import replace

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.fitting.comparison import SingleAxis
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.closure import Turns, errors
from imucal_wizard.solver.gyroscope import VectorFit
from imucal_wizard.solver.result import Parameter, SensorFit
from imucal_wizard.solver.rms import root_mean_square
from imucal_wizard.solver.single_axis import ScaleAndBias

FITTED = {"static": 1, "dynamic": 2}
"""How many numbers each approach takes from the angles of one axis."""


def by_single_axis(
    turns: Turns, fit: SensorFit, single: SingleAxis, method: str, vector: VectorFit
) -> SensorFit:
    """The nine-parameter result replaced by Q's: scale and bias of each axis on its own.

    Args:
        turns: the usable rotations.
        fit: the nine-parameter result.
        single: the rotations about each axis.
        method: ``static`` or ``dynamic``.
        vector: the nine-parameter fit, for which sensor axis feels which body axis and for what
            slow noise does.

    Raises:
        DataError: an axis has too few rotations.
    """
    chosen = {axis: rows.fit(method) for axis, rows in single.items()}
    missing = ", ".join(axis for axis, row in chosen.items() if row is None)
    if missing:
        raise DataError(
            f"the {method} approach needs rotations about one axis at a time; too few about "
            f"{missing}. Use the method vector, or add such rotations"
        )
    rows = [row for row in chosen.values() if row is not None]
    channels = vector.nominal.channels
    matrix, bias = _correction(rows, channels)
    closure = errors(turns, matrix, bias)
    out = held_out(turns, single, method, channels)
    return replace(
        fit,
        model=("bias", "scale"),
        method=method,
        matrix=matrix,
        bias=bias,
        parameters=tuple(_parameter(one, rows, vector) for one in fit.parameters),
        rms_fitted=root_mean_square(closure),
        rms_held_out=None if out is None else root_mean_square(out),
        not_held_out="" if out is not None else _needed(single, method),
        residuals=np.linalg.norm(closure, axis=1),
        held_out=None if out is None else np.linalg.norm(out, axis=1),
        covariance=None,
        warnings=(f"the {method} approach leaves all cross-axis gains at their nominal value",),
        degrees_of_freedom=max(min(map(len, single.values())) - FITTED[method], 0),
        suspects=(),
    )


def held_out(
    turns: Turns, single: SingleAxis, method: str, channels: tuple[int, ...]
) -> FloatArray | None:
    """Closure error of each rotation under the same approach without it, rad, shape (m, 3).

    A rotation that is about no single axis is in no fit, so that it is held out as it is. None when
    an axis has too few rotations to spare one. Which whole number of turns a rotation has made is
    counted with the rate, by the fit of all; no smaller error depends on it.
    """
    whole = [rows.fit(method) for rows in single.values()]
    matrices, biases = np.empty((len(turns), 3, 3)), np.empty((len(turns), 3))
    for place in range(len(turns)):
        fits = [
            rows.fit(method, without=place) if place in rows.places else fit
            for rows, fit in zip(single.values(), whole, strict=True)
        ]
        rows = [fit for fit in fits if fit is not None]
        if len(rows) < len(fits):
            return None
        matrices[place], biases[place] = _correction(rows, channels)
    return errors(turns, matrices, biases)


def _needed(single: SingleAxis, method: str) -> str:
    """Why no rotation could be left out."""
    few = [
        axis
        for axis, rows in single.items()
        if any(rows.fit(method, without=place) is None for place in rows.places)
    ]
    return (
        f"the {method} approach needs every rotation there is about {', '.join(few)}, so none "
        "could be left out to check it: add some"
    )


def _correction(
    rows: list[ScaleAndBias], channels: tuple[int, ...]
) -> tuple[FloatArray, FloatArray]:
    """M and b from one scale and bias per body axis."""
    matrix, bias = np.zeros((3, 3)), np.zeros(3)
    matrix[range(3), list(channels)] = [row.scale for row in rows]
    bias[list(channels)] = [row.bias for row in rows]
    return matrix, bias


def _parameter(parameter: Parameter, rows: list[ScaleAndBias], vector: VectorFit) -> Parameter:
    """One parameter of the nine-parameter fit as this approach has it."""
    if parameter.name.startswith("cross"):
        return replace(parameter, value=0.0, standard_error=None, carried=False)
    axis = "xyz".index(parameter.name[-1])
    if parameter.name.startswith("sensitivity"):
        row = rows[axis]
        error = None if row.scale_error is None else row.scale_error / row.scale**2
        return replace(parameter, value=1.0 / row.scale, standard_error=error, carried=True)
    row = rows[vector.nominal.channels.index(axis)]
    error = row.bias_error
    # slow noise shifts the rests of all turns alike, so that their scatter does not show it
    error = None if error is None else float(np.hypot(error, np.sqrt(vector.slow[axis])))
    return replace(parameter, value=row.bias, standard_error=error, carried=True)
