"""Algebraic fit: the quadric of least squared value over squared gradient (Taubin 1991).

With ``D(z) = (x², y², z², 2yx, 2zx, 2zy, 2x, 2y, 2z, 1)`` a quadric is ``D·v = 0``. Taubin's ratio
``Σ(D·v)² / Σ|∇(D·v)|²`` is the squared distance to first order, so that unlike ``|v| = 1`` it does
not prefer small ellipsoids; its minimum is an eigenvector.
G. Taubin, IEEE Trans. PAMI 13 (1991) 1115.
"""

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray, IntArray
from imucal_wizard.estimate.ellipsoid.surface import (
    QUADRIC_ENTRIES,
    parameters,
    positive_root,
    symmetric_matrix,
)
from imucal_wizard.estimate.magnitude import TRIANGLE
from imucal_wizard.estimate.method_data import Magnitudes, MethodEstimate
from imucal_wizard.estimate.methods import Method
from imucal_wizard.estimate.result import SensorFit

TERMS = 10
LARGEST_CONDITION = 1e9
"""Condition of the quadric's matrix beyond which the readings lie in a plane."""
_GRADIENTS = np.zeros((3, TERMS, 4))
"""``∂D/∂z_k = G_k (z, 1)``."""
for _term, (_i, _j) in enumerate(QUADRIC_ENTRIES):
    _GRADIENTS[_i, _term, _j] = _GRADIENTS[_j, _term, _i] = 2.0
for _axis in range(3):
    _GRADIENTS[_axis, 6 + _axis, 3] = 2.0


def run(data: Magnitudes) -> SensorFit:
    """Taubin's fit to all samples alike."""
    basis = quadrics(data.free)

    def estimate(points: FloatArray, rows: IntArray) -> MethodEstimate:
        theta = algebraic(np.ascontiguousarray(points[rows].T), basis)
        return MethodEstimate(symmetric_matrix(theta), theta[:3])

    return data.judged("algebraic", estimate)


def algebraic(points: FloatArray, basis: FloatArray | None = None) -> FloatArray:
    """θ of the ellipsoid that fits best, shape (9,).

    Args:
        points: dimensionless readings, shape (3, n).
        basis: columns span the quadrics allowed, shape (10, p), the last the constant alone; all
            of them by default.

    Raises:
        DataError: the samples do not determine a quadric, or it is no ellipsoid.
    """
    basis = np.eye(TERMS) if basis is None else basis
    sums = quadric_moments(points)
    # the products with the constant, 2x, 2y, 2z and 1 are what the gradient needs
    first = sums[6:, 6:] / np.outer((2.0, 2.0, 2.0, 1.0), (2.0, 2.0, 2.0, 1.0))
    slope = basis.T @ sum(g @ first @ g.T for g in _GRADIENTS) @ basis
    values = basis.T @ sums @ basis
    last = values[-1]
    # the constant has no gradient: it is what makes the mean value zero
    inner = values[:-1, :-1] - np.outer(last[:-1], last[:-1]) / last[-1]
    try:
        lower = np.linalg.cholesky(slope[:-1, :-1])
    except np.linalg.LinAlgError:
        raise DataError(_PLANE) from None
    half = np.linalg.solve(lower, inner)
    _, vectors = np.linalg.eigh(np.linalg.solve(lower, half.T))
    found = np.linalg.solve(lower.T, vectors[:, 0])
    quadric = basis @ np.append(found, -(last[:-1] @ found) / last[-1])
    return _ellipsoid(np.asarray(quadric, float))


def quadric_moments(points: FloatArray) -> FloatArray:
    """Sums of the products of D's terms, additive over samples, shape (10, 10).

    Args:
        points: dimensionless readings, shape (3, n).
    """
    terms = np.empty((TERMS, points.shape[1]))
    for term, (i, j) in enumerate(QUADRIC_ENTRIES):
        np.multiply(points[i], points[j], out=terms[term])
    terms[3:6] *= 2.0
    terms[6:9] = 2.0 * points
    terms[9] = 1.0
    return np.asarray(terms @ terms.T)


def quadrics(places: tuple[int, ...]) -> FloatArray:
    """Quadrics of a model with the free places of θ: all, diagonal, or a sphere (10, p).

    Args:
        places: free parameters, the off-diagonal ones are 4, 5 and 7.
            Without any scale (3, 6, 8) the three squares have one coefficient.
    """
    columns = []
    for term, (i, j) in enumerate(QUADRIC_ENTRIES):
        if 3 + TRIANGLE.index((i, j)) in places:
            columns.append(np.eye(TERMS)[term])
    if 3 not in places:
        columns.append(np.eye(TERMS)[:3].sum(axis=0))
    return np.column_stack([*columns, *np.eye(TERMS)[6:]])


def _ellipsoid(quadric: FloatArray) -> FloatArray:
    matrix = np.empty((3, 3))
    for value, (i, j) in zip(quadric[:6], QUADRIC_ENTRIES, strict=True):
        matrix[i, j] = matrix[j, i] = value
    if np.trace(matrix) < 0.0:
        matrix, quadric = -matrix, -quadric
    if np.linalg.cond(matrix) > LARGEST_CONDITION:
        raise DataError(_PLANE)
    centre = -np.linalg.solve(matrix, quadric[6:9])
    size = float(centre @ matrix @ centre - quadric[9])
    return parameters(positive_root(matrix / size), np.asarray(centre, float))


_PLANE = (
    "the readings lie in a plane or on a line: a single circle is not enough. Turn the device "
    "about its other axes too"
)

METHODS = (
    Method(
        "algebraic",
        ("accelerometer", "magnetometer"),
        "quadric of least value over gradient (Taubin)",
        "",
        run,
    ),
)
