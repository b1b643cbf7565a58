"""The up direction, from an accelerometer whose bias and scale are not known yet.

Good enough to recognise poses and to guide a hand, and no calibration: one common scale, no
non-orthogonality. The solver does that later.
"""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.statistics import median

SPREAD = 0.02
"""How far the axes' own errors put a hold off one common sphere, as a share of gravity."""
BIAS_PRIOR = 0.1
"""How far off zero a bias is expected, as a share of gravity."""
OFFSET_PRIOR = 0.4
"""The same where an offset had to be guessed."""
SPHERE_SCALE_PRIOR = 0.3
SMALLEST, LARGEST = 0.4, 2.0
"""Holds of another size than this share of the first say something else, such as a dead axis."""
SPHERE_STEPS = 8
MIN_OFFSET_RATIO = 0.6
"""Share of the largest reading that the smallest has where all three axes share an offset."""
LEAST_OFFSET = 100.0
"""Counts: no converter has its middle lower."""
COLLAPSED = 0.1
"""Share of what was taken for gravity at first; a smaller sphere is no solution."""
FALLING = 0.05
"""Share of gravity under which there is no telling which way is up."""


def guessed_offset(reading: FloatArray) -> float:
    """The zero of readings that never go negative: half the range of the converter, else 0.

    A device at rest cannot show nearly the same large reading on all three axes unless they share
    an offset; converters put it at a power of two (512, 2048, 32768).
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
        self.bias = np.zeros(3)
        self.radius = 1.0

    @property
    def known(self) -> bool:
        """Whether there has been a reading to start from."""
        return self._start is not None

    def begin(self, reading: FloatArray) -> None:
        """Start from the mean reading of a device at rest (or nearly), shape (3,)."""
        if not np.isfinite(reading).all():
            return
        offset = guessed_offset(reading) if self._counts else 0.0
        radius = float(np.linalg.norm(reading - offset))
        if radius > 0.0:
            self.bias, self.radius = np.full(3, offset), radius
            prior = OFFSET_PRIOR if offset else BIAS_PRIOR
            self._start = (self.bias, radius, prior)

    def learn(self, readings: Sequence[FloatArray]) -> None:
        """Improve the estimate from the mean readings of all holds so far, each of shape (3,).

        The sphere ``|y − b| = r`` that passes nearest to them (Gauss-Newton), held back by what is
        expected of ``b`` and ``r`` in the directions that the holds do not determine.
        """
        if self._start is None or not readings:
            return
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
