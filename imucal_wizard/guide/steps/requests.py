"""Measurements that the bench requests: poses in any order, then rotations."""

from collections.abc import Sequence
from dataclasses import replace

from imucal_wizard.core.limits.procedure import REQUEST_TOLERANCE_DEG
from imucal_wizard.core.poses import POSE_TOLERANCE_DEG
from imucal_wizard.guide.context import Context
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.measurements import KeptHold
from imucal_wizard.guide.plan import Step
from imucal_wizard.guide.state import Status
from imucal_wizard.guide.steps.directions import DirectionsStage, DirectionTarget
from imucal_wizard.guide.steps.rotations import RotationsStage
from imucal_wizard.measurement.requests import MeasurementRequest
from imucal_wizard.measurement.stillness import Block


class RequestsStage(DirectionsStage):
    """Takes the requested poses, then the requested rotations.

    Args:
        context: shared by all steps.
        pose: what a pose needs.
        rotation: what a rotation needs.

    Attributes:
        since: sample time of the request, s.
    """

    tie = 1.0  # the requests have no order of their own

    def __init__(self, context: Context, pose: Step, rotation: Step) -> None:
        super().__init__(context, replace(pose, kind=StepKind.MORE, poses=()))
        self._rotation_step = replace(rotation, kind=StepKind.MORE)
        self._rotations = RotationsStage(context, self._rotation_step, {})
        self._round = 0
        self.since = 0.0

    def ask(self, requests: Sequence[MeasurementRequest]) -> None:
        """Begin with these requests: poses, those with a warm device last, then rotations."""
        context = self._context
        self._round, self.since, self.wanted = self._round + 1, context.time, None
        poses = sorted((one for one in requests if not one.axis), key=lambda one: one.warm)
        self.targets = tuple(
            DirectionTarget(
                f"{self._round}.{index}",
                one.direction,
                one.pose,
                POSE_TOLERANCE_DEG if one.pose else REQUEST_TOLERANCE_DEG,
                one.reason,
                one.warm,
            )
            for index, one in enumerate(poses)
        )
        needs: dict[str, int] = {}
        for one in requests if context.has_gyroscope else ():
            if one.axis:
                needs[one.axis] = needs.get(one.axis, 0) + one.turns
        self._rotations = RotationsStage(context, self._rotation_step, needs, context.time)

    @property
    def rotating(self) -> bool:
        """Whether the poses are done and rotations are missing."""
        return not self.missing and not self._rotations.finished

    @property
    def seconds(self) -> float:
        """How long the device must be at rest for one hold, s."""
        return (self._rotation_step if self.rotating else self._step).seconds

    @property
    def finished(self) -> bool:
        """Whether all poses and rotations are taken."""
        return not self.missing and self._rotations.finished

    @property
    def tally(self) -> tuple[float, float]:
        """Poses and rotations taken, and needed."""
        poses, rotations = super().tally, self._rotations.tally
        return poses[0] + rotations[0], poses[1] + rotations[1]

    @property
    def holds_here(self) -> bool:
        """Whether a hold here counts for a pose or a rotation."""
        return self._rotations.holds_here if self.rotating else super().holds_here

    def enter(self) -> None:
        """Choose the nearest pose."""
        self._rotations.enter()
        super().enter()

    def follow(self, block: Block) -> None:
        """Choose a pose as soon as the up direction is known, or follow a rotation."""
        if self.rotating:
            self._rotations.follow(block)
        else:
            super().follow(block)

    def completed(self, kept: KeptHold) -> None:
        """Count the hold for its pose, or judge the rotation that it ends."""
        if self.rotating:
            self._rotations.completed(kept)
        else:
            super().completed(kept)

    def view(self) -> Status:
        """The wanted pose or rotation, and the way to it."""
        status = super().view()
        if self.rotating:
            return replace(self._rotations.view(), done=status.done, progress=self.tally)
        return status
