"""Newton's method on the squared error of the squared magnitude (Q, eq. 7–12).

The parameters X are the three biases and the six entries of ``M = K T``, upper triangular (eq. 7
lists seven unknowns; k_xz and k_yz are missing there). A calibrated reading is
``h(z, X) = M (z − b)`` (eq. 8), and with readings in units of the magnitude the cost is

    G(X) = Σ e²,    e = |h|² − 1                                                 (11)

whose derivatives follow from those of ``q = |h|²``, with ``d = z − b``:

    ∂q/∂b = −2 Mᵀh                    ∂²q/∂b∂b = 2 MᵀM
    ∂q/∂M_ij = 2 h_i d_j              ∂²q/∂M_ij∂M_kl = 2 δ_ik d_j d_l
    ∂²q/∂M_ij∂b_k = −2 (M_ik d_j + h_i δ_jk)

    ∇G = 2 Σ e ∇q                     ∇²G = 2 Σ (∇q ∇qᵀ + e ∇²q)

Newton's step ``X ← X − t (∇²G)⁻¹ ∇G`` (eq. 12) starts from the six positions, and back-tracking
halves t until the cost falls.
"""

import contextlib

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray, IntArray
from imucal_wizard.estimate.magnitude import (
    TRIANGLE,
    calibrated_points,
    in_triangle,
    triangle,
)
from imucal_wizard.estimate.method_data import Magnitudes, MethodEstimate
from imucal_wizard.estimate.methods import Method
from imucal_wizard.estimate.methods.six_position import from_faces
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.identifiability import SIZE

NEWTON_ITERATIONS = 100
LAST_NEWTON_STEP = 1e-12
"""Largest change of a parameter, in units of the magnitude, after which the iteration ends."""
SMALLEST_BACKTRACK = 1e-10
"""Share of Newton's step below which back-tracking has failed."""
ARMIJO = 1e-4
"""Share of the decrease that the slope promises which a step must bring."""


def run(data: Magnitudes) -> SensorFit:
    """Newton's method from Q's up/down start, or from a sphere where a face is missing."""
    start = data.start
    with contextlib.suppress(DataError):
        six = from_faces(data, data.points, np.arange(len(data.points)))
        start = np.concatenate([six.bias, in_triangle(six.matrix)])
    basis = np.eye(SIZE)[:, list(data.free)]

    def estimate(points: FloatArray, rows: IntArray) -> MethodEstimate:
        theta, iterations = newton(points[rows], start, basis)
        return MethodEstimate(triangle(theta), theta[:3], iterations)

    return data.judged("newton", estimate)


def newton(points: FloatArray, start: FloatArray, basis: FloatArray) -> tuple[FloatArray, int]:
    """Minimise eq. 11 over the parameters that ``basis`` frees.

    Where the Hessian is not positive definite its eigenvalues are taken by magnitude, so that every
    step goes downhill.

    Args:
        points: readings in units of the magnitude, shape (n, 3).
        start: X to start from, shape (9,).
        basis: free directions of X, shape (9, p).

    Returns:
        X and the number of iterations.

    Raises:
        DataError: it does not converge.
    """
    theta = start.copy()
    value = cost(theta, points)
    for iteration in range(1, NEWTON_ITERATIONS + 1):
        gradient, hessian = gradient_and_hessian(theta, points)
        slope = basis.T @ gradient
        values, vectors = np.linalg.eigh(basis.T @ hessian @ basis)
        curvature = np.maximum(np.abs(values), 1e-12 * np.abs(values).max())
        step = -vectors @ ((vectors.T @ slope) / curvature)  # Eq. 12
        move = basis @ step
        # the cost is known to rounding only; without this slack the last steps are refused
        rounding = 8.0 * np.finfo(float).eps * np.sqrt(len(points) * value)
        size = 1.0
        while cost(theta + size * move, points) > value + ARMIJO * size * slope @ step + rounding:
            size /= 2.0
            if size < SMALLEST_BACKTRACK:
                raise DataError(_NO_CONVERGENCE)
        theta = theta + size * move
        value = cost(theta, points)
        if np.abs(move).max() < LAST_NEWTON_STEP:
            return theta, iteration
    raise DataError(_NO_CONVERGENCE)


def cost(theta: FloatArray, points: FloatArray) -> float:
    """G(X), eq. 11, in units of the magnitude."""
    error = (calibrated_points(theta, points) ** 2).sum(axis=1) - 1.0
    return float(error @ error)


def gradient_and_hessian(theta: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """∇G, shape (9,), and ∇²G, shape (9, 9)."""
    offsets, matrix = points - theta[:3], triangle(theta)
    vectors = offsets @ matrix.T
    error = (vectors**2).sum(axis=1) - 1.0
    slope = np.empty((len(points), SIZE))
    slope[:, :3] = -2.0 * vectors @ matrix
    for place, (i, j) in enumerate(TRIANGLE, 3):
        slope[:, place] = 2.0 * vectors[:, i] * offsets[:, j]

    # Σ e ∇²q
    curvature = np.zeros((SIZE, SIZE))
    curvature[:3, :3] = 2.0 * error.sum() * matrix.T @ matrix
    sum_offsets, sum_vectors = error @ offsets, error @ vectors
    outer = (offsets * error[:, None]).T @ offsets
    for row, (i, j) in enumerate(TRIANGLE, 3):
        cross = -2.0 * matrix[i] * sum_offsets[j]
        cross[j] -= 2.0 * sum_vectors[i]
        curvature[row, :3] = curvature[:3, row] = cross
        for column, (k, m) in enumerate(TRIANGLE, 3):
            if i == k:
                curvature[row, column] = 2.0 * outer[j, m]
    return 2.0 * slope.T @ error, 2.0 * (slope.T @ slope + curvature)


_NO_CONVERGENCE = (
    "Newton's method does not converge from the start values; repeat the up/down positions, or use "
    "the method least_squares"
)

METHODS = (
    Method("newton", ("accelerometer",), "Newton on squared magnitudes (eq. 9–12)", "Q", run),
)
