"""Things that look wrong while measuring; said at once, because repeating is cheapest now."""

import numpy as np

from imucal_wizard.procedure.ledger import KeptRotation
from imucal_wizard.procedure.poses import AXES
from imucal_wizard.procedure.rotation_check import turned
from imucal_wizard.procedure.stillness import Noise, Windows
from imucal_wizard.procedure.wording import signed
from imucal_wizard.readings import FloatArray

ALIVE = 0.5
"""Noise of this many resolution steps flickers all the time; without it something is wrong."""
AGREE = 0.25
"""Gravity and gyroscope may differ by this share of an angle before the fit."""


def frozen_axis(window: Windows, noise: Noise | None, steps: FloatArray) -> str:
    """A warning when an accelerometer axis that has noise shows none at all, or "".

    A reading at the end of its range, or one that is repeated for ever, does not flicker.
    """
    if noise is None:
        return ""
    alive = (noise.std_a > ALIVE * steps) & (steps > 0.0)
    frozen = np.flatnonzero(alive & (window.std_a[0] == 0.0))
    if not len(frozen):
        return ""
    axis = AXES[int(frozen[0])]
    return (
        f"{axis} of the accelerometer does not change at all in this pose: "
        "is it at the end of its range? Choose a wider range."
    )


def denied(felt: FloatArray, seen: float, axis: str) -> bool:
    """Whether a turn that gravity saw about one axis is on another of the gyroscope, or on none.

    Args:
        felt: the gyroscope's angle about each axis, shape (3,).
        seen: gravity's angle about ``axis``, in the same unit.
        axis: the axis.
    """
    sizes, size = np.abs(felt), abs(seen)
    nowhere = bool((sizes < AGREE * size).all())
    return nowhere or _elsewhere(sizes, size, axis) is not None


def _elsewhere(sizes: FloatArray, size: float, axis: str) -> str | None:
    """The one other axis that turned by as much, while this one hardly turned."""
    if sizes[AXES.index(axis)] > 2.0 * AGREE * size:
        return None
    same = [other for other in AXES if abs(sizes[AXES.index(other)] - size) <= AGREE * size]
    return same[0] if len(same) == 1 else None


def disagreement(motion: KeptRotation, *, scale_known: bool) -> str:
    """A warning when the gyroscope's angle is far from gravity's, or ""."""
    if not scale_known or motion.axis is None:
        return ""
    axis, seen = motion.axis, motion.angle
    angles = np.degrees(turned(motion))
    felt = float(angles[AXES.index(axis)])
    if abs(felt - seen) <= AGREE * abs(seen):
        return ""
    turn = f"Gravity turned by {signed(seen)} about {axis}, the gyroscope"
    other = _elsewhere(np.abs(angles), abs(seen), axis)
    if other is not None:
        there = float(angles[AXES.index(other)])
        return f"{turn} by {signed(there)} about {other}: are its columns or axes swapped?"
    if abs(felt) < AGREE * abs(seen):
        return f"{turn} not at all: is its {axis} axis dead, or its column another one?"
    if abs(felt + seen) <= AGREE * abs(seen):
        return f"{turn} by {signed(felt)}: the sign of its {axis} axis is wrong."
    return f"{turn} by {signed(felt)}: check its unit and the sample rate."
