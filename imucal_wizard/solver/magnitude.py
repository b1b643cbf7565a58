"""Calibration from a known magnitude: ``|M (y − b)| = g`` with M upper triangular.

The nine numbers are kept in a form free of units and offsets, ``z = (y − centre) / span``, so that
raw counts around 32768 and m/s² are solved with the same accuracy.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.ellipsoid.shape import TRIANGLE
from imucal_wizard.readings import FloatArray

SIZE = 9
SHORTEST = 1e-12
"""A vector shorter than this, in units of the magnitude, has no direction and pulls nowhere."""
BIAS = (0, 1, 2)
SCALE = (3, 6, 8)
NON_ORTHOGONALITY = (4, 5, 7)


@dataclass(frozen=True, eq=False)
class Problem:
    """Means of holds made dimensionless, and how to get back.

    Attributes:
        points: dimensionless readings ``z``, shape (n, 3).
        centre: reading that maps to zero, shape (3,).
        span: reading units per unit of ``z``.
        magnitude: the magnitude the corrected vectors have, SI.
    """

    points: FloatArray
    centre: FloatArray
    span: float
    magnitude: float

    def matrix_and_bias(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """``M`` (SI per reading, shape (3, 3)) and ``b`` (reading, shape (3,))."""
        matrix = triangle(theta) * self.magnitude / self.span
        return matrix, self.centre + self.span * theta[:3]

    def covariance(self, of_theta: FloatArray | None) -> FloatArray | None:
        """Of (b, M's six entries) in reading units and SI per reading, shape (9, 9)."""
        if of_theta is None:
            return None
        scale = np.full(9, self.magnitude / self.span)
        scale[:3] = self.span
        return np.asarray(of_theta * np.outer(scale, scale))


def make_problem(means: FloatArray, magnitude: float) -> Problem:
    """The problem of finding M and b from mean readings, shape (n, 3)."""
    low, high = means.min(axis=0), means.max(axis=0)
    span = float((high - low).max()) / 2.0
    return Problem((means - (low + high) / 2.0) / span, (low + high) / 2.0, span, magnitude)


def triangle(theta: FloatArray) -> FloatArray:
    """The dimensionless upper-triangular matrix, shape (3, 3)."""
    matrix = np.zeros((3, 3))
    matrix[tuple(zip(*TRIANGLE, strict=True))] = theta[3:]
    return matrix


def corrected(theta: FloatArray, points: FloatArray) -> FloatArray:
    """Corrected vectors in units of the magnitude, shape (n, 3)."""
    return (points - theta[:3]) @ triangle(theta).T


def residuals(theta: FloatArray, points: FloatArray) -> FloatArray:
    """``|x| − 1`` of each point, in units of the magnitude, shape (n,)."""
    return np.asarray(np.linalg.norm(corrected(theta, points), axis=1)) - 1.0


def jacobian(theta: FloatArray, points: FloatArray) -> FloatArray:
    """Derivative of ``residuals`` with respect to the nine parameters, shape (n, 9).

    With ``u = x/|x|``: ∂|x|/∂b = −uᵀM and ∂|x|/∂M_ij = u_i (z − b)_j.
    """
    offsets = points - theta[:3]
    vectors = corrected(theta, points)
    lengths = np.linalg.norm(vectors, axis=1)
    unit = vectors / np.maximum(lengths, SHORTEST)[:, None]
    columns = np.empty((len(points), SIZE))
    columns[:, :3] = -unit @ triangle(theta)
    for place, (row, column) in enumerate(TRIANGLE):
        columns[:, 3 + place] = unit[:, row] * offsets[:, column]
    return columns
