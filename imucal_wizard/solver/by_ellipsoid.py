"""The accelerometer by the ellipsoid methods of the magnetometer: one model for all (N, IV).

N's matrix is symmetric and this sensor's triangular; the two are the same calibration in another
gauge, and ``gauge.triangular`` converts.
"""

from dataclasses import replace

import numpy as np

from imucal_wizard.ellipsoid.algebraic import algebraic, quadrics
from imucal_wizard.ellipsoid.numeric import numeric
from imucal_wizard.ellipsoid.shape import TRIANGLE, symmetric_matrix
from imucal_wizard.ellipsoid.two_step import two_step
from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.carried import ANGLES, EDGES_OF, Carried, basis_of
from imucal_wizard.solver.gauge import triangular
from imucal_wizard.solver.least_squares import Solution
from imucal_wizard.solver.magnitude import BIAS, NON_ORTHOGONALITY, SCALE, residuals

ELLIPSOID_METHODS = ("algebraic", "two-step", "numeric")


def by_ellipsoid(method: str, points: FloatArray, places: tuple[int, ...]) -> Solution:
    """The upper-triangular calibration that an ellipsoid method finds.

    Args:
        method: one of ``ELLIPSOID_METHODS``.
        points: dimensionless means of holds, shape (n, 3).
        places: free parameters; all nine, or bias and scale.

    Raises:
        DataError: the points carry no ellipsoid.
    """
    columns, cross = np.ascontiguousarray(points.T), set(NON_ORTHOGONALITY) <= set(places)
    iterations = 1
    if method == "algebraic":
        found = algebraic(columns, quadrics(places))
    else:
        start = two_step(columns, cross)
        found = start.theta
        if method == "numeric":
            found, iterations = numeric(columns, start, cross)
    theta = np.empty(9)
    theta[:3] = found[:3]
    matrix = triangular(symmetric_matrix(found))[1]
    theta[3:] = [matrix[i, j] for i, j in TRIANGLE]
    errors = residuals(theta, points)
    return Solution(theta, iterations, float(errors @ errors))


def all_or_no_angles(carried: Carried) -> Carried:
    """What N's model, which has all off-diagonal terms or none (VII-A), makes of what is carried.

    Raises:
        DataError: not even a scale for each axis is carried.
    """
    if not set(SCALE) <= set(carried.places):
        raise DataError(
            "the still positions do not carry a scale for each axis, which this method needs: hold "
            "the device still with each of its six faces up, or use least_squares"
        )
    if set(NON_ORTHOGONALITY) <= set(carried.places) or not set(carried.places) & set(
        NON_ORTHOGONALITY
    ):
        return carried
    between = "; ".join(EDGES_OF[place] for place in NON_ORTHOGONALITY)
    places = (*BIAS, *SCALE)
    return replace(
        carried,
        basis=basis_of(places),
        places=places,
        terms=("bias", "scale"),
        dropped=tuple(ANGLES.values()),
        reason="not all angles are carried, and this method has all of them or none: left at zero. "
        f"Add holds with the edges between these faces on top: {between}",
    )
