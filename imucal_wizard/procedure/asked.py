"""What is asked for beyond the plan: single poses and turns, each with its reason, as one text.

The text is the argument of the command ``measure``, so that a session that is taken up again asks
for the same.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from imucal_wizard.errors import UsageError
from imucal_wizard.procedure.poses import AXES, DIRECTIONS, spoken, spoken_up
from imucal_wizard.readings import FloatArray

MOST = 100
"""More than anybody would hold in one go."""


@dataclass(frozen=True)
class Asked:
    """One pose to hold, or some turns about one axis.

    Attributes:
        up: up in the body frame, unit vector; where turns begin.
        pose: its name, or None for a direction without one.
        why: what it is good for, in words.
        warm: with the device warmed up first.
        axis: the body axis to turn about, or "" for a pose.
        turns: how many turns about it.
    """

    up: tuple[float, float, float]
    pose: str | None = None
    why: str = ""
    warm: bool = False
    axis: str = ""
    turns: int = 0

    @property
    def direction(self) -> FloatArray:
        """Up in the body frame, shape (3,)."""
        return np.asarray(self.up, np.float64)

    @property
    def words(self) -> str:
        """Where it is, in plain words."""
        if self.pose:
            return spoken(self.pose)
        return spoken_up(self.direction)


def to_text(asked: Sequence[Asked]) -> str:
    """What ``from_text`` reads."""
    return msgspec.json.encode(list(asked)).decode()


def from_text(text: str) -> tuple[Asked, ...]:
    """What is asked for.

    Raises:
        UsageError: it is no such text, or asks for what cannot be.
    """
    try:
        asked = tuple(msgspec.json.decode(text, type=list[Asked]))
    except msgspec.MsgspecError as error:
        raise UsageError(f"measure: {error}; it takes what the bench asks for") from error
    if not 1 <= len(asked) <= MOST or not all(_possible(one) for one in asked):
        raise UsageError("measure: no pose or turn that can be; it takes what the bench asks for")
    return asked


def _possible(one: Asked) -> bool:
    length = float(np.linalg.norm(one.up))
    named = one.pose is None or one.pose in DIRECTIONS
    turning = (not one.axis and one.turns == 0) or (one.axis in AXES and 0 < one.turns <= MOST)
    return abs(length - 1.0) < 0.01 and named and turning and len(one.axis) <= 1
