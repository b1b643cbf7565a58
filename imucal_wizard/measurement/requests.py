"""A request to measure something beyond the plan: a pose to hold, or rotations about one axis.

Requests travel as one text, the argument of the command ``measure``, so that a session that is
resumed asks for the same.
"""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.poses import AXES, DIRECTIONS, direction_in_words, pose_in_words
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass

MAX_REQUESTS = 100
"""More than anybody would measure in one go."""


@dataclass(frozen=True)
class MeasurementRequest:
    """One pose to hold, or some rotations about one axis.

    Attributes:
        up: up in the body frame, unit vector; where rotations begin.
        pose: its name, or None for a direction without one.
        why: what it is good for, in words.
        warm: with the device warmed up first.
        axis: the body axis to rotate about, or "" for a pose.
        turns: how many rotations about it (the name is that of stored sessions).
        brief: what this request alone is good for, where ``why`` says more; "" is ``why``.
    """

    up: tuple[float, float, float]
    pose: str | None = None
    why: str = ""
    warm: bool = False
    axis: str = ""
    turns: int = 0
    brief: str = ""

    @property
    def direction(self) -> FloatArray:
        """Up in the body frame, shape (3,)."""
        return np.asarray(self.up, np.float64)

    @property
    def reason(self) -> str:
        """What this request alone is good for."""
        return self.brief or self.why

    @property
    def words(self) -> str:
        """Where it is, in plain words."""
        return pose_in_words(self.pose) if self.pose else direction_in_words(self.direction)


def requests_to_text(asked: Sequence[MeasurementRequest]) -> str:
    """What ``requests_from_text`` reads."""
    from msgspec import json  # imported only where requests travel

    return json.encode(list(asked)).decode()


def requests_from_text(text: str) -> tuple[MeasurementRequest, ...]:
    """What is asked for.

    Raises:
        UsageError: it is no such text, or asks for what cannot be.
    """
    import msgspec

    try:
        asked = tuple(msgspec.json.decode(text, type=list[MeasurementRequest]))
    except msgspec.MsgspecError as error:
        raise UsageError(f"measure: {error}; it takes what the bench asks for") from error
    if not 1 <= len(asked) <= MAX_REQUESTS or not all(_possible(one) for one in asked):
        raise UsageError(
            "measure: a pose or rotation that is impossible; it takes what the bench asks for"
        )
    return asked


def _possible(one: MeasurementRequest) -> bool:
    length = float(np.linalg.norm(one.up))
    named = one.pose is None or one.pose in DIRECTIONS
    resting = not one.axis and one.turns == 0
    rotating = one.axis in tuple(AXES) and 0 < one.turns <= MAX_REQUESTS
    return abs(length - 1.0) < 0.01 and named and (resting or rotating)
