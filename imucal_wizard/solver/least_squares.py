"""The default fit: weighted least squares on ``|x| − g``, Levenberg–Marquardt, analytic Jacobian.

SciPy's ``least_squares`` does the same, but importing it alone costs more than the whole fit of a
recording, and every leave-one-out fit repeats it.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.magnitude import jacobian, residuals

MAX_ITERATIONS = 100
TOLERANCE = 1e-12


@dataclass(frozen=True, eq=False)
class Solution:
    """Where a minimiser stopped.

    Attributes:
        theta: parameters, shape (9,).
        iterations: steps taken.
        cost: value of the cost there.
    """

    theta: FloatArray
    iterations: int
    cost: float


def least_squares(
    points: FloatArray, start: FloatArray, basis: FloatArray, weights: FloatArray
) -> Solution:
    """Minimise ``Σ (w (|x| − 1))²`` over the parameters that ``basis`` frees.

    Args:
        points: dimensionless readings, shape (n, 3).
        start: parameters to start from; what ``basis`` does not free stays there, shape (9,).
        basis: columns span the free directions of the parameters, shape (9, p).
        weights: square roots of the weights, shape (n,).

    Raises:
        DataError: it does not converge.
    """
    theta = start.copy()
    residual = weights * residuals(theta, points)
    cost = float(residual @ residual)
    damping = 1e-9
    for iteration in range(1, MAX_ITERATIONS + 1):
        columns = (weights[:, None] * jacobian(theta, points)) @ basis
        normal, slope = columns.T @ columns, columns.T @ residual
        while True:
            damped = normal + damping * np.diag(np.diag(normal) + 1e-300)
            step = basis @ -np.linalg.lstsq(damped, slope, rcond=None)[0]
            tried = weights * residuals(theta + step, points)
            new_cost = float(tried @ tried)
            if new_cost <= cost or np.abs(step).max() < TOLERANCE:
                break
            damping *= 10.0
            if damping > 1e12:
                raise DataError(_NO_CONVERGENCE)
        done = np.abs(step).max() < TOLERANCE
        if new_cost <= cost:
            theta, residual, cost = theta + step, tried, new_cost
            damping = max(damping / 10.0, 1e-15)
        if done:
            return Solution(theta, iteration, cost)
    # near a perfect fit, steps bounce at rounding level; a stall there is convergence
    if np.abs(step).max() < 1e-8:
        return Solution(theta, MAX_ITERATIONS, cost)
    raise DataError(_NO_CONVERGENCE)


_NO_CONVERGENCE = (
    "the fit of the accelerometer does not converge: some still positions are not of one gravity. "
    "Check the residual of each hold and measure the worst again"
)
