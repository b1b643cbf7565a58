"""The angle of a rotation about a body axis from gravity, including full turns and the sign.

Q's equations 25–28 divide by a root and lose the sign of one component, so they end at ±90°. Here
the tilt is the two-argument arctangent in the plane of rotation; full turns come from the
integrated rate if its scale is known, otherwise from following the tilt.
"""

import math

import numpy as np

from imucal_wizard.core.limits.stillness import MIN_LEVEL_GRAVITY
from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import FloatArray


def tilt_about_axis(up: FloatArray, axis: str) -> float | None:
    """Angle of gravity in the plane perpendicular to an axis, rad; positive rotations increase it.

    With (k, i, j) in cyclic order and ``du/dt = u × w``, a rate about k moves ``u`` from j to i.

    Args:
        up: unit vector that points up, body frame, shape (3,).
        axis: ``x``, ``y`` or ``z``.

    Returns:
        The angle in (−π, π], or None when the axis stands upright.
    """
    index = AXES.index(axis)
    across, along = float(up[(index + 1) % 3]), float(up[(index + 2) % 3])
    if math.hypot(across, along) < MIN_LEVEL_GRAVITY:
        return None
    return math.atan2(across, along)


def axis_elevation(up: FloatArray, axis: str) -> float:
    """Elevation of an axis from level, degrees; gravity shows only rotations about level axes."""
    return abs(math.degrees(math.asin(max(-1.0, min(1.0, float(up[AXES.index(axis)]))))))


def unwrapped(angle: float, near: float) -> float:
    """The angle plus the full turns that bring it nearest to ``near``, rad."""
    return angle + 2.0 * math.pi * round((near - angle) / (2.0 * math.pi))


def rotation_between(
    before: FloatArray, after: FloatArray, axis: str, turned: float
) -> float | None:
    """Angle about an axis between two holds, rad.

    Args:
        before: up during the first hold.
        after: up during the second.
        axis: the axis.
        turned: the integrated rate, rad; 0 if its scale is unknown, which assumes less than half a
            turn.
    """
    first, last = tilt_about_axis(before, axis), tilt_about_axis(after, axis)
    if first is None or last is None:
        return None
    return unwrapped(last - first, turned)


def integrated_rate(time: FloatArray, rate: FloatArray) -> FloatArray:
    """Trapezoid integral of each column of rates over their own times, rad or counts·s, (k,)."""
    steps = np.diff(time)[:, None]
    return np.asarray((0.5 * (rate[1:] + rate[:-1]) * steps).sum(axis=0), float)


def soft_rotation(angle: float, fastest: float, step: float) -> tuple[FloatArray, FloatArray]:
    """A rotation that begins and ends softly, as by a hand: times and rates, ``fastest · sin²``.

    Args:
        angle: signed; its unit is that of the rates times seconds.
        fastest: peak rate, positive.
        step: seconds between two samples.
    """
    count = max(round(2.0 * abs(angle) / fastest / step), 4)
    phase = np.pi * np.arange(count + 1) / count
    rate = angle / (step * count / 2.0) * np.sin(phase) ** 2
    return np.asarray(step * np.arange(count + 1), float), np.asarray(rate, float)


class RotationAngle:
    """The angle of a rotation in progress, updated piece by piece."""

    def __init__(self, axis: str, up: FloatArray) -> None:
        self._axis = axis
        self._start = tilt_about_axis(up, axis)
        self._carried = 0.0
        self.angle = 0.0

    def add(self, up: FloatArray | None, turned: float | None) -> float:
        """The angle so far, rad.

        Args:
            up: current up direction, or None if the accelerometer does not show it.
            turned: increment of the integrated rate, rad, or None while its scale is unknown.
        """
        if turned is not None:
            self._carried += turned
        seen = None if up is None else tilt_about_axis(up, self._axis)
        if seen is None or self._start is None:
            if turned is not None:
                self.angle += turned
            return self.angle
        near = self.angle if turned is None else self._carried
        self.angle = unwrapped(seen - self._start, near)
        return self.angle
