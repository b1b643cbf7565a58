"""What is left at its nominal value, counted in the standard errors of what is fitted.

Soft iron that the directions do not carry is left at none, but no sensor has none. What it is
moves the parameters fitted beside it: with rows ``J``, weights ``W``, free directions ``B`` and the
others ``C``, an error ``δ`` along ``C`` moves the fit by

    B δ_B = −B (Bᵀ Jᵀ W J B)⁻¹ Bᵀ Jᵀ W J C δ.
"""

import numpy as np

from imucal_wizard.ellipsoid.shape import SIZE, symmetric_matrix
from imucal_wizard.readings import FloatArray

SOFT_IRON = 0.05
"""Standard deviation of the soft iron's entries on boards; N's figure 7 has 0.06, 0.04 and 0.03."""


def with_nominal(
    covariance: FloatArray, theta: FloatArray, normal: FloatArray, basis: FloatArray
) -> FloatArray:
    """Covariance of θ that counts what the model leaves at its nominal value.

    Args:
        covariance: of θ by noise alone, shape (9, 9).
        theta: shape (9,).
        normal: weighted normal matrix of all nine parameters, shape (9, 9).
        basis: free directions of θ, shape (9, p).

    Returns:
        Shape (9, 9).
    """
    left = _complement(basis)
    if not left.shape[1]:
        return covariance
    pulled = np.linalg.solve(basis.T @ normal @ basis, basis.T @ normal @ left)
    moved = left - basis @ pulled
    size = SOFT_IRON * float(np.trace(symmetric_matrix(theta))) / 3.0
    return np.asarray(covariance + size**2 * moved @ moved.T)


def _complement(basis: FloatArray) -> FloatArray:
    """Orthonormal directions that the basis does not free, shape (9, 9 − p)."""
    vectors, _, _ = np.linalg.svd(basis, full_matrices=True)
    return np.asarray(vectors[:, basis.shape[1] : SIZE])
