"""A pose to take next."""

from collections.abc import Iterator
from dataclasses import dataclass

from imucal_wizard.procedure.poses import DIRECTIONS, spoken
from imucal_wizard.readings import FloatArray

START_POSE = {"x": "+z", "y": "+z", "z": "+x"}
"""From where a turn about each axis begins."""


@dataclass(frozen=True, eq=False)
class NextPose:
    """A pose to take.

    Attributes:
        direction: up in the body frame, unit vector.
        why: what it is good for, in words.
        pose: its name, or None for a direction without one.
        warm: with the device warmed up first.
    """

    direction: FloatArray
    why: str
    pose: str | None = None
    warm: bool = False


def turns(axes: str, why: str) -> Iterator[NextPose]:
    """Turns about some axes, as the poses that they begin in."""
    for axis in axes:
        start = START_POSE[axis]
        yield NextPose(
            DIRECTIONS[start],
            f"with {spoken(start)}, turn it about {axis}, left and right, each slowly, faster and "
            f"fast (50, 150, 300 °/s): {why}",
            start,
        )
