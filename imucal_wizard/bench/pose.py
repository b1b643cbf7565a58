"""What to measure next: a pose to hold, or turns about an axis."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from imucal_wizard.procedure.asked import Asked
from imucal_wizard.procedure.plan import START_POSES
from imucal_wizard.procedure.poses import DIRECTIONS, spoken
from imucal_wizard.readings import FloatArray

SPEEDS = (50.0, 120.0, 220.0)
"""How fast the turns are that are asked for, °/s: an error that grows with the rate shows in the
difference between them, and the smallest usual range ends at 250."""
SENSES = (1.0, -1.0)


@dataclass(frozen=True, eq=False)
class NextPose:
    """A pose to take, or turns to make from it.

    Attributes:
        direction: up in the body frame, unit vector.
        why: what it is good for, in words.
        pose: its name, or None for a direction without one.
        warm: with the device warmed up first.
        axis: the body axis to turn about, or "" for a pose.
        turns: how many turns about it.
        brief: what this pose alone is good for, where ``why`` says more; "" is ``why``.
    """

    direction: FloatArray
    why: str
    pose: str | None = None
    warm: bool = False
    axis: str = ""
    turns: int = 0
    brief: str = ""


def turns(axes: str, why: str) -> Iterator[NextPose]:
    """Turns about some axes, in both senses at each speed."""
    speeds = ", ".join(f"{speed:.0f}" for speed in SPEEDS)
    for axis in axes:
        start = START_POSES[axis]
        yield NextPose(
            DIRECTIONS[start],
            f"with {spoken(start)}, turn it about {axis}, left and right, each slowly, faster and "
            f"fast ({speeds} °/s): {why}",
            start,
            axis=axis,
            turns=len(SPEEDS) * len(SENSES),
            brief=f"turn it about {axis}, left and right, each at {speeds} °/s",
        )


def asked_for(poses: Sequence[NextPose]) -> tuple[Asked, ...]:
    """The same as the procedure takes it, to lead somebody through."""
    return tuple(
        Asked(
            (float(one.direction[0]), float(one.direction[1]), float(one.direction[2])),
            one.pose,
            one.brief or one.why,
            one.warm,
            one.axis,
            one.turns,
        )
        for one in poses
    )
