"""The errors that a gyroscope's coarse readings leave in the integrals of rotations.

While the device rests, the error is that of the rests: all of them read the same bias, and rounding
shifts it by up to half a step. In motion, errors of different steps cancel. In between, the error
depends on the place of the rests in their step, which all rotations share.
"""

import itertools
from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.attitude import RotationSamples
from imucal_wizard.core.readings import BoolArray, FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median
from imucal_wizard.estimate.noise import has_rate
from imucal_wizard.estimate.rounded import unseen_rounding
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.measurement.rounding import integrated_rounding

LEVELS = ((2.0, 6.0, 0.9), (4.0, 12.0, 1.25))
"""Two distances from the rests, in steps, and how many times the time between them an axis begins
to move before the first. A twentieth of a step is enough to make an error another one than that of
the rests. Whether the reading has changed by then depends on the place of the rests in their step;
so the beginning follows from what comes later.

The factors are those of simulated motions (``benchmarks.gyroscope_bound``) and lie between those of
n = 2 and n = 3. With a rate of (t/c)ⁿ steps the error is that of the rests
for ``c Γ(1+1/n) cos(π/2n) Σ (6/π²k²) (2πk)^(−1/n)`` on average over all places: 0.20 c for
n = 2, 0.36 c for n = 3, 0.47 c for n = 4."""
BEGINNING = 0.28
"""A beginning's integrated error that is even in the place of the rests and has the sense of the
motion: standard deviation over that of a rest's error and the time between two ``LEVELS``. By the
same series with sin(π/2n), for n = 3."""
ON_STEP = 0.75
"""Steps between the mean of the rests and a reading on their step; between two steps, on both."""


@dataclass(frozen=True, eq=False)
class RoundingInMotion:
    """Errors by rounding in m rotations with n samples.

    Attributes:
        variance: of the integral of each axis by errors that no other rotation has, beyond the
            noise at rest, (reading × s)², shape (m, 3).
        resting: samples at either end of a rotation whose errors are those of the holds; of an axis
            that never leaves the step of the rests all of them, shape (n, 3).
        begun: further errors by the place of the rests in their step while an axis begins to move:
            one standard deviation over that of a rest's error, shape (n, 3).
    """

    variance: FloatArray
    resting: BoolArray
    begun: FloatArray


def rounding_in_motion(
    samples: RotationSamples, step: FloatArray, holds: Sequence[Hold]
) -> RoundingInMotion:
    """See ``RoundingInMotion``.

    Args:
        samples: of the rotations.
        step: of the readings on each axis, shape (3,); 0 where they never change.
        holds: still periods, one of them with a mean rate.
    """
    count, unseen = len(samples.offsets) - 1, unseen_rounding(holds, step)
    variance, begun = np.zeros((count, 3)), np.zeros((len(samples.time), 3))
    resting = np.zeros((len(samples.time), 3), bool)
    if not unseen.any():
        return RoundingInMotion(variance, resting, begun)
    rest = np.array([hold.gyroscope for hold in holds if has_rate(hold)]).mean(axis=0)
    away = np.where(step > 0.0, samples.reading - rest, 0.0) / np.where(step > 0.0, step, 1.0)
    for place, (first, past) in enumerate(itertools.pairwise(samples.offsets.tolist())):
        own, reading = away[first:past], samples.reading[first:past]
        still = resting[first:past]
        for ahead, inside, error in (
            (own, still, begun[first:past]),
            (own[::-1], still[::-1], begun[first:past][::-1]),
        ):
            start, pace, way = _beginning(ahead)
            inside |= 0.5 + np.arange(len(own))[:, None] < start
            for axis in np.flatnonzero(pace):
                since = int(max(start[axis], 0.0))
                until = int(np.ceil(start[axis] + 2.0 * pace[axis]))
                error[since:until, axis] += BEGINNING * way[axis] * pace[axis] / (until - since)
        stays = np.asarray((np.abs(own) < ON_STEP).all(axis=0))
        interval = median(np.diff(samples.time[first:past]))
        for axis in np.flatnonzero(unseen):
            moving = reading[~still[:, axis], axis]
            whole = float(integrated_rounding(moving[:, None], step[[axis]])[0])
            whole -= len(moving) * (step[axis] ** 2 / 12.0 - unseen[axis])
            variance[place, axis] = max(whole, 0.0) * interval**2
        still[:, stays] = True
    return RoundingInMotion(variance, resting, begun)


def _beginning(away: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """When each axis begins to move.

    Args:
        away: how many steps each reading of a rotation is from the mean of the rests, shape (n, 3).

    Returns:
        The sample at which it begins, the samples from one of ``LEVELS`` to the other, 0 where it
        does not reach them in the first half of the rotation, and the direction, shape (3,) each.
    """
    size, axes = np.abs(away[: (len(away) + 1) // 2]), np.arange(3)
    still = float(np.logical_and.accumulate((size < 1.0).all(axis=1)).sum())
    begun, pace, way = np.full(3, still), np.zeros(3), np.zeros(3)
    for near, far, before in LEVELS:
        reached = size > far - 0.5
        moved = reached.any(axis=0)
        if not moved.any():
            continue
        first, last = np.argmax(size > near - 0.5, axis=0), np.argmax(reached, axis=0)
        fastest = moved & (last == last[moved].min())
        begun = np.where(moved, first - before * (last - first), begun)
        pace = np.where(moved, np.maximum(last - first, 0.5), pace)
        way = np.where(moved, np.sign(away[last, axes]), way)
        # the others move less, and so the fastest one is well on its way when they begin to
        start = first[fastest].min()
        begun = np.where(pace > 0.0, np.clip(begun, begun[fastest].min(), start), start)
    return begun, pace, way
