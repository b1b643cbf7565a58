"""Holds in given directions, in any order; the program recognises each direction.

The steps up/down and poses need named poses; the validation needs any new orientations.
"""

import math
from dataclasses import replace

from imucal_wizard.core.limits.procedure import MIN_WARMING
from imucal_wizard.core.poses import (
    AXES,
    CORNERS,
    DIRECTIONS,
    FACE_TOLERANCE_DEG,
    NAMED,
    POSE_TOLERANCE_DEG,
    TIE_DEG,
    angle_between,
    direction_in_words,
    nearest_pose,
    pose_in_words,
)
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.guide.context import Context
from imucal_wizard.guide.kinds import Act, EventKind, StepKind
from imucal_wizard.guide.measurements import KeptHold
from imucal_wizard.guide.plan import Step
from imucal_wizard.guide.state import AxisStart, Status
from imucal_wizard.guide.wording import ALL_TAKEN, HOLD_STILL, PUT_BACK, THERE, label, turn_up
from imucal_wizard.measurement.stillness import Block


@dataclass(frozen=True, eq=False)
class DirectionTarget:
    """A wanted direction.

    Attributes:
        key: identifies it among the directions of its step.
        up: up in the body frame, unit vector, shape (3,).
        pose: its name, or None.
        tolerance: largest angle between a hold and the direction, degrees.
        why: why it is needed, or "".
        warm: to be held after the device has been warmed.
    """

    key: str
    up: FloatArray
    pose: str | None
    tolerance: float
    why: str = ""
    warm: bool = False

    def away(self, up: FloatArray) -> float:
        """Angle from an up direction, degrees."""
        return math.degrees(angle_between(up, self.up))

    def near(self, up: FloatArray) -> bool:
        """Whether an up direction, a unit vector, is within the tolerance."""
        # the cosine rules most directions out, at a tenth of the cost of the accurate angle
        farther = math.cos(math.radians(min(self.tolerance + 1.0, 180.0)))
        return float(up @ self.up) >= farther and self.away(up) <= self.tolerance

    @property
    def words(self) -> str:
        """The direction in words."""
        return pose_in_words(self.pose) if self.pose else direction_in_words(self.up)

    @property
    def label(self) -> str:
        """Its name in capitals, or "The pose"."""
        return label(self.pose) if self.pose else "The pose"


class DirectionsStage:
    """Takes one hold in each of the given directions.

    Args:
        context: shared by all steps.
        step: what the step needs.

    Attributes:
        targets: the directions.
        wanted: the direction that the instruction names, or None.
        tie: directions whose distances differ by less than this, degrees, keep the list's order.
    """

    tie = TIE_DEG

    def __init__(self, context: Context, step: Step) -> None:
        self._context = context
        self._step = step
        edges = any(len(pose) > 2 for pose in step.poses)
        tolerance = POSE_TOLERANCE_DEG if edges else FACE_TOLERANCE_DEG
        self.targets = tuple(
            DirectionTarget(pose, NAMED[pose], pose, tolerance) for pose in step.poses
        )
        self.wanted: DirectionTarget | None = None

    @property
    def seconds(self) -> float:
        """How long the device must be at rest for one hold, s."""
        return self._step.seconds

    @property
    def missing(self) -> tuple[DirectionTarget, ...]:
        """The directions still to take."""
        done = self._context.measurements.ticked(self._step.kind)
        return tuple(target for target in self.targets if target.key not in done)

    @property
    def finished(self) -> bool:
        """All directions are taken."""
        return not self.missing

    @property
    def tally(self) -> tuple[float, float]:
        """Directions taken, directions wanted."""
        return float(len(self.targets) - len(self.missing)), float(len(self.targets))

    @property
    def holds_here(self) -> bool:
        """Whether a hold here counts for a missing direction."""
        up = self._context.up
        return up is None or self._counts(up)

    def enter(self) -> None:
        """Choose the nearest missing direction."""
        self.wanted = None
        self._choose()

    def follow(self, block: Block) -> None:  # noqa: ARG002 -- every stage gets each block
        """Choose a direction as soon as the up direction is known."""
        if self.wanted is None:
            self._choose()

    def ask_again(self, key: str) -> None:
        """Choose a direction that was taken back, wherever the device is."""
        self.wanted = next((one for one in self.missing if one.key == key), self.wanted)

    def completed(self, kept: KeptHold) -> None:
        """Count the hold for its direction, or explain why it is none of the step's directions."""
        context, kind = self._context, self._step.kind
        up = context.direction(kept)
        found = None if up is None else self._recognised(up)
        if kind is StepKind.UP_DOWN and up is not None and not context.procedure.led:
            self._count_onwards(kept, up)
        if found is None:
            if StepKind.POSES not in kept.ticks:
                self._refuse(up)
            return
        again = found not in self.missing
        least = self._least_warm(kept)
        if found.warm and not again and least is not None:
            cold = f"The device has only {kept.hold.temperature:.1f} °C"
            text = f"{cold}: warm it to at least {least:.1f} °C, then hold this pose again."
            context.emit(EventKind.WARNING, text)
            return
        kept.ticks[kind] = found.key
        if kind is StepKind.UP_DOWN and context.procedure.count_faces:
            kept.ticks[StepKind.POSES] = found.key
        kept.hold = replace(kept.hold, pose=found.pose)
        if not again:
            self.wanted = None
        self._choose()
        if again:
            text = f"{found.label} is done already; kept as a repeat."
            context.emit(EventKind.ALREADY_DONE, text)
            return
        done, wanted = self.tally
        context.emit(EventKind.HOLD_TAKEN, f"{found.label} taken, {done:.0f} of {wanted:.0f}.")

    def _count_onwards(self, kept: KeptHold, up: FloatArray) -> None:
        """Count the hold for the poses of the next step too."""
        poses = self._context.procedure.step(StepKind.POSES).poses
        pose = nearest_pose(up, poses, POSE_TOLERANCE_DEG)
        if pose is not None:
            kept.ticks[StepKind.POSES] = pose
            kept.hold = replace(kept.hold, pose=pose)
            self._context.emit(
                EventKind.HOLD_TAKEN, f"{label(pose)} also counts as one of the poses."
            )

    def _least_warm(self, kept: KeptHold) -> float | None:
        """The temperature that a warm device must have, °C, if it has less; None if it is warm.

        Also None where the temperature is not known, or was not known before.
        """
        others = (one for one in self._context.measurements.holds if one is not kept)
        known = [one.hold.temperature for one in others if one.hold.temperature is not None]
        now = kept.hold.temperature
        if now is None or not known or now >= min(known) + MIN_WARMING:
            return None
        return min(known) + MIN_WARMING

    def _refuse(self, up: FloatArray | None) -> None:
        if up is None:
            text = (
                "The accelerometer reads almost nothing here. Check its values in the source step."
            )
        else:
            target = min(self.targets, key=lambda one: one.away(up))
            name = label(target.pose) if target.pose else "the pose"
            text = f"Held {target.away(up):.0f}° off {name}. The fit uses this hold too."
        self._context.emit(EventKind.WRONG_POSE, text)

    def _recognised(self, up: FloatArray) -> DirectionTarget | None:
        """The direction of the device; of several equal ones a missing one."""
        missing = self.missing
        near = [one for one in self.targets if one.near(up)]
        return min(near, key=lambda one: (round(one.away(up)), one not in missing), default=None)

    @property
    def _spent(self) -> bool:
        """Whether this placement was measured, so that the device must move first."""
        run = self._context.run
        return run.used or self._step.kind in run.received

    def _choose(self) -> None:
        """Choose the nearest missing direction, cold ones first; it stays until it is taken."""
        up, missing = self._context.up, self.missing
        if self.wanted in missing:
            return
        self.wanted = None
        if up is None:
            return
        cold = [one for one in missing if not one.warm] or list(missing)
        # between two holds in the same direction another direction is taken, if there is one
        elsewhere = [one for one in cold if not self._spent or one.away(up) > one.tolerance]
        self.wanted = min(
            elsewhere or cold, key=lambda one: round(one.away(up) / self.tie), default=None
        )

    def view(self) -> Status:
        """Instruction, directions done and missing, and the way to the wanted one."""
        up, wanted, missing = self._context.up, self.wanted, self.missing
        here = None if up is None else self._recognised(up)
        status = Status(
            act=Act.WAIT if missing else Act.DONE,
            instruction="ONE MOMENT" if missing else ALL_TAKEN,
            recognised=None if here is None else here.pose,
            done=tuple(one.pose for one in self.targets if one.pose and one not in missing),
            missing=tuple(one.pose for one in missing if one.pose),
            progress=self.tally,
            start_values=self._start_values(),
        )
        if wanted is None:
            return status
        aim = (float(wanted.up[0]), float(wanted.up[1]), float(wanted.up[2]))
        status = replace(
            status,
            act=Act.POSE,
            instruction=turn_up(wanted.pose) if wanted.pose else "TILT IT AS SHOWN",
            detail=f"warm it first; {wanted.words}" if wanted.warm else wanted.words,
            reason=wanted.why,
            aim=aim,
            wanted=wanted.pose,
            wanted_up=None if wanted.pose else aim,
            off_by=None if up is None else wanted.away(up),
        )
        return status if up is None else self._here(status, up, here, wanted)

    def _here(
        self,
        status: Status,
        up: FloatArray,
        here: DirectionTarget | None,
        wanted: DirectionTarget,
    ) -> Status:
        """The instruction where the device is now: hold it, lift it, or bring it to the pose."""
        still, spent = self._context.still, self._context.still and self._spent
        # a device that has long tried to rest here is offered ways to do so
        stays = still or self._context.watch.offered
        if spent and here is wanted:
            return replace(status, act=Act.LIFT, instruction="LIFT IT", guidance=PUT_BACK)
        if here is wanted:
            return replace(status, act=Act.HOLD, instruction=HOLD_STILL, guidance=THERE)
        if stays and not spent and self._counts(up):
            pose = f"{here.label} counts too" if here is not None else "a new orientation counts"
            return replace(
                status, act=Act.HOLD, instruction=HOLD_STILL, detail=pose, reason="", aim=None
            )
        return status

    def _counts(self, up: FloatArray) -> bool:
        """Whether a hold here counts for the step."""
        return self._recognised(up) in self.missing

    def _start_values(self) -> tuple[AxisStart, ...]:
        """Q's start values from the up/down holds, eq. 13–14.

        ``(a_up − a_down)/2`` is a *sensitivity*, reading per g; Q's eq. 5 multiplies by its
        reciprocal, the correction.
        """
        if self._step.kind is not StepKind.UP_DOWN:
            return ()
        ticked = self._context.measurements.ticked(StepKind.UP_DOWN)
        unit = self._context.units.accelerometer
        values = []
        for index, axis in enumerate(AXES):
            holds = (ticked.get(f"+{axis}"), ticked.get(f"-{axis}"))
            up, down = (
                None if one is None else float(one.hold.accelerometer[index]) for one in holds
            )
            bias = sensitivity = None
            if up is not None and down is not None:
                bias, sensitivity = (up + down) / 2.0, (up - down) / 2.0
            values.append(AxisStart(axis, up, down, bias, sensitivity, unit))
        return tuple(values)


def _already_taken(angle: float) -> str:
    """What to say of a hold so many degrees from a pose that is taken; a resumed one is there."""
    if round(angle) < 1:
        return "This pose is already taken. Tilt it to a new one."
    return f"Held only {angle:.0f}° from a pose already taken."


class ValidationStage(DirectionsStage):
    """Takes orientations that the fit has not seen; suggests corners, accepts any new one.

    Its holds go to the validation only.
    """

    tie = 1.0  # the corners have no order of their own

    def __init__(self, context: Context, step: Step) -> None:
        super().__init__(context, step)
        self.targets = tuple(
            DirectionTarget(name, up, name, POSE_TOLERANCE_DEG) for name, up in CORNERS.items()
        )
        self._new: tuple[DirectionTarget, ...] = ()

    @property
    def missing(self) -> tuple[DirectionTarget, ...]:
        """The corners that were new at the last choice; none once there are enough."""
        return () if self.finished else self._new

    @property
    def finished(self) -> bool:
        """Whether there are enough new orientations."""
        return len(self._context.measurements.validation) >= self._step.orientations

    @property
    def tally(self) -> tuple[float, float]:
        """New orientations taken, and needed."""
        taken = len(self._context.measurements.validation)
        return float(taken), float(self._step.orientations)

    def completed(self, kept: KeptHold) -> None:
        """Keep the hold if it is far from all known directions; else advise where to tilt."""
        context = self._context
        up = context.direction(kept)
        near = None if up is None else self._apart(up, self._known(kept))
        if up is None or near is not None:
            context.measurements.remove(kept)
            where = "" if near is None else _already_taken(near)
            context.emit(
                EventKind.WRONG_POSE,
                where
                or "The accelerometer reads almost nothing "
                "here. Check its values in the source "
                "step.",
            )
            return
        kept.hold = replace(kept.hold, pose=nearest_pose(up, DIRECTIONS, POSE_TOLERANCE_DEG))
        self._choose()
        done, wanted = self.tally
        text = f"New orientation taken, {done:.0f} of {wanted:.0f}."
        context.emit(EventKind.HOLD_TAKEN, text)

    def _choose(self) -> None:
        """Choose the nearest new corner."""
        known = self._known(None)
        self._new = tuple(one for one in self.targets if self._apart(one.up, known) is None)
        super()._choose()

    def _known(self, apart_from: KeptHold | None) -> list[FloatArray]:
        own = self._context.measurements
        kept = [hold for hold in (*own.holds, *own.validation) if hold is not apart_from]
        ups = [self._context.direction(hold) for hold in kept]
        return [up for up in ups if up is not None]

    def _apart(self, up: FloatArray, known: list[FloatArray]) -> float | None:
        """Angle to the nearest known direction, degrees; None if it is large enough."""
        angle = math.degrees(min((angle_between(up, other) for other in known), default=math.pi))
        return angle if angle < self._step.apart_deg else None

    def view(self) -> Status:
        """The suggested corner; other new orientations count too."""
        status, up = super().view(), self._context.up
        return replace(
            status,
            detail="any other new orientation counts too"
            if status.act is Act.POSE
            else status.detail,
            recognised=None if up is None else nearest_pose(up, DIRECTIONS, POSE_TOLERANCE_DEG),
            done=(),
            missing=(),
        )

    def _counts(self, up: FloatArray) -> bool:
        """Every new orientation counts."""
        return self._apart(up, self._known(self._context.run.kept)) is None
