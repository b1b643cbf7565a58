"""The ellipsoid on which readings of a constant vector lie: ``|P (z − b)| = 1``, P symmetric.

This is N's model ``S = W⁻¹ (S_p − V₀)`` (eq. 4 and 7) with the magnitude taken into the matrix. The
readings are made dimensionless first, ``z = (y − centre) / span``, so that counts and µT are solved
with the same accuracy.
"""

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.magnitude import TRIANGLE

ELLIPSOID_SIZE = 9
"""Parameters θ: three biases, then P's xx, xy, xz, yy, yz, zz."""
ROWS = tuple(i for i, _ in TRIANGLE)
COLUMNS = tuple(j for _, j in TRIANGLE)
QUADRIC_ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Matrix entries in the order of N's figure 2 and of the algebraic fit: squares, then products."""
SHORTEST_VECTOR = 1e-12
"""Length of a vector, in units of the magnitude, below which it has no direction."""
RIDGE = 0.003
"""Mean square, in spans, below which the points say nothing of the centre in that direction."""
SMALLEST_RADIUS, LARGEST_RADIUS = 0.01, 10.0
"""Radius in spans: beyond, the points lie in one place or on a line."""
ORTHOGONAL_ITERATIONS = 25
LAST_ORTHOGONAL_STEP = 1e-6
"""Steps below this share of a standard error change nothing that can be known."""
FARTHEST_CENTRE = 1e6
"""No centre and no axis is so many times the readings' span away from them."""


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
        raise DataError("the sensor always sends the same value: it is missing or asleep")
    centre = 0.5 * (low + high)
    columns -= centre[:, None]
    columns /= span
    return Cloud(columns, centre, span)


def symmetric_matrix(theta: FloatArray) -> FloatArray:
    """P from its parameters, shape (3, 3)."""
    xx, xy, xz, yy, yz, zz = theta[3:]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def radius_of(theta: FloatArray) -> float:
    """Radius of the sphere of the same volume, dimensionless."""
    return float(abs(np.linalg.det(symmetric_matrix(theta))) ** (-1.0 / 3.0))


def parameters(matrix: FloatArray, bias: FloatArray) -> FloatArray:
    """θ from P and b, shape (9,)."""
    return np.concatenate([bias, matrix[ROWS, COLUMNS]])


def locate(theta: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How far each sample is from the ellipsoid, and in which direction it lies.

    Returns:
        Distances to first order, ``(|x| − 1)/|P u|``, shape (n,), and the unit vectors
        ``u = x/|x|`` with ``x = P (z − b)``, shape (3, n).
    """
    matrix = symmetric_matrix(theta)
    vectors = matrix @ (points - theta[:3, None])
    lengths = np.sqrt(np.einsum("in,in->n", vectors, vectors))
    vectors /= np.maximum(lengths, SHORTEST_VECTOR)
    normal = matrix @ vectors
    lengths -= 1.0
    lengths /= np.sqrt(np.einsum("in,in->n", normal, normal))
    return lengths, vectors


def positive_root(square: FloatArray) -> FloatArray:
    """The symmetric positive root of a symmetric matrix.

    Raises:
        DataError: it has none: the surface that fits best is no ellipsoid.
    """
    values, vectors = np.linalg.eigh(square)
    if not values[0] > 1e-9 * values[-1]:
        raise DataError(
            "no ellipsoid fits the readings: they are not curved in all directions. Turn the "
            "device through all directions, away from iron and magnets"
        )
    return np.asarray((vectors * np.sqrt(values)) @ vectors.T)


def sphere_near(points: FloatArray) -> FloatArray | None:
    """θ of a sphere through dimensionless readings; across a plane its centre stays in it.

    Args:
        points: shape (3, n), about zero.

    Returns:
        None where nothing bends.
    """
    columns = np.concatenate([points, np.ones((1, points.shape[1]))])
    ridge = np.diag([RIDGE, RIDGE, RIDGE, 0.0]) * points.shape[1]
    square = np.einsum("in,in->n", points, points)
    beta = np.linalg.solve(columns @ columns.T + ridge, columns @ square)
    centre = beta[:3] / 2.0
    radius = float(beta[3] + centre @ centre)
    if not SMALLEST_RADIUS**2 < radius < LARGEST_RADIUS**2:
        return None
    return parameters(np.eye(3) / np.sqrt(radius), centre)


@dataclass(frozen=True, eq=False)
class Distances:
    """Distances of samples from the ellipsoid of one θ.

    Attributes:
        distance: of each sample from the ellipsoid, dimensionless, outside positive, shape (n,).
        slope: derivative of the distance by θ, shape (9, n).
        seen: directions of the samples as ``locate`` gives them, unit vectors, shape (3, n).
    """

    distance: FloatArray
    slope: FloatArray
    seen: FloatArray


def distances(theta: FloatArray, points: FloatArray, variance: FloatArray | float) -> Distances:
    """Distances and their derivatives, free of the bias by noise.

    To first order the distance of a sample is ``(|x| − 1)/|Pu|`` with ``x = P (z − b)`` and
    ``u = x/|x|`` (Sampson). Noise of variance σ² in each axis moves a sample along the surface too,
    and since the surface bends away this makes the mean of ``|x|`` too long by
    ``σ² (tr PPᵀ − |Pu|²)/2``, which is taken off. The derivatives are those at the foot of the
    sample on the ellipsoid, whose error is independent of the distance; at the sample itself they
    would correlate with it, and with many samples that bias exceeds the standard error.

    Args:
        theta: parameters, shape (9,).
        points: dimensionless readings, shape (3, n).
        variance: σ² of the noise in each axis, dimensionless, shape (n,) or of all.
    """
    matrix = symmetric_matrix(theta)
    offsets = points - theta[:3, None]
    vectors = matrix @ offsets
    lengths = np.sqrt(np.einsum("in,in->n", vectors, vectors))
    error = lengths - 1.0
    seen = vectors / np.maximum(lengths, SHORTEST_VECTOR)
    normal = matrix @ seen
    offsets -= normal * (error / np.einsum("in,in->n", normal, normal))
    vectors = matrix @ offsets
    vectors /= np.sqrt(np.einsum("in,in->n", vectors, vectors))
    normal = matrix @ vectors
    steep = np.einsum("in,in->n", normal, normal)
    inverse = 1.0 / np.sqrt(steep)
    error -= 0.5 * variance * (float((matrix**2).sum()) - steep)
    vectors *= inverse
    slope = np.empty((ELLIPSOID_SIZE, points.shape[1]))
    np.multiply(normal, -inverse, out=slope[:3])
    for place, (i, j) in enumerate(TRIANGLE, 3):
        np.multiply(vectors[i], offsets[j], out=slope[place])
        if i != j:
            slope[place] += vectors[j] * offsets[i]
    return Distances(error * inverse, slope, seen)


def orthogonal(
    points: FloatArray, start: FloatArray, noise: FloatArray | float = 1.0
) -> FloatArray:
    """θ, shape (9,), that minimises the sum of squared distances over noise (Gauss–Newton).

    The variance of the noise is that of the distances.

    Args:
        points: dimensionless readings, shape (3, n).
        start: θ to start from, shape (9,).
        noise: standard deviations of the distances up to a common factor, shape (n,), or of all.

    Raises:
        DataError: it does not converge.
    """
    theta, factor = start.copy(), 0.0
    share = np.asarray(noise / np.mean(noise), np.float64)
    for _ in range(ORTHOGONAL_ITERATIONS):
        now = distances(theta, points, factor * share**2)
        error, slope = now.distance / share, now.slope / share
        normal = slope @ slope.T
        try:
            step = np.linalg.solve(normal, slope @ error)
        except np.linalg.LinAlgError:
            raise DataError(_NO_CONVERGENCE) from None
        theta = theta - step
        factor = float(error @ error) / max(len(error) - ELLIPSOID_SIZE, 1)
        if not np.abs(theta).max() < FARTHEST_CENTRE:
            break
        # the step in standard errors: its square is the drop of the sum of squares over σ²
        if step @ normal @ step <= LAST_ORTHOGONAL_STEP**2 * factor + 1e-24:
            return theta
    raise DataError(_NO_CONVERGENCE)


_NO_CONVERGENCE = (
    "the fit does not converge: the readings are not of one constant field. Measure again, away "
    "from iron, magnets and loudspeakers, and turn the device through all directions"
)
