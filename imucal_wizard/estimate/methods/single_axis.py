"""Static and dynamic approach: scale and bias of one gyroscope axis at a time (Q, eq. 15–21).

Each rotation k is about one body axis i, between two rests. With ``w̄`` the mean reading over its
duration T and Δθ the angle that the accelerometer saw,

    Δθ = k (w̄ − b) T                                           (17)

* *static* approach: b is the reading at rest, and ``k = Δθ / ((w̄ − b) T)`` (18) is averaged;
* *dynamic* approach: both follow from all rotations, ``[w̄T, −T] · [k, k b] = Δθ`` (19), by least
  squares (20–21).

Here ``k`` is a correction, rad/s per reading. The angle is taken in the plane across the axis,

    θ = atan2(u_{k+1}, u_{k+2})      (axes in cyclic order; it grows with positive rotation)

since eq. 25–28 divide by a root, lose the sign of g_Z' and so end at ±90°; whole turns are counted
with the integrated rate. All cross-axis gains stay at zero.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import root_mean_square
from imucal_wizard.estimate.method_data import GyroscopeData
from imucal_wizard.estimate.methods import Method
from imucal_wizard.estimate.result import Parameter, SensorFit

MAX_CONDITION = 1e3
"""Condition of eq. 19 beyond which the rotations are all alike: an angle error of 0.1° then makes
one of 100 %."""


@dataclass(frozen=True, eq=False)
class AxisTurn:
    """One rotation about one axis.

    Attributes:
        angle: Δθ from the accelerometer, rad.
        integral: ∫ y dt of the axis's readings (``w̄ T``), reading units × s.
        duration: T, s.
        bias: the axis's reading at rest around it, reading units.
    """

    angle: float
    integral: float
    duration: float
    bias: float


@dataclass(frozen=True)
class ScaleAndBias:
    """One axis by one approach; ``corrected = scale · (reading − bias)``.

    Attributes:
        scale: k, rad/s per reading.
        scale_error: its standard error, or None with too few rotations.
        bias: b, reading units.
        bias_error: its standard error, or None.
        shared: covariance of the two; 0 where it is not known.
    """

    scale: float
    scale_error: float | None
    bias: float
    bias_error: float | None
    shared: float = 0.0


def static_approach(turns: Sequence[AxisTurn]) -> ScaleAndBias | None:
    """Q's static approach: bias at rest, then ``k = Δθ / ((w̄ − b) T)`` averaged (eq. 18).

    None without a rotation in which the readings add up to anything.
    """
    turns = [t for t in turns if t.integral - t.bias * t.duration != 0.0]
    if not turns:
        return None
    scales = np.array([t.angle / (t.integral - t.bias * t.duration) for t in turns])
    biases = np.array([t.bias for t in turns])
    several = len(turns) > 1
    root = np.sqrt(len(turns))
    return ScaleAndBias(
        scale=float(scales.mean()),
        scale_error=float(scales.std(ddof=1) / root) if several else None,
        bias=float(biases.mean()),
        bias_error=float(biases.std(ddof=1) / root) if several else None,
        shared=float(np.cov(scales, biases)[0, 1] / len(turns)) if several else 0.0,
    )


def dynamic_approach(turns: Sequence[AxisTurn]) -> ScaleAndBias | None:
    """Q's dynamic approach: ``[w̄T, −T] · [k, k b] = Δθ`` by least squares (eq. 19–21).

    The readings are taken relative to the bias at rest, so that raw counts around 32768 do not make
    the two columns look alike; that changes nothing in exact arithmetic. None with fewer than three
    rotations, or where they do not separate the two unknowns.
    """
    if len(turns) < 3:
        return None
    reference = float(np.mean([t.bias for t in turns]))
    durations = np.array([t.duration for t in turns])
    integrals = np.array([t.integral for t in turns]) - reference * durations
    angles = np.array([t.angle for t in turns])
    columns = np.column_stack([integrals, -durations])
    norms = np.linalg.norm(columns, axis=0)
    silent = norms[0] <= 1e-9 * np.abs([t.integral for t in turns]).max()
    if silent or not norms.all() or np.linalg.cond(columns / norms) > MAX_CONDITION:
        return None
    scale, product = np.linalg.lstsq(columns, angles, rcond=None)[0]
    if scale == 0.0:
        return None
    residual = angles - columns @ np.array([scale, product])
    variance = float(residual @ residual) / (len(turns) - 2)
    covariance = variance * np.linalg.inv(columns.T @ columns)
    slope = np.array([-product / scale**2, 1.0 / scale])
    return ScaleAndBias(
        scale=float(scale),
        scale_error=float(np.sqrt(covariance[0, 0])),
        bias=float(product / scale + reference),
        bias_error=float(np.sqrt(slope @ covariance @ slope)),
        shared=float(covariance[0] @ slope),
    )


APPROACHES: dict[str, Callable[[Sequence[AxisTurn]], ScaleAndBias | None]] = {
    "static": static_approach,
    "dynamic": dynamic_approach,
}
FITTED = {"static": 1, "dynamic": 2}
"""How many numbers each approach takes from the angles of one axis."""


def run(method: str, data: GyroscopeData) -> SensorFit:
    """Scale and bias of each axis by one approach, in place of the nine-parameter fit.

    Raises:
        DataError: an axis has too few rotations.
    """
    assert data.full is not None  # noqa: S101 - the rotations of these methods have been fitted
    assert data.closure is not None  # noqa: S101
    approach, axes = APPROACHES[method], data.axes
    found = {axis: approach(turns.turns) for axis, turns in axes.items()}
    rows = [row for row in found.values() if row is not None]
    if len(rows) < len(found):
        missing = ", ".join(axis for axis, row in found.items() if row is None)
        raise DataError(
            f"the {method} approach needs rotations about one level axis at a time, and there are "
            f"too few about {missing}: use the method vector, or add such rotations"
        )
    matrix, bias = _correction(rows, data.channels)
    closure = data.closure(matrix, bias)

    # each rotation left out of its own axis; whole turns stay counted by the fit of all
    count = len(closure)
    matrices, biases = np.repeat(matrix[None], count, axis=0), np.repeat(bias[None], count, axis=0)
    needed: list[str] = []
    for k, (axis, turns) in enumerate(axes.items()):
        for place in turns.places:
            other = approach(turns.without(place))
            if other is None:
                needed.append(axis)
                break
            rest = [other if k == index else row for index, row in enumerate(rows)]
            matrices[place], biases[place] = _correction(rest, data.channels)
    out = None if needed else np.asarray(data.closure(matrices, biases))
    full = data.full
    parameters = tuple(_parameter(one, rows, data) for one in full.parameters)
    return SensorFit(
        sensor=full.sensor,
        model=("bias", "scale"),
        method=method,
        frame=full.frame,
        matrix=matrix,
        bias=bias,
        bias_unit=full.bias_unit,
        parameters=parameters,
        parameter_covariance=_covariance(parameters, rows, data),
        unit=full.unit,
        rms_before=full.rms_before,
        rms_fitted=root_mean_square(closure),
        rms_held_out=None if out is None else root_mean_square(out),
        not_held_out=""
        if out is not None
        else f"the {method} approach needs every rotation about {', '.join(needed)}, so none "
        "could be left out to check it: add some",
        floor=full.floor,
        floor_fitted=full.floor_fitted,
        residuals=np.linalg.norm(closure, axis=1),
        held_out=None if out is None else np.linalg.norm(out, axis=1),
        warnings=(f"the {method} approach leaves all cross-axis gains at their nominal value",),
        degrees_of_freedom=max(min(map(len, axes.values())) - FITTED[method], 0),
        repeatability=full.repeatability,
        slow_noise_measured=full.slow_noise_measured,
    )


def _correction(
    rows: list[ScaleAndBias], channels: tuple[int, ...]
) -> tuple[FloatArray, FloatArray]:
    """M and b from one scale and bias per body axis."""
    matrix, bias = np.zeros((3, 3)), np.zeros(3)
    matrix[range(3), list(channels)] = [row.scale for row in rows]
    bias[list(channels)] = [row.bias for row in rows]
    return matrix, bias


def _parameter(parameter: Parameter, rows: list[ScaleAndBias], data: GyroscopeData) -> Parameter:
    """One parameter of the nine-parameter fit as this approach has it."""
    if parameter.name.startswith("cross"):
        return replace(parameter, value=0.0, standard_error=None, carried=False)
    axis = "xyz".index(parameter.name[-1])
    if parameter.name.startswith("sensitivity"):
        row = rows[axis]
        error = None if row.scale_error is None else row.scale_error / row.scale**2
        return replace(parameter, value=1.0 / row.scale, standard_error=error, carried=True)
    about = data.channels.index(axis)
    row = rows[about]
    error = row.bias_error
    # slow noise shifts rests that follow one another alike, so that their scatter does not show it
    slow = float(data.slow["xyz"[about]][axis])
    error = None if error is None else float(np.hypot(error, np.sqrt(slow)))
    return replace(parameter, value=row.bias, standard_error=error, carried=True)


def _covariance(
    parameters: tuple[Parameter, ...], rows: list[ScaleAndBias], data: GyroscopeData
) -> FloatArray:
    """Of all parameters: scale and bias of one axis share their rotations, those of two do not."""
    names = [one.name for one in parameters]
    found = np.diag([(one.standard_error or 0.0) ** 2 for one in parameters])
    for row, about, channel in zip(rows, "xyz", data.channels, strict=True):
        i, j = names.index(f"sensitivity_{about}"), names.index(f"bias_{'xyz'[channel]}")
        found[i, j] = found[j, i] = -row.shared / row.scale**2
    return found


METHODS = (
    Method(
        "static",
        ("gyroscope",),
        "bias at rest, then one scale per axis (eq. 16–18)",
        "Q",
        partial(run, "static"),
        each_axis_alone=True,
    ),
    Method(
        "dynamic",
        ("gyroscope",),
        "scale and bias per axis together (eq. 19–21)",
        "Q",
        partial(run, "dynamic"),
        each_axis_alone=True,
    ),
)
