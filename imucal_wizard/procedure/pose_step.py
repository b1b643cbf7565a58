"""Up/down and poses: named directions in any order, recognised by themselves."""

from dataclasses import replace

from imucal_wizard.procedure.ledger import KeptHold
from imucal_wizard.procedure.moments import Moment
from imucal_wizard.procedure.plan import Step
from imucal_wizard.procedure.poses import (
    AXES,
    FACE_TOLERANCE_DEG,
    NAMED,
    POSE_TOLERANCE_DEG,
    TIE_DEG,
    nearest,
    spoken,
    turn_towards,
)
from imucal_wizard.procedure.scene import Scene
from imucal_wizard.procedure.state import AxisStart, EventKind, Status, StepKind
from imucal_wizard.procedure.wording import PUT_BACK, how_to_turn, label, lift_and_turn, turn_up
from imucal_wizard.readings import FloatArray


class PoseStage:
    """Takes the poses of one step."""

    def __init__(self, scene: Scene, step: Step) -> None:
        self._scene = scene
        self._step = step
        self.seconds = step.seconds
        self.wanted: str | None = None
        edges = any(len(pose) > 2 for pose in step.poses)
        self._tolerance = POSE_TOLERANCE_DEG if edges else FACE_TOLERANCE_DEG

    @property
    def done(self) -> tuple[str, ...]:
        """The poses taken, in the order of the list."""
        ticked = self._scene.ledger.ticked(self._step.kind)
        return tuple(pose for pose in self._step.poses if pose in ticked)

    @property
    def missing(self) -> tuple[str, ...]:
        """The poses still to take."""
        done = set(self.done)
        return tuple(pose for pose in self._step.poses if pose not in done)

    @property
    def finished(self) -> bool:
        """All poses are taken."""
        return not self.missing

    @property
    def tally(self) -> tuple[float, float]:
        """Poses taken, poses wanted."""
        return float(len(self.done)), float(len(self._step.poses))

    def enter(self) -> None:
        """Ask for the nearest missing pose."""
        self.wanted = None
        self._choose()

    def follow(self, moment: Moment) -> None:  # noqa: ARG002 -- every stage is told of each moment
        """Ask for a pose as soon as it is known where the device is."""
        if self.wanted is None:
            self._choose()

    def ask_again(self, pose: str) -> None:
        """Ask for the pose that was taken back, wherever the device is."""
        if pose in self.missing:
            self.wanted = pose

    def completed(self, kept: KeptHold) -> None:
        """Tick the pose of this hold, or say why it is none."""
        scene, kind = self._scene, self._step.kind
        up = scene.direction(kept)
        pose = None if up is None else nearest(up, self._step.poses, self._tolerance)
        if kind is StepKind.UP_DOWN and up is not None and not scene.procedure.led:
            self._count_onwards(kept, up)
        if pose is None:
            if StepKind.POSES not in kept.ticks:
                self._refuse(up)
            return
        again = pose in self.done
        kept.ticks[kind] = pose
        if kind is StepKind.UP_DOWN and scene.procedure.count_faces:
            kept.ticks[StepKind.POSES] = pose
        kept.hold = replace(kept.hold, pose=pose)
        if not again:
            self.wanted = None
        self._choose()
        following = f" Next: {label(self.wanted)} up." if self.wanted else ""
        if again:
            scene.emit(
                EventKind.ALREADY_DONE,
                f"{label(pose)} is done already; kept as a repeat.{following}",
            )
        else:
            done, wanted = self.tally
            scene.emit(
                EventKind.HOLD_TAKEN, f"{label(pose)} taken, {done:.0f} of {wanted:.0f}.{following}"
            )

    def _count_onwards(self, kept: KeptHold, up: FloatArray) -> None:
        """Tick it among the poses of the next step, which nobody will take again."""
        poses = self._scene.procedure.step(StepKind.POSES).poses
        pose = nearest(up, poses, POSE_TOLERANCE_DEG)
        if pose is not None:
            kept.ticks[StepKind.POSES] = pose
            kept.hold = replace(kept.hold, pose=pose)
            self._scene.emit(EventKind.HOLD_TAKEN, f"{label(pose)} is among the poses.")

    def _refuse(self, up: FloatArray | None) -> None:
        if up is None:
            self._scene.emit(
                EventKind.WRONG_POSE,
                "The accelerometer reads almost nothing here: is an axis dead, or its unit wrong? "
                "Look at the values in the source step (b goes back).",
            )
            return
        pose = min(self._step.poses, key=lambda name: turn_towards(up, NAMED[name])[2])
        axis, sense, angle = turn_towards(up, NAMED[pose])
        self._scene.emit(
            EventKind.WRONG_POSE,
            f"{angle:.0f}° off {label(pose)}: turn it about {axis}, to the {sense}. "
            "Kept for the fit all the same.",
        )

    def _choose(self) -> None:
        """The missing pose that is the smallest turn from here; it stays until it is taken."""
        missing = self.missing
        if self.wanted in missing:
            return
        up = self._scene.up
        if not missing or up is None:
            self.wanted = None
            return
        here = nearest(up, self._step.poses, self._tolerance) if self._scene.run.used else None
        near = [pose for pose in missing if pose != here] or list(missing)

        def turn(pose: str) -> tuple[int, int]:
            angle = turn_towards(up, NAMED[pose])[2]
            return round(angle / TIE_DEG), self._step.poses.index(pose)

        self.wanted = min(near, key=turn)

    def view(self) -> Status:
        """Instruction, what is done and missing, and the way to the wanted pose."""
        scene, wanted = self._scene, self.wanted
        up = scene.up
        recognised = None if up is None else nearest(up, self._step.poses, self._tolerance)
        off_by = None
        if up is not None and wanted is not None:
            off_by = turn_towards(up, NAMED[wanted])[2]
        return Status(
            instruction=self._instruction(),
            detail=spoken(wanted) if wanted else "",
            guidance=self._guidance(up, recognised),
            wanted=wanted,
            recognised=recognised,
            off_by=off_by,
            done=self.done,
            missing=self.missing,
            progress=self.tally,
            start_values=self.start_values(),
        )

    def _instruction(self) -> str:
        if self.wanted is not None:
            return turn_up(self.wanted)
        return "HOLD IT STILL" if self.missing else "ALL TAKEN"

    def _guidance(self, up: FloatArray | None, recognised: str | None) -> str:
        if up is None or self.wanted is None:
            return ""
        way = how_to_turn(up, self.wanted)
        if self._scene.still and self._scene.run.used:
            again = recognised == self.wanted
            return PUT_BACK if again else lift_and_turn(up, self.wanted)
        if recognised == self.wanted:
            return "there: hold it still"
        if recognised in self.missing:
            return f"{label(recognised)} is missing too: hold it still"
        return way

    def start_values(self) -> tuple[AxisStart, ...]:
        """Q's start values from the up/down holds, eq. 13–14.

        ``(a_up − a_down)/2`` is a *sensitivity*, reading per g; Q's eq. 5 multiplies by its
        reciprocal, the correction.
        """
        if self._step.kind is not StepKind.UP_DOWN:
            return ()
        ticked = self._scene.ledger.ticked(StepKind.UP_DOWN)
        unit = self._scene.units.accelerometer

        def reading(pose: str, axis: int) -> float | None:
            kept = ticked.get(pose)
            return None if kept is None else float(kept.hold.accelerometer[axis])

        values = []
        for index, axis in enumerate(AXES):
            up, down = reading(f"+{axis}", index), reading(f"-{axis}", index)
            bias = sensitivity = None
            if up is not None and down is not None:
                bias, sensitivity = (up + down) / 2.0, (up - down) / 2.0
            values.append(AxisStart(axis, up, down, bias, sensitivity, unit))
        return tuple(values)
