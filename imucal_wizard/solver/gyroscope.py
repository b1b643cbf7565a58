"""The gyroscope's default fit: nine gains and three biases in the accelerometer's frame.

Still means say the bias, rotations say the gains and a little of the bias; both are fitted
together, each weighed by its own scatter.
"""

from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.closure import BIAS, MATRIX, SIZE, Turns, errors
from imucal_wizard.solver.gains import CROSS_PRIOR, SCALE_PRIOR, Nominal, not_carried
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
SMALLEST_DECREASE = 1e-6
"""Fall of the cost, in units of one degree of freedom, that no longer matters: it moves no
parameter by more than a thousandth of its standard error."""
PRIOR = np.array([SCALE_PRIOR if i in (0, 4, 8) else CROSS_PRIOR for i in range(9)] + 3 * [np.inf])
PRIOR = PRIOR**-2.0
"""Weight of the datasheets in a first fit that only decides what the rotations carry."""
DAMPING = PRIOR / 100.0


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
    point, iterations = _minimise(data, point, PRIOR)
    if noise is not None:
        data = _weighed(data, point.closing, noise)
    free = _carried(data, point, nominal)
    while True:
        matrix = nominal.filled(point.matrix, free)
        begin = point_at(data, matrix, point.bias, point.closing, free)
        point, taken = _minimise(data, begin, 0.0 * PRIOR)
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


def _minimise(data: RotationData, point: Point, prior: FloatArray) -> tuple[Point, int]:
    """Gauss–Newton with halving, and how many steps it took.

    Each step is damped as if it began ten datasheet spreads from the truth, so that it does not
    leap along combinations of gains that the rotations hardly show.

    Args:
        data: rotations and still means.
        point: where to begin.
        prior: weight of the distance from there, per squared unit of each parameter, shape (12,).
    """
    free = list(point.free)
    begin, settled = point, False
    for iteration in range(MAX_ITERATIONS):
        step = np.zeros(SIZE)
        normal, slope = point.normal(data, point.columns(data))
        slope = slope + (prior * point.distance(data, begin))[free]
        step[free] = -inverted(normal + np.diag((prior + DAMPING)[free]))[0] @ slope
        decrease = -float(slope @ step[free])
        if settled and decrease < SMALLEST_DECREASE:
            return point, iteration
        size = _length(data, _Hill(begin, prior), point, step, decrease)
        moved = moved_by(data, point, size * step)
        known = normal @ inverted(normal + np.diag(prior[free]))[0]
        closing = _closing(data, moved, float(np.trace(known)))
        settled = abs(closing - point.closing) < 1e-3 * point.closing
        point = replace(moved, closing=closing)
    raise DataError(
        "the fit of the gyroscope does not converge: check that its columns, unit and sampling "
        "rate are right"
    )


def _closing(data: RotationData, point: Point, fitted: float) -> float:
    """Rms closure per component, given how many parameters the data have fitted.

    The three biases are known from the still means and cost the rotations nothing.
    """
    left = max(2.0 * len(data.turns) - max(fitted - 3.0, 0.0), 1.0)
    squares = float((point.errors(data) ** 2).sum()) * point.closing**2
    return max(float(np.sqrt(squares / left)), SMALLEST_CLOSING)


@dataclass(frozen=True, eq=False)
class _Hill:
    """What the cost counts besides the data: the distance from the beginning."""

    begin: Point
    prior: FloatArray


def _length(
    data: RotationData, hill: _Hill, point: Point, step: FloatArray, decrease: float
) -> float:
    """The largest of 1, ½, ¼ … of the step that lowers the cost, or does not matter any more."""
    value = _cost(data, hill, point, point.at.errors)
    size = 1.0
    while size * decrease > SMALLEST_DECREASE:
        trial = point.shifted(data, size * step)
        closure = errors(data.turns, trial.matrix, trial.bias)
        if _cost(data, hill, trial, closure) < value:
            break
        size /= 2.0
    return size


def _cost(data: RotationData, hill: _Hill, point: Point, closure: FloatArray) -> float:
    still = (data.stills - point.bias) / data.still_sigma
    away = hill.prior * point.distance(data, hill.begin) ** 2
    turned = closure / (point.closing * data.spread[:, None])
    return float((turned**2).sum() + (still**2).sum() + away.sum())
