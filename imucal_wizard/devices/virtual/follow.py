"""The hand that does what the wizard asks: decides from the procedure's status what comes next.

A decision is due a fixed time after the event that called for it, in sample time, so that the same
procedure at another playback speed sees the same motion.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from imucal_wizard.devices.virtual.actions import Action, Place, RestUntil, Turn, direction
from imucal_wizard.devices.virtual.scripts import (
    LARGEST_TILT_DEG,
    SPEEDS_DEG,
    VALIDATION,
    next_angle,
)
from imucal_wizard.readings import FloatArray

REACTION = 1.5
"""From the wizard's word to the hand's move, s of samples."""
LISTENING = 0.5
"""For so long after an event, s of samples, the hand waits whether more is said."""
PATIENCE = 8.0
"""How much longer than needed a pose is held, s, before the hand places it again."""
TURN_PATIENCE = 4.0
"""How much longer than needed the hand waits, s, for a turn to be counted."""
START_ERROR_DEG = 12.0
"""A turn begins with its axis level within this; else the hand goes to the start pose first."""


class EventLike(Protocol):
    """What the follower reads of an event."""

    @property
    def time(self) -> float:
        """Sample time, s."""


class StillLike(Protocol):
    """What the follower reads of the stillness."""

    @property
    def held(self) -> float:
        """Seconds of the present hold so far."""

    @property
    def needed(self) -> float:
        """Seconds wanted."""


class RotationLike(Protocol):
    """What the follower reads of the rotations."""

    @property
    def axis(self) -> str:
        """The axis asked for."""

    @property
    def start_pose(self) -> str:
        """The pose to start from."""

    @property
    def done(self) -> tuple[float, ...]:
        """Rotations counted so far about that axis."""


class StatusLike(Protocol):
    """What the follower reads of ``procedure.state.Status``."""

    @property
    def step(self) -> str:
        """Name of the step."""

    @property
    def elapsed(self) -> float:
        """Seconds of samples since the first."""

    @property
    def still(self) -> StillLike:
        """Whether it is still, and for how long."""

    @property
    def wanted(self) -> str | None:
        """The pose asked for."""

    @property
    def missing(self) -> tuple[str, ...]:
        """Poses still to take."""

    @property
    def rotation(self) -> RotationLike | None:
        """The rotation asked for."""

    @property
    def last_event(self) -> EventLike | None:
        """The newest event."""

    @property
    def holds(self) -> int:
        """Holds kept so far."""


class Follower:
    """Remembers what it has done for which request.

    Attributes:
        horizon: sample time the hand may go to before the wizard is heard again, or None.
    """

    def __init__(self) -> None:
        self.horizon: float | None = None
        self._lag = np.inf
        self._request: tuple[object, ...] | None = None
        self._turns = 0
        self._axis = ""

    def react(
        self,
        status: StatusLike,
        time: float | None,
        now: float,
        idle: bool,
        rest_since: float,
        up: FloatArray,
    ) -> Sequence[Action]:
        """What to do about this status.

        Args:
            status: what the wizard says.
            time: device time of the newest sample behind it, s; None: guessed from ``elapsed``.
            now: device time of the next sample, s.
            idle: whether the hand has nothing to do.
            rest_since: device time at which the last move ended, s.
            up: up direction in the body frame.
        """
        if time is None:
            self._lag = min(self._lag, now - status.elapsed)
            time = status.elapsed + self._lag
        self.horizon = time + REACTION - LISTENING
        if not idle or time <= rest_since:
            return ()
        event = status.last_event
        asked = time
        if event is not None and event.time > rest_since:
            asked = event.time
            if time < asked + LISTENING:
                return ()
        doing = self._decide(status, time - rest_since, up)
        return [RestUntil(asked + REACTION), *doing] if doing else ()

    def _decide(self, status: StatusLike, rested: float, up: FloatArray) -> Sequence[Action]:
        if status.step == "rotations":
            return self._rotate(status.rotation, status.still, rested, up)
        if status.step not in ("up-down", "poses", "validate"):
            return ()
        target = _target(status)
        if target is None:
            return ()
        request = (status.step, target)
        if request == self._request and rested < status.still.needed + PATIENCE:
            return ()
        self._request = request
        return [Place(target)]

    def _rotate(
        self, rotation: RotationLike | None, still: StillLike, rested: float, up: FloatArray
    ) -> Sequence[Action]:
        if rotation is None:
            return ()
        request = ("rotations", rotation.axis, len(rotation.done))
        start = direction(rotation.start_pose)
        axis = "xyz".index(rotation.axis)
        level = abs(np.degrees(np.arcsin(np.clip(up[axis], -1.0, 1.0)))) < START_ERROR_DEG
        if rotation.axis != self._axis or not level:
            self._axis, self._turns, self._request = rotation.axis, 0, None
            return [Place(rotation.start_pose, error=0.7)]
        counted = request != self._request
        if not (still.held >= still.needed if counted else rested > still.needed + TURN_PATIENCE):
            return ()
        self._request = request
        tilt = tilt_about(axis, start, up)
        angle = next_angle(self._turns, tilt)
        if (
            rotation.done
            and angle * rotation.done[-1] > 0.0
            and abs(tilt - angle) < LARGEST_TILT_DEG
        ):
            angle = -angle  # the wizard wants both senses, and has just had this one
        fastest = SPEEDS_DEG[self._turns % len(SPEEDS_DEG)]
        self._turns += 1
        return [Turn(rotation.axis, angle, fastest)]


def tilt_about(axis: int, start: FloatArray, up: FloatArray) -> float:
    """How far the device has been turned about a level body axis since ``start`` was up, degrees.

    Turning by ``+θ`` about the axis carries the up direction, seen from the body, by ``−θ``.
    """
    along = np.eye(3)[axis]
    return float(np.degrees(np.arctan2(-np.cross(start, up) @ along, start @ up)))


def _target(status: StatusLike) -> str | tuple[float, float, float] | None:
    if status.wanted is not None:
        return status.wanted
    if status.missing:
        return status.missing[0]
    if status.step == "validate":
        return VALIDATION[status.holds % len(VALIDATION)]
    return None
