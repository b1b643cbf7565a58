"""Rotations about x, y and z by hand between still periods (Q's figure 2)."""

import math
from collections.abc import Mapping

import numpy as np

from imucal_wizard.procedure.doubts import disagreement
from imucal_wizard.procedure.ledger import KeptHold, KeptRotation
from imucal_wizard.procedure.moments import Moment
from imucal_wizard.procedure.plan import START_POSES, Step
from imucal_wizard.procedure.poses import AXES, DIRECTIONS, turn_towards
from imucal_wizard.procedure.rotation_check import speeds
from imucal_wizard.procedure.rotation_judge import RotationJudge
from imucal_wizard.procedure.scene import Scene
from imucal_wizard.procedure.state import EventKind, RotationStatus, Status
from imucal_wizard.procedure.turn_advice import advice, senses
from imucal_wizard.procedure.turns import TurnAngle
from imucal_wizard.procedure.wording import how_to_turn, label, signed, turn_up

USUAL_RANGE = 250.0
"""The smallest full scale that is usual, °/s: below it no gyroscope clips."""


class RotationStage:
    """Takes the rotations about each axis in turn.

    Args:
        scene: the present moment.
        step: what a rotation needs, and how many are wanted about each axis.
        needs: how many are wanted about which axes, where that is not the same for all.
        since: only rotations that end after this sample time, s, count.
    """

    def __init__(
        self,
        scene: Scene,
        step: Step,
        needs: Mapping[str, int] | None = None,
        since: float = -math.inf,
    ) -> None:
        self._scene = scene
        self._step = step
        self._needs = dict.fromkeys(AXES, step.per_axis) if needs is None else dict(needs)
        self._since = since
        self._judge = RotationJudge(scene, step)
        self.seconds = step.seconds
        self._turn: TurnAngle | None = None
        self._angle = 0.0
        self._rate = 0.0
        self._fastest = 0.0

    @property
    def axis(self) -> str:
        """About which axis rotations are wanted now; the last one when there are enough."""
        short = (axis for axis, need in self._needs.items() if len(self._turns(axis)) < need)
        return next(short, list(self._needs)[-1])

    def _turns(self, axis: str) -> list[KeptRotation]:
        turns = self._scene.ledger.turns(axis)
        own = [turn for turn in turns if turn.step is self._step.kind]
        return [turn for turn in own if turn.after.hold.start >= self._since]

    @property
    def finished(self) -> bool:
        """There are enough rotations about each axis."""
        return all(len(self._turns(axis)) >= need for axis, need in self._needs.items())

    @property
    def tally(self) -> tuple[float, float]:
        """Rotations taken, rotations wanted, all axes together."""
        done = sum(min(len(self._turns(axis)), need) for axis, need in self._needs.items())
        return float(done), float(sum(self._needs.values()))

    def enter(self) -> None:
        """Nothing is under way."""
        self._turn = None
        self._angle = self._rate = self._fastest = 0.0

    def follow(self, moment: Moment) -> None:
        """Follow the angle and the rate of the turn under way."""
        scene, index = self._scene, AXES.index(self.axis)
        before = scene.passage.before
        if moment.rate is None or before is None:
            self.enter()
            return
        if scene.still and scene.run.kept is before:
            self.enter()
            return
        if self._turn is None:
            up = scene.direction(before)
            if up is None:
                return
            self._turn = TurnAngle(self.axis, up)
        rest = before.hold.gyroscope
        turning = moment.rate[:, index] - (0.0 if rest is None else rest[index])
        self._rate = float(turning.mean()) * scene.units.degrees
        peak = float(np.abs(turning).max()) * scene.units.degrees
        self._fastest = max(self._fastest, peak)
        scale = self._judge.scale(self.axis)
        turned = None if scale is None else scale * float(turning.mean()) * moment.seconds
        if math.isfinite(self._rate):
            self._angle = math.degrees(self._turn.add(scene.up, turned))

    def completed(self, kept: KeptHold) -> None:
        """The device rests again: judge the motion that led here."""
        scene, motion = self._scene, self._scene.motion
        kept.between |= kept.step is self._step.kind
        self.enter()
        if motion is None:
            self._begin(kept)
            return
        axis = self.axis
        problem = self._judge.fault(motion, axis)
        if problem is None:
            scene.ledger.count(motion, axis)
            done = len(self._turns(axis))
            text = f"{signed(motion.angle)} about {axis} taken, {done} of {self._needs[axis]}."
            text += f" Next: about {self.axis}." if self.axis != axis else self._hint()
            scene.emit(EventKind.ROTATION_TAKEN, text)
            doubt = disagreement(motion, scale_known=scene.units.gyroscope_known)
            if doubt:
                scene.emit(EventKind.WARNING, doubt)
        elif problem:
            scene.emit(EventKind.ROTATION_REJECTED, f"Rotation not used: {problem}.")
        else:
            self._begin(kept)

    def _hint(self) -> str:
        advice = self._advice()
        return f" {advice.capitalize()}." if advice else ""

    def _begin(self, kept: KeptHold) -> None:
        """A hold that ends no rotation: a place to start from, or to go on from."""
        scene, axis = self._scene, self.axis
        up = scene.direction(kept)
        if scene.passage.lost:
            scene.emit(
                EventKind.ROTATION_REJECTED, f"Rotation not used: {scene.passage.lost}. Turn again."
            )
        elif self._judge.poised(up, axis):
            scene.emit(EventKind.HOLD_TAKEN, f"Start hold taken. Rotate about {axis} and stop.")
        else:
            start = label(START_POSES[axis])
            scene.emit(EventKind.HOLD_TAKEN, f"Held. Now turn {start} up to rotate about {axis}.")

    def _advice(self) -> str:
        """What is still missing about this axis, or ""."""
        return advice(self._turns(self.axis), scale_known=self._scene.units.gyroscope_known)

    def view(self) -> Status:
        """The rotation under way, or how to begin one."""
        scene, axis = self._scene, self.axis
        start = START_POSES[axis]
        moving = self._turn is not None
        up = scene.up
        off_by = None if up is None else turn_towards(up, DIRECTIONS[start])[2]
        poised = moving or self._judge.poised(up, axis)
        return Status(
            instruction=f"ROTATE ABOUT {axis.upper()}" if poised else turn_up(start),
            detail=self._detail(),
            guidance="" if poised or up is None else how_to_turn(up, start),
            wanted=None if poised else start,
            off_by=off_by,
            progress=self.tally,
            rotation=self._rotation(),
        )

    def _detail(self) -> str:
        scene, axis = self._scene, self.axis
        if self._turn is not None:
            return f"stop where you like, then hold still for {self.seconds:.0f} s"
        if scene.passage.before is None or not scene.still or scene.held < self.seconds:
            return f"first hold still for {self.seconds:.0f} s"
        if not self._judge.poised(scene.up, axis):
            return f"{axis} must lie level: gravity shows only turns about a level axis"
        left, _ = senses(self._turns(axis))
        sense = "right" if left and len(self._turns(axis)) % 2 else "left"
        return f"turn it to the {sense} and stop"

    def _rotation(self) -> RotationStatus:
        axis = self.axis
        turns = self._turns(axis)
        full, units = self._scene.gyroscope_range, self._scene.units
        usual = USUAL_RANGE if units.gyroscope_known else None
        left, right = senses(turns)
        return RotationStatus(
            axis=axis,
            start_pose=START_POSES[axis],
            angle=self._angle,
            rate=self._rate,
            fastest=self._fastest,
            range_limit=usual if full is None else full * units.degrees,
            range_known=full is not None,
            done=tuple(rotation.angle for rotation in turns),
            wanted=self._needs[axis],
            senses=left and right,
            speeds=speeds([rotation.fastest for rotation in turns]),
            advice=self._advice(),
        )
