"""The status of the procedure: frozen, complete, and cheap to replace.

The state machine makes one ``Status`` whenever it is asked; screens, sounds and tests read nothing
else.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.estimate.ellipsoid.coverage import BINS
from imucal_wizard.guide.kinds import EventKind, StepKind

GOOD = {"gaps": 15.0, "variance": 4.5, "wobble": 4.0, "fit_error": 5.0}
"""Per cent below which each figure is good: the limits that users of MotionCal know. Gaps are those
of free tumbling; circles on all six faces are enough whatever gaps they leave."""


def _empty() -> NDArray[np.intp]:
    return np.zeros(BINS, np.intp)


@dataclass(frozen=True, eq=False)
class FieldStatus:
    """The magnetometer's circles at one moment.

    Directions are those of the field seen from the body, by the provisional calibration; areas are
    numbered as in ``ellipsoid.bins``.

    Attributes:
        face: the face to be laid on the table next (``-z``: the bottom), or None where any motion
            will do.
        face_down: the face that lies on the table now, or None while none does.
        turned: degrees turned so far with that face down, 0 to 360; 0 while none is.
        done: faces whose circle is complete, in the order of the list.
        missing: faces whose circle is not.
        counts: samples in each area, shape (100,); no more than are needed to see that it is full.
        here: area of the newest sample, or None.
        gaps: share of the sphere that no sample is near, per cent; None before there is a fit.
        variance: magnitude variance, per cent of the field.
        wobble: how far the middle of the samples is off, per cent of the field.
        fit_error: per cent of the field.
        magnitude: size of the field by the reading's own unit, µT; None for counts, or too early.
        advice: which motion fills the largest gap, in plain words.
        disturbed: what disturbs the field at this moment, or "".
        trouble: why no calibration can come of it so far (not the Earth's field, it does not turn,
            saturation, one plane), or "".
        samples: samples kept.
        left_out: samples left out as disturbed.
        good: coverage and fit suffice.
    """

    face: str | None = None
    face_down: str | None = None
    turned: float = 0.0
    done: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    counts: NDArray[np.intp] = field(default_factory=_empty)
    here: int | None = None
    gaps: float | None = None
    variance: float | None = None
    wobble: float | None = None
    fit_error: float | None = None
    magnitude: float | None = None
    advice: str = ""
    disturbed: str = ""
    trouble: str = ""
    samples: int = 0
    left_out: int = 0
    good: bool = False


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
    """A command that is open now, and its effect in plain words."""

    command: str
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
        clips: the present rotation is so fast that the gyroscope is about to be clipped.
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
    clips: bool = False


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
        counts_here: a hold that begins here and now counts for the step.
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
    counts_here: bool = False
