"""The hand that does what the wizard asks: decides from the procedure's status what comes next."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.devices.virtual.actions import AXES, Action, Place, Shake, Turn, direction
from imucal_wizard.devices.virtual.asks import RotationLike, StatusLike, StillLike
from imucal_wizard.devices.virtual.scripts import (
    CIRCLE_SPEED_DEG,
    LARGEST_TILT_DEG,
    SHAKEN_EVERY,
    SPEEDS_DEG,
    VALIDATION,
    next_angle,
)
from imucal_wizard.readings import FloatArray

PATIENCE = 8.0
"""How much longer than needed a pose is held, s, before the hand places it again."""
TURN_PATIENCE = 4.0
"""How much longer than needed the hand waits, s, for a turn to be counted."""
START_ERROR_DEG = 12.0
"""A turn begins with its axis level within this; else the hand goes to the start pose first."""
FACE_SECONDS = 1.2
"""A face lies on the table for so long before it is turned, s."""
CIRCLE_DEG = 372.0
"""A hand that turns a device once round turns a little more."""
SHAKE_RMS = 0.5
"""Vibration per axis of an idling machine on which every third pose is held, m/s²."""


class Follower:
    """Remembers what it has done for which request.

    Attributes:
        shaken: every third of the poses is held on a support that vibrates.
    """

    def __init__(self) -> None:
        self.shaken = False
        self._placed = 0
        self._request: tuple[object, ...] | None = None
        self._turns = 0
        self._axis = ""

    def decide(self, status: StatusLike, rested: float, up: FloatArray) -> Sequence[Action]:
        """What to do about what the wizard says of a device at rest.

        Args:
            status: what the wizard says.
            rested: for how long the device had been at rest when it said so, s.
            up: up direction in the body frame.
        """
        if status.step in ("rotations", "more") and status.rotation is not None:
            return self._rotate(status.rotation, status.still, rested, up)
        if status.step == "field" and status.field is not None:
            return self._circle(status.field.face, rested, up)
        if status.step not in ("up-down", "poses", "validate", "more"):
            return ()
        target = _target(status)
        if target is None:
            return ()
        # a pose may be wanted twice: the next request for it begins with the hold of the last one
        request = (status.step, target, status.holds if status.step == "more" else 0)
        if request == self._request and rested < status.still.needed + PATIENCE:
            return ()
        self._placed += request != self._request
        self._request = request
        return [*self._support(status.step), Place(target)]

    def _support(self, step: str) -> Sequence[Action]:
        """What the device is laid on."""
        if not self.shaken:
            return ()
        shakes = step == "poses" and self._placed % SHAKEN_EVERY == 0
        return [Shake(SHAKE_RMS if shakes else 0.0)]

    def _circle(self, face: str | None, rested: float, up: FloatArray) -> Sequence[Action]:
        """Once round with a face on the table; about one axis after the other without one."""
        request = ("field", face)
        if face is None:
            self._turns += 1
            return [Turn(AXES[self._turns % 3], CIRCLE_DEG, CIRCLE_SPEED_DEG)]
        down = direction(face)
        tilted = np.degrees(np.arccos(np.clip(-down @ up, -1.0, 1.0)))
        if tilted > START_ERROR_DEG:
            self._request = None
            return [Place((-down[0], -down[1], -down[2]), error=0.7)]
        if rested < (FACE_SECONDS if request != self._request else TURN_PATIENCE):
            return ()
        self._request = request
        return [Turn(face[1], CIRCLE_DEG, CIRCLE_SPEED_DEG, error=2.0)]

    def _rotate(
        self, rotation: RotationLike, still: StillLike, rested: float, up: FloatArray
    ) -> Sequence[Action]:
        request = ("rotations", rotation.axis, len(rotation.done))
        start = direction(rotation.start_pose)
        axis = "xyz".index(rotation.axis)
        level = abs(np.degrees(np.arcsin(np.clip(up[axis], -1.0, 1.0)))) < START_ERROR_DEG
        if rotation.axis != self._axis or not level:
            self._axis, self._turns, self._request = rotation.axis, 0, None
            return [*self._support("rotations"), Place(rotation.start_pose, error=0.7)]
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
    if status.wanted_up is not None:
        return status.wanted_up
    if status.missing:
        return status.missing[0]
    if status.step == "validate":
        return VALIDATION[status.holds % len(VALIDATION)]
    return None
