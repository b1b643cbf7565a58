"""The up direction, from an accelerometer whose bias and scale are not known yet.

The estimate has one common scale and no non-orthogonality. That is enough to recognise poses and to
guide the operator; the calibration is fitted later.
"""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.statistics import median

SPREAD = 0.02
"""Deviation of a hold from the common sphere by errors of the axes, as a share of gravity."""
BIAS_PRIOR = 0.1
"""Prior standard deviation of a bias, as a share of gravity."""
OFFSET_PRIOR = 0.4
"""The same if an offset was guessed."""
SPHERE_SCALE_PRIOR = 0.3
SMALLEST, LARGEST = 0.4, 2.0
"""Range of a hold's magnitude, as a share of the first; beyond it an axis is dead or wrong."""
SPHERE_STEPS = 8
MIN_OFFSET_RATIO = 0.6
"""The smallest reading over the largest, from which all three axes share an offset."""
LEAST_OFFSET = 100.0
"""Counts; no converter has its middle lower than this."""
COLLAPSED = 0.1
"""Radius of the sphere over the first one below which the fit has failed."""
FALLING = 0.05
"""Share of gravity below which the up direction is unknown."""


def guessed_offset(reading: FloatArray) -> float:
    """The offset of readings that are never negative: half the range of the converter, else 0.

    At rest the three axes read nearly the same large value only if they share an offset; in
    converters it is a power of two (512, 2048, 32768).
    """
    smallest, largest = float(np.min(reading)), float(np.max(reading))
    if not smallest > MIN_OFFSET_RATIO * largest or largest < LEAST_OFFSET:
        return 0.0
    return float(2.0 ** round(np.log2(median(reading))))


class UpEstimate:
    """A running estimate of the accelerometer's bias and of its reading for one gravity."""

    def __init__(self, *, counts: bool) -> None:
        self._counts = counts
        self._start: tuple[FloatArray, float, float] | None = None
        self._offset = 0.0
        self.bias = np.zeros(3)
        self.radius = 1.0

    @property
    def known(self) -> bool:
        """Whether there has been a first reading."""
        return self._start is not None

    def begin(self, reading: FloatArray) -> None:
        """Start from the mean reading of a device that is nearly at rest, shape (3,)."""
        if not np.isfinite(reading).all():
            return
        self._begin(reading, guessed_offset(reading) if self._counts else 0.0)

    def _begin(self, reading: FloatArray, offset: float) -> None:
        self._offset = offset
        radius = float(np.linalg.norm(reading - offset))
        if radius > 0.0:
            self.bias, self.radius = np.full(3, offset), radius
            prior = OFFSET_PRIOR if offset else BIAS_PRIOR
            self._start = (self.bias, radius, prior)

    def learn(self, readings: Sequence[FloatArray]) -> None:
        """Improve the estimate by the mean readings of all holds, each of shape (3,).

        It is the sphere ``|y − b| = r`` nearest to the holds (Gauss-Newton), with priors on ``b``
        and ``r`` for the directions that the holds do not determine.
        """
        if self._start is None or not readings:
            return
        if self._offset and min(float(one.min()) for one in readings) < 0.0:
            # readings with an offset are never negative: the first hold had a corner up
            self._begin(readings[0], 0.0)
        start, scale, prior = self._start
        points = (np.stack(readings) - start) / scale
        sizes = np.sqrt((points * points).sum(axis=1))
        points = points[(sizes > SMALLEST) & (sizes < LARGEST)]
        if not len(points):
            return
        bias, radius = np.zeros(3), 1.0
        for _ in range(SPHERE_STEPS):
            apart = points - bias
            length = np.sqrt((apart * apart).sum(axis=1))
            if not (length > 0.0).all():
                return
            rows = np.column_stack([-apart / length[:, None], -np.ones(len(points))]) / SPREAD
            weights = np.diag([1.0 / prior] * 3 + [1.0 / SPHERE_SCALE_PRIOR])
            misfit = np.concatenate(
                [(length - radius) / SPREAD, bias / prior, [(radius - 1.0) / SPHERE_SCALE_PRIOR]]
            )
            change = np.linalg.lstsq(np.vstack([rows, weights]), -misfit, rcond=None)[0]
            bias, radius = bias + change[:3], radius + float(change[3])
        if radius > COLLAPSED:
            self.bias, self.radius = start + scale * bias, scale * radius

    def up(self, reading: FloatArray) -> FloatArray | None:
        """The unit vector that points up, in the body frame, shape (3,); None in free fall."""
        if self._start is None:
            return None
        force = reading - self.bias
        size = float(np.linalg.norm(force))
        return force / size if size > FALLING * self.radius else None
