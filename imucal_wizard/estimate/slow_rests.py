"""Slow noise within rests: what changes there is noise of the sensor, apart from any model."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from imucal_wizard.core.readings import FloatArray, IntArray, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import complement
from imucal_wizard.estimate.slow_kernels import Kernel
from imucal_wizard.measurement.holds import Hold

MIN_LONG_REST = 60.0
"""Seconds from which on one rest shows slow noise: twenty averages as long as a hold."""
PIECE = 3.0
"""Seconds of each of these averages."""
MOMENTS = 6
"""Parts of each of them, whose scatter is white noise."""


@dataclass(frozen=True, eq=False)
class RestPieces:
    """Rests in one direction each, cut into pieces.

    Attributes:
        spans: beginning and end of each piece, s, shape (m, 2).
        means: of the pieces on each axis, or of their magnitudes, shape (m, a).
        white: variance of each by white noise, shape (m, a).
        levels: factors by which all of that variance may be wrong, equally likely, shape (l,).
        lever: by how much each moves with the bias, shape (m,).
        rest: number of the rest of each, in order, shape (m,).
    """

    spans: FloatArray
    means: FloatArray
    white: FloatArray
    levels: FloatArray
    lever: FloatArray
    rest: IntArray

    def evidence(
        self, kernel: Kernel | None, squares: FloatArray, axes: slice, of_strength: bool
    ) -> FloatArray:
        """Logarithm of the likelihood of slow errors of each of these sizes, shape (k,).

        Args:
            kernel: covariance of averages by slow errors of size one; None for errors that are the
                same throughout a rest.
            squares: squares of the sizes, shape (k,).
            axes: whose slow errors have these sizes.
            of_strength: whether they are errors of the field's strength and not of the bias.
        """
        edges = np.append(np.flatnonzero(np.diff(self.rest, prepend=self.rest[0] - 1)), len(self))
        turned, white, slow = [], [], []
        for first, last in pairwise(edges):
            across, values = complement(np.ones((last - first, 1))), np.zeros(last - first - 1)
            if kernel is not None:
                inside = kernel(self.spans[first:last] - self.spans[first, 0])
                values, vectors = np.linalg.eigh(across.T @ inside @ across)
                across = across @ vectors
            moved = 1.0 if of_strength else float(np.mean(self.lever[first:last] ** 2))
            turned.append((across.T @ self.means[first:last, axes]) ** 2)
            white.append(np.tile(self.white[first:last, axes].mean(axis=0), (len(values), 1)))
            slow.append(moved * np.maximum(values, 0.0))
        square, own = np.concatenate(turned), np.concatenate(white)
        beyond = squares[:, None, None] * np.concatenate(slow)[:, None]
        of_each = []
        for level in self.levels:
            variance = level * own + beyond
            of_each.append(-0.5 * (np.log(variance) + square / variance).sum(axis=(1, 2)))
        return np.asarray(np.logaddexp.reduce(of_each, axis=0) - math.log(len(self.levels)))

    def __len__(self) -> int:
        return len(self.rest)


def long_rest(series: Series, holds: Sequence[Hold], matrix: FloatArray) -> RestPieces | None:
    """The longest rest of a recording, if it is long enough to show slow noise.

    Args:
        series: readings of the sensor.
        holds: still periods.
        matrix: SI per reading, shape (3, 3).
    """
    longest = max(holds, key=lambda hold: hold.end - hold.start)
    seconds = longest.end - longest.start
    if seconds < MIN_LONG_REST:
        return None
    inside = series.between(longest.start, longest.end)
    count = int(seconds / PIECE)
    moments = np.floor((inside.time - longest.start) / (seconds / (count * MOMENTS))).astype(int)
    moments = np.clip(moments, 0, count * MOMENTS - 1)
    number = np.bincount(moments, minlength=count * MOMENTS)
    if number.min() < 1:
        return None  # samples are missing
    centred = (inside.values - inside.values.mean(axis=0)) @ matrix.T
    means = np.array([np.bincount(moments, axis) / number for axis in centred.T])
    means = means.reshape(3, count, MOMENTS)
    pieces = means.mean(axis=2)
    white = ((means - pieces[:, :, None]) ** 2).sum(axis=(1, 2)) / (count * (MOMENTS - 1) * MOMENTS)
    if not (white > 0.0).all():
        return None
    edges = longest.start + seconds / count * np.arange(count + 1)
    return RestPieces(
        spans=np.column_stack([edges[:-1], edges[1:]]),
        means=pieces.T,
        white=np.tile(white, (count, 1)),
        levels=np.ones(1),
        lever=np.ones(count),
        rest=np.zeros(count, np.int64),
    )
