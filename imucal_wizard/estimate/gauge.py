"""Three forms of one calibration: triangular, symmetric, full.

A magnitude cannot tell ``M`` from ``R M`` with any rotation R, so a calibration from magnitudes
alone needs a convention for the body frame:

* *triangular* (Q, eq. 3–8): ``M = R T`` with T upper triangular; the x axis alone reads an input
  along x, the x and y axes one along y. T of M is the R of a QR decomposition; for the sensitivity
  ``S = M⁻¹`` the same is an RQ decomposition.
* *symmetric* (N, eq. 7): ``M = R P`` with P symmetric, the polar decomposition; the body frame is
  the one nearest to the sensor's axes.
* *full*: the frame is another sensor's, and M any matrix: ``rotation @ form``.

R is always a proper rotation. Left-handed axes (``det M < 0``) show as a negative last scale of T,
or as a negative P.
"""

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray


def triangular(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """``M = R T``.

    Args:
        matrix: M of any form, shape (3, 3).

    Returns:
        R, a rotation from the triangular form's body frame to M's, and T, upper triangular with
        positive scales (the last one negative for left-handed axes).

    Raises:
        DataError: M is singular.
    """
    _check(matrix)
    rotation, triangle = np.linalg.qr(matrix)
    signs = np.where(np.diag(triangle) < 0.0, -1.0, 1.0)
    rotation, triangle = rotation * signs, signs[:, None] * triangle
    if np.linalg.det(rotation) < 0.0:
        rotation[:, 2], triangle[2] = -rotation[:, 2], -triangle[2]
    return rotation, np.triu(triangle)


def symmetric(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """``M = R P``.

    Args:
        matrix: M of any form, shape (3, 3).

    Returns:
        R, a rotation from the symmetric form's body frame to M's, and P, symmetric and positive
        (negative for left-handed axes).

    Raises:
        DataError: M is singular.
    """
    _check(matrix)
    left, values, right = np.linalg.svd(matrix)
    rotation, root = left @ right, (right.T * values) @ right
    if np.linalg.det(rotation) < 0.0:
        rotation, root = -rotation, -root
    return rotation, 0.5 * (root + root.T)


def _check(matrix: FloatArray) -> None:
    values = np.linalg.svd(matrix, compute_uv=False)
    if not np.isfinite(values).all() or values[-1] <= 1e-12 * values[0]:
        raise DataError(
            "the calibration's matrix is singular: an axis does not respond. Check that every "
            "axis is connected, and calibrate again"
        )
