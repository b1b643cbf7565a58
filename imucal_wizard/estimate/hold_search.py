"""Which of the limits of rest suits a recording: the one whose holds calibrate best."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.directions import mean_directions
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.limits.stillness import QUIET_BLOCKS
from imucal_wizard.core.readings import FloatArray, IntArray, Readings
from imucal_wizard.core.statistics import median
from imucal_wizard.core.units import COUNT
from imucal_wizard.estimate.accelerometer import AccelerometerExperiment, first_fit
from imucal_wizard.estimate.fit import Minimum
from imucal_wizard.estimate.held_out import groups_by_size, left_out, outlier_of, unexplained
from imucal_wizard.estimate.rounded import Steps
from imucal_wizard.measurement.blocks import block_size, rest_in_words, shortest_rest
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.measurement.segmentation import (
    ReducedRecording,
    loose_candidates,
    reduce_recording,
    rest_numbers,
    rests_apart,
    shaken_holds,
    turning_rates,
    usual_candidates,
)
from imucal_wizard.model.identifiability import expected_error

EQUAL_EXPECTED_RATIO = 1.1
"""Expected errors that differ by less say nothing: each comes from about thirty residuals, which
know a spread to 13 % at best."""
MAX_NOISE_OF_HOLD = 10.0
"""Noise of a hold over that of most, above which it has less than a hundredth of their weight: it
is of use only where it adds a direction, and then the expected error falls."""
SIX_HOLDS = 6
"""Rests for which a longer recording is not too short."""
GOOD_ENOUGH = 1e-3
"""An expected error, in units of gravity, below which no looser limit needs to be tried."""

_TOO_SHORT = "the recording is too short: six still positions of at least {} are needed"
_TOO_UNEVEN = (
    "no {:.2g} s of the recording are without a gap between samples, so that nothing shows rest: "
    "record at an even rate"
)


def find_holds(readings: Readings, gravity: float) -> tuple[list[Hold], Steps, list[Hold]]:
    """The holds under the limit from which the best calibration follows.

    Returns:
        The holds, the resolution of the readings, and the rests in which the gyroscope reads
        another mean than in the holds, see ``rests_apart``.
    """
    stream = reduce_recording(readings)
    if stream is None:
        time, rate = readings.accelerometer.time, readings.accelerometer.rate
        long = rate > 0.0 and time[-1] - time[0] > SIX_HOLDS * shortest_rest(rate)
        if long:
            raise DataError(_TOO_UNEVEN.format(QUIET_BLOCKS * block_size(rate) / rate))
        raise DataError(_TOO_SHORT.format(rest_in_words(rate)))
    steps = stream.step_a, stream.step_g
    found = [holds for _, holds in usual_candidates(stream)]
    if stream.one_position:  # nothing to calibrate from: the longest rest is what there is
        best = max(found, key=lambda holds: sum(one.end - one.start for one in holds))
        return best, steps, rests_apart(stream, best)
    errors = [judge(holds, gravity, rest_numbers(holds)) for holds in found]
    if min(errors) > GOOD_ENOUGH * gravity:
        looser = [holds for _, holds in loose_candidates(stream)]
        found += looser
        errors += [judge(holds, gravity, rest_numbers(holds)) for holds in looser]
    best = _best(found, errors)
    odd = disturbed(best, gravity)
    if odd is not None:
        # a hold that was disturbed is so under every limit and must not decide between them
        others = [_without(holds, best[odd]) for holds in found]
        best = _best(found, [judge(holds, gravity, rest_numbers(holds)) for holds in others])
    _refuse_slow_motion(stream, best, readings.accelerometer.rate)
    best = sorted([*best, *shaken_holds(stream, best)], key=lambda hold: hold.start)
    return best, steps, rests_apart(stream, best)


def _refuse_slow_motion(stream: ReducedRecording, holds: Sequence[Hold], rate: float) -> None:
    """Refuse holds that are only the slow moments of a device that is never put down.

    Raises:
        DataError: they turn nearly as fast as the device does between them.
    """
    within, between, slow = turning_rates(stream.blocks, stream.gravity, holds)
    if slow:
        raise DataError(
            f"the device was never at rest: it turns at {np.degrees(within):.2g} °/s where it is "
            f"calmest and at {np.degrees(between):.2g} °/s otherwise. Put it down or lean it on "
            f"something in each position, and leave it alone there for {rest_in_words(rate)}"
        )


def _best(found: Sequence[list[Hold]], errors: Sequence[float]) -> list[Hold]:
    """Of those that are about as good as the best, the one with the longest holds that count.

    A limit that is too strict breaks holds to pieces, one too loose adds slow moments of turns. The
    pieces of one rest are judged as one, or a calm rest would count the more the more it is broken.
    Of limits that are equal in all that counts it is the strictest.
    """
    least = min(errors)
    if not np.isfinite(least):
        return max(found, key=_directions)
    equal = [
        one
        for one, error in zip(found, errors, strict=True)
        if error <= EQUAL_EXPECTED_RATIO * least
    ]
    return max(equal, key=_seconds_that_count)


def _seconds_that_count(holds: Sequence[Hold]) -> float:
    """Duration of the holds; without a gyroscope, of those that have a weight in the calibration.

    What is much noisier than the others may be a part of a motion. A gyroscope shows that it is
    none, and then the hold is the end of rotations.
    """
    if not holds:
        return 0.0
    noise = np.sqrt([np.trace(one.accelerometer_covariance) for one in holds])
    weighs = noise <= MAX_NOISE_OF_HOLD * median(noise)
    return sum(
        one.end - one.start
        for one, counts in zip(holds, weighs.tolist(), strict=True)
        if counts or one.gyroscope is not None
    )


def judge(holds: Sequence[Hold], gravity: float, rests: IntArray | None = None) -> float:
    """Expected rms error of a calibration from these holds on other orientations, m/s².

    The error of each direction left out stands for the noise of a hold; what becomes of it anywhere
    follows from the directions there are and the parameters that they identify.

    Args:
        holds: still periods.
        gravity: local gravity, m/s².
        rests: number of the rest of which each hold is a piece, shape (n,); all pieces of a rest
            together count as one hold. None where each hold is a rest of its own.

    Returns:
        The error; infinite when the holds determine no calibration, or no direction can be left
        out.
    """
    shares = np.ones(len(holds)) if rests is None else 1.0 / np.bincount(rests)[rests]
    found = _fitted(holds, gravity, shares)
    if found is None:
        return np.inf
    experiment, groups = found.experiment, found.groups
    up = mean_directions(found.rows[0].direction, groups)
    if len(up) <= len(found.directions):
        return np.inf
    white = found.system.columns * np.sqrt(shares)[:, None]
    errors = found.system.residual * np.sqrt(shares)
    lever = white @ found.balance.covariance / found.balance.variance[0] / shares[0]
    squares = 0.0
    for rows in groups_by_size(groups):
        squares += float((left_out(unexplained(lever[rows], white[rows]), errors[rows]) ** 2).sum())
    noise = float(np.sqrt(squares / shares.sum())) / gravity
    return expected_error(up, experiment.identified.basis, noise) * gravity


def disturbed(holds: Sequence[Hold], gravity: float) -> int | None:
    """The hold that does not fit with all others, if one stands out."""
    found = _fitted(holds, gravity, np.ones(len(holds)))
    odd = None if found is None else outlier_of(found)
    return None if odd is None else odd.index


def _fitted(
    holds: Sequence[Hold], gravity: float, shares: FloatArray
) -> Minimum[AccelerometerExperiment] | None:
    try:
        return first_fit(holds, gravity, COUNT, shares)
    except DataError:
        return None


def _without(holds: Sequence[Hold], odd: Hold) -> list[Hold]:
    """The holds at other times."""
    return [hold for hold in holds if hold.end <= odd.start or hold.start >= odd.end]


def _directions(holds: Sequence[Hold]) -> tuple[int, float]:
    """How many clearly different readings there are, and for how long in all."""
    means = np.array([hold.accelerometer for hold in holds]).reshape(-1, 3)
    leaders: list[FloatArray] = []
    reach = 0.2 * float(np.ptp(means, axis=0).max()) if len(means) else 0.0
    for mean in means:
        if all(np.linalg.norm(mean - leader) > reach for leader in leaders):
            leaders.append(mean)
    return len(leaders), sum(hold.end - hold.start for hold in holds)
