"""The status of the procedure: a frozen snapshot that the state machine makes on request.

Screens and sounds read nothing else of the procedure.
"""

import math
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.limits.procedure import FAST_RATE, SLOW_RATE
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.ellipsoid.coverage import BINS
from imucal_wizard.guide.kinds import Act, EventKind, StepKind
from imucal_wizard.guide.operator_view import Turn, Vector

GOOD = {"gaps": 15.0, "variance": 4.5, "wobble": 4.0, "fit_error": 5.0}
"""Per cent below which each figure is good; the limits of MotionCal. The limit of the gaps is for
free tumbling: circles on all six faces are enough whatever gaps they leave."""


def _empty() -> NDArray[np.intp]:
    return np.zeros(BINS, np.intp)


@dataclass(frozen=True, eq=False)
class FieldStatus:
    """The magnetometer's circles at one moment.

    Directions are those of the field in the body frame, by the provisional calibration; areas are
    numbered as in ``ellipsoid.bins``.

    Attributes:
        face: the face to lay on the table next (``-z``: the bottom), or None if any motion
            counts.
        face_down: the face on the table now, or None.
        turned: angle turned with that face down, degrees from 0 to 360; 0 if no face is down.
        done: faces with a complete circle.
        missing: faces without a complete circle.
        counts: samples in each area, shape (100,), up to the number that makes an area full.
        here: area of the newest sample, or None.
        gaps: share of the sphere without a sample nearby, per cent; None before there is a fit.
        variance: spread of the magnitude, per cent of the field.
        wobble: offset of the samples' centre, per cent of the field.
        fit_error: unexplained part, per cent of the field.
        magnitude: magnitude of the field, µT; None for counts or before there is a fit.
        advice: the motion that fills the largest gap, in words.
        disturbed: message about the present disturbance, or "".
        trouble: why these samples give no calibration (not the Earth's field, no rotation,
            saturation, all samples in one plane), or "".
        samples: number of samples kept.
        left_out: number of samples left out as disturbed.
        good: coverage and fit error are good.
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
    """An event.

    Attributes:
        kind: kind of event.
        time: sample time, s.
        text: one short plain sentence.
    """

    kind: EventKind
    time: float
    text: str


@dataclass(frozen=True)
class AxisMotion:
    """The motion of one axis and its limit, in the unit that people use."""

    channel: str
    """``ax`` … ``gz``."""
    value: float
    limit: float
    unit: str
    """``mg``, ``°/s`` or ``count``."""

    @property
    def moving(self) -> bool:
        """Whether the value exceeds its limit; a value that is not a number does."""
        return not self.value <= self.limit


@dataclass(frozen=True)
class StillStatus:
    """Whether the device is still; if not, which axis moves, by how much, and its limit.

    Attributes:
        still: the decision at the newest block.
        motions: all axes, accelerometer first; empty until the first window is full.
        worst: the axis with the largest motion in terms of its limit; None at the start.
        held: duration of the present hold, s.
        needed: duration that the step needs, s.
        waiting: time without a completed hold while one is needed, s.
        loosened: factor by which the limits are wider than after the settle step.
        reason: why the device is not still ("z turns at 2.9 °/s, limit 0.8"), or "".
        spent: this placement no longer counts; the device must move before the next hold.
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
    """A command that is offered now, and its effect in words."""

    command: str
    text: str


@dataclass(frozen=True)
class RotationStatus:
    """The present or next rotation.

    Attributes:
        axis: the axis of rotation.
        start_pose: the pose to start from (``+z`` for x and y, ``+x`` for z).
        angle: present angle about the axis, degrees, from the accelerometer, unwrapped by the rate.
        rate: present rate about the axis, in ``unit``.
        fastest: largest rate in this rotation, in ``unit``.
        range_limit: full scale of the gyroscope, °/s; the smallest usual one if its
            own is unknown; None for counts.
        done: signed angles of the rotations taken about this axis, degrees.
        wanted: number of rotations needed about this axis.
        senses: rotations in both senses have been taken.
        speeds: number of different speeds taken (slow, medium, fast).
        wanted_angle: signed angle of the rotation that improves the fit most, degrees.
        wanted_rate: its peak rate, °/s.
        range_known: whether ``range_limit`` is the gyroscope's own.
        clips: the present rotation nearly reaches ``range_limit``.
        unit: ``°/s``, or ``count`` while the scale of a gyroscope's counts is not known.
        scaled_by: rotations about this axis from which the scale of its counts was found; 0 if the
            readings have a unit.
        least: smallest angle that counts, degrees.
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
    wanted_angle: float = 90.0
    wanted_rate: float = 120.0
    range_known: bool = True
    clips: bool = False
    unit: str = "°/s"
    scaled_by: int = 0
    least: float = 20.0

    @property
    def asked(self) -> str:
        """Angle and speed that are asked for: "120°, fast"."""
        rate = self.wanted_rate
        speed = "slow" if rate <= SLOW_RATE else "fast" if rate >= FAST_RATE else "medium"
        return f"{abs(self.wanted_angle):.0f}°, {speed}"

    @property
    def left(self) -> float:
        """What is left of the wanted angle, degrees: all of it after a turn in the other sense."""
        done = self.angle if self.angle * self.wanted_angle > 0.0 else 0.0
        return math.copysign(max(abs(self.wanted_angle) - abs(done), 0.0), self.wanted_angle)


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
    """Everything that a screen shows of the procedure.

    Attributes:
        step: the present step.
        elapsed: sample time since the start, s.
        instruction: what to do now, in a few capitals ("TURN +X −Y UP").
        detail: the same in words.
        reason: why it is needed, if that is not obvious; or "".
        act: what the operator is to do; ``instruction``, ``detail`` and ``guidance`` say this and
            nothing else.
        guidance: the way there ("23° away: tip it towards you"), or "".
        aim: up direction in the body frame of the pose that is asked for, or None.
        turn: the turn that is asked for, as the operator sees it, or None.
        still: whether the device is still, and why not.
        up: up direction in the body frame, or None if not known.
        wanted: name of the wanted pose, or None.
        wanted_up: up direction of a wanted pose without a name, or None.
        recognised: name of the present pose, or None.
        off_by: angle between ``up`` and the wanted pose, degrees, or None.
        done: names of the poses taken in this step.
        missing: names of the poses still to take in this step.
        progress: (done, needed) of this step in its own unit (seconds, poses, rotations).
        start_values: the start values of the up/down step.
        rotation: the present rotation, in the steps with rotations.
        field: the magnetometer's circles, in their step.
        noise: noise of each axis from the settle step as text, or "".
        offers: commands that are offered now.
        last_event: the newest event, or None.
        holds: number of holds kept.
        rotations: number of rotations kept.
        skipped: steps that were skipped, with the consequence.
        steps: all steps of this procedure, in order; () for the standard ones.
        poses: number of poses that the pose step needs.
    """

    step: StepKind = StepKind.SOURCE
    elapsed: float = 0.0
    instruction: str = "ONE MOMENT"
    detail: str = ""
    reason: str = ""
    act: Act = Act.WAIT
    guidance: str = ""
    aim: Vector | None = None
    turn: Turn | None = None
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
