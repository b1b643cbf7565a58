"""The gyroscope's default fit: nine gains and three biases in the accelerometer's frame.

Still means say the bias, rotations say the gains and a little of the bias; both are fitted
together, each weighed by its own scatter.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.closure import (
    BIAS,
    MATRIX,
    SIZE,
    Turns,
    errors,
)
from imucal_wizard.solver.gains import Nominal, not_carried
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
    inverted,
    moved_by,
    point_at,
    rotation_data,
)

MAX_ITERATIONS = 40
CLOSING_AT_FIRST = 0.01
"""Closure error that the first step expects, rad; every later step takes it from the data."""
SMALLEST_CLOSING = 1e-9
SMALLEST_STEP = 1e-5
"""Relative change of a gain, or of a bias in its standard deviations, that no longer matters."""


@dataclass(frozen=True, eq=False)
class VectorFit:
    """The nine-parameter fit.

    Attributes:
        matrix: M, rad/s per reading, shape (3, 3).
        bias: b, reading units, shape (3,).
        covariance: of the nine entries of M by rows and the biases, shape (12, 12).
        closure: closure error of each rotation, rad, shape (m, 3).
        held_out: the same with each rotation left out in turn, or None.
        drops: how much the sum of squared closures falls without each, rad², shape (m,).
        dropped: names of the gains not carried, left at their nominal value.
        nominal: which sensor axis feels each body axis, and which gains are scales.
        iterations: Gauss–Newton steps.
        degrees_of_freedom: two closures per rotation, less the gains fitted.
    """

    matrix: FloatArray
    bias: FloatArray
    covariance: FloatArray
    closure: FloatArray
    held_out: FloatArray | None
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
) -> VectorFit:
    """Fit M and b to rotations and still means.

    Args:
        turns: the rotations.
        stills: mean reading of each hold, shape (n, 3).
        still_floor: standard deviation of such a mean from noise alone, shape (3,).
        start: M to start from, shape (3, 3).
        nominal: what a gain is that the rotations do not carry.

    Raises:
        DataError: the rotations do not carry the scales, or the fit does not converge.
    """
    data = rotation_data(turns, stills, still_floor, start)
    free = tuple(range(SIZE))
    matrix, bias, iterations = start, stills.mean(axis=0), 0
    while True:
        matrix = nominal.filled(matrix, free)
        point, taken = _minimise(data, matrix, bias, free)
        iterations += taken
        covariance, blind = covariance_of(data, point)
        drop = not_carried(covariance[MATRIX, MATRIX] / data.gain**2, blind[MATRIX], free, nominal)
        if drop is None:
            break
        nominal.check(drop)
        free = tuple(index for index in free if index != drop)
        matrix, bias = point.matrix, point.bias
    return VectorFit(
        point.matrix,
        point.bias,
        covariance + frame_covariance(data, point),
        point.at.errors,
        held_out(data, point),
        drops(data, point),
        tuple(nominal.parameter(index) for index in range(9) if index not in free),
        nominal,
        iterations,
        freedom(turns, free),
    )


def _minimise(
    data: RotationData, matrix: FloatArray, bias: FloatArray, free: tuple[int, ...]
) -> tuple[Point, int]:
    """Gauss–Newton with halving, and how many steps it took."""
    point = point_at(data, matrix, bias, CLOSING_AT_FIRST, free)
    for iteration in range(1, MAX_ITERATIONS + 1):
        step = np.zeros(SIZE)
        normal, slope = point.normal(data, point.columns(data))
        step[list(free)] = -inverted(normal)[0] @ slope
        size = _length(data, point, step)
        moved = moved_by(data, point, size * step)
        squares = float((moved.at.errors**2).sum())
        closing = np.sqrt(squares / max(freedom(data.turns, free), 1))
        closing = max(float(closing), SMALLEST_CLOSING)
        settled = abs(closing - point.closing) < 1e-3 * point.closing
        point = Point(moved.matrix, moved.bias, moved.at, closing, free)
        if settled and np.abs(size * step).max() < SMALLEST_STEP:
            return point, iteration
    raise DataError(
        "the fit of the gyroscope does not converge: check that its columns, unit and sampling "
        "rate are right"
    )


def _length(data: RotationData, point: Point, step: FloatArray) -> float:
    """The largest of 1, ½, ¼ … of the step that does not raise the cost."""
    change = step * data.units
    value = _cost(data, point, point.at.errors, point.bias)
    size = 1.0
    while size > 1e-4 and np.abs(size * step).max() > SMALLEST_STEP:
        bias = point.bias + size * change[BIAS]
        matrix = point.matrix + size * change[MATRIX].reshape(3, 3)
        if _cost(data, point, errors(data.turns, matrix, bias), bias) <= value * (1.0 + 1e-9):
            break
        size /= 2.0
    return size


def _cost(data: RotationData, point: Point, closure: FloatArray, bias: FloatArray) -> float:
    still = (data.stills - bias) / data.still_sigma
    return float((closure**2).sum()) / point.closing**2 + float((still**2).sum())
