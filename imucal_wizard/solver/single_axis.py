"""Q's two approaches for the gyroscope: one axis at a time, rotations about that axis (eq. 16–21).

The angle of a rotation about body axis k is read from the accelerometer in the plane across it,

    θ = atan2(u_{k+1}, u_{k+2})      (axes in cyclic order; it grows with positive rotation)

by the two-argument arctangent; whole turns are counted with the integrated rate.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imucal_wizard.readings import FloatArray

MAX_CONDITION = 1e3
"""Beyond this the rotations are all alike: an angle error of 0.1° then makes one of 100 %."""


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
    """

    scale: float
    scale_error: float | None
    bias: float
    bias_error: float | None


def plane_angle(up: FloatArray, axis: int) -> float:
    """Angle of up in the plane across a body axis, rad; grows with positive rotation about it."""
    return float(np.arctan2(up[(axis + 1) % 3], up[(axis + 2) % 3]))


def turn_angle(before: FloatArray, after: FloatArray, axis: int, integrated: float) -> float:
    """Angle turned about a body axis between two up directions, rad.

    Args:
        before: up at the beginning, unit vector.
        after: up at the end.
        axis: 0, 1 or 2.
        integrated: roughly the same angle from the gyroscope; it decides the whole turns.
    """
    angle = plane_angle(after, axis) - plane_angle(before, axis)
    return float(angle + 2.0 * np.pi * np.round((integrated - angle) / (2.0 * np.pi)))


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
    )


def dynamic_approach(turns: Sequence[AxisTurn]) -> ScaleAndBias | None:
    """Q's dynamic approach: ``[w̄T, −T] · [k, k b] = Δθ`` by least squares (eq. 19–21).

    The readings are taken relative to the bias at rest, so that raw counts around 32768 do not make
    the two columns look alike; that changes nothing in exact arithmetic. None with fewer than three
    rotations, or where they do not tell the two unknowns apart.
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
    )
