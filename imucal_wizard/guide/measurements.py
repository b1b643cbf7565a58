"""The measurements, the step of each, and the order in which undo removes them."""

import itertools
import math
from dataclasses import field, replace
from typing import ClassVar

import numpy as np

from imucal_wizard.core.limits.stillness import ROTATION_OVERLAP_SECONDS
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.measurement.holds import Collected, Hold, Rotation


@dataclass(eq=False)
class KeptHold:
    """A hold that may still be growing.

    Attributes:
        hold: the hold as it is now.
        step: the step it was taken in.
        ticks: the pose that it counts for, by step.
        dropped: taken back; no motion starts from it.
        between: held only to start or end a rotation.
    """

    hold: Hold
    step: StepKind
    ticks: dict[StepKind, str] = field(default_factory=dict)
    dropped: bool = False
    between: bool = False

    @property
    def seconds(self) -> float:
        """Duration, s."""
        return self.hold.end - self.hold.start

    def update(self, hold: Hold) -> None:
        """Replace it by the same hold with more samples."""
        self.hold = replace(hold, pose=self.hold.pose, hand_held=self.hold.hand_held)


@dataclass(eq=False)
class KeptRotation:
    """The motion between two kept holds.

    Attributes:
        before: the hold it starts from.
        after: the hold it ends in.
        time: gyroscope sample times, s, shape (n,).
        rate: gyroscope readings, shape (n, 3).
        acceleration: accelerometer readings at these times, shape (n, 3).
        step: the step in which it ended.
        axis: the body axis of the rotation, or None.
        problem: why it cannot be used, or None.
        angle: signed angle about ``axis``, degrees.
        fastest: largest rate about ``axis``, °/s or counts.
        counts: counts as one of the rotations that the step needs.
    """

    before: KeptHold
    after: KeptHold
    time: FloatArray
    rate: FloatArray
    acceleration: FloatArray
    step: StepKind
    axis: str | None = None
    problem: str | None = None
    angle: float = 0.0
    fastest: float = 0.0
    counts: bool = False

    def rotation(self) -> Rotation:
        """The rotation, frozen, with its holds as they are now."""
        before, after = self.before.hold, self.after.hold
        # as it is cut from a file: the motion was kept while the hold after it could still be
        # trimmed, and samples at rest add noise to the angle
        begin, end = before.end - ROTATION_OVERLAP_SECONDS, after.start + ROTATION_OVERLAP_SECONDS
        own = slice(*np.searchsorted(self.time, (begin, end)).tolist())
        time, rate, acceleration = self.time[own], self.rate[own], self.acceleration[own]
        return Rotation(before, after, time, rate, self.axis, self.problem, acceleration)


@dataclass(eq=False)
class KeptCircle:
    """A circle with one face on the table, and the motion to the next face.

    Attributes:
        number: unique in the session.
        face: the face on the table (``-z``), or "" if none.
        complete: all of the circle was turned.
    """

    number: int
    face: str
    complete: bool = False
    step: ClassVar[StepKind] = StepKind.FIELD


Kept = KeptHold | KeptRotation | KeptCircle


class Measurements:
    """All holds, rotations and circles in time order."""

    def __init__(self) -> None:
        self.holds: list[KeptHold] = []
        self.rotations: list[KeptRotation] = []
        self.validation: list[KeptHold] = []
        self.circles: list[KeptCircle] = []
        self._circle_numbers = itertools.count()
        self._log: list[Kept] = []

    def add_hold(self, kept: KeptHold) -> None:
        """Keep a hold; the holds of the validation separately."""
        validating = kept.step is StepKind.VALIDATE
        (self.validation if validating else self.holds).append(kept)
        self._log.append(kept)

    def add_rotation(self, kept: KeptRotation) -> None:
        """Keep a motion between two holds."""
        self.rotations.append(kept)

    def begin_circle(self, face: str) -> KeptCircle:
        """Begin a circle with this face on the table; "" for none."""
        kept = KeptCircle(next(self._circle_numbers), face)
        self.circles.append(kept)
        self._log.append(kept)
        return kept

    def count(self, kept: KeptRotation, axis: str) -> None:
        """Count a motion as a rotation about an axis; undo can take it back."""
        kept.axis, kept.counts = axis, True
        self._log.append(kept)

    def discount(self, kept: KeptRotation) -> bool:
        """Take back that a motion counts as a rotation; whether it did."""
        counted, kept.counts = kept.counts, False
        self._log = [entry for entry in self._log if entry is not kept]
        return counted

    def last(self) -> Kept | None:
        """The measurement that undo removes; never a hold that only ends a rotation."""
        for kept in reversed(self._log):
            if not isinstance(kept, KeptHold):
                return kept
            if not kept.between and (kept.ticks or kept.step is not StepKind.SETTLE):
                return kept
        return None

    def remove(self, kept: Kept) -> None:
        """Remove a hold with the motions that start or end in it, a rotation, or a circle."""
        self._log = [entry for entry in self._log if entry is not kept]
        if isinstance(kept, KeptCircle):
            self.circles = [entry for entry in self.circles if entry is not kept]
            return
        if isinstance(kept, KeptRotation):
            self.rotations = [entry for entry in self.rotations if entry is not kept]
            return
        kept.dropped = True
        self.holds = [entry for entry in self.holds if entry is not kept]
        self.validation = [entry for entry in self.validation if entry is not kept]
        touching = [r for r in self.rotations if r.before is kept or r.after is kept]
        for rotation in touching:
            self.remove(rotation)

    def clear(self, step: StepKind, since: float = -math.inf) -> int:
        """Remove the measurements of a step; returns how many holds, rotations or circles.

        Args:
            step: the step.
            since: remove only measurements that began at this sample time, s, or later.
        """
        if step is StepKind.FIELD:
            circles = list(self.circles)
            for circle in circles:
                self.remove(circle)
            return sum(circle.complete for circle in circles)
        every = (*self.holds, *self.validation)
        held = [kept for kept in every if kept.step is step and kept.hold.start >= since]
        turned = [
            kept for kept in self.rotations if kept.step is step and kept.after.hold.start >= since
        ]
        asked = sum(kept.counts for kept in turned)
        for rotation in turned:
            self.remove(rotation)
        for hold in held:
            self.remove(hold)
        for other in self.holds if since == -math.inf else ():
            other.ticks.pop(step, None)
        return asked + sum(not kept.between for kept in held)

    def ticked(self, step: StepKind) -> dict[str, KeptHold]:
        """The newest hold of each pose taken in a step."""
        return {kept.ticks[step]: kept for kept in self.holds if step in kept.ticks}

    def counted_rotations(self, axis: str) -> list[KeptRotation]:
        """The rotations about an axis that count."""
        return [kept for kept in self.rotations if kept.counts and kept.axis == axis]

    def collected(self, without: KeptHold | None = None) -> Collected:
        """All measurements, frozen.

        Args:
            without: a hold that is left out with its rotations.
        """
        turned = [one for one in self.rotations if without not in (one.before, one.after)]
        return Collected(
            holds=tuple(entry.hold for entry in self.holds if entry is not without),
            rotations=tuple(entry.rotation() for entry in turned),
            validation=tuple(entry.hold for entry in self.validation if entry is not without),
        )
