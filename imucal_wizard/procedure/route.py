"""Which step comes when; each is at work in a stage of its own."""

from imucal_wizard.procedure.field.stage import FieldStage
from imucal_wizard.procedure.holding import Holding
from imucal_wizard.procedure.more_step import MoreStage
from imucal_wizard.procedure.plain_step import PlainStage
from imucal_wizard.procedure.pose_step import PoseStage
from imucal_wizard.procedure.rotation_step import RotationStage
from imucal_wizard.procedure.scene import Scene, Stage
from imucal_wizard.procedure.settle_step import SettleStage
from imucal_wizard.procedure.state import EventKind, StepKind
from imucal_wizard.procedure.stillness import Noise
from imucal_wizard.procedure.validate_step import ValidateStage
from imucal_wizard.procedure.wording import TITLES

MEASURING = (
    StepKind.SETTLE,
    StepKind.UP_DOWN,
    StepKind.POSES,
    StepKind.ROTATIONS,
    StepKind.FIELD,
)
"""The steps that follow one another by themselves; the result comes after the last."""


class Route:
    """The way through the steps.

    Attributes:
        settle: the settle stage, whose limits all others use.
        field: the stage of the magnetometer's circles.
        more: the stage of what is asked for beyond the plan; not one of the procedure's steps.
        stages: the stage of each step.
        step: the step at work.
        skipped: steps left out, with the consequence.
        return_to: the step to come back to when the noise has been measured again.
    """

    def __init__(self, scene: Scene, holding: Holding, noise: Noise | None = None) -> None:
        self._scene = scene
        self._holding = holding
        procedure = scene.procedure
        self.settle = SettleStage(scene, procedure.step(StepKind.SETTLE), noise)
        self.stages: dict[StepKind, Stage] = {
            StepKind.SETTLE: self.settle,
            StepKind.UP_DOWN: PoseStage(scene, procedure.step(StepKind.UP_DOWN)),
            StepKind.POSES: PoseStage(scene, procedure.step(StepKind.POSES)),
            StepKind.ROTATIONS: RotationStage(scene, procedure.step(StepKind.ROTATIONS)),
            StepKind.VALIDATE: ValidateStage(scene, procedure.step(StepKind.VALIDATE)),
        }
        poses, turns = procedure.step(StepKind.POSES), procedure.step(StepKind.ROTATIONS)
        self.more = MoreStage(scene, poses, turns)
        self.stages[StepKind.MORE] = self.more
        self.field = FieldStage(scene)
        self.stages[StepKind.FIELD] = self.field
        for kind in (StepKind.SOURCE, StepKind.RESULT, StepKind.SAVE):
            self.stages[kind] = PlainStage(kind)
        self.step = procedure.kinds[0]
        self.skipped: dict[StepKind, str] = {}
        self.return_to: StepKind | None = None

    @property
    def stage(self) -> Stage:
        """The step at work."""
        return self.stages[self.step]

    @property
    def _begins_at_rest(self) -> bool:
        """Whether the hold that the device is in may begin a turn."""
        return self.step is StepKind.MORE and self.more.turning

    @property
    def asking(self) -> bool:
        """Whether a hold is asked for now."""
        return self.stage.seconds > 0.0

    @property
    def kinds(self) -> tuple[StepKind, ...]:
        """The steps there are for this stream, in their order."""
        every = self._scene.procedure.kinds
        if self._scene.has_magnetometer:
            return every
        return tuple(kind for kind in every if kind is not StepKind.FIELD)

    def enter(self, kind: StepKind) -> None:
        """Begin a step, or come back to it."""
        scene = self._scene
        self.step = kind
        self.skipped.pop(kind, None)
        kept = scene.run.kept
        if kind is StepKind.SETTLE:
            self._holding.restart()
        elif kept is not None and (kind is StepKind.VALIDATE or kept.ticks):
            # One placement is one measurement: a repeat begins with a move.
            scene.run.used = kind is not StepKind.ROTATIONS and not self._begins_at_rest
        if kind is StepKind.SAVE and not self.stages[StepKind.VALIDATE].finished:
            self.skipped[StepKind.VALIDATE] = self._unchecked()
        if kind is StepKind.RESULT:
            # What is fitted on the way into the result stays what it is.
            self._holding.finish()
            scene.run.complete = kept is not None
        scene.watch.rest()
        self.stage.enter()

    def _unchecked(self) -> str:
        """What it means that the validation is not whole."""
        taken, wanted = self.stages[StepKind.VALIDATE].tally
        if not taken:
            return self._scene.procedure.step(StepKind.VALIDATE).skipped
        return f"{taken:.0f} of {wanted:.0f} new orientations were taken"

    def advance(self) -> None:
        """The step has all it needs: on to the next that does not."""
        self._scene.emit(EventKind.STEP_DONE, f"{TITLES[self.step]} done.")
        self.go_on()

    def go_on(self) -> None:
        """Enter the next step that is neither finished nor skipped."""
        if self.step is StepKind.SETTLE and self.return_to is not None:
            kind, self.return_to = self.return_to, None
            self.enter(kind)
            return
        if self.step is StepKind.MORE:
            self._arrive(StepKind.RESULT)
            return
        kinds = self.kinds
        for kind in kinds[kinds.index(self.step) + 1 :]:
            if self._left_out(kind):
                continue
            self._arrive(kind)
            return

    def _arrive(self, kind: StepKind) -> None:
        self.enter(kind)
        if kind is StepKind.RESULT:
            left = ", ".join(TITLES[kind] for kind in self.skipped)
            text = f"Measured, but for {left}." if left else "Everything is measured."
            self._scene.emit(EventKind.FINISHED, text)

    def leave_out(self, before: StepKind) -> None:
        """What is jumped over on the way to a step is left out, and its consequence known."""
        if self.step is StepKind.MORE:
            return
        kinds = self.kinds
        for kind in kinds[kinds.index(self.step) : kinds.index(before)]:
            if kind in MEASURING and not self.stages[kind].finished:
                self.skipped[kind] = self._scene.procedure.step(kind).skipped

    def _left_out(self, kind: StepKind) -> bool:
        if kind not in MEASURING:
            return False
        if self.stages[kind].finished or kind in self.skipped:
            return True
        if kind is StepKind.ROTATIONS and not self._scene.has_gyroscope:
            self.skipped[kind] = "the stream has no gyroscope"
            self._scene.emit(EventKind.STEP_SKIPPED, "No gyroscope: no rotations.")
            return True
        return False
