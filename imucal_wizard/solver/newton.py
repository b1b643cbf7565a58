"""Q's method: Newton with back-tracking on the squared error of the squared magnitude (eq. 11–12).

``G = Σ (|x|² − 1)²`` with ``x = M (z − b)``, M upper triangular. With the six entries and three
biases as parameters, ``h = |x|²`` has the derivatives

    ∂h/∂b = −2 Mᵀx                    ∂²h/∂b∂b = 2 MᵀM
    ∂h/∂M_ij = 2 x_i d_j              ∂²h/∂M_ij∂M_kl = 2 δ_ik d_j d_l
    ∂²h/∂M_ij∂b_k = −2 (M_ik d_j + x_i δ_jk)          with d = z − b

and ``∇G = 2 Σ e ∇h``, ``∇²G = 2 Σ (∇h ∇hᵀ + e ∇²h)`` with ``e = h − 1``.
"""

import numpy as np

from imucal_wizard.ellipsoid.shape import TRIANGLE
from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.least_squares import TOLERANCE, Solution
from imucal_wizard.solver.magnitude import SIZE, corrected, triangle

MAX_ITERATIONS = 100
SMALLEST_SIZE = 1e-10


def cost(theta: FloatArray, points: FloatArray) -> float:
    """Q's cost, eq. 11, in units of the magnitude."""
    error = (corrected(theta, points) ** 2).sum(axis=1) - 1.0
    return float(error @ error)


def gradient_and_hessian(theta: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """∇G, shape (9,), and ∇²G, shape (9, 9)."""
    offsets = points - theta[:3]
    matrix = triangle(theta)
    vectors = offsets @ matrix.T
    error = (vectors**2).sum(axis=1) - 1.0
    slope = np.empty((len(points), SIZE))
    slope[:, :3] = -2.0 * vectors @ matrix
    for place, (row, column) in enumerate(TRIANGLE):
        slope[:, 3 + place] = 2.0 * vectors[:, row] * offsets[:, column]
    curvature = _curvature(error, offsets, vectors, matrix)
    return 2.0 * slope.T @ error, 2.0 * (slope.T @ slope + curvature)


def _curvature(
    error: FloatArray, offsets: FloatArray, vectors: FloatArray, matrix: FloatArray
) -> FloatArray:
    """``Σ e ∇²h``, shape (9, 9)."""
    out = np.zeros((SIZE, SIZE))
    out[:3, :3] = 2.0 * error.sum() * matrix.T @ matrix
    sum_offsets = error @ offsets
    sum_vectors = error @ vectors
    outer = (offsets * error[:, None]).T @ offsets
    for a, (i, j) in enumerate(TRIANGLE):
        cross = -2.0 * matrix[i] * sum_offsets[j]
        cross[j] -= 2.0 * sum_vectors[i]
        out[3 + a, :3] = out[:3, 3 + a] = cross
        for b, (k, m) in enumerate(TRIANGLE):
            if i == k:
                out[3 + a, 3 + b] = 2.0 * outer[j, m]
    return out


def newton(points: FloatArray, start: FloatArray, basis: FloatArray) -> Solution:
    """Minimise Q's cost over the parameters that ``basis`` frees.

    Where the Hessian is not positive definite its eigenvalues are taken by magnitude, so that every
    step goes downhill; back-tracking halves it until the cost falls (Armijo).

    Args:
        points: dimensionless readings, shape (n, 3).
        start: parameters to start from, shape (9,).
        basis: free directions, shape (9, p).

    Raises:
        DataError: it does not converge.
    """
    theta = start.copy()
    value = cost(theta, points)
    for iteration in range(1, MAX_ITERATIONS + 1):
        gradient, hessian = gradient_and_hessian(theta, points)
        slope = basis.T @ gradient
        step = -_downhill(basis.T @ hessian @ basis, slope)
        move = basis @ step
        # the cost is known to rounding only; without this slack the last steps are refused
        rounding = 8.0 * np.finfo(float).eps * np.sqrt(len(points) * value)
        size = 1.0
        while cost(theta + size * move, points) > value + 1e-4 * size * slope @ step + rounding:
            size /= 2.0
            if size < SMALLEST_SIZE:
                raise DataError(_NO_CONVERGENCE)
        theta = theta + size * move
        value = cost(theta, points)
        if np.abs(move).max() < TOLERANCE:
            return Solution(theta, iteration, value)
    raise DataError(_NO_CONVERGENCE)


def _downhill(curvature: FloatArray, slope: FloatArray) -> FloatArray:
    """Newton's step with the curvature's eigenvalues taken by magnitude."""
    values, vectors = np.linalg.eigh(curvature)
    floor = 1e-12 * np.abs(values).max()
    return np.asarray(vectors @ ((vectors.T @ slope) / np.maximum(np.abs(values), floor)))


_NO_CONVERGENCE = (
    "Newton's method does not converge from the start values; repeat the up/down positions, or use "
    "the method least_squares"
)
