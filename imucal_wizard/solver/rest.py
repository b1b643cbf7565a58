"""How quiet the gyroscope was in each hold: its noise, and what the device moved besides."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imucal_wizard.procedure.holds import Hold
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.noise import BATCH_FREEDOM, hold_noise

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
