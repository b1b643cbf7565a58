"""Assigns the magnetometer's samples to circles by the face that is down."""

import numpy as np

from imucal_wizard.core.limits.procedure import (
    FACE_NEAR_DEG,
    FACE_STAYS_DEG,
    FACE_STEADY_SECONDS,
    MAX_BLOCK_GAP,
    MAX_LYING_SECONDS,
    STIR_SECONDS,
    STIR_SHARE,
)
from imucal_wizard.core.poses import DIRECTIONS, FACES, angle_between, nearest_pose
from imucal_wizard.core.readings import MAX_READING, FloatArray
from imucal_wizard.core.units import COUNT
from imucal_wizard.guide.context import Context
from imucal_wizard.guide.field.samples import FieldBlock
from imucal_wizard.guide.field.survey import Survey
from imucal_wizard.guide.measurements import KeptCircle
from imucal_wizard.measurement.stillness import Block


class FaceWatch:
    """Follows the face that points down.

    Attributes:
        face: the face that points down now, or None.
        seconds: for how long it has.
    """

    def __init__(self) -> None:
        self.face: str | None = None
        self.seconds = 0.0

    @property
    def steady(self) -> str | None:
        """The face that has been down long enough to lie on the table, or None."""
        return self.face if self.seconds >= FACE_STEADY_SECONDS else None

    def follow(self, up: FloatArray | None, seconds: float) -> None:
        """Take the next block.

        Args:
            up: up direction in the body frame, or None if it is not known.
            seconds: duration of the block.
        """
        face = None if up is None else self._pointing_down(up)
        self.seconds = self.seconds + seconds if face == self.face else 0.0
        self.face = face

    def _pointing_down(self, up: FloatArray) -> str | None:
        now = self.face
        if now is not None and np.degrees(angle_between(-up, DIRECTIONS[now])) < FACE_STAYS_DEG:
            return now
        return nearest_pose(-up, FACES, FACE_NEAR_DEG)


class Gathering:
    """Gathers the samples of the step.

    Args:
        context: shared by all steps.

    Attributes:
        survey: evaluation of the samples.
        faces: the face that is down.
        circle: the present circle, or None.
        unit: of the samples.
        still: duration of the present rest, s.
        silent: time since the last sample, s.
        constant: time without a changed value while the device turned, s.
    """

    def __init__(self, context: Context) -> None:
        self._context = context
        self.clear()

    def clear(self) -> None:
        """Forget all samples."""
        self.survey = Survey()
        self.faces = FaceWatch()
        self.circle: KeptCircle | None = None
        self.unit = COUNT
        self.still = self.silent = self.constant = 0.0
        self._angle = self._end = 0.0
        self._last: FloatArray | None = None
        self._recent: list[tuple[float, FloatArray]] = []

    def look(self) -> None:
        """Evaluate all samples again, without the circles that were taken back."""
        circles = self._context.measurements.circles
        if self.circle is not None and self.circle not in circles:
            self.circle = None
        if len(self.survey.log):
            self.survey.update([circle.number for circle in circles])

    @property
    def turned(self) -> float:
        """Angle turned in the present circle, degrees."""
        return 0.0 if self.circle is None else self.survey.turned(self.circle.number)

    def follow(self, block: Block) -> None:
        """Take the next block."""
        context = self._context
        self.faces.follow(context.up, block.seconds)
        values = self._new(block)
        self._recent = [one for one in self._recent if one[0] > context.time - STIR_SECONDS]
        if len(values):
            self._recent.append((block.end, values.mean(axis=0)))
        self.still = self.still + block.seconds if self._rests() else 0.0
        start = float(block.summary.start[0])
        if abs(start - self._end) > MAX_BLOCK_GAP:
            self.circle = None  # the angle turned during the gap is unknown
        self._end = block.end
        before, after = self._turn(block)
        spoke = block.field is not None and len(block.field) > 0
        self.silent = 0.0 if spoke else self.silent + block.seconds
        if not len(values):
            self.constant += 0.0 if context.still else block.seconds
            return
        self.constant = 0.0
        if self.still >= MAX_LYING_SECONDS:
            return
        circle = self.circle = self._belongs_to()
        down = circle.face != "" and circle.face == self.faces.face
        up = np.full(3, np.nan) if context.up is None else context.up
        self.survey.add(
            FieldBlock(start, block.end, values, circle.number, down, before, after, up)
        )

    def _rests(self) -> bool:
        """Whether the device rests; a smooth rotation shows in the gyroscope or in the field."""
        fit = self.survey.fit
        if not self._context.still or fit is None or not self._recent:
            return self._context.still
        second = np.array([reading for _, reading in self._recent])
        return bool(np.ptp(second, axis=0).max() < STIR_SHARE * fit.magnitude)

    def _new(self, block: Block) -> FloatArray:
        """Finite readings that differ from the one before, shape (n, 3)."""
        if block.field is None:
            return np.zeros((0, 3))
        self.unit, values = block.field.unit, block.field.values
        values = values[(np.abs(values) < MAX_READING).all(axis=1)]
        if not len(values):
            return values
        last = np.full((1, 3), np.nan) if self._last is None else self._last
        changed = (np.diff(values, axis=0, prepend=last) != 0.0).any(axis=1)
        self._last = values[-1:]
        return np.asarray(values[changed])

    def _turn(self, block: Block) -> tuple[float, float]:
        """Angle about the vertical before and after, degrees; NaN without a gyroscope in rad/s."""
        context = self._context
        if block.rate is None or not context.units.gyroscope_known or context.up is None:
            return np.nan, np.nan
        limits = context.watch.limits
        rest = 0.0 if limits is None or limits.gyroscope_mean is None else limits.gyroscope_mean
        rate = float((block.rate.mean(axis=0) - rest) @ context.up)
        before = self._angle
        if np.isfinite(rate) and not self.still:  # at rest a gyroscope reads its bias
            self._angle += float(np.degrees(rate)) * block.seconds
        return before, self._angle

    def _belongs_to(self) -> KeptCircle:
        """The circle of the present samples; a new face on the table begins a new circle."""
        face, circle = self.faces.steady, self.circle
        if circle is None:
            return self._begin(face or "")
        if face is None or face == circle.face:
            return circle
        if circle.face:
            return self._begin(face)
        circle.face = face
        return circle

    def _begin(self, face: str) -> KeptCircle:
        return self._context.measurements.begin_circle(face)
