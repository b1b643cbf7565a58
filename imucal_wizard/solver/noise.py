"""The noise of a hold's average, for weights and for the floor that no model can go below."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imucal_wizard.procedure.holds import Hold
from imucal_wizard.readings import FloatArray

BATCH_FREEDOM = 4
"""Degrees of freedom per axis of the covariance of an average: five batch means."""


@dataclass(frozen=True, eq=False)
class HoldNoise:
    """Noise of averages.

    Attributes:
        accelerometer: variance of each hold's average along gravity, reading units², shape (n,).
        gyroscope_density: variance × time of the gyroscope per axis, reading units² s, or None.
    """

    accelerometer: FloatArray
    gyroscope_density: FloatArray | None


def hold_noise(holds: Sequence[Hold]) -> HoldNoise:
    """Pooled noise of the holds, by duration.

    The batch covariance of one hold has four degrees of freedom, too few to weigh it by; the noise
    per second is therefore the median over all holds, and a hold's variance is that over its time.
    A hold taken hand-held keeps its own, larger one.
    """
    times = np.array([hold.end - hold.start for hold in holds])
    own = np.array([_mean_variance(hold.accelerometer_covariance) for hold in holds])
    density = _pooled(own * times, 3 * BATCH_FREEDOM)
    variance = density / times
    for index, hold in enumerate(holds):
        if hold.hand_held and np.isfinite(own[index]):
            variance[index] = max(variance[index], own[index])
    gyroscope = [
        np.diag(hold.gyroscope_covariance) * time
        for hold, time in zip(holds, times, strict=True)
        if hold.gyroscope_covariance is not None
    ]
    per_axis = None
    if gyroscope:
        columns = np.array(gyroscope).T
        per_axis = np.array([_pooled(column, BATCH_FREEDOM) for column in columns])
    return HoldNoise(variance, per_axis)


def _mean_variance(covariance: FloatArray) -> float:
    return float(np.trace(covariance)) / 3.0


def _pooled(values: FloatArray, freedom: int) -> float:
    """Mean of χ²-distributed values from their median, which a disturbed one does not move.

    Median over mean is ``(1 − 2/(9ν))³`` (Wilson & Hilferty).
    """
    known = values[np.isfinite(values)]
    ratio = (1.0 - 2.0 / (9.0 * freedom)) ** 3
    return float(np.median(known)) / ratio if len(known) else 0.0
