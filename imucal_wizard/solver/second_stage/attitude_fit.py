"""The gyroscope's nine gains and biases from the closures by both references."""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.closure import MATRIX, SIZE
from imucal_wizard.solver.second_stage.references import Closed, References, closed

MAX_ITERATIONS = 60
TOLERANCE = 1e-4
"""A step of so many standard errors is the last."""
SMALLEST = 1e-9
NOT_CARRIED = 0.02
"""Standard error of a gain, as a share of the overall gain, from which it is not carried."""
FEWEST_SPARE = 3
KIND = [0, 0, 0, 1]
"""Which of the four closures of a turn are across the vertical, and which is about it."""


@dataclass(frozen=True, eq=False)
class AttitudeFit:
    """The gyroscope by both references.

    Attributes:
        matrix: M, rad/s per reading, in the accelerometer's frame, shape (3, 3).
        bias: b, reading units, shape (3,).
        covariance: of M's entries by rows and b, shape (12, 12).
        tilt: closure across the vertical of each rotation, rad, shape (m,).
        heading: closure about the vertical, rad, shape (m,).
        tilt_held_out: the same with each rotation left out in turn, shape (m,).
        heading_held_out: the same of the heading.
        degrees_of_freedom: three closures per rotation, less the nine gains.
    """

    matrix: FloatArray
    bias: FloatArray
    covariance: FloatArray
    tilt: FloatArray
    heading: FloatArray
    tilt_held_out: FloatArray
    heading_held_out: FloatArray
    degrees_of_freedom: int


def fit_attitude(
    data: References,
    stills: FloatArray,
    still_sigma: FloatArray,
    matrix: FloatArray,
    bias: FloatArray,
) -> AttitudeFit:
    """Fit M and b to the closures and the still means.

    Args:
        data: the rotations.
        stills: mean reading of each hold, shape (n, 3).
        still_sigma: scatter of such a mean, shape (3,).
        matrix: M to start from.
        bias: b to start from.

    Raises:
        DataError: the rotations do not carry the nine gains, or the fit does not converge.
    """
    gain = float(np.linalg.norm(matrix)) / np.sqrt(3.0)
    units = np.concatenate([np.full(9, gain), still_sigma])
    tilt_variance = heading_variance = 1e-4
    for _ in range(MAX_ITERATIONS):
        at = closed(data, matrix, bias)
        problem = _Problem(
            at, data.spread, stills, still_sigma, bias, units, tilt_variance, heading_variance
        )
        step = -np.linalg.solve(problem.normal, problem.slope)
        matrix = matrix + (units[MATRIX] * step[MATRIX]).reshape(3, 3)
        bias = bias + units[9:] * step[9:]
        before = tilt_variance, heading_variance
        # half way, by their logarithms: taken whole, the two may swing for ever
        tilt_new, heading_new = problem.variances()
        tilt_variance = float(np.sqrt(tilt_variance * tilt_new))
        heading_variance = float(np.sqrt(heading_variance * heading_new))
        settled = abs(tilt_variance - before[0]) < 1e-3 * before[0]
        settled &= abs(heading_variance - before[1]) < 1e-3 * before[1]
        if settled and step @ problem.normal @ step < TOLERANCE**2 * SIZE:
            return _fit(data, matrix, bias, stills, still_sigma, units, before)
    raise DataError("the gyroscope's fit with both references does not converge")


class _Problem:
    """The weighted linear problem at one calibration, in dimensionless parameters."""

    def __init__(
        self,
        at: Closed,
        spread: FloatArray,
        stills: FloatArray,
        still_sigma: FloatArray,
        bias: FloatArray,
        units: FloatArray,
        tilt_variance: float,
        heading_variance: float,
    ) -> None:
        slopes = np.concatenate([at.tilt_slope, at.heading_slope[:, None]], axis=1)
        scale = spread[:, KIND]
        self.rows = slopes * units / scale[:, :, None]
        self.errors = np.concatenate([at.tilt, at.heading[:, None]], axis=1) / scale
        self.weights = 1.0 / np.array([*3 * [tilt_variance], heading_variance])
        self.tilt_normal = np.einsum("mip,miq->pq", self.rows[:, :3], self.rows[:, :3])
        self.tilt_normal *= self.weights[0]
        self.heading_normal = self.rows[:, 3].T @ self.rows[:, 3] * self.weights[3]
        self.normal = self.tilt_normal + self.heading_normal
        self.slope = np.einsum("mip,mi,i->p", self.rows, self.errors, self.weights)
        # the biases' unit is the scatter of a still mean: n of them weigh n
        self.normal[range(9, 12), range(9, 12)] += len(stills)
        self.slope[9:] += ((bias - stills) / still_sigma).sum(axis=0)
        if np.linalg.eigvalsh(self.normal)[0] < 1e-9 * np.linalg.eigvalsh(self.normal)[-1]:
            raise DataError(_BLIND)

    def variances(self) -> tuple[float, float]:
        """Of a component of the tilt's closure, and of the heading's, where the spread is 1.

        Each kind of closure has lost as many degrees of freedom as it has decided parameters.
        """
        inverse = np.linalg.inv(self.normal)
        count = len(self.errors)
        tilt_free = max(2.0 * count - float(np.trace(inverse @ self.tilt_normal)), 1.0)
        heading_free = max(count - float(np.trace(inverse @ self.heading_normal)), 1.0)
        tilt = float((self.errors[:, :3] ** 2).sum()) / tilt_free
        heading = float((self.errors[:, 3] ** 2).sum()) / heading_free
        return max(tilt, SMALLEST**2), max(heading, SMALLEST**2)


def _fit(
    data: References,
    matrix: FloatArray,
    bias: FloatArray,
    stills: FloatArray,
    still_sigma: FloatArray,
    units: FloatArray,
    variances: tuple[float, float],
) -> AttitudeFit:
    at = closed(data, matrix, bias)
    problem = _Problem(at, data.spread, stills, still_sigma, bias, units, *variances)
    inverse = np.linalg.inv(problem.normal)
    freedom = 3 * len(data) - 9
    if freedom < FEWEST_SPARE or np.sqrt(np.diag(inverse)[MATRIX]).max() > NOT_CARRIED:
        raise DataError(_BLIND)
    out = np.empty_like(problem.errors)
    root = np.sqrt(problem.weights)
    for k, (row, error) in enumerate(zip(problem.rows, problem.errors, strict=True)):
        weighted = row * root[:, None]
        left = np.eye(4) - weighted @ inverse @ weighted.T
        out[k] = np.linalg.lstsq(left, error * root, rcond=1e-6)[0] / root
        out[k] *= data.spread[k, KIND]
    return AttitudeFit(
        matrix,
        bias,
        inverse * np.outer(units, units),
        np.linalg.norm(at.tilt, axis=1),
        at.heading,
        np.linalg.norm(out[:, :3], axis=1),
        out[:, 3],
        freedom,
    )


_BLIND = (
    "the rotations do not carry the gyroscope's nine gains with both references either: turn the "
    "device about each of its axes, in both senses"
)
