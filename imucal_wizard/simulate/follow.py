"""The virtual hand's response to the procedure's instructions."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.instruction import Instruction, RotationRequest
from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.simulate.actions import Action, PlacePose, Rotate, Shake, direction
from imucal_wizard.simulate.scripts import (
    CIRCLE_SPEED_DEG,
    SHAKE_RMS,
    SHAKEN_EVERY,
    VALIDATION,
)

MAX_HOLD_WAIT_SECONDS = 8.0
"""Additional time, s, for which a pose is held before the hand places it again."""
MAX_TURN_WAIT_SECONDS = 4.0
"""Additional time, s, for which the hand waits until a rotation is counted."""
START_ERROR_DEG = 12.0
"""Tolerance of the level axis at the start of a rotation, degrees; beyond it, the hand goes to the
start pose first."""
FACE_SECONDS = 1.2
"""Time for which a face lies on the table before it is turned, s."""
HAND_CIRCLE_DEG = 372.0
"""Angle of a circle by hand: slightly more than a full turn, degrees."""


class Follower:
    """Decides how the hand responds to an instruction, and remembers its responses.

    Args:
        shaken: whether every third pose is held on a vibrating support.
    """

    def __init__(self, *, shaken: bool = False) -> None:
        self._shaken = shaken
        self._placed = 0
        self._request: tuple[object, ...] | None = None
        self._turns = 0
        self._axis = ""

    def decide(self, asked: Instruction, rested: float, up: FloatArray) -> Sequence[Action]:
        """The response to an instruction, for a device at rest.

        Args:
            asked: the instruction.
            rested: time for which the device had been at rest when the instruction was given, s.
            up: up direction in the body frame.
        """
        if asked.rotation is not None:
            return self._rotate(asked, asked.rotation, rested, up)
        if asked.circles:
            return self._circle(asked.face, rested, up)
        pose = asked.pose
        if pose is None and asked.step == "validate":
            pose = VALIDATION[asked.holds % len(VALIDATION)]
        if pose is None:
            return ()
        # a pose may be requested twice: the second request begins with the hold of the first one
        request = (asked.step, pose, asked.holds if asked.step in ("more", "recheck") else 0)
        if request == self._request and rested < asked.needed + MAX_HOLD_WAIT_SECONDS:
            return ()
        self._placed += request != self._request
        self._request = request
        return [*self._support(asked.step), PlacePose(pose)]

    def _support(self, step: str) -> Sequence[Action]:
        """The support of the device."""
        if not self._shaken:
            return ()
        shakes = step == "poses" and self._placed % SHAKEN_EVERY == 0
        return [Shake(SHAKE_RMS if shakes else 0.0)]

    def _circle(self, face: str | None, rested: float, up: FloatArray) -> Sequence[Action]:
        """One circle with a face on the table, or about the axes in turn if none is requested."""
        request = ("field", face)
        if face is None:
            self._turns += 1
            return [Rotate(AXES[self._turns % 3], HAND_CIRCLE_DEG, CIRCLE_SPEED_DEG)]
        down = direction(face)
        tilted = np.degrees(np.arccos(np.clip(-down @ up, -1.0, 1.0)))
        if tilted > START_ERROR_DEG:
            self._request = None
            return [PlacePose((-down[0], -down[1], -down[2]), error=0.7)]
        if rested < (FACE_SECONDS if request != self._request else MAX_TURN_WAIT_SECONDS):
            return ()
        self._request = request
        return [Rotate(face[1], HAND_CIRCLE_DEG, CIRCLE_SPEED_DEG, error=2.0)]

    def _rotate(
        self, asked: Instruction, rotation: RotationRequest, rested: float, up: FloatArray
    ) -> Sequence[Action]:
        request = ("rotations", rotation.axis, len(rotation.done))
        axis = "xyz".index(rotation.axis)
        level = abs(np.degrees(np.arcsin(np.clip(up[axis], -1.0, 1.0)))) < START_ERROR_DEG
        if rotation.axis != self._axis or not level:
            self._axis, self._request = rotation.axis, None
            return [*self._support("rotations"), PlacePose(rotation.start_pose, error=0.7)]
        counted = request != self._request
        ready = (
            asked.held >= asked.needed if counted else rested > asked.needed + MAX_TURN_WAIT_SECONDS
        )
        if not ready:
            return ()
        self._request = request
        return [Rotate(rotation.axis, rotation.angle, rotation.fastest)]
