"""From moments to the samples of circles: which are new, on which face, how far it has turned."""

import numpy as np

from imucal_wizard.procedure.field.faces import FaceWatch
from imucal_wizard.procedure.field.log import APART, Passed
from imucal_wizard.procedure.field.survey import Survey
from imucal_wizard.procedure.ledger import KeptCircle
from imucal_wizard.procedure.moments import Moment
from imucal_wizard.procedure.scene import Scene
from imucal_wizard.readings import FloatArray
from imucal_wizard.units import COUNT

STIRS = 0.1
"""Share of the field by which the readings of a second differ when the device turns."""
LARGEST = 1e15
"""No magnetometer reads more, in whatever unit."""
_SECOND = 1.0
"""Seconds of readings in which a turn shows."""
LYING = 5.0
"""Seconds of rest from which more of it says nothing new: who leaves the device to lie for an hour
would drown the circles in samples of one direction."""


class Gathering:
    """Gathers the samples of the step.

    Args:
        scene: the present moment.

    Attributes:
        survey: what the samples say.
        faces: which face lies on the table.
        circle: the circle under way, or None.
        unit: of the samples.
        still: for how long the device has been at rest, s.
        silent: for how long no sample has come, s.
        constant: for how long no new one has come while the device turned, s.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.clear()

    def clear(self) -> None:
        """Nothing has been measured."""
        self.survey = Survey()
        self.faces = FaceWatch()
        self.circle: KeptCircle | None = None
        self.unit = COUNT
        self.still = self.silent = self.constant = 0.0
        self._angle = self._end = 0.0
        self._last: FloatArray | None = None
        self._recent: list[tuple[float, FloatArray]] = []

    def look(self) -> None:
        """Judge everything anew, without what has been taken back."""
        circles = self._scene.ledger.circles
        if self.circle is not None and self.circle not in circles:
            self.circle = None
        if len(self.survey.log):
            self.survey.update([circle.number for circle in circles])

    @property
    def turned(self) -> float:
        """How much of the circle under way has been turned, degrees."""
        return 0.0 if self.circle is None else self.survey.turned(self.circle.number)

    def follow(self, moment: Moment) -> None:
        """Take the next moment."""
        scene = self._scene
        self.faces.follow(scene.up, moment.seconds)
        values = self._new(moment)
        self._recent = [one for one in self._recent if one[0] > scene.time - _SECOND]
        if len(values):
            self._recent.append((moment.end, values.mean(axis=0)))
        self.still = self.still + moment.seconds if self._rests() else 0.0
        start = float(moment.block.start[0])
        if abs(start - self._end) > APART:
            self.circle = None  # nobody knows how far it was turned in between
        self._end = moment.end
        before, after = self._turn(moment)
        spoke = moment.field is not None and len(moment.field) > 0
        self.silent = 0.0 if spoke else self.silent + moment.seconds
        if not len(values):
            self.constant += 0.0 if scene.still else moment.seconds
            return
        self.constant = 0.0
        if self.still >= LYING:
            return
        circle = self.circle = self._belongs_to()
        down = circle.face != "" and circle.face == self.faces.face
        up = np.full(3, np.nan) if scene.up is None else scene.up
        self.survey.add(Passed(start, moment.end, values, circle.number, down, before, after, up))

    def _rests(self) -> bool:
        """Whether the device does not turn; a smooth turn is seen by a gyroscope or the field."""
        fit = self.survey.fit
        if not self._scene.still or fit is None or not self._recent:
            return self._scene.still
        second = np.array([reading for _, reading in self._recent])
        return bool(np.ptp(second, axis=0).max() < STIRS * fit.magnitude)

    def _new(self, moment: Moment) -> FloatArray:
        """Readings that are numbers, and not merely the last one written down again, (n, 3)."""
        if moment.field is None:
            return np.zeros((0, 3))
        self.unit, values = moment.field.unit, moment.field.values
        values = values[(np.abs(values) < LARGEST).all(axis=1)]
        if not len(values):
            return values
        last = np.full((1, 3), np.nan) if self._last is None else self._last
        changed = (np.diff(values, axis=0, prepend=last) != 0.0).any(axis=1)
        self._last = values[-1:]
        return np.asarray(values[changed])

    def _turn(self, moment: Moment) -> tuple[float, float]:
        """Angle about the vertical before and after, degrees; NaN without a gyroscope in rad/s."""
        scene = self._scene
        if moment.rate is None or not scene.units.gyroscope_known or scene.up is None:
            return np.nan, np.nan
        limits = scene.watch.limits
        rest = 0.0 if limits is None or limits.gyroscope_mean is None else limits.gyroscope_mean
        rate = float((moment.rate.mean(axis=0) - rest) @ scene.up)
        before = self._angle
        if np.isfinite(rate) and not self.still:  # at rest a gyroscope reads its bias
            self._angle += float(np.degrees(rate)) * moment.seconds
        return before, self._angle

    def _belongs_to(self) -> KeptCircle:
        """The circle that a sample is of now: a face that comes to lie there begins a new one."""
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
        return self._scene.ledger.begin_circle(face)
