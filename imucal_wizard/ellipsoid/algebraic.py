"""The algebraic fit: the quadric of least squared value over squared gradient (Taubin 1991).

With ``D(z) = (x², y², z², 2yx, 2zx, 2zy, 2x, 2y, 2z, 1)`` a quadric is ``D·v = 0``. Taubin's ratio
``Σ(D·v)² / Σ|∇(D·v)|²`` is the squared distance to first order, so that unlike ``|v| = 1`` it does
not prefer small ellipsoids; its minimum is an eigenvector.
G. Taubin, IEEE Trans. PAMI 13 (1991) 1115.
"""

import numpy as np

from imucal_wizard.ellipsoid.shape import TRIANGLE, parameters, root
from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray

TERMS = 10
PLACES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Entries of the quadric's matrix in the order of D."""


def _gradients() -> FloatArray:
    """``∂D/∂z_k = G_k (z, 1)``, shape (3, 10, 4)."""
    out = np.zeros((3, TERMS, 4))
    for term, (i, j) in enumerate(PLACES):
        out[i, term, j] = out[j, term, i] = 2.0
    for axis in range(3):
        out[axis, 6 + axis, 3] = 2.0
    return out


_GRADIENTS = _gradients()


def moments(points: FloatArray) -> FloatArray:
    """Sums of the products of D's terms, additive over samples, shape (10, 10).

    Args:
        points: dimensionless readings, shape (3, n).
    """
    terms = np.empty((TERMS, points.shape[1]))
    for term, (i, j) in enumerate(PLACES):
        np.multiply(points[i], points[j], out=terms[term])
    terms[3:6] *= 2.0
    terms[6:9] = 2.0 * points
    terms[9] = 1.0
    return np.asarray(terms @ terms.T)


def from_moments(sums: FloatArray, basis: FloatArray | None = None) -> FloatArray:
    """θ of the quadric that fits best, shape (9,).

    Args:
        sums: see ``moments``.
        basis: columns span the quadrics allowed, shape (10, p), the last the constant alone; all
            of them by default.

    Raises:
        DataError: the samples do not determine a quadric, or it is no ellipsoid.
    """
    basis = np.eye(TERMS) if basis is None else basis
    # the products with the constant, 2x, 2y, 2z and 1 are the moments that the gradient needs
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


def algebraic(points: FloatArray, basis: FloatArray | None = None) -> FloatArray:
    """θ of the ellipsoid through dimensionless readings, shape (3, n); see ``from_moments``."""
    return from_moments(moments(points), basis)


def quadrics(places: tuple[int, ...]) -> FloatArray:
    """Quadrics of a model with the free places of θ: all, diagonal, or a sphere (10, p).

    Args:
        places: free parameters, as in ``solver.carried``; the off-diagonal ones are 4, 5 and 7.
            Without any scale (3, 6, 8) the three squares have one coefficient.
    """
    columns = []
    for term, (i, j) in enumerate(PLACES):
        if 3 + TRIANGLE.index((i, j)) in places:
            columns.append(np.eye(TERMS)[term])
    if 3 not in places:
        columns.append(np.eye(TERMS)[:3].sum(axis=0))
    return np.column_stack([*columns, *np.eye(TERMS)[6:]])


def _ellipsoid(quadric: FloatArray) -> FloatArray:
    matrix = np.empty((3, 3))
    for value, (i, j) in zip(quadric[:6], PLACES, strict=True):
        matrix[i, j] = matrix[j, i] = value
    if np.trace(matrix) < 0.0:
        matrix, quadric = -matrix, -quadric
    if np.linalg.cond(matrix) > 1e9:
        raise DataError(_PLANE)
    centre = -np.linalg.solve(matrix, quadric[6:9])
    size = float(centre @ matrix @ centre - quadric[9])
    return parameters(root(matrix / size), np.asarray(centre, float))


_PLANE = (
    "the readings lie in a plane or on a line: a single circle is not enough. Turn the device "
    "about its other axes too"
)
