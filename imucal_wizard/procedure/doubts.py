"""Things that look wrong while measuring; said at once, because repeating is cheapest now."""

import math

import numpy as np

from imucal_wizard.procedure.ledger import KeptRotation
from imucal_wizard.procedure.poses import AXES
from imucal_wizard.procedure.rotation_judge import turned
from imucal_wizard.procedure.stillness import Noise, Windows
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


def disagreement(motion: KeptRotation, *, scale_known: bool) -> str:
    """A warning when the gyroscope's angle is far from gravity's, or ""."""
    if not scale_known or motion.axis is None:
        return ""
    seen = motion.angle
    felt = math.degrees(float(turned(motion)[AXES.index(motion.axis)]))
    if abs(felt - seen) <= AGREE * abs(seen):
        return ""
    return (
        f"Gravity turned by {seen:+.0f}° about {motion.axis}, the gyroscope says {felt:+.0f}°: "
        "check its unit, its sign and the sample rate."
    )
