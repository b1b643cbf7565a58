"""The gyroscope's default fit: nine gains and three biases in the accelerometer's frame.

Still means say the bias, rotations say the gains and a little of the bias; both are fitted
together, each weighed by its own scatter.
"""

from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.closure import BIAS, MATRIX, SIZE, Turns
from imucal_wizard.solver.gains import Nominal, not_carried
from imucal_wizard.solver.gyroscope_descent import PRIOR, minimise
from imucal_wizard.solver.gyroscope_uncertainty import (
    covariance_of,
    drops,
    frame_covariance,
    held_out,
)
from imucal_wizard.solver.rotation_data import (
    Point,
    RotationData,
    freedom,
    point_at,
    rotation_data,
)

CLOSING_AT_FIRST = 0.01
"""Closure error that the first step expects, rad; every later step takes it from the data."""


@dataclass(frozen=True, eq=False)
class VectorFit:
    """The nine-parameter fit.

    Attributes:
        matrix: M, rad/s per reading, shape (3, 3).
        bias: b, reading units, shape (3,).
        covariance: of the nine entries of M by rows and the biases, shape (12, 12).
        slow: variance of the biases by slow noise, which is part of it, shape (3,).
        closure: closure error of each rotation, rad, shape (m, 3).
        held_out: the same with each rotation left out in turn, or None.
        weighted: closure errors over the standard deviation of each, shape (m, 3).
        drops: how much the sum of their squares falls without each rotation, shape (m,).
        dropped: names of the gains not carried, left at their nominal value.
        nominal: which sensor axis feels each body axis, and which gains are scales.
        iterations: Gauss–Newton steps.
        degrees_of_freedom: two closures per rotation, less the gains fitted.
    """

    matrix: FloatArray
    bias: FloatArray
    covariance: FloatArray
    slow: FloatArray
    closure: FloatArray
    held_out: FloatArray | None
    weighted: FloatArray
    drops: FloatArray
    dropped: tuple[str, ...]
    nominal: Nominal
    iterations: int
    degrees_of_freedom: int


def fit_vector(
    turns: Turns,
    stills: FloatArray,
    still_floor: FloatArray,
    start: FloatArray,
    nominal: Nominal,
    noise: FloatArray | None = None,
    slow: FloatArray | None = None,
) -> VectorFit:
    """Fit M and b to rotations and still means.

    Args:
        turns: the rotations.
        stills: mean reading of each hold, shape (n, 3).
        still_floor: standard deviation of such a mean from noise alone, shape (3,).
        start: M to start from, shape (3, 3).
        nominal: what a gain is that the rotations do not carry.
        noise: variance of each component of each rotation's closure that noise alone makes, rad²,
            shape (m,); None when not known.
        slow: variance by which slow noise shifts the mean of all stills, shape (3,). The rates of
            the rotations are shifted with it, so that the gains do not feel it.

    Raises:
        DataError: the rotations do not carry the scales, or the fit does not converge.
    """
    data = rotation_data(turns, stills, still_floor, start)
    point = point_at(data, start, stills.mean(axis=0), CLOSING_AT_FIRST, tuple(range(SIZE)))
    point, iterations = minimise(data, point, PRIOR)
    if noise is not None:
        data = _weighed(data, point.closing, noise)
    free = _carried(data, point, nominal)
    while True:
        matrix = nominal.filled(point.matrix, free)
        begin = point_at(data, matrix, point.bias, point.closing, free)
        point, taken = minimise(data, begin, 0.0 * PRIOR)
        iterations += taken
        free = _carried(data, point, nominal)
        if free == point.free:
            break
    covariance = covariance_of(data, point)[0] + frame_covariance(data, point)
    slow = np.zeros(3) if slow is None else slow
    covariance[BIAS, BIAS] += np.diag(slow)
    return VectorFit(
        point.matrix,
        point.bias,
        covariance,
        slow,
        point.at.errors,
        held_out(data, point),
        point.errors(data),
        drops(data, point),
        tuple(nominal.parameter(index) for index in range(9) if index not in free),
        nominal,
        iterations,
        freedom(turns, free),
    )


def _weighed(data: RotationData, closing: float, noise: FloatArray) -> RotationData:
    """Rotations weighed by their noise and by what a first fit leaves beyond it.

    That rest (the hand, the support, physics not in the model) is the same for all of them.
    """
    variance = noise + max(closing**2 - float(noise.mean()), 0.0)
    if not (variance > 0.0).all():
        return data
    return replace(data, spread=np.sqrt(variance / variance.mean()))


def _carried(data: RotationData, point: Point, nominal: Nominal) -> tuple[int, ...]:
    """Which of the parameters fitted the data carry; the worst known gain goes first.

    Raises:
        DataError: a scale is not carried and has no nominal value.
    """
    while True:
        covariance, blind = covariance_of(data, point)
        relative = covariance[MATRIX, MATRIX] / data.gain**2
        drop = not_carried(relative, blind[MATRIX], point.free, nominal)
        if drop is None:
            return point.free
        nominal.check(drop)
        point = replace(point, free=tuple(index for index in point.free if index != drop))
        if not set(nominal.scales) & set(point.free):
            raise DataError(
                "the rotations carry none of the gyroscope's scales: turn the device about each "
                "axis in both senses between still positions, with that axis level"
            )
