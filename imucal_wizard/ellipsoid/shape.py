"""The ellipsoid on which readings of a constant vector lie: ``|P (z − b)| = 1``, P symmetric.

This is N's model ``S = W⁻¹ (S_p − V₀)`` (eq. 4 and 7) with the magnitude taken into the matrix. The
readings are made dimensionless first, ``z = (y − centre) / span``, so that counts and µT are solved
with the same accuracy.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray

TRIANGLE = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
"""Places of the six matrix entries in the parameter vector, after the three biases."""
SIZE = 9
"""Parameters θ: three biases, then P's xx, xy, xz, yy, yz, zz."""
ROWS = tuple(i for i, _ in TRIANGLE)
COLUMNS = tuple(j for _, j in TRIANGLE)


@dataclass(frozen=True, eq=False)
class Cloud:
    """Readings made dimensionless, and how to get back.

    Attributes:
        points: ``z``, one column per sample, shape (3, n).
        centre: reading that maps to zero, shape (3,).
        span: reading units per unit of ``z``.
    """

    points: FloatArray
    centre: FloatArray
    span: float

    def bias(self, theta: FloatArray) -> FloatArray:
        """``b`` in reading units, shape (3,)."""
        return np.asarray(self.centre + self.span * theta[:3])

    def shape(self, theta: FloatArray) -> FloatArray:
        """``P`` per reading unit: ``|P (y − b)| = 1``, shape (3, 3)."""
        return symmetric_matrix(theta) / self.span


def make_cloud(readings: FloatArray) -> Cloud:
    """The dimensionless form of readings, shape (n, 3).

    Raises:
        DataError: all readings are the same.
    """
    columns = np.array(readings.T, order="C")  # a copy, even of readings stored column by column
    low, high = columns.min(axis=1), columns.max(axis=1)
    span = 0.5 * float((high - low).max())
    if not span > 0.0:
        raise DataError("the sensor sends one and the same value: it is not there, or asleep")
    centre = 0.5 * (low + high)
    columns -= centre[:, None]
    columns /= span
    return Cloud(columns, centre, span)


def symmetric_matrix(theta: FloatArray) -> FloatArray:
    """P from its parameters, shape (3, 3)."""
    matrix = np.empty((3, 3))
    matrix[ROWS, COLUMNS] = matrix[COLUMNS, ROWS] = theta[3:]
    return matrix


def radius_of(theta: FloatArray) -> float:
    """Radius of the sphere of the same volume, dimensionless."""
    return float(abs(np.linalg.det(symmetric_matrix(theta))) ** (-1.0 / 3.0))


def parameters(matrix: FloatArray, bias: FloatArray) -> FloatArray:
    """θ from P and b, shape (9,)."""
    return np.concatenate([bias, matrix[ROWS, COLUMNS]])


def errors(theta: FloatArray, points: FloatArray) -> FloatArray:
    """``|P (z − b)| − 1`` of each sample, shape (n,)."""
    vectors = symmetric_matrix(theta) @ (points - theta[:3, None])
    return np.asarray(np.sqrt(np.einsum("in,in->n", vectors, vectors))) - 1.0


def look(theta: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How far each sample is from the ellipsoid, and in which direction it lies.

    Returns:
        Distances to first order, ``(|x| − 1)/|P u|``, shape (n,), and the unit vectors
        ``u = x/|x|`` with ``x = P (z − b)``, shape (3, n).
    """
    matrix = symmetric_matrix(theta)
    vectors = matrix @ (points - theta[:3, None])
    lengths = np.sqrt(np.einsum("in,in->n", vectors, vectors))
    vectors /= np.maximum(lengths, 1e-12)
    normal = matrix @ vectors
    lengths -= 1.0
    lengths /= np.sqrt(np.einsum("in,in->n", normal, normal))
    return lengths, vectors


def root(square: FloatArray) -> FloatArray:
    """The symmetric positive root of a symmetric matrix.

    Raises:
        DataError: it has none: the surface that fits best is no ellipsoid.
    """
    values, vectors = np.linalg.eigh(square)
    if not values[0] > 1e-9 * values[-1]:
        raise DataError(
            "no ellipsoid fits the readings: they do not bend on all sides. Turn the device "
            "through all directions, away from iron and magnets"
        )
    return np.asarray((vectors * np.sqrt(values)) @ vectors.T)
