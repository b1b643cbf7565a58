"""The noise of a hold's average, for weights and for the floor that no model can go below."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.readings import MAX_READING, BoolArray, FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import SIGMA_PER_MEDIAN, complement, median, sphere_through
from imucal_wizard.estimate.distributions import EXACT_FREEDOM, exceeded
from imucal_wizard.estimate.result import GravityReference
from imucal_wizard.measurement.holds import Hold

TREMBLING = 2.0
"""Variance across gravity over that along it from which on they are two numbers and not one ..."""
SURE = 3.0
"""... if it is larger than 1 by so many standard errors."""
OUTLYING = 4.0
"""Standard deviations by which a hold's noise exceeds that of all others if something moved it."""
QUIET_P = 3e-5
"""Probability by chance of as small a variance, at which it is as far off as ``OUTLYING``."""
MIN_CHANCE = 1e-6
"""Least variance by chance of a logarithm, where a share is nearly the whole."""
MIN_SPHERE = 0.1
"""Least over largest singular value of the equations of a sphere's centre."""
EQUAL_P = 0.05
"""Probability of variances that differ as much by chance, above which they are taken as equal."""
SWAYED_P = 0.01
"""Probability by chance, in any hold, of as much noise across gravity as in one that swayed."""
NO_NOISE = 1e-12
"""Noise of an axis over that of the noisiest one, as variances, which no sensor has."""
TURNING = 10.0
"""What the gyroscope turns in a hold over what its noise at the quietest frequencies makes, as
variances, from which on a hand moves it: a bias wanders less in some seconds."""
INTEGRATED = 2.0 * (1.0 + 1.0 / 4.0) / 2.0 / (4.0 * np.pi**2)
"""Variance of the mean of the integral of white noise of density one over a second, as the
covariance of a mean tells it: by two cosines, ``1/ω²`` each, and two sines, ``3/ω²``, of one and
two cycles."""
SHRINKING_ROUNDS = 30
SHRUNK_TO = 1e-4
"""Change of the variance beyond chance, relative, that no longer matters."""


@dataclass(frozen=True, eq=False)
class HoldNoise:
    """Noise of the accelerometer's averages.

    Attributes:
        accelerometer: variance of each hold's average along gravity, reading units², shape (n,).
        across: the same of each of the two components across gravity, which a hand that trembles
            turns far more than it changes the magnitude, shape (n,).
        held: a hand holds the device, so that most of the noise is motion.
    """

    accelerometer: FloatArray
    across: FloatArray
    held: bool = False

    def bounded(self, errors: FloatArray, columns: FloatArray) -> "HoldNoise":
        """The same, where a hand holds the device at most what the fit leaves.

        What accelerates a sensor off the centre of a hand's sway is the change of a bounded
        velocity: it has less power at the frequency zero, which the mean shows, than at the lowest
        ones within a hold. A misfit makes what is left larger, which changes nothing.

        Args:
            errors: what a fit leaves along gravity, reading units, shape (n,).
            columns: derivatives of the errors by what was fitted, shape (n, p).
        """
        across = complement(columns)
        freedom = across.shape[1]
        # the mean of a variance of which so many degrees of freedom are seen, with a flat prior of
        # its logarithm, needs three
        if not self.held or freedom < 3 or not (self.accelerometer > 0.0).all():
            return self
        left, spread = across.T @ errors, across.T * self.accelerometer @ across
        share = float(left @ np.linalg.solve(spread, left)) / (freedom - 2)
        return replace(self, accelerometer=min(share, 1.0) * self.accelerometer)


def has_rate(hold: Hold) -> bool:
    """Whether a hold has a mean of the gyroscope that is a number."""
    return hold.gyroscope is not None and bool((np.abs(hold.gyroscope) < MAX_READING).all())


def hold_noise(holds: Sequence[Hold]) -> HoldNoise:
    """The accelerometer's noise in the holds: each by its own samples, moderated by all others.

    The noise per second of a hold is that at its lowest frequencies, which counts correlated noise
    in full but has few degrees of freedom, and that of its samples, of which there are many: the
    ratio of the two is estimated from all holds together. How far holds differ by
    more than chance decides how much each one's own noise counts (``shrunk``), and how far axes
    do, how much their own. Of holds in which the device swayed only the noise along gravity counts
    for the magnitude.
    """
    times = np.array([hold.end - hold.start for hold in holds])
    up, along, across = _along_and_across(holds)
    freedom = np.array([hold.noise_freedom for hold in holds])
    if _trembling(along, across, freedom):
        along = shrunk(along * times, freedom) / times
        across = shrunk(across * times, 2 * freedom) / times
        return HoldNoise(along, across, held=True)
    # one number of a hold, which is better known, but for those in which the device swayed
    both = (along + 2.0 * across) / 3.0 * times
    each = _samples_alone(holds)
    single = times * each.mean(axis=1)
    swayed = _swayed(along * times, across * times, single, freedom)
    # degrees of freedom by Satterthwaite: three axes are one where that is far noisier
    squares = (each**2).sum(axis=1)
    measured = squares > 0.0
    axes = np.where(measured, each.sum(axis=1) ** 2 / np.where(measured, squares, 1.0), 3.0)
    calm, known = ~swayed, np.rint(axes * freedom).astype(np.int64)
    samples = np.rint(axes * [hold.samples - 1 for hold in holds]).astype(np.int64)
    both[calm], known[calm] = _moderated(both[calm], single[calm], known[calm], samples[calm])
    # what it is along gravity over its mean, by the axes that gravity lies along
    rows = np.flatnonzero(calm & (both > 0.0))
    part = up**2 @ _share_of_axes([holds[k] for k in rows.tolist()], (both / times)[rows])
    part[rows] *= _by_force([holds[k] for k in rows.tolist()], up[rows], part[rows], both[rows])
    own = shrunk(np.where(swayed, along * times / part, both), np.where(swayed, freedom, known))
    return HoldNoise(
        np.where(swayed, own, both) * part / times,
        np.where(swayed, across, 0.5 * (3.0 - part) * both / times),
    )


def _share_of_axes(holds: Sequence[Hold], level: FloatArray) -> FloatArray:
    """Noise of each axis of the accelerometer over the mean of the three, as variances, (3,).

    Of many sensors the axis across the chip is noisier than the others.

    Args:
        holds: in which the device did not sway.
        level: variance of the mean in each, over the axes, above zero, shape (n,).
    """
    if not holds:
        return np.ones(3)
    means = np.array([hold.accelerometer_covariance.diagonal() for hold in holds])
    singles = _samples_alone(holds)
    # each hold counts alike, however noisy it is
    mean, single = (np.mean(one / level[:, None], axis=0) for one in (means, singles))
    freedom = np.full(3, sum(hold.noise_freedom for hold in holds))
    samples = np.full(3, sum(hold.samples - 1 for hold in holds))
    found, _ = _moderated(mean, single, freedom, samples)
    return found / found.mean() if found.all() else np.ones(3)


def _by_force(
    holds: Sequence[Hold], up: FloatArray, part: FloatArray, both: FloatArray
) -> FloatArray:
    """Noise along gravity over what the axes make of it in all holds, as variances, shape (n,).

    Of some sensors an axis is noisier under force, so that the noise along gravity is the larger
    the fewer axes share it. Where the samples of the holds differ in this by no more than chance,
    it is one.

    Args:
        holds: in which the device did not sway.
        up: gravity's direction in each, shape (n, 3).
        part: noise along it over the mean of the axes, by the axes alone, shape (n,).
        both: variance × time of the mean in each, over the axes, shape (n,).
    """
    single = _samples_alone(holds)
    if not len(single) or not (single > 0.0).all():
        return np.ones(len(holds))
    along = up**2 * single
    times = np.array([hold.end - hold.start for hold in holds])
    samples = np.array([hold.samples - 1 for hold in holds])
    many = samples / max(median(both / times / single.mean(axis=1)), 1.0)
    # the same samples are in both, and where all axes share gravity nothing is left to chance
    apart = along / along.sum(axis=1)[:, None] - single / single.sum(axis=1)[:, None]
    freedom = many / np.maximum((apart**2).sum(axis=1), MIN_CHANCE)
    return shrunk(along.sum(axis=1) / (part * single.mean(axis=1)), freedom)


def _samples_alone(holds: Sequence[Hold]) -> FloatArray:
    """Variance of each axis of the means if samples are independent, NaN where unknown, (n, 3)."""
    scatters = [hold.accelerometer_scatter for hold in holds]
    unknown = np.full(3, np.nan)
    return np.array([unknown if one is None else one for one in scatters]).reshape(-1, 3)


def rate_noise(holds: Sequence[Hold]) -> FloatArray | None:
    """Variance × time of the gyroscope per axis, reading units² s, shape (3,); None without one."""
    with_rate = [hold for hold in holds if hold.gyroscope_covariance is not None]
    if not with_rate:
        return None
    covariances = np.array([hold.gyroscope_covariance for hold in with_rate])
    seconds = np.array([hold.end - hold.start for hold in with_rate])
    columns = covariances[:, range(3), range(3)] * seconds[:, None]
    freedom = np.array([hold.noise_freedom for hold in with_rate])
    return np.array([pooled(column, freedom) for column in columns.T])


def _moderated(
    means: FloatArray, single: FloatArray, freedom: IntArray, samples: IntArray
) -> tuple[FloatArray, IntArray]:
    """Noise of holds by that of their means and, where it is known, by that of single samples.

    Args:
        means: variances, shape (n,).
        single: the same if samples are independent, shape (n,).
        freedom: degrees of freedom of the first.
        samples: of the second.

    Returns:
        The noise, shape (n,), and its degrees of freedom.
    """
    if not (single > 0.0).all():
        return shrunk(means, freedom), freedom
    growth = shrunk(means / single, freedom, samples)
    many = samples / max(median(growth), 1.0)
    return np.asarray(growth * shrunk(single, many)), np.maximum(many, freedom).astype(np.int64)


def shrunk(
    values: FloatArray, freedom: IntArray | FloatArray, of: IntArray | None = None
) -> FloatArray:
    """Variances, each moderated by all others: empirical Bayes on their logarithms.

    Where a 5 % test finds them equal, all become their mean; where they differ much more than by
    chance, each keeps its own. One that is far larger than all others (a bump), or far smaller (the
    mean of a vibration), keeps its own, too, and does not count for how much the others differ.
    Those not known or zero become the mean.

    Args:
        values: distributed as χ²/ν about the variances, shape (n,).
        freedom: ν of each.
        of: where the values are shares of a variance with more degrees of freedom, these.
    """
    known = (values > 0.0) & (values < np.inf) & (freedom > 0)
    if not known.any():
        return np.zeros(len(values))
    logs, chance, off = _logarithms(values, known, freedom, of)
    kept = known & (np.abs(off) < OUTLYING)
    beyond = 0.0
    for _ in range(SHRINKING_ROUNDS):
        # variance beyond chance by which the weighed squares are as many as degrees of freedom
        weight = np.where(kept, 1.0 / (chance + beyond), 0.0)
        centre = float((weight * logs).sum() / weight.sum())
        squares = weight * (logs - centre) ** 2
        slope = float((weight * squares).sum())
        more, freedom_left = float(squares.sum()), int(kept.sum()) - 1
        if not beyond and (
            freedom_left < 1 or exceeded(more / freedom_left, freedom_left, EXACT_FREEDOM) > EQUAL_P
        ):
            break
        step = (more - freedom_left) / slope
        before, beyond = beyond, max(beyond + step, 0.0)
        if abs(beyond - before) <= SHRUNK_TO * (beyond + float(chance.min())):
            break
    kept_own = off >= OUTLYING
    for k in np.flatnonzero(off <= -OUTLYING):
        # by chance few degrees of freedom make far smaller variances than larger ones
        ratio = float(np.exp(centre)) / values[k]
        kept_own[k] = exceeded(ratio, EXACT_FREEDOM, float(freedom[k])) < QUIET_P
    share = np.where(kept_own, 1.0, beyond / (beyond + chance))
    return np.asarray(np.exp(centre + np.where(known, share * (logs - centre), 0.0)))


def _logarithms(
    values: FloatArray, known: BoolArray, freedom: IntArray | FloatArray, of: IntArray | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Logarithms of variances, 0 where not known, and their variance by chance.

    And by how many standard deviations each is larger than most, shape (n,) each. For the
    arguments see ``shrunk``.
    """
    offset, chance = log_moments(np.maximum(freedom, 1))
    if of is not None:
        whole = log_moments(of)
        offset, chance = offset - whole[0], np.maximum(chance - whole[1], MIN_CHANCE)
    logs = np.where(known, np.log(np.where(known, values, 1.0)) - offset, 0.0)
    middle = median(logs[known])
    spread = (SIGMA_PER_MEDIAN * median(np.abs(logs[known] - middle))) ** 2
    off = np.where(known, (logs - middle) / np.sqrt(np.maximum(spread, chance)), 0.0)
    return logs, np.asarray(chance), np.asarray(off)


def _trembling(along: FloatArray, across: FloatArray, freedom: IntArray) -> bool:
    """Whether the noise across gravity is clearly larger than that along it, in most holds."""
    known = (along > 0.0) & (across > 0.0) & (freedom > 0)
    known &= np.isfinite(along) & np.isfinite(across)
    if not known.any():
        return False
    first, second = (log_moments(k * freedom[known]) for k in (1, 2))
    ratio = np.log(across[known] / along[known]) - (second[0] - first[0])
    # the variance of a median is π/2 times that of a mean
    doubt = np.sqrt(0.5 * np.pi * float((first[1] + second[1]).mean()) / len(ratio))
    return bool(median(ratio) > max(np.log(TREMBLING), SURE * float(doubt)))


def _swayed(
    along: FloatArray, across: FloatArray, single: FloatArray, freedom: IntArray
) -> BoolArray:
    """Holds whose noise across gravity is far above that of the others, and above that along it.

    A device that sways in a hold, or turns about the vertical, turns gravity's direction and hardly
    changes its magnitude. A sway is slow: it changes the mean far more than independent samples of
    the same scatter would, which noise that differs from hold to hold does not.

    Args:
        along: variance × time along gravity, shape (n,).
        across: the same of one component across it, shape (n,).
        single: the same if samples are independent, NaN where not known, shape (n,).
        freedom: degrees of freedom of ``along``, half of those of ``across``.
    """
    known = (along > 0.0) & (across > 0.0) & (freedom > 0)
    known &= np.isfinite(along) & np.isfinite(across)
    swayed = np.zeros(len(along), np.bool_)
    if not known.any():
        return swayed
    slow = across / single if (single > 0.0).all() else across
    usual = pooled(slow[known], 2 * freedom[known])
    for k in np.flatnonzero(known & (slow > usual) & (across > along)):
        far = exceeded(slow[k] / usual, 2 * freedom[k], EXACT_FREEDOM) < SWAYED_P / len(along)
        ratio = across[k] / along[k]
        swayed[k] = far and exceeded(ratio, 2 * freedom[k], freedom[k]) < EQUAL_P
    return swayed


def log_moments(freedom: IntArray | FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean and variance of the logarithm of χ²/ν, by the digamma and trigamma functions.

    Their asymptotic series (Abramowitz & Stegun 6.3.18, 6.4.12); from one step up, so that they
    hold for one degree of freedom, too.
    """
    half = 0.5 * np.asarray(freedom, np.float64)
    up = half + 1.0
    mean = np.log(up / half) - 1.0 / half - 1.0 / (2.0 * up) - 1.0 / (12.0 * up**2)
    variance = 1.0 / half**2 + 1.0 / up + 1.0 / (2.0 * up**2) + 1.0 / (6.0 * up**3)
    return mean, variance


def _along_and_across(holds: Sequence[Hold]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Gravity's direction in each hold, and the variance of its average along and across gravity.

    Gravity's direction is that of the reading from the centre of the sphere through all of them;
    where there is none, the axes share equally.

    Returns:
        Unit vectors, shape (n, 3); the variance along them, and of one component across, (n,) each.
    """
    means = np.array([hold.accelerometer for hold in holds]).reshape(-1, 3)
    covariances = np.array([hold.accelerometer_covariance for hold in holds]).reshape(-1, 3, 3)
    away = means - _centre(means)
    length = np.linalg.norm(away, axis=1)
    known = (length > 0.0) & (length < np.inf)
    up = away / np.where(known, length, 1.0)[:, None]
    whole = np.trace(covariances, axis1=1, axis2=2)
    along = np.maximum(np.einsum("ni,nij,nj->n", up, covariances, up), 0.0)
    across = np.maximum(0.5 * (whole - along), 0.0)
    up = np.where(known[:, None], up, np.sqrt(1.0 / 3.0))
    return up, np.where(known, along, whole / 3.0), np.where(known, across, whole / 3.0)


def _centre(means: FloatArray) -> FloatArray:
    """Centre of the sphere through readings, or of their range if that is not determined, (3,)."""
    middle = 0.5 * (means.min(axis=0) + means.max(axis=0))
    away = means - middle
    reach = float(np.abs(away).max())
    if not 0.0 < reach < MAX_READING:
        return np.asarray(middle)
    found = sphere_through(away / reach, MIN_SPHERE)
    return np.asarray(middle if found is None else middle + reach * found[0])


def pooled(values: FloatArray, freedom: FloatArray | IntArray) -> float:
    """Mean of χ²-distributed values from their median, which a disturbed one does not move.

    Median over mean is ``(1 − 2/(9ν))³`` (Wilson & Hilferty).

    Args:
        values: distributed as χ²/ν about one variance, NaN where unknown, shape (n,).
        freedom: ν of each, shape (n,).
    """
    known = np.isfinite(values) & (freedom > 0)
    if not known.any():
        return 0.0
    return median(values[known] / (1.0 - 2.0 / (9.0 * freedom[known])) ** 3)


@dataclass(frozen=True, eq=False)
class Rest:
    """Noise of the holds.

    Attributes:
        mean: variance of each mean rate, (rad/s)², shape (h, 3).
        moved: what it has beyond the noise common to all, (rad/s)², shape (h,).
        end: variance of the direction at either end of the hold about its mean, rad², shape (h,);
            where the gyroscope carries the direction, that of its noise.
        carried: the device turned by more in the hold than the gyroscope's noise, which carries
            the mean direction to either end, shape (h,).
        per_second: variance × time of the corrected rate by noise alone, rad²/s, shape (3,).
        per_sample: the same by single samples, whose noise a filter in the sensor may lessen, (3,).
        tilt: variance of each component of the mean direction across gravity without the sway that
            the gyroscope follows, rad², shape (h,); infinite where it follows none.
        held: a hand holds the device, so that ``per_second`` is that of the quietest frequencies.
    """

    mean: FloatArray
    moved: FloatArray
    end: FloatArray
    carried: BoolArray
    per_second: FloatArray
    per_sample: FloatArray
    tilt: FloatArray
    held: bool


def rest_of(
    holds: Sequence[Hold],
    matrix: FloatArray,
    bias: FloatArray | None = None,
    reference: GravityReference | None = None,
) -> Rest:
    """From the noise of the holds' means.

    Axes differ by the noise per second that is common to all holds, holds by their own scatter,
    moderated by all others (``shrunk``). What a hold has beyond the common noise says less about
    the bias. In one that is far noisier than all others the device turned while it was averaged: it
    ends elsewhere than its mean direction. Where a hand holds the device, most of what the rates
    show is turning: the common noise is then that of the quietest frequencies, and each hold turns.

    Args:
        holds: all of them; without a gyroscope in them they count as noisy as the others.
        matrix: M, rad/s per reading.
        bias: b, the unit of the readings.
        reference: up in each hold; without these two no hold is taken to sway.
    """
    seconds, tilt = np.array([hold.end - hold.start for hold in holds]), np.full(len(holds), np.inf)
    swaying = followed = np.zeros(len(holds), np.bool_)
    if bias is not None and reference is not None:
        tilt, followed, denied = _tilt(holds, matrix, bias, reference)
        swaying = np.isfinite(tilt) | (_held(holds) and not denied)
    density = _common(holds, matrix, tilt, swaying)
    # |M|² per axis carries variances of readings over to corrected rates
    per_second = (matrix**2) @ density
    common = per_second / seconds[:, None]
    growth, per_sample, alone = np.ones(len(holds)), density, np.full(len(holds), np.nan)
    turned = np.zeros(len(holds), np.bool_)
    if (density > 0.0).all():
        # of each axis over the common noise: by its mean and by single samples
        unknown = np.full(3, np.nan)
        each = [None if (c := one.gyroscope_covariance) is None else c.diagonal() for one in holds]
        single = [one.gyroscope_scatter for one in holds]
        batches, samples = (
            np.array([unknown if v is None else v for v in values]) * seconds[:, None] / density
            for values in (each, single)
        )
        freedom = 3 * np.array([one.noise_freedom for one in holds])
        many = 3 * np.array([one.samples - 1 for one in holds])
        alone = samples.mean(axis=1)
        growth, freedom = _moderated(batches.mean(axis=1), alone, freedom, many)
        turned = _logarithms(growth, growth > 0.0, freedom)[2] > OUTLYING
        if np.isfinite(samples).all():
            per_sample = density * [median(one) for one in samples.T]
    moved = np.maximum(growth - 1.0, 0.0) * common.mean(axis=1)
    own = common * np.minimum(growth, 1.0)[:, None]
    swayed = np.where(swaying, _bounded(holds, matrix, own + moved[:, None], swaying), 1.0) * moved
    # carrying integrates noise: that of its own samples counts, which no slow motion changes
    end, noise = moved * (0.5 * seconds) ** 2, common.mean(axis=1) * seconds**2 / 3.0
    known = np.array([one.gyroscope_turn is not None for one in holds])
    # where the device sways the samples show more than noise; NaN where no noise is known
    sways = swaying | turned & followed
    carried = known & (end > np.where(sways, noise, noise * alone))
    # where it is not known, the order of turns is half the cross product of two small angles
    unordered = np.array([one.gyroscope_order is None for one in holds])
    end = np.where(carried, np.minimum(noise, end) + 0.5 * unordered * end**2, turned * end)
    tilt = np.where(carried, tilt, np.inf)
    mean = own + swayed[:, None]
    per_sample = (matrix**2) @ np.asarray(per_sample)
    return Rest(mean, moved, end, carried, per_second, per_sample, tilt, bool(swaying.any()))


def _common(
    holds: Sequence[Hold], matrix: FloatArray, tilt: FloatArray, swaying: BoolArray
) -> FloatArray:
    """Variance × time of the gyroscope that all holds have, reading units² s, shape (3,).

    Args:
        holds: all of them.
        matrix: M.
        tilt: see ``_tilt``.
        swaying: holds in which the device turns, shape (h,).
    """
    found = rate_noise(holds)
    density = np.zeros(3) if found is None else found
    # where most holds read one step, what is left is the rounding of double numbers
    density = np.where(density < NO_NOISE * density.max(), 0.0, density)
    times = np.array([one.end - one.start for one in holds])
    quiet = [
        one.gyroscope_quiet * time
        for one, time in zip(holds, times, strict=True)
        if one.gyroscope_quiet is not None
    ]
    if swaying.any() and quiet:
        density = np.minimum(density, np.mean(quiet, axis=0))
    if (followed := np.isfinite(tilt)).any():
        # more noise of the rates, integrated, would make the directions scatter more
        most = median((tilt / times)[followed]) / INTEGRATED
        density = density * min(most / max(float((matrix**2 @ density).mean()), 1e-300), 1.0)
    return density


def _bounded(
    holds: Sequence[Hold], matrix: FloatArray, variance: FloatArray, swaying: BoolArray
) -> float:
    """Scatter of the mean rates of holds that sway over what their low frequencies foretell.

    A sway is bounded: it has less power at the frequency zero, which the mean shows, than at those
    above. What differs from hold to hold beside it makes the share larger, at most one.

    Args:
        holds: all of them.
        matrix: M.
        variance: of each mean, (rad/s)², shape (h, 3).
        swaying: those that count, shape (h,).
    """
    rows = [k for k in np.flatnonzero(swaying).tolist() if has_rate(holds[k])]
    freedom = 3 * (len(rows) - 1)
    if freedom < 1 or not (variance[rows] > 0.0).all():
        return 1.0
    rates = np.array([holds[k].gyroscope for k in rows], np.float64) @ matrix.T
    weight = 1.0 / variance[rows]
    away = rates - (weight * rates).sum(axis=0) / weight.sum(axis=0)
    return min(float((weight * away**2).sum()) / freedom, 1.0)


def _held(holds: Sequence[Hold]) -> bool:
    """Whether the gyroscope turns in most holds far more than its noise at other frequencies."""
    shares = []
    for hold in holds:
        turned, quiet = hold.gyroscope_turn, hold.gyroscope_quiet
        if (
            turned is not None
            and quiet is not None
            and (known := quiet > NO_NOISE * quiet.max()).any()
        ):
            made = quiet[known] * (hold.end - hold.start) ** 2 / 12.0
            shares.append(float((turned[known] ** 2 / made).mean()))
    return bool(shares) and median(shares) > TURNING


def _tilt(
    holds: Sequence[Hold], matrix: FloatArray, bias: FloatArray, reference: GravityReference
) -> tuple[FloatArray, BoolArray, bool]:
    """Variance of each mean direction without the sway that the gyroscope follows, rad², (h,).

    The gyroscope follows a sway where the directions of the accelerometer scatter less once what
    it turned is taken off. Its noise, integrated, makes them scatter more; a force of the hand that
    is no turn does either in half of the holds.

    Returns:
        The variance, infinite where not clearly more than half of the holds show a sway and where
        nothing is known; the holds that show one, shape (h,); whether clearly more than half of
        them deny it: then what the gyroscope reads is its noise, however slow that is.
    """
    out, freedom = np.full((2, len(holds)), np.nan), np.zeros(len(holds), np.int64)
    shown = [k for k, one in enumerate(holds) if one.sway is not None and one.gyroscope is not None]
    if shown:
        up, sway = reference.up[shown], np.array([holds[k].sway for k in shown])
        rate = np.array([holds[k].gyroscope for k in shown], np.float64) - bias
        read, turned = np.zeros((2, len(shown), 3, 7))
        read[:, :, :3] = np.eye(3) - up[:, :, None] * up[:, None, :]
        read *= reference.gain / reference.gravity
        # a body that turns by φ sees up move by up × φ
        turned[:, :, 3:6], turned[:, :, 6] = matrix, rate @ matrix.T
        turned[:, :, 3:] = np.cross(up[:, :, None], turned[:, :, 3:], axis=1)
        for row, tilts in enumerate((read, read - turned)):
            out[row, shown] = 0.5 * ((tilts @ sway) * tilts).sum(axis=(1, 2))
        freedom[shown] = [2 * holds[k].noise_freedom for k in shown]
    known = np.isfinite(out).all(axis=0)
    followed = known & (out[1] < out[0])
    more, clear = 2 * int(followed.sum()) - int(known.sum()), SURE * np.sqrt(known.sum())
    if more <= clear:
        return np.full(len(holds), np.inf), followed, bool(more < -clear)
    times = np.array([one.end - one.start for one in holds])
    left = shrunk(np.where(known, out[1], 0.0) * times, np.where(known, freedom, 0)) / times
    return np.where(known, left, np.inf), followed, False
