"""What the procedure tells whoever watches it: frozen, whole, and cheap to replace.

The machine in ``steps.py`` makes one ``Status`` whenever it is asked; screens, sounds and tests
read nothing else.
"""

from dataclasses import dataclass, field
from enum import StrEnum

from imucal_wizard.procedure.field_status import FieldStatus


class StepKind(StrEnum):
    """The steps of the wizard, in their default order."""

    SOURCE = "source"
    SETTLE = "settle"
    UP_DOWN = "up-down"
    POSES = "poses"
    ROTATIONS = "rotations"
    FIELD = "field"
    """Circles for the magnetometer; only there when the stream has one."""
    RESULT = "result"
    MORE = "more"
    """An excursion from the result and back: what the bench asks for."""
    VALIDATE = "validate"
    SAVE = "save"


class EventKind(StrEnum):
    """Things that happen, each with a sound of its own."""

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
    WRITTEN_AGAIN = "written-again"
    WARNING = "warning"
    FINISHED = "finished"


@dataclass(frozen=True)
class Event:
    """One thing that happened.

    Attributes:
        kind: what.
        time: sample time, s.
        text: one short plain sentence.
    """

    kind: EventKind
    time: float
    text: str


@dataclass(frozen=True)
class AxisMotion:
    """How much one axis moves, against which limit, in the unit a person reads."""

    channel: str
    """``ax`` … ``gz``."""
    value: float
    limit: float
    unit: str
    """``mg``, ``°/s`` or ``count``."""

    @property
    def moving(self) -> bool:
        """Whether the value is over its limit (a value that is not a number is)."""
        return not self.value <= self.limit


@dataclass(frozen=True)
class StillStatus:
    """Is the device still; if not, which axis moves, by how much, against which limit.

    Attributes:
        still: the decision at the newest block.
        motions: all axes, accelerometer first; empty before the first window is full.
        worst: the axis farthest over its limit (or nearest to it when still); None at the start.
        held: seconds of the present hold so far.
        needed: seconds wanted.
        waiting: seconds since the device was last still while a hold was asked for.
        loosened: factor by which the limits are wider than the settle step set them.
        reason: why it does not count as still, in words ("z turns at 2.9 °/s, limit 0.8"), or "".
        spent: this placement counts no more; the device must be moved before it can count again.
    """

    still: bool = False
    motions: tuple[AxisMotion, ...] = ()
    worst: AxisMotion | None = None
    held: float = 0.0
    needed: float = 2.0
    waiting: float = 0.0
    loosened: float = 1.0
    reason: str = ""
    spent: bool = False


@dataclass(frozen=True)
class Offer:
    """A way out or a choice: the command, its key, and what it does in plain words."""

    command: str
    key: str
    text: str


@dataclass(frozen=True)
class RotationStatus:
    """The rotation under way, or awaited.

    Attributes:
        axis: about which axis rotations are wanted now.
        start_pose: the pose to start from (``+z`` for x and y, ``+x`` for z).
        angle: angle so far about the axis, degrees, from the accelerometer unwrapped with the rate.
        rate: present rate about the axis, degrees per second (counts while the scale is unknown).
        fastest: fastest rate so far in this rotation.
        range_limit: full scale of the gyroscope in the same unit; the smallest usual one where its
            own is not known; None for counts.
        done: signed angles of the rotations taken about this axis, degrees.
        wanted: how many are wanted about this axis.
        senses: whether both senses have been turned.
        speeds: how many different speeds have been seen (slow, medium, fast).
        advice: what is still missing, in words ("turn the other way", "go slower"), or "".
        range_known: whether ``range_limit`` is the gyroscope's own.
    """

    axis: str
    start_pose: str
    angle: float = 0.0
    rate: float = 0.0
    fastest: float = 0.0
    range_limit: float | None = None
    done: tuple[float, ...] = ()
    wanted: int = 6
    senses: bool = False
    speeds: int = 0
    advice: str = ""
    range_known: bool = True


@dataclass(frozen=True)
class AxisStart:
    """Q's start values for one axis (eq. 13–14), None until both poses are known."""

    axis: str
    up: float | None = None
    down: float | None = None
    bias: float | None = None
    sensitivity: float | None = None
    """Reading per g: ``(a_up − a_down) / 2``."""
    unit: str = "m/s^2"


@dataclass(frozen=True)
class Status:
    """Everything a screen shows of the procedure at one moment.

    Attributes:
        step: the step the machine is in.
        elapsed: seconds of samples since the first one.
        instruction: what to do now, short, in capitals where it is a pose ("TURN +X −Y UP").
        detail: one more line in plain words.
        reason: what it is asked for, where that is not plain; or "".
        guidance: how to get there ("23° away: turn it about z, to the left"), or "".
        still: the stillness decision and its reasons.
        up: present up direction in the body frame, or None before it is known.
        wanted: name of the pose asked for next, or None.
        wanted_up: up in the pose asked for next where it has no name, or None.
        recognised: name of the pose the device is in, or None.
        off_by: degrees between ``up`` and the wanted pose, or None.
        done: names of the poses taken in this step.
        missing: names of the poses still to take in this step.
        progress: (done, wanted) of this step in its own unit (seconds, poses, rotations).
        start_values: the up/down start values, live.
        rotation: the rotation under way, in that step only.
        field: the magnetometer's circles, in that step only.
        noise: (accelerometer, gyroscope) noise per axis from the settle step as a text, or "".
        offers: ways out and choices open now.
        last_event: the newest event, or None.
        holds: how many holds have been kept in all.
        rotations: how many rotations have been kept in all.
        skipped: steps that were skipped, with the consequence.
        steps: all steps of this procedure, in their order; () for all that there are.
        poses: how many poses the step of the poses asks for.
    """

    step: StepKind = StepKind.SOURCE
    elapsed: float = 0.0
    instruction: str = ""
    detail: str = ""
    reason: str = ""
    guidance: str = ""
    still: StillStatus = field(default_factory=StillStatus)
    up: tuple[float, float, float] | None = None
    wanted: str | None = None
    wanted_up: tuple[float, float, float] | None = None
    recognised: str | None = None
    off_by: float | None = None
    done: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    progress: tuple[float, float] = (0.0, 1.0)
    start_values: tuple[AxisStart, ...] = ()
    rotation: RotationStatus | None = None
    field: FieldStatus | None = None
    noise: str = ""
    offers: tuple[Offer, ...] = ()
    last_event: Event | None = None
    holds: int = 0
    rotations: int = 0
    skipped: tuple[tuple[StepKind, str], ...] = ()
    steps: tuple[StepKind, ...] = ()
    poses: int = 18
