"""The procedure as data: its steps and what each step needs."""

from dataclasses import replace

from imucal_wizard.core.poses import EDGES, FACES, POSE_SETS
from imucal_wizard.core.records import dataclass
from imucal_wizard.guide.kinds import StepKind


@dataclass(frozen=True)
class Step:
    """One step of the procedure.

    Attributes:
        kind: kind of the step.
        seconds: rest for one hold, s.
        poses: names of the poses to take (up/down, poses).
        per_axis: number of rotations about each axis (rotations).
        minimum_deg: smallest rotation that counts, degrees (rotations).
        orientations: number of new orientations (validation).
        apart_deg: least angle between a new orientation and every known one (validation).
        skipped: consequence for the result if the step is skipped.
    """

    kind: StepKind
    seconds: float = 2.0
    poses: tuple[str, ...] = ()
    per_axis: int = 0
    minimum_deg: float = 20.0
    orientations: int = 0
    apart_deg: float = 15.0
    skipped: str = ""


_SETTLE = Step(
    StepKind.SETTLE,
    seconds=10.0,
    skipped="the limits of rest are typical values, not this device's noise",
)
STANDARD_STEPS: tuple[Step, ...] = (
    Step(StepKind.SOURCE),
    _SETTLE,
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
        skipped="the gyroscope has only the motions made before: parameters that they cannot "
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
        skipped="the error is known from held-out data only, not from new orientations",
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
        """The step of this kind; an empty one if the procedure does not have it."""
        return next((step for step in self.steps if step.kind is kind), Step(kind))

    @property
    def kinds(self) -> tuple[StepKind, ...]:
        """The kinds of steps in their order."""
        return tuple(step.kind for step in self.steps)


RECHECK_STEPS: tuple[Step, ...] = (
    Step(StepKind.SOURCE),
    replace(_SETTLE, seconds=5.0),
    Step(
        StepKind.RECHECK,
        poses=(*FACES, *EDGES),
        skipped="axes that were not measured are not judged",
    ),
    Step(StepKind.VERDICT),
)
"""A recheck ends as soon as the poses taken would show every change that is looked for."""


def consequence(kind: StepKind) -> str:
    """Consequence for the result if a step is skipped; "" if it has none."""
    return next(one.skipped for one in (*STANDARD_STEPS, *RECHECK_STEPS) if one.kind is kind)


def standard(
    rotations_per_axis: int = 6,
    *,
    poses: str = "18",
    settle_seconds: float = 10.0,
    hold_seconds: float = 2.0,
    rotation_hold_seconds: float = 3.0,
    count_faces: bool = False,
) -> Procedure:
    """Q's procedure with its settings; Q takes 18 rotations.

    Args:
        rotations_per_axis: 0 for none; the gyroscope's offset needs no rotations.
        poses: a name of ``poses.POSE_SETS``; with N's eight there is no up/down step.
        settle_seconds: rest at the beginning, s.
        hold_seconds: rest in each pose, s.
        rotation_hold_seconds: rest before and after each rotation, s.
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
