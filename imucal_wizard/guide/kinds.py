"""The kinds of steps and events. The first screen needs them, so this module imports no NumPy."""

from collections.abc import Mapping
from enum import StrEnum


class StepKind(StrEnum):
    """The steps of the wizard, in their default order."""

    SOURCE = "source"
    SETTLE = "settle"
    UP_DOWN = "up-down"
    POSES = "poses"
    ROTATIONS = "rotations"
    FIELD = "field"
    """Circles for the magnetometer, if the stream has one."""
    RESULT = "result"
    MORE = "more"
    """Measurements that the bench requests; the result follows again."""
    VALIDATE = "validate"
    SAVE = "save"
    RECHECK = "recheck"
    """Poses until every change that a recheck looks for would be seen."""
    VERDICT = "verdict"
    """GO or NO-GO."""


class Act(StrEnum):
    """What the operator is to do now; exactly one at any moment."""

    WAIT = "wait"
    CONNECT = "connect"
    """No samples arrive."""
    ENDED = "ended"
    """The source has ended; nothing more can be measured."""
    LAY_DOWN = "lay-down"
    POSE = "pose"
    """Bring a direction on top."""
    HOLD = "hold"
    LIFT = "lift"
    """Lift it, and put it back in the same way."""
    ROTATE = "rotate"
    CIRCLE = "circle"
    """Turn it round on the table, or tumble it."""
    DONE = "done"
    """The step has all that it needs."""


class EventKind(StrEnum):
    """Kinds of events, each with its own sound."""

    STILL = "still"
    MOVED = "moved"
    HOLD_TAKEN = "hold-taken"
    HOLD_BROKEN = "hold-broken"
    ALREADY_DONE = "already-done"
    WRONG_POSE = "wrong-pose"
    ROTATION_TAKEN = "rotation-taken"
    ROTATION_REJECTED = "rotation-rejected"
    STUCK = "stuck"
    STEP_DONE = "step-done"
    STEP_SKIPPED = "step-skipped"
    UNDONE = "undone"
    LINK_LOST = "link-lost"
    LINK_BACK = "link-back"
    STALLED = "stalled"
    FLOWING = "flowing"
    FIELD_BACK = "field-back"
    WARNING = "warning"
    FINISHED = "finished"


TITLES: Mapping[str, str] = {
    StepKind.SOURCE: "Source",
    StepKind.SETTLE: "Settle",
    StepKind.UP_DOWN: "Up/down",
    StepKind.POSES: "Poses",
    StepKind.ROTATIONS: "Rotations",
    StepKind.FIELD: "Field",
    StepKind.RESULT: "Result",
    StepKind.MORE: "More poses",
    StepKind.VALIDATE: "Validate",
    StepKind.SAVE: "Save",
    StepKind.RECHECK: "Recheck",
    StepKind.VERDICT: "Verdict",
}
MEASURING = (
    StepKind.SETTLE,
    StepKind.UP_DOWN,
    StepKind.POSES,
    StepKind.ROTATIONS,
    StepKind.FIELD,
    StepKind.RECHECK,
)
"""Steps that measure for the fit; each begins by itself, the result follows the last."""
AFTERWARDS = (StepKind.RESULT, StepKind.MORE, StepKind.VALIDATE, StepKind.SAVE)
"""Steps after the fit, in which the bench can request more measurements."""
