"""N's numerical estimate: quasi-Newton on the rms of ``|W⁻¹ (S_p − V₀)| − S`` (figures 3 and 4).

``S`` and the start ``V₀`` are those of the two-step estimate, ``W⁻¹`` starts at the identity. Every
sample counts the same, so the fit follows the directions that hold more of them (N, VII-C).
"""

import numpy as np

from imucal_wizard.ellipsoid.shape import COLUMNS, ROWS, parameters, symmetric_matrix
from imucal_wizard.ellipsoid.two_step import TwoStep
from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray

MAX_ITERATIONS = 2000
CROSS = (4, 5, 7)


def numeric(points: FloatArray, start: TwoStep, cross: bool = True) -> tuple[FloatArray, int]:
    """N's estimate from samples, shape (3, n), in units near 1.

    Args:
        points: samples.
        start: where ``V₀`` and ``S`` are taken from.
        cross: whether ``w₄`` to ``w₆`` are free.

    Returns:
        θ with ``|P (z − b)| = 1``, shape (9,), and how many iterations it took.

    Raises:
        DataError: it does not converge.
    """
    from scipy.optimize import minimize

    free = np.ones(9, bool)
    free[list(CROSS)] = cross
    theta = parameters(np.eye(3), start.offset)
    # figure 4 divides nothing by S; doing it here changes no minimum and keeps the steps near 1
    size = start.magnitude

    def freed(x: FloatArray) -> tuple[float, FloatArray]:
        theta[free] = x
        value, slope = performance(theta, points, size)
        return value, slope[free]

    found = minimize(
        freed,
        theta[free].copy(),
        jac=True,
        method="BFGS",
        options={"maxiter": MAX_ITERATIONS, "gtol": 1e-9},
    )
    theta[free] = found.x
    _, slope = performance(theta, points, size)
    if not np.abs(slope[free]).max() < 1e-4:
        raise DataError(
            "the numeric method does not converge: the readings are not of one field; use the "
            "method orthogonal"
        )
    matrix = symmetric_matrix(theta) / size
    if not np.linalg.eigvalsh(matrix)[0] > 0.0:
        raise DataError("the numeric method ended at a matrix that turns directions around")
    return parameters(matrix, theta[:3]), int(found.nit)


def performance(
    theta: FloatArray, points: FloatArray, magnitude: float
) -> tuple[float, FloatArray]:
    """Figure 4 in units of the magnitude, and its derivative, shape (9,)."""
    offsets = points - theta[:3, None]
    matrix = symmetric_matrix(theta)
    vectors = matrix @ offsets
    lengths = np.sqrt(np.einsum("in,in->n", vectors, vectors))
    error = lengths / magnitude - 1.0
    value = float(np.sqrt(error @ error / len(error)))
    pull = vectors * (error / np.maximum(lengths, 1e-12))
    outer = pull @ offsets.T
    slope = np.empty(9)
    slope[:3] = -matrix @ pull.sum(axis=1)
    slope[3:] = (outer + outer.T - np.diag(np.diag(outer)))[ROWS, COLUMNS]
    return value, slope / (len(error) * magnitude * max(value, 1e-12))
