"""Tilt-compensated magnetic heading, and how well it is known.

North is the field's part across the vertical, ``n = m − u (u·m)``, east is ``n × u``; the heading
of the body's x axis is ``atan2(x·east, x·north)``, clockwise from magnetic north. Where x stands
upright there is none.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from imucal_wizard.readings import FloatArray

UPRIGHT = np.cos(np.radians(25.0))
"""The x axis nearer to the vertical than this has no heading worth a number."""


@dataclass(frozen=True, eq=False)
class Bearings:
    """Tilt-compensated heading of the x axis for each pair of readings.

    Attributes:
        before: by the readings as they come, rad; NaN where x is upright.
        after: by the calibration, rad.
        error: standard deviation by what is not known of the calibration, rad.
    """

    before: FloatArray
    after: FloatArray
    error: FloatArray


def heading(up: FloatArray, field: FloatArray) -> FloatArray:
    """Heading of the body's x axis, rad from −π to π; NaN where x is upright.

    Args:
        up: up in the body frame, any length, shape (n, 3).
        field: field in the same frame, any length, shape (n, 3).
    """
    unit = up / np.linalg.norm(up, axis=1)[:, None]
    north = field - unit * (unit * field).sum(axis=1)[:, None]
    east = np.cross(north, unit)
    value = np.arctan2(east[:, 0], north[:, 0])
    return np.asarray(np.where(np.abs(unit[:, 0]) > UPRIGHT, np.nan, value))


def heading_error(
    of: Callable[[FloatArray], FloatArray], theta: FloatArray, covariance: FloatArray
) -> FloatArray:
    """Standard deviation of each heading by what is not known of the calibration, rad, (n,).

    Args:
        of: headings from the parameters.
        theta: parameters.
        covariance: of them.
    """
    scale = np.sqrt(np.diag(covariance))
    columns = []
    for place in np.flatnonzero(scale):
        step = np.zeros_like(theta)
        step[place] = 1e-2 * scale[place]
        columns.append(turned(of(theta + step), of(theta - step)) / (2.0 * step[place]))
    slope = np.array(columns).T
    seen = covariance[np.ix_(scale > 0.0, scale > 0.0)]
    return np.asarray(np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", slope, seen, slope), 0.0)))


def turned(after: FloatArray, before: FloatArray) -> FloatArray:
    """From one heading to another the short way, rad."""
    return np.asarray(np.angle(np.exp(1j * (after - before))))
