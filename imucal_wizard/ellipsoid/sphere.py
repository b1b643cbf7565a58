"""A sphere to start from, whatever there is to lay it through."""

import numpy as np

from imucal_wizard.ellipsoid.shape import parameters
from imucal_wizard.readings import FloatArray

RIDGE = 0.003
"""Mean square, in spans, below which the points say nothing of the centre in that direction."""
SMALLEST, LARGEST = 0.01, 10.0
"""Radius in spans: beyond, the points lie in one place or on a line."""


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
    if not SMALLEST**2 < radius < LARGEST**2:
        return None
    return parameters(np.eye(3) / np.sqrt(radius), centre)
