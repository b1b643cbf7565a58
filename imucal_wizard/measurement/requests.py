"""Requests for measurements beyond the plan: a pose to hold, or rotations about an axis.

Requests are passed as one text, the argument of the command ``measure``, so that a resumed session
makes the same requests.
"""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.poses import AXES, DIRECTIONS, direction_in_words, pose_in_words
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass

MAX_REQUESTS = 100
"""More than anybody would measure in one session."""


@dataclass(frozen=True)
class MeasurementRequest:
    """One pose to hold, or some rotations about one axis.

    Attributes:
        up: up direction in the body frame, unit vector; the start of rotations.
        pose: name of the pose, or None.
        why: the purpose, in words.
        warm: whether the device must be warmed up first.
        axis: the body axis to rotate about, or "" for a pose.
        turns: number of rotations about the axis (the name is that of stored sessions).
        brief: the purpose of this request alone, if ``why`` covers several; "" means ``why``.
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
        """The purpose of this request alone."""
        return self.brief or self.why

    @property
    def words(self) -> str:
        """The pose or direction in words."""
        return pose_in_words(self.pose) if self.pose else direction_in_words(self.direction)


def requests_to_text(asked: Sequence[MeasurementRequest]) -> str:
    """The requests as text."""
    import msgspec  # only where requests travel

    return msgspec.json.encode(list(asked)).decode()


def requests_from_text(text: str) -> tuple[MeasurementRequest, ...]:
    """The requests in a text.

    Raises:
        UsageError: the text is not a list of possible requests.
    """
    import msgspec

    try:
        asked = tuple(msgspec.json.decode(text, type=list[MeasurementRequest]))
    except msgspec.MsgspecError as error:
        raise UsageError(f"measure: {error}; it needs a request of the bench") from error
    if not 1 <= len(asked) <= MAX_REQUESTS or not all(_possible(one) for one in asked):
        raise UsageError("measure: an impossible pose or rotation; it needs a request of the bench")
    return asked


def _possible(one: MeasurementRequest) -> bool:
    length = float(np.linalg.norm(one.up))
    named = one.pose is None or one.pose in DIRECTIONS
    resting = not one.axis and one.turns == 0
    rotating = one.axis in tuple(AXES) and 0 < one.turns <= MAX_REQUESTS
    return abs(length - 1.0) < 0.01 and named and (resting or rotating)
