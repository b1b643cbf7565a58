"""Calibration from a known magnitude: ``|M (y − b)| = g`` with M upper triangular.

The nine numbers are kept in a form free of units and offsets, ``z = (y − centre) / span``, so that
raw counts around 32768 and m/s² are solved with the same accuracy.
"""

import numpy as np

from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import sphere_through

TRIANGLE = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
"""Places of the six entries of a triangular or symmetric matrix, in the order of the parameters."""


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

    def theta(self, matrix: FloatArray, bias: FloatArray) -> FloatArray:
        """The dimensionless parameters of ``M``, upper triangular, and ``b``, shape (9,)."""
        scaled = matrix * self.span / self.magnitude
        return np.concatenate([(bias - self.centre) / self.span, in_triangle(scaled)])


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


def up_moved(up: FloatArray, mode: FloatArray) -> FloatArray:
    """Up with an accelerometer that is wrong so: not of length one, both of shape (n, 3).

    Args:
        up: unit up, shape (n, 3).
        mode: change of what is corrected by three biases and six entries of a triangular matrix,
            in units of gravity and rad, shape (9,).
    """
    return np.asarray(up + mode[:3] + up @ triangle(mode).T)


def up_changes(up: FloatArray, modes: FloatArray) -> FloatArray:
    """Change of unit up, (n, 3), with each of k such modes, (9, k), shape (n, 3, k)."""
    out = np.zeros((*up.shape, modes.shape[1]))
    for place, mode in enumerate(modes.T):
        out[:, :, place] = unit_vectors(up_moved(up, mode)) - up
    return out


def in_triangle(matrix: FloatArray) -> FloatArray:
    """The six entries of an upper-triangular matrix, in the order of θ."""
    return np.array([matrix[i, j] for i, j in TRIANGLE])


def calibrated_points(theta: FloatArray, points: FloatArray) -> FloatArray:
    """Corrected vectors in units of the magnitude, shape (n, 3)."""
    return (points - theta[:3]) @ triangle(theta).T


def residuals(theta: FloatArray, points: FloatArray) -> FloatArray:
    """``|x| − 1`` of each point, in units of the magnitude, shape (n,)."""
    return np.asarray(np.linalg.norm(calibrated_points(theta, points), axis=1)) - 1.0


def sphere(problem: Problem) -> FloatArray:
    """Parameters of the sphere nearest to the points, by linear least squares, shape (9,).

    Raises:
        DataError: the points lie in a plane or do not bend like a sphere.
    """
    found = sphere_through(problem.points)
    if found is None:
        raise DataError(
            "the still positions do not surround the sensor: their readings lie in one plane. "
            "Hold the device still with each of its six faces up"
        )
    centre, square = found
    theta = np.zeros(9)
    theta[:3] = centre
    theta[[3, 6, 8]] = 1.0 / np.sqrt(square)
    return theta
