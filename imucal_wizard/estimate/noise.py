"""The noise of a hold's average, for weights and for the floor that no model can go below."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.readings import MAX_READING, BoolArray, FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median
from imucal_wizard.measurement.holds import Hold

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
    return hold.gyroscope is not None and bool((np.abs(hold.gyroscope) < MAX_READING).all())


def hold_noise(holds: Sequence[Hold]) -> HoldNoise:
    """Pooled noise of the holds, by duration.

    The batch covariance of one hold has four degrees of freedom, too few to weigh it by; the noise
    per second is therefore the median over all holds, and a hold's variance is that over its time.
    A hold taken hand-held keeps its own, larger one.
    """
    times = np.array([hold.end - hold.start for hold in holds])
    along, across = _along_and_across(holds)
    with_rate = [hold for hold in holds if hold.gyroscope_covariance is not None]
    per_axis = None
    if with_rate:
        covariances = np.array([hold.gyroscope_covariance for hold in with_rate])
        seconds = np.array([hold.end - hold.start for hold in with_rate])
        columns = covariances[:, range(3), range(3)] * seconds[:, None]
        per_axis = np.array([_pooled(column, BATCH_FREEDOM) for column in columns.T])
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
    covariances = np.array([hold.accelerometer_covariance for hold in holds]).reshape(-1, 3, 3)
    away = means - 0.5 * (means.min(axis=0) + means.max(axis=0))
    length = np.linalg.norm(away, axis=1)
    told = (length > 0.0) & (length < np.inf)
    up = away / np.where(told, length, 1.0)[:, None]
    whole = np.trace(covariances, axis1=1, axis2=2)
    along = np.maximum(np.einsum("ni,nij,nj->n", up, covariances, up), 0.0)
    across = np.maximum(0.5 * (whole - along), 0.0)
    return np.where(told, along, whole / 3.0), np.where(told, across, whole / 3.0)


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
    return median(known) / ratio if len(known) else 0.0


TRUST = 3 * BATCH_FREEDOM
"""Degrees of freedom with which the pooled noise speaks against a hold's own: as many as it has."""


@dataclass(frozen=True, eq=False)
class Rest:
    """Noise of the holds.

    Attributes:
        mean: variance of each mean rate, (rad/s)², shape (h, 3).
        moved: variance of the rate with which the device itself turned, (rad/s)², shape (h,).
        end: variance of the direction at either end of the hold about its mean by that, rad²,
            shape (h,).
        per_second: variance × time of the corrected rate by noise alone, rad²/s, shape (3,).
    """

    mean: FloatArray
    moved: FloatArray
    end: FloatArray
    per_second: FloatArray


def rest_of(holds: Sequence[Hold], matrix: FloatArray) -> Rest:
    """From the scatter of the holds' batch means.

    The noise per second is common to all holds; a hand that trembled in one of them is not. The
    scatter of a hold, moderated by the common one, counts where it is larger: a device that turned
    while it was averaged tells less of the bias, and ends elsewhere than its mean direction.

    Args:
        holds: all of them; without a gyroscope in them they count as noisy as the others.
        matrix: M, rad/s per reading.
    """
    density = hold_noise(holds).gyroscope_density
    density = np.zeros(3) if density is None else density
    # |M|² per axis carries variances of readings over to corrected rates
    per_second = (matrix**2) @ density
    seconds = np.array([hold.end - hold.start for hold in holds])
    common = per_second / seconds[:, None]
    ratio = np.array([_ratio(hold, density) for hold in holds])
    own = 3 * BATCH_FREEDOM
    growth = np.maximum((TRUST + own * ratio) / (TRUST + own), 1.0)
    moved = (growth - 1.0) * common.mean(axis=1)
    return Rest(common + moved[:, None], moved, moved * (0.5 * seconds) ** 2, per_second)


def _ratio(hold: Hold, density: FloatArray) -> float:
    """Variance of a hold's mean, by its own scatter, over that by the common noise."""
    if hold.gyroscope_covariance is None or not (density > 0.0).all():
        return 1.0
    own = np.diag(hold.gyroscope_covariance) * (hold.end - hold.start) / density
    return float(own.mean()) if np.isfinite(own).all() else 1.0
