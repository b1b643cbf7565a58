"""The orthogonal fit: least squares of the distances to the ellipsoid, free of their bias by noise.

The distance of a sample to first order is ``(|x| − 1)/|Px/|x||`` with ``x = P (z − b)`` (Sampson).
Noise of variance σ² in each axis moves a sample along the surface too, and since the surface bends
away this makes the mean of ``|x|`` too long by

    σ² (‖P‖² − |Pu|²) / 2,      u = x/|x|,  ‖P‖² = tr PPᵀ,

which is taken off. All derivatives and weights are taken at the foot of each sample on the
ellipsoid, whose error is independent of the distance; taken at the sample itself they would
correlate with it, and with many samples that bias exceeds the standard error.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.ellipsoid.shape import SIZE, TRIANGLE, symmetric_matrix
from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray

MAX_ITERATIONS = 25
TOLERANCE = 1e-6
"""Steps below this share of a standard error change nothing that can be known."""
FARTHEST = 1e6
"""No centre and no axis is so many times the readings' span away from them."""


@dataclass(frozen=True, eq=False)
class Rows:
    """The linear problem at one θ.

    Attributes:
        distance: of each sample from the ellipsoid, dimensionless, outside positive, shape (n,).
        slope: derivative of the distance by θ, shape (9, n).
    """

    distance: FloatArray
    slope: FloatArray


def rows(theta: FloatArray, points: FloatArray, variance: float) -> Rows:
    """Distances and their derivatives.

    Args:
        theta: parameters, shape (9,).
        points: dimensionless readings, shape (3, n).
        variance: σ² of the noise in each axis, dimensionless.
    """
    matrix = symmetric_matrix(theta)
    offsets = points - theta[:3, None]
    vectors = matrix @ offsets
    lengths = np.sqrt(np.einsum("in,in->n", vectors, vectors))
    error = lengths - 1.0
    normal = matrix @ (vectors / np.maximum(lengths, 1e-12))
    offsets -= normal * (error / np.einsum("in,in->n", normal, normal))
    vectors = matrix @ offsets
    vectors /= np.sqrt(np.einsum("in,in->n", vectors, vectors))
    normal = matrix @ vectors
    steep = np.einsum("in,in->n", normal, normal)
    inverse = 1.0 / np.sqrt(steep)
    error -= 0.5 * variance * (float((matrix**2).sum()) - steep)
    vectors *= inverse
    slope = np.empty((SIZE, points.shape[1]))
    np.multiply(normal, -inverse, out=slope[:3])
    for place, (i, j) in enumerate(TRIANGLE, 3):
        np.multiply(vectors[i], offsets[j], out=slope[place])
        if i != j:
            slope[place] += vectors[j] * offsets[i]
    return Rows(error * inverse, slope)


def orthogonal(points: FloatArray, start: FloatArray) -> FloatArray:
    """θ, shape (9,), that minimises the sum of squared distances (Gauss–Newton).

    The variance of the noise is that of the distances.

    Args:
        points: dimensionless readings, shape (3, n).
        start: θ to start from, shape (9,).

    Raises:
        DataError: it does not converge.
    """
    theta, variance = start.copy(), 0.0
    for _ in range(MAX_ITERATIONS):
        now = rows(theta, points, variance)
        normal = now.slope @ now.slope.T
        try:
            step = np.linalg.solve(normal, now.slope @ now.distance)
        except np.linalg.LinAlgError:
            raise DataError(_NO_CONVERGENCE) from None
        theta = theta - step
        variance = float(now.distance @ now.distance) / max(len(now.distance) - SIZE, 1)
        if not np.abs(theta).max() < FARTHEST:
            break
        # the step in standard errors: its square is the drop of the sum of squares over σ²
        if step @ normal @ step <= TOLERANCE**2 * variance + 1e-24:
            return theta
    raise DataError(_NO_CONVERGENCE)


_NO_CONVERGENCE = (
    "the fit does not converge: the readings are not of one constant field. Measure again, away "
    "from iron, magnets and loudspeakers, and turn the device through all directions"
)
