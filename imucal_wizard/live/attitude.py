"""The attitude for the drawing alone: smooth to look at, and never used to measure anything."""

import numpy as np

from imucal_wizard.readings import FloatArray, Readings
from imucal_wizard.solver.quaternions import matrices, quaternions

_LEANING = 0.3
"""Seconds in which the drawing leans to where gravity says up is, while the gyroscope turns it."""
_LEANING_ALONE = 0.05
"""The same where no gyroscope in rad/s helps."""
_PIECE = 0.01
"""Seconds over which the rate is averaged."""
_MOST_PIECES = 200
_UP = np.array([0.0, 0.0, 1.0])


class Attitude:
    """Turned by the gyroscope, held upright by the accelerometer (a complementary filter).

    Attributes:
        matrix: body to world, shape (3, 3); None before up is known.
    """

    def __init__(self) -> None:
        self.matrix: FloatArray | None = None

    def feed(self, readings: Readings, up: tuple[float, float, float] | None) -> None:
        """Follow new samples.

        Args:
            readings: samples of all sensors at the same times.
            up: up direction in the body frame as the procedure sees it, for accelerations in
                counts, from which it cannot be read directly; None while it is not known.
        """
        if not len(readings):
            return
        turned = self._turn(readings)
        measured = _up_from(readings) if readings.accelerometer.unit == "m/s^2" else None
        if measured is None and up is not None:
            measured = np.array(up)
        if measured is not None:
            time = readings.accelerometer.time
            seconds = float(time[-1] - time[0]) + _PIECE
            self._lean(measured, seconds / (_LEANING if turned else _LEANING_ALONE))

    def _turn(self, readings: Readings) -> bool:
        """Turn by the rate; whether it could be."""
        gyroscope = readings.gyroscope
        if gyroscope is None or gyroscope.unit != "rad/s" or len(gyroscope) < 2:
            return False
        if self.matrix is None:
            return True
        step = float(gyroscope.time[-1] - gyroscope.time[0]) / (len(gyroscope) - 1)
        size = max(1, round(_PIECE / step)) if step > 0 else len(gyroscope)
        starts = np.arange(0, len(gyroscope), size)[-_MOST_PIECES:]
        vectors = np.add.reduceat(gyroscope.values, starts, axis=0) * step
        for turn in _rotations(vectors):
            self.matrix = self.matrix @ turn
        return True

    def _lean(self, up: FloatArray, time_constants: float) -> None:
        """Turn the drawing about a level axis until ``up`` points up, or part of the way."""
        if self.matrix is None:
            self.matrix, time_constants = np.eye(3), np.inf
        shown = self.matrix @ up
        level = np.cross(shown, _UP)
        sine = float(np.linalg.norm(level))
        axis = level / sine if sine > 1e-9 else np.array([1.0, 0.0, 0.0])
        angle = float(np.arctan2(sine, shown[2])) * (1.0 - float(np.exp(-time_constants)))
        self.matrix = _rotations((axis * angle)[None])[0] @ self.matrix


def _rotations(vectors: FloatArray) -> FloatArray:
    """Rotation matrices, shape (n, 3, 3), of rotation vectors, shape (n, 3)."""
    return np.moveaxis(matrices(quaternions(vectors.T)), -1, 0)


def _up_from(readings: Readings) -> FloatArray | None:
    mean = readings.accelerometer.values.mean(axis=0)
    size = float(np.linalg.norm(mean))
    return mean / size if size > 0.0 else None
