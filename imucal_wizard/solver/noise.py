"""The noise of a hold's average, for weights and for the floor that no model can go below."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imucal_wizard.procedure.holds import Hold
from imucal_wizard.readings import ENDLESS, BoolArray, FloatArray

BATCH_FREEDOM = 4
"""Degrees of freedom per axis of the covariance of an average: five batch means."""
TREMBLING = 2.0
"""Variance across gravity over that along it from which on they are two numbers and not one: some
thirty holds know the ratio to 20 % where it is 1."""


@dataclass(frozen=True, eq=False)
class HoldNoise:
    """Noise of averages.

    Attributes:
        accelerometer: variance of each hold's average along gravity, reading units², shape (n,).
        across: the same of each of the two components across gravity, which a hand that trembles
            turns far more than it changes the magnitude, shape (n,).
        gyroscope_density: variance × time of the gyroscope per axis, reading units² s, or None.
    """

    accelerometer: FloatArray
    across: FloatArray
    gyroscope_density: FloatArray | None


def has_rate(hold: Hold) -> bool:
    """Whether a hold has a mean of the gyroscope that is a number."""
    return hold.gyroscope is not None and bool((np.abs(hold.gyroscope) < ENDLESS).all())


def hold_noise(holds: Sequence[Hold]) -> HoldNoise:
    """Pooled noise of the holds, by duration.

    The batch covariance of one hold has four degrees of freedom, too few to weigh it by; the noise
    per second is therefore the median over all holds, and a hold's variance is that over its time.
    A hold taken hand-held keeps its own, larger one.
    """
    times = np.array([hold.end - hold.start for hold in holds])
    along, across = _along_and_across(holds)
    gyroscope = [
        np.diag(hold.gyroscope_covariance) * time
        for hold, time in zip(holds, times, strict=True)
        if hold.gyroscope_covariance is not None
    ]
    per_axis = None
    if gyroscope:
        columns = np.array(gyroscope).T
        per_axis = np.array([_pooled(column, BATCH_FREEDOM) for column in columns])
    by_hand = np.array([hold.hand_held for hold in holds], bool)
    per_second = _densities(along * times, across * times)
    return HoldNoise(
        _by_duration(per_second[0], along, times, by_hand),
        _by_duration(per_second[1], across, times, by_hand),
        per_axis,
    )


def _densities(along: FloatArray, across: FloatArray) -> tuple[float, float]:
    """Noise per second along gravity and across it, from that of each hold, shape (n,) each.

    One number from all axes, which is better known, unless the hands trembled.
    """
    first, second = _pooled(along, BATCH_FREEDOM), _pooled(across, 2 * BATCH_FREEDOM)
    if second > TREMBLING * first:
        return first, second
    both = _pooled((along + 2.0 * across) / 3.0, 3 * BATCH_FREEDOM)
    return both, both


def _along_and_across(holds: Sequence[Hold]) -> tuple[FloatArray, FloatArray]:
    """Variance of each average along gravity, and of one component across it, shape (n,) each.

    Gravity's direction is that of the reading from the middle of all of them; where there is none,
    both are the mean over the axes.
    """
    means = np.array([hold.accelerometer for hold in holds]).reshape(-1, 3)
    middle = 0.5 * (means.min(axis=0) + means.max(axis=0))
    along, across = np.empty(len(holds)), np.empty(len(holds))
    for index, hold in enumerate(holds):
        whole = float(np.trace(hold.accelerometer_covariance))
        away = means[index] - middle
        length = float(np.linalg.norm(away))
        if not 0.0 < length < np.inf:
            along[index] = across[index] = whole / 3.0
            continue
        up = away / length
        along[index] = max(float(up @ hold.accelerometer_covariance @ up), 0.0)
        across[index] = max(0.5 * (whole - along[index]), 0.0)
    return along, across


def _by_duration(
    per_second: float, own: FloatArray, times: FloatArray, by_hand: BoolArray
) -> FloatArray:
    """The common noise over each hold's time; a hand-held hold's own where larger."""
    variance = per_second / times
    keep = by_hand & np.isfinite(own)
    return np.where(keep, np.maximum(variance, np.where(keep, own, 0.0)), variance)


def _pooled(values: FloatArray, freedom: int) -> float:
    """Mean of χ²-distributed values from their median, which a disturbed one does not move.

    Median over mean is ``(1 − 2/(9ν))³`` (Wilson & Hilferty).
    """
    known = values[np.isfinite(values)]
    ratio = (1.0 - 2.0 / (9.0 * freedom)) ** 3
    return float(np.median(known)) / ratio if len(known) else 0.0
