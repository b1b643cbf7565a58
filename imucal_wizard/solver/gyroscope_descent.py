"""The descent of the gyroscope's fit: damped Gauss–Newton, scatter found on the way."""

from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.closure import SIZE, errors
from imucal_wizard.solver.gains import CROSS_PRIOR, SCALE_PRIOR
from imucal_wizard.solver.rotation_data import Point, RotationData, inverted, moved_by

MAX_ITERATIONS = 40
SMALLEST_CLOSING = 1e-9
SMALLEST_DECREASE = 1e-6
"""Fall of the cost, in units of one degree of freedom, that no longer matters: it moves no
parameter by more than a thousandth of its standard error."""
PRIOR = np.array([SCALE_PRIOR if i in (0, 4, 8) else CROSS_PRIOR for i in range(9)] + 3 * [np.inf])
PRIOR = PRIOR**-2.0
"""Weight of the datasheets in a first fit that only decides what the rotations carry."""
DAMPING = PRIOR / 100.0


def minimise(data: RotationData, point: Point, prior: FloatArray) -> tuple[Point, int]:
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
