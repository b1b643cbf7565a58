"""Was this motion a rotation about the axis asked for, by how much, and can it be used."""

import math

import numpy as np

from imucal_wizard.procedure.doubts import AGREE, denied
from imucal_wizard.procedure.gravity_turn import followed
from imucal_wizard.procedure.ledger import KeptRotation
from imucal_wizard.procedure.plan import START_POSES, Step
from imucal_wizard.procedure.poses import AXES, DIRECTIONS, POSE_TOLERANCE_DEG, turn_towards
from imucal_wizard.procedure.rotation_check import MOSTLY, resting, shares, turned
from imucal_wizard.procedure.scene import Scene
from imucal_wizard.procedure.turns import level, turn_between, unwrapped
from imucal_wizard.procedure.wording import signed
from imucal_wizard.readings import FloatArray

LEVEL_DEG = 25.0
"""An axis this far from level still shows its turns in gravity."""
NUDGE_DEG = 5.0
"""A motion smaller than this was no attempt at a rotation."""
NUDGE_RATE = 30.0
"""Unless it was as fast as this on the way, °/s."""
MOST_CIRCLES = 3
"""A hand does not turn a device farther than this between two holds."""
FAR = math.radians(120.0)
PLAIN = math.radians(45.0)
"""From here on a turn in gravity is no mere change of place."""


class RotationJudge:
    """Judges the motions of the rotation step."""

    def __init__(self, scene: Scene, step: Step) -> None:
        self._scene = scene
        self._minimum = step.minimum_deg

    def poised(self, up: FloatArray | None, axis: str) -> bool:
        """Whether an axis lies level, so that gravity shows a turn about it."""
        return up is not None and level(up, axis) <= LEVEL_DEG

    def scale(self, axis: str) -> float | None:
        """Radians per second for a reading of one; None while it is not known.

        For counts it is what the rotations so far say of this axis (least squares).
        """
        if self._scene.units.gyroscope_known:
            return 1.0
        turns = self._scene.ledger.turns(axis)
        pairs = [(math.radians(turn.angle), turned(turn)[AXES.index(axis)]) for turn in turns]
        squares = sum(through * through for _, through in pairs)
        return sum(angle * through for angle, through in pairs) / squares if squares > 0 else None

    def fault(self, motion: KeptRotation, axis: str) -> str | None:
        """What keeps a motion from being a rotation about the axis.

        Fills in the angle, the fastest rate and, where it was about the axis, the axis.

        Returns:
            None when it is one, the reason when it is not, "" when none was meant.
        """
        before = self._scene.direction(motion.before)
        after = self._scene.direction(motion.after)
        if before is None or after is None or level(before, axis) > LEVEL_DEG:
            return ""
        if not np.isfinite(motion.rate).all():
            return motion.problem
        share = shares(motion.rate, resting(motion))
        if share[AXES.index(axis)] < MOSTLY:
            if self._contradicted(motion, axis):
                return motion.problem
            return self._strayed(share, before, after, axis)
        angle = self._angle(motion, before, after, axis)
        if angle is None:
            return f"{axis} stands upright at its end: keep it level"
        if abs(angle) > MOST_CIRCLES * 2.0 * math.pi:
            circles = abs(angle) / (2.0 * math.pi)
            return f"the gyroscope says {circles:.0f} whole circles: is its unit right?"
        motion.axis, motion.angle = axis, math.degrees(angle)
        motion.fastest = self._fastest(motion, axis)
        return motion.problem or self._too_small(motion)

    def _contradicted(self, motion: KeptRotation, axis: str) -> bool:
        """Whether gravity shows a turn about the axis that the gyroscope denies.

        Its columns are swapped then, or one is dead. The rotation counts: asking for another would
        ask for ever, and the fit finds out which it is.
        """
        scene = self._scene
        if not scene.units.gyroscope_known:
            return False
        angle = followed(motion.acceleration, scene.upright, axis)
        if angle is None or abs(angle) < PLAIN or not denied(turned(motion), angle, axis):
            return False
        motion.axis, motion.angle = axis, math.degrees(angle)
        motion.fastest = float(np.abs(motion.rate - resting(motion)).max()) * scene.units.degrees
        return True

    def _angle(
        self, motion: KeptRotation, before: FloatArray, after: FloatArray, axis: str
    ) -> float | None:
        through = float(turned(motion)[AXES.index(axis)])
        scale = self.scale(axis)
        angle = turn_between(before, after, axis, 0.0 if scale is None else scale * through)
        if angle is not None and scale is not None:
            if abs(angle - scale * through) > AGREE * abs(angle):  # then gravity counts the circles
                seen = followed(motion.acceleration, self._scene.upright, axis)
                angle = angle if seen is None else unwrapped(angle, seen)
            return angle
        if angle is not None and through * angle < 0.0 and abs(angle) > FAR:
            # More than half a circle, seen from the other side: the sense is the gyroscope's.
            return unwrapped(angle, math.copysign(math.pi, through))
        return angle

    def _fastest(self, motion: KeptRotation, axis: str) -> float:
        index = AXES.index(axis)
        rate = motion.rate[:, index] - resting(motion)[index]
        return float(np.abs(rate).max()) * self._scene.units.degrees

    def _too_small(self, motion: KeptRotation) -> str | None:
        if abs(motion.angle) >= self._minimum:
            return None
        motion.axis = None
        swung = self._scene.units.gyroscope_known and motion.fastest >= NUDGE_RATE
        if abs(motion.angle) < NUDGE_DEG and not swung:
            return ""
        return f"only {signed(motion.angle)}: turn at least {self._minimum:.0f}°"

    def _strayed(self, share: FloatArray, before: FloatArray, after: FloatArray, axis: str) -> str:
        """A motion about another axis; a mere change of place is no attempt."""
        start = DIRECTIONS[START_POSES[axis]]
        moved = turn_towards(before, after)[2]
        if moved < NUDGE_DEG or turn_towards(after, start)[2] <= POSE_TOLERANCE_DEG:
            return ""
        other = AXES[int(np.argmax(share))]
        if other == axis:
            return f"it turned about {axis} and about another axis too: turn about {axis} alone"
        return f"it turned mostly about {other}: turn about {axis}"
