"""Rotations about x, y and z by hand between still periods (Q's figure 2)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.limits.procedure import (
    AMBIGUOUS_SENSE_DEG,
    MAX_ANGLE_DISAGREEMENT,
    MAX_AXIS_TILT_DEG,
    MAX_CIRCLES,
    MIN_ATTEMPT_DEG,
    MIN_ATTEMPT_RATE,
    MIN_AXIS_SHARE,
    MIN_CONTRADICTION_DEG,
    NEAR_RANGE_SHARE,
    USUAL_RANGE,
)
from imucal_wizard.core.poses import (
    AXES,
    DIRECTIONS,
    POSE_TOLERANCE_DEG,
    START_POSES,
    angle_between,
)
from imucal_wizard.core.quantities import readable
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.guide.context import Context
from imucal_wizard.guide.kinds import Act, EventKind
from imucal_wizard.guide.live_checks import (
    axis_shares,
    contradicted,
    disagreement,
    gravity_angle,
    integrated,
    resting_rate,
    speeds,
)
from imucal_wizard.guide.measurements import KeptHold, KeptRotation
from imucal_wizard.guide.plan import Step
from imucal_wizard.guide.rotation_needs import PlannedRotation, neediest_axis, next_rotation
from imucal_wizard.guide.state import RotationStatus, Status
from imucal_wizard.guide.wording import ALL_TAKEN, HOLD_STILL, signed, turn_up
from imucal_wizard.measurement.rotation_angle import (
    RotationAngle,
    axis_elevation,
    rotation_between,
    tilt_about_axis,
    unwrapped,
)
from imucal_wizard.measurement.stillness import Block


def senses(rotations: Sequence[KeptRotation]) -> tuple[bool, bool]:
    """Whether there are rotations to the left, and to the right."""
    angles = [rotation.angle for rotation in rotations]
    return any(angle > 0.0 for angle in angles), any(angle < 0.0 for angle in angles)


MIN_RATE = 1.0
"""°/s; a slower rotation is planned as this one."""


def _tilt(up: FloatArray, axis: str) -> float:
    """Angle about a level axis from its start pose, degrees, −180 to 180."""
    start = tilt_about_axis(DIRECTIONS[START_POSES[axis]], axis) or 0.0
    now = tilt_about_axis(up, axis)
    return 0.0 if now is None else math.degrees(unwrapped(now - start, 0.0))


class RotationJudge:
    """Judges the motions of the rotation step."""

    def __init__(self, context: Context, step: Step) -> None:
        self._context = context
        self._minimum = step.minimum_deg

    def poised(self, up: FloatArray | None, axis: str) -> bool:
        """Whether an axis is level, so that gravity shows a rotation about it."""
        return up is not None and axis_elevation(up, axis) <= MAX_AXIS_TILT_DEG

    def scale(self, axis: str) -> float | None:
        """Radians per second per unit of reading; None if not known.

        For counts it is the least-squares estimate from the rotations taken about this axis.
        """
        if self._context.units.gyroscope_known:
            return 1.0
        known = self._context.measurements.counted_rotations(axis)
        pairs = [(math.radians(one.angle), integrated(one)[AXES.index(axis)]) for one in known]
        squares = sum(through * through for _, through in pairs)
        return sum(angle * through for angle, through in pairs) / squares if squares > 0 else None

    def fault(self, motion: KeptRotation, axis: str) -> str | None:
        """Why a motion is not a rotation about the axis.

        For a rotation about the axis it sets axis, angle and fastest rate of the motion.

        Returns:
            None for a rotation, the reason for a failed one, "" for a motion that was no attempt.
        """
        before = self._context.direction(motion.before)
        after = self._context.direction(motion.after)
        if before is None or after is None or axis_elevation(before, axis) > MAX_AXIS_TILT_DEG:
            return ""
        if not np.isfinite(motion.rate).all():
            return motion.problem
        share = axis_shares(motion.rate, resting_rate(motion))
        if share[AXES.index(axis)] < MIN_AXIS_SHARE:
            if self._contradicted(motion, axis):
                return motion.problem
            return self._strayed(share, before, after, axis)
        angle = self._angle(motion, before, after, axis)
        if angle is None:
            return f"{axis} pointed up or down at the end"
        if abs(angle) > MAX_CIRCLES * 2.0 * math.pi:
            circles = abs(angle) / (2.0 * math.pi)
            return f"the gyroscope shows {circles:.0f} whole circles: is its unit right?"
        motion.axis, motion.angle = axis, math.degrees(angle)
        motion.fastest = self._fastest(motion, axis)
        small = self._too_small(motion)
        if small == "":
            return ""  # a mere change of place is no rotation, whatever is wrong with its readings
        return motion.problem or small

    def _contradicted(self, motion: KeptRotation, axis: str) -> bool:
        """Whether gravity shows a rotation about the axis that the gyroscope does not show.

        Then columns are swapped, or one is dead. The rotation counts, because a repeat would fail
        too; the fit finds the cause.
        """
        context = self._context
        if not context.units.gyroscope_known:
            return False
        angle = gravity_angle(motion.acceleration, context.up_estimate, axis)
        if angle is None or abs(angle) < math.radians(MIN_CONTRADICTION_DEG):
            return False
        if not contradicted(integrated(motion), angle, axis):
            return False
        motion.axis, motion.angle = axis, math.degrees(angle)
        motion.fastest = (
            float(np.abs(motion.rate - resting_rate(motion)).max()) * context.units.degrees
        )
        return True

    def _angle(
        self, motion: KeptRotation, before: FloatArray, after: FloatArray, axis: str
    ) -> float | None:
        through = float(integrated(motion)[AXES.index(axis)])
        scale = self.scale(axis)
        angle = rotation_between(before, after, axis, 0.0 if scale is None else scale * through)
        if angle is not None and scale is not None:
            if abs(angle - scale * through) > MAX_ANGLE_DISAGREEMENT * abs(angle):
                # gravity gives the number of whole turns
                seen = gravity_angle(motion.acceleration, self._context.up_estimate, axis)
                angle = angle if seen is None else unwrapped(angle, seen)
            return angle
        if (
            angle is not None
            and through * angle < 0.0
            and abs(angle) > math.radians(AMBIGUOUS_SENSE_DEG)
        ):
            # Beyond half a turn gravity shows the opposite sense: the gyroscope's is right.
            return unwrapped(angle, math.copysign(math.pi, through))
        return angle

    def _fastest(self, motion: KeptRotation, axis: str) -> float:
        index = AXES.index(axis)
        rate = motion.rate[:, index] - resting_rate(motion)[index]
        return float(np.abs(rate).max()) * self._context.units.degrees

    def _too_small(self, motion: KeptRotation) -> str | None:
        """The reason for a short rotation; "" for a mere change of place; None if it counts."""
        if abs(motion.angle) >= self._minimum:
            return None
        motion.axis = None
        swung = self._context.units.gyroscope_known and motion.fastest >= MIN_ATTEMPT_RATE
        if abs(motion.angle) < MIN_ATTEMPT_DEG and not swung:
            return ""
        short = min(abs(motion.angle), self._minimum - 1.0)  # is not rounded up to the limit
        angle = signed(math.copysign(short, motion.angle))
        return f"only {angle} of at least {self._minimum:.0f}°"

    def _strayed(self, share: FloatArray, before: FloatArray, after: FloatArray, axis: str) -> str:
        """The reason for a motion about another axis; "" for a mere change of place."""
        start = DIRECTIONS[START_POSES[axis]]
        moved, short = (math.degrees(angle_between(after, one)) for one in (before, start))
        if moved < MIN_ATTEMPT_DEG or short <= POSE_TOLERANCE_DEG:
            return ""
        other = AXES[int(np.argmax(share))]
        if other == axis:
            return f"it turned about {axis} and about another axis too"
        return f"it turned mostly about {other}, not about {axis}"


class RotationsStage:
    """Takes the rotations about each axis in turn.

    Args:
        context: shared by all steps.
        step: what a rotation needs, and how many are needed about each axis.
        needs: how many are needed by axis, if that is not the same for all.
        since: only rotations that end after this sample time, s, count.
    """

    def __init__(
        self,
        context: Context,
        step: Step,
        needs: Mapping[str, int] | None = None,
        since: float = -math.inf,
    ) -> None:
        self._context = context
        self._step = step
        self._needs = dict.fromkeys(AXES, step.per_axis) if needs is None else dict(needs)
        self._since = since
        self._judge = RotationJudge(context, step)
        self.seconds = step.seconds
        self._axis = ""
        self._planned: tuple[tuple[object, ...], PlannedRotation] | None = None
        self._turn: RotationAngle | None = None
        self._broken = False
        self._angle = 0.0
        self._rate = 0.0
        self._fastest = 0.0

    @property
    def axis(self) -> str:
        """The axis of the next rotation; the last axis if there are enough.

        It stays until it has enough. Then an axis that was begun comes first, and among the others
        the one that improves the fit most.
        """
        short = [axis for axis, need in self._needs.items() if len(self._taken(axis)) < need]
        if self._axis not in short:
            begun = [axis for axis in short if self._taken(axis)]
            last = next(reversed(self._needs), AXES[-1])
            self._axis = (
                neediest_axis(self._known(), tuple(begun or short))
                if len(begun or short) > 1
                else (*begun, *short, last)[0]
            )
        return self._axis

    def _known(self) -> tuple[PlannedRotation, ...]:
        """All rotations that are counted so far, as the fit sees them."""
        context, found = self._context, []
        scales = dict.fromkeys(AXES, 1.0)  # fastest rates are in °/s, or else in counts
        if not context.units.gyroscope_known:
            scales = {axis: math.degrees(abs(self._judge.scale(axis) or 0.0)) for axis in AXES}
        for one in context.measurements.rotations:
            up = context.direction(one.before)
            if one.counts and one.axis is not None and up is not None:
                rate = max(scales[one.axis] * one.fastest, MIN_RATE)
                found.append(PlannedRotation(one.axis, one.angle, rate, _tilt(up, one.axis)))
        return tuple(found)

    def _plan(self) -> PlannedRotation:
        """The rotation that improves the fit most, from the pose in which the device rests."""
        context, axis = self._context, self.axis
        before = None if context.start is None else context.direction(context.start)
        tilt = 0.0
        if before is not None and self._judge.poised(before, axis):
            tilt = float(round(_tilt(before, axis)))
        key = (axis, tilt, self._known())
        if self._planned is None or self._planned[0] != key:
            full = context.gyroscope_range if context.units.gyroscope_known else None
            limit = None if full is None else full * context.units.degrees
            self._planned = key, next_rotation(key[2], axis, tilt, limit)
        return self._planned[1]

    def _taken(self, axis: str) -> list[KeptRotation]:
        known = self._context.measurements.counted_rotations(axis)
        own = [rotation for rotation in known if rotation.step is self._step.kind]
        return [rotation for rotation in own if rotation.after.hold.start >= self._since]

    @property
    def finished(self) -> bool:
        """Whether there are enough rotations about each axis."""
        return all(len(self._taken(axis)) >= need for axis, need in self._needs.items())

    @property
    def tally(self) -> tuple[float, float]:
        """Rotations taken, rotations needed, all axes together."""
        done = sum(min(len(self._taken(axis)), need) for axis, need in self._needs.items())
        return float(done), float(sum(self._needs.values()))

    @property
    def holds_here(self) -> bool:
        """Whether a hold here ends the present rotation, or can begin one."""
        up = self._context.up
        if self._turn is not None:
            return abs(self._angle) > self._step.minimum_deg
        return up is None or self._judge.poised(up, self.axis)

    def enter(self) -> None:
        """Choose the axis anew, and forget the present rotation."""
        self._axis = ""
        self._forget()

    def _forget(self) -> None:
        """Forget the present rotation."""
        self._turn = None
        self._broken = False
        self._angle = self._rate = self._fastest = 0.0

    def follow(self, block: Block) -> None:
        """Follow the angle and the rate of the present rotation, up to a gap in the samples."""
        context, index = self._context, AXES.index(self.axis)
        before = context.start
        if block.rate is None or before is None:
            self._forget()
            return
        if context.still and context.run.kept is before:
            self._forget()
            return
        if self._broken or block.summary.gap[0]:  # a rotation across a gap cannot count
            self._forget()
            self._broken = True
            return
        if self._turn is None:
            up = context.direction(before)
            if up is None or not self._judge.poised(up, self.axis):
                return
            self._turn = RotationAngle(self.axis, up)
        rest = before.hold.gyroscope
        turning = block.rate[:, index] - (0.0 if rest is None else rest[index])
        self._rate = float(turning.mean()) * context.units.degrees
        peak = float(np.abs(turning).max()) * context.units.degrees
        self._fastest = max(self._fastest, peak)
        scale = self._judge.scale(self.axis)
        turned = None if scale is None else scale * float(turning.mean()) * block.seconds
        if math.isfinite(self._rate):
            self._angle = math.degrees(self._turn.add(context.up, turned))

    def completed(self, kept: KeptHold) -> None:
        """Judge the motion that ended in this hold."""
        context, motion = self._context, self._context.motion
        kept.between |= kept.step is self._step.kind
        self._forget()
        if motion is None:
            self._begin(kept)
            return
        axis = self.axis
        problem = self._judge.fault(motion, axis)
        if problem is None:
            context.measurements.count(motion, axis)
            done = len(self._taken(axis))
            text = f"{signed(motion.angle)} about {axis} taken, {done} of {self._needs[axis]}."
            context.emit(EventKind.ROTATION_TAKEN, text)
            doubt = disagreement(motion, scale_known=context.units.gyroscope_known)
            if doubt:
                context.emit(EventKind.WARNING, doubt)
        elif problem:
            context.emit(EventKind.ROTATION_REJECTED, f"Rotation not used: {problem}.")
        else:
            self._begin(kept)

    def _begin(self, kept: KeptHold) -> None:
        """Report a hold that ends no rotation, but may start one."""
        context, axis = self._context, self.axis
        up = context.direction(kept)
        if context.start_lost:
            context.emit(EventKind.ROTATION_REJECTED, f"Rotation not used: {context.start_lost}.")
        elif self._judge.poised(up, axis):
            context.emit(EventKind.HOLD_TAKEN, "Start hold taken.")
        else:
            context.emit(EventKind.WRONG_POSE, f"Held, but {axis} is not level here.")

    def view(self) -> Status:
        """The present rotation, or how to begin one."""
        context, axis = self._context, self.axis
        start, up, rotation = START_POSES[axis], context.up, self._rotation()
        status = Status(progress=self.tally, rotation=rotation)
        if self.finished:
            return replace(status, act=Act.DONE, instruction=ALL_TAKEN)
        seconds, rotate = f"for {self.seconds:.0f} s", f"ROTATE ABOUT {axis.upper()}"
        if self._turn is not None:
            # a device that has long tried to rest here is offered ways to do so
            stopped = (context.still or context.watch.offered) and self.holds_here
            if stopped or rotation.left == 0.0:
                return replace(status, act=Act.HOLD, instruction=HOLD_STILL, detail=seconds)
            return replace(
                status,
                act=Act.ROTATE,
                instruction=rotate,
                detail=f"stop anywhere, then hold still {seconds}",
            )
        if up is not None and not self._judge.poised(up, axis):
            x, y, z = DIRECTIONS[start].tolist()
            return replace(
                status,
                act=Act.POSE,
                instruction=turn_up(start),
                detail=f"{axis} must be level: gravity then shows the angle",
                wanted=start,
                aim=(x, y, z),
                off_by=math.degrees(angle_between(up, DIRECTIONS[start])),
            )
        ready = context.start is not None and context.still and context.held >= self.seconds
        if not ready:
            detail = f"{seconds}; the rotation about {axis} follows"
            return replace(status, act=Act.HOLD, instruction=HOLD_STILL, detail=detail)
        return replace(
            status,
            act=Act.ROTATE,
            instruction=rotate,
            detail="these help most; other angles count, too",
        )

    def _rotation(self) -> RotationStatus:
        axis = self.axis
        rotations = self._taken(axis)
        full, units = self._context.gyroscope_range, self._context.units
        limit, factor, unit, scaled_by = None, 1.0, units.degrees_unit, 0
        if units.gyroscope_known:
            limit = USUAL_RANGE if full is None else full * units.degrees
        elif (scale := self._judge.scale(axis)) is not None:
            factor, unit = math.degrees(abs(scale)), readable("rad/s")[1]
            scaled_by = len(self._context.measurements.counted_rotations(axis))
        left, right = senses(rotations)
        plan = self._plan()
        return RotationStatus(
            axis=axis,
            start_pose=START_POSES[axis],
            angle=self._angle,
            rate=self._rate * factor,
            fastest=self._fastest * factor,
            range_limit=limit,
            range_known=full is not None,
            done=tuple(rotation.angle for rotation in rotations),
            wanted=self._needs[axis],
            senses=left and right,
            speeds=speeds([rotation.fastest for rotation in rotations]),
            wanted_angle=plan.angle,
            wanted_rate=plan.fastest,
            clips=limit is not None and self._fastest >= NEAR_RANGE_SHARE * limit,
            unit=unit,
            scaled_by=scaled_by,
            least=self._step.minimum_deg,
        )
