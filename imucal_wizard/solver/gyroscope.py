"""The gyroscope's default fit: nine gains and three biases in the accelerometer's frame.

Still means say the bias, rotations say the gains and a little of the bias; both are fitted
together, each weighed by its own scatter.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.closure import BIAS, MATRIX, SIZE, Turns, errors, errors_and_jacobian

MAX_ITERATIONS = 40
CROSS_PRIOR = 0.02
"""Cross-axis gain of MEMS gyroscopes, one standard deviation (datasheets: 1–2 %)."""
SCALE_PRIOR = 0.05
"""Scale error, one standard deviation (datasheets: 1–4 %)."""
CARRIED_SHARE = 0.5
"""A gain is carried when the data know it at least twice as well as a datasheet does."""
NAMES = tuple(f"{row}{column}" for row in "xyz" for column in "xyz")
DIAGONAL = (0, 4, 8)


@dataclass(frozen=True, eq=False)
class VectorFit:
    """The nine-parameter fit.

    Attributes:
        matrix: M, rad/s per reading, shape (3, 3).
        bias: b, reading units, shape (3,).
        covariance: of the nine entries of M by rows and the biases, shape (12, 12).
        closure: closure error of each rotation, rad, shape (m, 3).
        held_out: the same with each rotation left out in turn, or None.
        dropped: gains not carried, by axes (``xy`` …), left at their nominal value.
        iterations: Gauss–Newton steps.
    """

    matrix: FloatArray
    bias: FloatArray
    covariance: FloatArray
    closure: FloatArray
    held_out: FloatArray | None
    dropped: tuple[str, ...]
    iterations: int


@dataclass(frozen=True, eq=False)
class _Data:
    """Rotations and still means, with the units that make the parameters dimensionless."""

    turns: Turns
    stills: FloatArray
    still_sigma: FloatArray
    gain: float

    @property
    def units(self) -> FloatArray:
        """What one unit of each dimensionless parameter is, shape (12,)."""
        return np.concatenate([np.full(9, self.gain), self.still_sigma])


def fit_vector(
    turns: Turns, stills: FloatArray, still_floor: FloatArray, start: FloatArray, nominal: bool
) -> VectorFit:
    """Fit M and b to rotations and still means.

    Args:
        turns: the rotations.
        stills: mean reading of each hold, shape (n, 3).
        still_floor: standard deviation of such a mean from noise alone, shape (3,).
        start: M to start from, shape (3, 3).
        nominal: the readings are in rad/s, so that a scale the data do not carry is 1.

    Raises:
        DataError: the rotations do not carry the scales, or the fit does not converge.
    """
    scatter = stills.std(axis=0, ddof=1) if len(stills) > 2 else still_floor
    sigma = np.maximum(scatter, still_floor)
    gain = 1.0 if nominal else _gain(start)
    tiny = 1e-9 * max(float(np.abs(stills).max()), 1e-9)
    data = _Data(turns, stills, np.maximum(sigma, tiny), gain)
    matrix, bias = start, stills.mean(axis=0)
    free = list(range(SIZE))
    for _ in range(10):
        matrix = _with_nominal(matrix, free, gain)
        matrix, bias, closing, iterations = _minimise(data, matrix, bias, free)
        covariance, blind = _covariance(data, matrix, bias, free, closing)
        drop = _not_carried(covariance, blind, free, gain)
        if drop is None:
            break
        if drop in DIAGONAL and not nominal:
            raise DataError(
                f"the rotations do not carry the gyroscope's scale about {NAMES[drop][0]}: turn "
                "the device about each axis in both senses, with that axis level"
            )
        free.remove(drop)
    dropped = tuple(NAMES[index] for index in range(9) if index not in free)
    closure, _ = errors_and_jacobian(turns, matrix, bias)
    held_out = _held_out(data, matrix, bias, free, closing)
    return VectorFit(matrix, bias, covariance, closure, held_out, dropped, iterations)


def _gain(matrix: FloatArray) -> float:
    """The overall scale of a matrix, whatever the order and sign of its axes."""
    return float(np.linalg.norm(matrix) / np.sqrt(3.0))


def _with_nominal(matrix: FloatArray, free: Sequence[int], gain: float) -> FloatArray:
    nominal = (gain * np.eye(3)).ravel()
    flat = [matrix.ravel()[i] if i in free else nominal[i] for i in range(9)]
    return np.array(flat).reshape(3, 3)


def _minimise(
    data: _Data, matrix: FloatArray, bias: FloatArray, free: Sequence[int]
) -> tuple[FloatArray, FloatArray, float, int]:
    """Gauss–Newton with halving; also the rms closure per component that weighs the rotations."""
    closing = 0.01
    value = np.inf
    for iteration in range(1, MAX_ITERATIONS + 1):
        normal, slope, squares, _ = _normal(data, matrix, bias, closing)
        freedom = max(2 * len(data.turns) - sum(i < 9 for i in free), 1)
        step = np.zeros(SIZE)
        step[free] = -np.linalg.lstsq(normal[np.ix_(free, free)], slope[free], rcond=1e-12)[0]
        change = step * data.units
        size = 1.0
        value = _cost(data, matrix, bias, closing)
        while size > 1e-4:
            trial = matrix + size * change[MATRIX].reshape(3, 3), bias + size * change[BIAS]
            if _cost(data, *trial, closing) <= value * (1.0 + 1e-9):
                break
            size /= 2.0
        matrix, bias = trial
        squares = float((errors(data.turns, matrix, bias) ** 2).sum())
        newer = max(float(np.sqrt(squares / freedom)), 1e-9)
        settled = abs(newer - closing) < 1e-3 * closing
        closing = newer
        if settled and np.abs(size * step[free]).max() < 1e-5:
            return matrix, bias, closing, iteration
    raise DataError(
        "the fit of the gyroscope does not converge: check that its columns, unit and sampling "
        "rate are right"
    )


def _cost(data: _Data, matrix: FloatArray, bias: FloatArray, closing: float) -> float:
    closure = errors(data.turns, matrix, bias) / closing
    still = (data.stills - bias) / data.still_sigma
    return float((closure**2).sum() + (still**2).sum())


def _normal(
    data: _Data, matrix: FloatArray, bias: FloatArray, closing: float
) -> tuple[FloatArray, FloatArray, float, FloatArray]:
    """Normal matrix (12, 12), gradient (12,), sum of squared closures, Jacobian (m, 3, 12)."""
    closure, jacobian = errors_and_jacobian(data.turns, matrix, bias)
    columns = (jacobian * data.units).reshape(-1, SIZE) / closing
    normal = columns.T @ columns
    slope = columns.T @ closure.ravel() / closing
    normal[BIAS, BIAS] += len(data.stills) * np.eye(3)
    slope[BIAS] -= ((data.stills - bias) / data.still_sigma).sum(axis=0)
    return normal, slope, float((closure**2).sum()), jacobian


def _covariance(
    data: _Data, matrix: FloatArray, bias: FloatArray, free: Sequence[int], closing: float
) -> tuple[FloatArray, FloatArray]:
    """Covariance of the twelve parameters, and which dimensionless ones are not determined."""
    normal = _normal(data, matrix, bias, closing)[0][np.ix_(free, free)]
    values, vectors = np.linalg.eigh(normal)
    seen = values > 1e-10 * values[-1]
    inverse = (vectors[:, seen] / values[seen]) @ vectors[:, seen].T
    blind = np.zeros(SIZE)
    blind[list(free)] = (vectors[:, ~seen] ** 2).sum(axis=1)
    covariance = np.zeros((SIZE, SIZE))
    covariance[np.ix_(free, free)] = inverse
    return covariance * np.outer(data.units, data.units), blind


def _not_carried(
    covariance: FloatArray, blind: FloatArray, free: Sequence[int], gain: float
) -> int | None:
    """The gain that the data know worst against what a datasheet says, if it is not carried."""
    sigma = np.sqrt(np.diag(covariance)[MATRIX]) / gain
    prior = np.full(9, CROSS_PRIOR)
    prior[list(DIAGONAL)] = SCALE_PRIOR
    share = np.where(blind[MATRIX] > 1e-3, np.inf, sigma / prior)
    candidates = [index for index in range(9) if index in free]
    if not candidates:
        return None
    # cross-axis gains go before scales: a scale is what the rotations were made for
    worst = max(candidates, key=lambda index: (share[index], index not in DIAGONAL))
    return worst if share[worst] > CARRIED_SHARE else None


def _held_out(
    data: _Data, matrix: FloatArray, bias: FloatArray, free: Sequence[int], closing: float
) -> FloatArray | None:
    """Closure error of each rotation under the fit of all others, rad, shape (m, 3).

    The fit without one rotation is one Gauss–Newton step from the fit of all; the step is so small
    that the next one would change the error by its square. The error itself is then integrated
    anew. None where leaving one out leaves too few.
    """
    turns = data.turns
    gains = sum(index < 9 for index in free)
    if 2 * (len(turns) - 1) <= gains:
        return None
    normal, slope, _, jacobian = _normal(data, matrix, bias, closing)
    closure = errors(turns, matrix, bias)
    matrices, biases = np.empty((len(turns), 3, 3)), np.empty((len(turns), 3))
    for index in range(len(turns)):
        columns = jacobian[index] * data.units / closing
        less = (normal - columns.T @ columns)[np.ix_(free, free)]
        rest = (slope - columns.T @ closure[index] / closing)[list(free)]
        values = np.linalg.eigvalsh(less)
        if values[0] < 1e-10 * values[-1]:
            return None
        step = np.zeros(SIZE)
        step[list(free)] = -np.linalg.solve(less, rest)
        change = step * data.units
        matrices[index] = matrix + change[MATRIX].reshape(3, 3)
        biases[index] = bias + change[BIAS]
    return errors(turns, matrices, biases)
