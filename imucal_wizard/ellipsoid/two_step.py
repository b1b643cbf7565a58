"""N's two-step estimate: a sphere, then the matrix about its centre (figure 2).

Both steps are linear, ``|z|² = 2 z·V₀ + (S² − |V₀|²)`` and ``dᵀ W⁻² d = S²``, and neither is what
noise and a strong soft iron ask for: the first takes the ellipsoid for a sphere, and what it errs
the second cannot repair.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.ellipsoid.algebraic import PLACES
from imucal_wizard.ellipsoid.shape import parameters, root
from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray

RANK = 1e-6


@dataclass(frozen=True, eq=False)
class TwoStep:
    """N's figure 6.

    Attributes:
        magnitude: ``S``, in the samples' unit.
        offset: ``V₀``, shape (3,).
        matrix: ``W⁻¹``, symmetric, shape (3, 3).
    """

    magnitude: float
    offset: FloatArray
    matrix: FloatArray

    @property
    def theta(self) -> FloatArray:
        """The same with the magnitude taken into the matrix, shape (9,)."""
        return parameters(self.matrix / self.magnitude, self.offset)


def two_step(points: FloatArray, cross: bool = True) -> TwoStep:
    """N's estimate from samples, shape (3, n).

    Args:
        points: samples, in any unit.
        cross: whether the products, and so ``w₄`` to ``w₆``, are fitted; N leaves them at zero
            where few orientations are there (VII-A).

    Raises:
        DataError: the samples lie in a plane, or bend like no ellipsoid.
    """
    offset, magnitude = sphere(points)
    square = magnitude**2
    centred = points - offset[:, None]
    places = PLACES if cross else PLACES[:3]
    products = np.array([centred[i] * centred[j] for i, j in places])
    beta = _solve(products, np.full(points.shape[1], square))
    matrix = np.zeros((3, 3))
    for value, (i, j) in zip(beta, places, strict=False):
        matrix[i, j] = matrix[j, i] = value if i == j else value / 2.0
    return TwoStep(magnitude, offset, root(matrix))


def sphere(points: FloatArray) -> tuple[FloatArray, float]:
    """Step 1: centre, shape (3,), and radius of the sphere through samples, shape (3, n).

    Raises:
        DataError: the samples lie in a plane.
    """
    columns = np.concatenate([points, np.ones((1, points.shape[1]))])
    beta = _solve(columns, np.einsum("in,in->n", points, points))
    centre = beta[:3] / 2.0
    square = float(beta[3] + centre @ centre)
    if not square > 0.0:
        raise DataError(_NO_SPHERE)
    return centre, float(np.sqrt(square))


def _solve(columns: FloatArray, wanted: FloatArray) -> FloatArray:
    """N's ``(x'x)⁻¹ x'y``, refused where ``x'x`` has no inverse."""
    normal = columns @ columns.T
    scale = np.sqrt(np.diag(normal))
    if (scale == 0.0).any():
        raise DataError(_NO_SPHERE)
    even = normal / np.outer(scale, scale)
    if np.linalg.eigvalsh(even)[0] < RANK**2:
        raise DataError(_NO_SPHERE)
    return np.asarray(np.linalg.solve(even, columns @ wanted / scale) / scale)


_NO_SPHERE = (
    "the readings do not surround a centre: they lie in a plane or near one point. Turn the device "
    "about all of its axes"
)
