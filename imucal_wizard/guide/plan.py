"""The procedure as data: which steps there are, and what each of them needs."""

from dataclasses import dataclass, replace

from imucal_wizard.core.poses import EDGES, FACES, POSE_SETS
from imucal_wizard.guide.kinds import StepKind


@dataclass(frozen=True)
class Step:
    """One step of the procedure.

    Attributes:
        kind: which step.
        seconds: how long the device must be at rest for one hold, s.
        poses: names of the poses to take (up/down, poses).
        per_axis: how many rotations about each axis (rotations).
        minimum_deg: a rotation smaller than this says too little, degrees (rotations).
        orientations: how many new orientations (validation).
        apart_deg: how far a new orientation lies from every one known, degrees (validation).
        skipped: what it means for the result when the step is left out.
    """

    kind: StepKind
    seconds: float = 2.0
    poses: tuple[str, ...] = ()
    per_axis: int = 0
    minimum_deg: float = 20.0
    orientations: int = 0
    apart_deg: float = 15.0
    skipped: str = ""


STANDARD_STEPS: tuple[Step, ...] = (
    Step(StepKind.SOURCE),
    Step(
        StepKind.SETTLE,
        seconds=10.0,
        skipped="the limits of rest are typical values, not this device's noise",
    ),
    Step(
        StepKind.UP_DOWN,
        poses=tuple(FACES),
        skipped="no start values: the fit begins with a sphere through the poses",
    ),
    Step(
        StepKind.POSES,
        poses=(*FACES, *EDGES),
        skipped="fewer directions: parameters that they cannot determine keep their nominal values",
    ),
    Step(
        StepKind.ROTATIONS,
        seconds=3.0,
        per_axis=6,
        skipped="the gyroscope has only the motions between poses: parameters that they cannot "
        "determine keep their nominal values",
    ),
    Step(
        StepKind.FIELD,
        skipped="the magnetometer is not calibrated: no hard and soft iron, no heading",
    ),
    Step(StepKind.RESULT),
    Step(
        StepKind.VALIDATE,
        orientations=4,
        skipped="the error is known only from the data that were fitted",
    ),
    Step(StepKind.SAVE),
)


@dataclass(frozen=True)
class Procedure:
    """The steps in their order, each kind at most once.

    Attributes:
        steps: the steps.
        count_faces: the faces of the up/down step count among the poses too.
        led: the operator is led through the steps. In a recording each hold counts among the poses
            whenever it came.
    """

    steps: tuple[Step, ...] = STANDARD_STEPS
    count_faces: bool = False
    led: bool = True

    def step(self, kind: StepKind) -> Step:
        """The step of this kind; a step without needs when the procedure does not have it."""
        return next((step for step in self.steps if step.kind is kind), Step(kind))

    @property
    def kinds(self) -> tuple[StepKind, ...]:
        """The kinds of steps in their order."""
        return tuple(step.kind for step in self.steps)


def standard(
    rotations_per_axis: int = 6,
    *,
    poses: str = "18",
    settle_seconds: float = 10.0,
    hold_seconds: float = 2.0,
    rotation_hold_seconds: float = 3.0,
    count_faces: bool = False,
) -> Procedure:
    """Q's procedure with the settings that a person may choose; Q itself takes 18 rotations.

    Args:
        rotations_per_axis: 0 for no rotations at all: the gyroscope's offset needs none.
        poses: a name of ``poses.POSE_SETS``. N's eight take the place of the faces, too.
        settle_seconds: of rest at the beginning.
        hold_seconds: of each pose.
        rotation_hold_seconds: of rest before and after each rotation.
        count_faces: the faces of the up/down step count among the poses too.
    """
    left_out = set()
    if poses == "8":
        left_out.add(StepKind.UP_DOWN)
    if not rotations_per_axis:
        left_out.add(StepKind.ROTATIONS)
    seconds = {
        StepKind.SETTLE: settle_seconds,
        StepKind.UP_DOWN: hold_seconds,
        StepKind.POSES: hold_seconds,
        StepKind.ROTATIONS: rotation_hold_seconds,
        StepKind.VALIDATE: hold_seconds,
    }
    steps = (
        replace(
            step,
            seconds=seconds.get(step.kind, step.seconds),
            per_axis=rotations_per_axis if step.kind is StepKind.ROTATIONS else 0,
            poses=POSE_SETS[poses] if step.kind is StepKind.POSES else step.poses,
        )
        for step in STANDARD_STEPS
        if step.kind not in left_out
    )
    return Procedure(tuple(steps), count_faces)
