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


def orthogonal(
    points: FloatArray,
    start: FloatArray,
    basis: FloatArray,
    weights: FloatArray | None = None,
    variance: float | None = None,
) -> tuple[FloatArray, Rows, int]:
    """Minimise ``Σ w·distance²`` over the parameters that ``basis`` frees (Gauss–Newton).

    Args:
        points: dimensionless readings, shape (3, n).
        start: parameters to start from, shape (9,); what ``basis`` does not free stays there.
        basis: free directions of the parameters, shape (9, p).
        weights: of each sample, shape (n,); all alike by default.
        variance: σ² of the noise in each axis; by default what the distances scatter.

    Returns:
        θ, the rows at the last step but one (θ moved by less than the tolerance since), and the
        number of iterations.

    Raises:
        DataError: it does not converge.
    """
    theta, known = start.copy(), variance or 0.0
    free = basis.shape[1]
    for iteration in range(1, MAX_ITERATIONS + 1):
        now = rows(theta, points, known)
        slope = basis.T @ now.slope if free < SIZE else now.slope
        weighted = slope if weights is None else slope * weights
        normal = weighted @ slope.T
        try:
            step = np.linalg.solve(normal, weighted @ now.distance)
        except np.linalg.LinAlgError:
            raise DataError(_NO_CONVERGENCE) from None
        theta = theta - basis @ step
        scatter = float(now.distance @ now.distance) / max(len(now.distance) - free, 1)
        if variance is None:
            known = scatter
        if not np.abs(theta).max() < FARTHEST:
            break
        # the step in standard errors: its square is the drop of the sum of squares over σ²
        if step @ normal @ step <= TOLERANCE**2 * scatter + 1e-24:
            return theta, now, iteration
    raise DataError(_NO_CONVERGENCE)


_NO_CONVERGENCE = (
    "the fit does not converge: the readings are not of one constant field. Measure again, away "
    "from iron, magnets and loudspeakers, and turn the device through all directions"
)
