"""A turn as the accelerometer alone saw it: what a doubtful gyroscope is held against."""

import numpy as np

from imucal_wizard.procedure.poses import AXES
from imucal_wizard.procedure.upright import Upright
from imucal_wizard.readings import FloatArray

LEVEL = float(np.sin(np.radians(35.0)))
"""Along its way the axis may be so far from level; a hand's own acceleration is part of it."""
MOSTLY = 0.8
"""Share of the samples that must show gravity, and a level axis."""
AT_ENDS = 5
"""Samples averaged at either end, where the device rests."""


def followed(acceleration: FloatArray, upright: Upright, axis: str) -> float | None:
    """The angle about an axis, rad, whole circles included.

    Args:
        acceleration: readings during the motion, from rest to rest, shape (n, 3).
        upright: bias and size of gravity in the reading's unit.
        axis: ``x``, ``y`` or ``z``.

    Returns:
        The angle; None where the axis did not stay level or something else than gravity was felt.
    """
    force = acceleration - upright.bias
    size = np.sqrt((force * force).sum(axis=1))
    felt = np.isfinite(size) & (np.abs(size / upright.radius - 1.0) < 0.5)
    if len(felt) < 2 * AT_ENDS or felt.mean() < MOSTLY:
        return None
    up = force[felt] / size[felt, None]
    index = AXES.index(axis)
    if np.quantile(np.abs(up[:, index]), MOSTLY) > LEVEL:
        return None
    angles = np.unwrap(np.arctan2(up[:, (index + 1) % 3], up[:, (index + 2) % 3]))
    return float(angles[-AT_ENDS:].mean() - angles[:AT_ENDS].mean())
