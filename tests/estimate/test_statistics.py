"""Small statistics: Student's t, noise of averages, repeats, what stands out."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy import special, stats

from imucal_wizard.core.attitude import rotation_samples
from imucal_wizard.core.directions import group_directions
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.estimate.distributions import exceeded, outside, quantile, two_sided
from imucal_wizard.estimate.noise import (
    HoldNoise,
    has_rate,
    hold_noise,
    log_moments,
    rate_noise,
    rest_of,
)
from imucal_wizard.estimate.outliers import FALSE_ALARM, Outlier, outlier
from imucal_wizard.estimate.rotation_set import RotationSet
from imucal_wizard.measurement.blocks import BlockCutter
from imucal_wizard.measurement.holds import Hold, hold_from
from tests.estimate.truth import EIGHTEEN, even_directions, hold, tilted


def _odd_hold(errors: FloatArray, columns: FloatArray) -> Outlier | None:
    """The hold that stands out among weighted residuals of a fit with these columns."""
    left = 1.0 - (columns * np.linalg.pinv(columns).T).sum(axis=1)
    freedom = len(errors) - columns.shape[1]
    return outlier(errors**2 / left, float(errors @ errors), 1, freedom)


@pytest.mark.parametrize("freedom", [1, 2, 3, 4, 9, 10, 29, 60])
def test_students_t_is_scipys(freedom: int) -> None:
    """Tail probabilities to 1e-13 and quantiles to 1e-9, odd and even degrees of freedom."""
    for t in (0.0, 0.1, -1.0, 2.5, 7.0, 40.0):
        assert two_sided(t, freedom) == pytest.approx(2 * stats.t.sf(abs(t), freedom), abs=1e-13)


@pytest.mark.parametrize("freedom", [4, 9, 17, 111, 1000])
def test_the_shares_outside_intervals_are_those_of_student(freedom: int) -> None:
    """Of an array at once, against SciPy."""
    t = np.linspace(0.0, 2.6, 27)
    assert outside(t, freedom) == pytest.approx(2 * stats.t.sf(t, freedom), rel=0.02)
    with np.errstate(over="raise"):  # an error that cannot happen, beside one that can
        assert outside(np.array([1e200]), freedom) == pytest.approx(0.0, abs=1e-12)
    for level in (0.5, 0.95, 0.999):
        expected = stats.t.ppf(0.5 + level / 2, freedom)
        assert quantile(level, freedom) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("above", "below"), [(1, 1), (2, 9), (9, 6), (27, 18), (30, 400)])
def test_fishers_f_is_scipys(above: int, below: int) -> None:
    """Tail probabilities to ten digits, from nearly certain to a millionth."""
    for ratio in (1e-3, 0.4, 1.0, 2.5, 9.0, 60.0):
        expected = stats.f.sf(ratio, above, below)
        assert exceeded(ratio, above, below) == pytest.approx(expected, rel=1e-9, abs=1e-14)
    assert exceeded(0.0, above, below) == 1.0
    assert exceeded(np.inf, above, below) == 0.0


def test_few_degrees_of_freedom_reach_further() -> None:
    """The table at the end of every textbook."""
    known = {1: 12.706, 2: 4.303, 5: 2.571, 9: 2.262, 30: 2.042, 1000: 1.962}
    for freedom, value in known.items():
        assert quantile(0.95, freedom) == pytest.approx(value, abs=5e-4)


@pytest.mark.parametrize(("rate", "count"), [(100.0, 200), (5.0, 20)])
def test_the_noise_of_an_average_is_that_of_white_noise(rate: float, count: int) -> None:
    """400 holds of many blocks and of five: the variance is σ²/n.

    That of the accelerometer within 6 %, three standard errors; a median is known less well.
    """
    rng = np.random.default_rng(0)
    sigma = np.array([0.02, 0.02, 0.02, 0.001, 0.002, 0.003])
    holds = []
    for _ in range(400):
        values = sigma * rng.standard_normal((count, 6))
        time = np.arange(count) / rate
        readings = Readings(
            Series(time, values[:, :3], "m/s^2"), Series(time, values[:, 3:], "rad/s")
        )
        holds.append(hold_from(BlockCutter(rate).feed(readings)))
    noise = hold_noise(holds)
    assert noise.accelerometer == pytest.approx(np.full(400, 0.02**2 / count), rel=0.06)
    assert rate_noise(holds) == pytest.approx(sigma[3:] ** 2 / rate, rel=0.15)


@pytest.mark.parametrize("across_chip", [1.0, 2.0])
def test_the_noise_along_gravity_is_that_of_the_axes_along_it(across_chip: float) -> None:
    """Of many sensors z is noisier than x and y; where axes are alike, the holds are, too."""
    rng, sigma, count = np.random.default_rng(23), 0.02, 300
    each = sigma * np.array([1.0, 1.0, across_chip])
    holds = []
    for up in EIGHTEEN:
        values = 9.81 * np.asarray(up) + each * rng.standard_normal((count, 3))
        readings = Readings(Series(np.arange(count) / 100.0, values, "m/s^2"), None)
        holds.append(hold_from(BlockCutter(100.0).feed(readings)))
    noise = hold_noise(holds)
    along = (np.asarray(EIGHTEEN) ** 2) @ each**2
    across = 0.5 * ((each**2).sum() - along)
    assert noise.accelerometer * count == pytest.approx(along, rel=0.15)
    assert noise.across * count == pytest.approx(across, rel=0.15)


def test_the_noise_along_gravity_is_larger_where_the_axis_under_force_is_noisier() -> None:
    """Five times as noisy along gravity as across it: nearly all of the noise of a face."""
    rng, sigma, count = np.random.default_rng(23), 0.02, 300
    each, holds = sigma * (1.0 + 4.0 * np.abs(EIGHTEEN)), []
    for up, noises in zip(np.asarray(EIGHTEEN), each, strict=True):
        values = 9.81 * up + noises * rng.standard_normal((count, 3))
        readings = Readings(Series(np.arange(count) / 100.0, values, "m/s^2"), None)
        holds.append(hold_from(BlockCutter(100.0).feed(readings)))
    share = hold_noise(holds).accelerometer * count / (np.asarray(EIGHTEEN) ** 2 * each**2).sum(1)
    # what all have in common is known to 20 %, by the lowest frequencies of all holds together
    assert share == pytest.approx(np.full(len(holds), share.mean()), rel=0.2)
    assert share.mean() == pytest.approx(1.0, abs=0.5)


@pytest.mark.parametrize("swaying", [0, 6])
def test_holds_in_which_the_device_swayed_are_as_quiet_along_gravity(swaying: int) -> None:
    """Their directions wander by tenths of a degree, which is 40 times the noise of the others."""
    rng = np.random.default_rng(4)
    sigma, count = 0.01, 400
    holds = []
    for number in range(40):
        up, side = np.linalg.qr(rng.standard_normal((3, 2)))[0].T
        steps = np.radians(0.015) * rng.standard_normal(count)
        angle = np.cumsum(steps) if number < swaying else np.zeros(count)
        force = 9.81 * (np.outer(np.cos(angle), up) + np.outer(np.sin(angle), side))
        values = force + sigma * rng.standard_normal((count, 3))
        readings = Readings(Series(np.arange(count) / 100.0, values, "m/s^2"), None)
        holds.append(hold_from(BlockCutter(100.0).feed(readings)))
    noise = hold_noise(holds)
    along, across = np.sqrt(np.array([noise.accelerometer, noise.across]) * count) / sigma
    assert along == pytest.approx(np.ones(len(holds)), rel=0.15)
    assert across[swaying:] == pytest.approx(np.ones(len(holds) - swaying), rel=0.15)
    assert (across[:swaying] > 3.0).all()


@pytest.mark.parametrize("rate", [25.0, 100.0])
def test_a_rotation_begins_and_ends_at_the_mean_direction_of_a_swaying_hold(rate: float) -> None:
    """A hold that turns about z by waves; the true angles beside the integral of the samples.

    The rotation shares five samples with the hold before, or four with the hold after.
    """
    time = np.arange(6 * int(rate)) / rate
    waves, sizes = np.array([2.0, 55.0]), np.radians([3.0, 0.1])
    angle = np.sin(np.outer(time, waves)) @ sizes
    turned = np.zeros((len(time), 3))
    turned[:, 2] = np.cos(np.outer(time, waves)) @ (waves * sizes)
    force = 9.81 * np.column_stack([np.cos(angle), -np.sin(angle), np.zeros(len(time))])
    rates = 0.1 + turned
    readings = Readings(Series(time, force, "m/s^2"), Series(time, rates, "rad/s"))
    found = hold_from(BlockCutter(rate).feed(readings))
    whole = round(found.end * rate)
    last, first = slice(whole - 5, whole), slice(0, 4)
    rotations = RotationSet(
        samples=rotation_samples([time[last], time[first]], [rates[last], rates[first]]),
        usable=np.arange(2),
        before=np.array([0, 1]),
        after=np.array([1, 0]),
        up=None,
        rounding=np.zeros(3),
        step=np.zeros(3),
    )
    samples, recorded, happened = rotations.between_means([found, found], np.array([True, False]))
    assert recorded.sum() == 9
    mean = angle[:whole].mean()
    expected = angle[whole - 1] - mean, mean - angle[0]
    for part, true in zip(itertools.pairwise(samples.offsets.tolist()), expected, strict=True):
        own = slice(*part)
        steps = np.diff(samples.time[own])
        rate_z = samples.reading[own, 2] - 0.1
        integral = (0.5 * (rate_z[1:] + rate_z[:-1]) * steps).sum()
        # the trapezoidal rule takes a hundredth of the fast wave off at 25 samples/s
        assert integral == pytest.approx(true, abs=np.radians(0.03))
    # each moment of the hold to its end, and from its beginning to each moment
    for part, share in zip(itertools.pairwise(samples.offsets.tolist()), (2.0, 1.0), strict=True):
        stands = happened[slice(*part)][~recorded[slice(*part)]]
        middle = (stands.mean() - found.start) / (found.end - found.start)
        assert middle == pytest.approx(share / 3.0, abs=0.02)


@pytest.mark.parametrize(
    ("uneven", "bump", "turned"), [(0.7, 1.0, 0), (0.0, 1.0, 0), (0.0, 8.0, 1)]
)
def test_noise_that_differs_between_holds_turns_no_direction(
    uneven: float, bump: float, turned: int
) -> None:
    """Only a hold that is far noisier than all others ends elsewhere than its mean direction."""
    rng = np.random.default_rng(27)
    sizes = np.exp(uneven * rng.standard_normal(30))
    sizes[7] *= bump
    holds = []
    for size in sizes:
        values = size * rng.standard_normal((150, 6))
        time = np.arange(150) / 50.0
        readings = Readings(
            Series(time, values[:, :3], "m/s^2"), Series(time, values[:, 3:], "rad/s")
        )
        holds.append(hold_from(BlockCutter(50.0).feed(readings)))
    ends = rest_of(holds, np.eye(3)).end
    assert np.flatnonzero(ends > 0.0).tolist() == [7] * turned


def _sampled(sigma: float, seconds: float, rng: np.random.Generator, smooth: int = 1) -> Hold:
    """A hold at 50 Hz of white noise of this size, or of its running means."""
    count = round(50 * seconds)
    values = sigma * rng.standard_normal((count + smooth - 1, 3))
    values = np.array([np.convolve(axis, np.ones(smooth), "valid") for axis in values.T]).T
    series = Series(np.arange(count) / 50.0, values, "m/s^2")
    return hold_from(BlockCutter(50.0).feed(Readings(series)))


def test_one_restless_hold_counts_by_its_own_noise_and_leaves_the_others_theirs() -> None:
    """Forty times the noise of seventeen others, which stay within 10 % of theirs."""
    rng = np.random.default_rng(21)
    quiet = [_sampled(1e-3, 3.0, rng) for _ in range(17)]
    noise = hold_noise([*quiet, _sampled(0.04, 3.0, rng)]).accelerometer
    assert noise[:17] == pytest.approx(np.full(17, 1e-6 / 150.0), rel=0.1)
    assert noise[17] == pytest.approx(0.04**2 / 150.0, rel=0.25)


def test_a_hold_that_drifts_counts_by_its_batches() -> None:
    """Its samples are as quiet as all others, its batch means are not."""
    rng = np.random.default_rng(22)
    quiet = [_sampled(1e-3, 3.0, rng) for _ in range(17)]
    drifting = replace(quiet[0], accelerometer_covariance=1e-6 * np.eye(3))
    noise = hold_noise([drifting, *quiet[1:]]).accelerometer
    # its own 150 samples know how the noise along gravity differs from that of the axes to 12 %
    assert noise[0] == pytest.approx(1e-6, rel=0.15)
    assert noise[1:] == pytest.approx(np.full(16, 1e-6 / 150.0), rel=0.1)


def test_a_longer_hold_is_quieter() -> None:
    """White noise: four times as long, a quarter of the variance."""
    rng = np.random.default_rng(23)
    noise = hold_noise([_sampled(1e-3, seconds, rng) for seconds in 50 * (2.0, 8.0)]).accelerometer
    assert noise[0::2].mean() == pytest.approx(4.0 * noise[1::2].mean(), rel=0.05)


def test_equal_noise_is_found_equal_and_unequal_noise_is_kept() -> None:
    """The scatter of the variances, beyond chance, decides how much each one's own counts."""
    rng = np.random.default_rng(24)
    equal = [_sampled(1e-3, 3.0, rng) for _ in range(18)]
    noise = hold_noise(equal).accelerometer
    assert np.log(noise).std() < 0.05
    sizes = 1e-3 * np.exp(rng.standard_normal(18))
    noise = hold_noise([_sampled(size, 3.0, rng) for size in sizes]).accelerometer
    # 450 samples know the logarithm of a variance to 0.07, their common factor apart
    assert np.log(noise / sizes**2 * 150.0).std() < 0.1
    assert np.log(noise / sizes**2 * 150.0).mean() == pytest.approx(0.0, abs=0.2)


def test_correlated_samples_count_by_their_independent_number() -> None:
    """Running means of ten samples: a hold's average has ten times the variance of white noise."""
    rng = np.random.default_rng(25)
    noise = hold_noise([_sampled(1e-3, 6.0, rng, smooth=10) for _ in range(120)]).accelerometer
    assert noise == pytest.approx(np.full(120, 100.0 * 1e-6 / 300.0), rel=0.2)


@pytest.mark.parametrize("freedom", [1, 2, 4, 12, 200])
def test_the_logarithm_of_a_variance_has_these_moments(freedom: int) -> None:
    """Against SciPy's digamma and trigamma functions."""
    mean, variance = log_moments(np.array([freedom]))
    assert mean[0] == pytest.approx(
        special.digamma(freedom / 2) - np.log(freedom / 2), abs=2e-3, rel=2e-3
    )
    assert variance[0] == pytest.approx(special.polygamma(1, freedom / 2), rel=2e-3)


def test_holds_within_twelve_degrees_are_repeats() -> None:
    """Eighteen poses held three times by a hand that misses by 1.5° are eighteen directions."""
    rng = np.random.default_rng(1)
    up = tilted(np.tile(EIGHTEEN, (3, 1)), 1.0, rng)
    labels = group_directions(up)
    assert (labels == np.tile(np.arange(18), 3)).all()


def test_false_alarms_are_as_rare_as_they_are_said_to_be() -> None:
    """2000 faultless sets of holds and of rotations: at most 7 suspects where 2 are expected."""
    rng = np.random.default_rng(2)
    columns = np.column_stack([EIGHTEEN, EIGHTEEN**2, np.ones(18) * 0.1])
    hat = columns @ np.linalg.pinv(columns)
    holds = rotations = 0
    gains = rng.standard_normal((36, 9))
    project = np.eye(36) - gains @ np.linalg.pinv(gains)
    for _ in range(2000):
        noise = rng.standard_normal(18)
        holds += _odd_hold(noise - hat @ noise, columns) is not None
        left = (project @ rng.standard_normal(36)).reshape(18, 2)
        drops = np.array(
            [
                left[i] @ np.linalg.solve(project[2 * i : 2 * i + 2, 2 * i : 2 * i + 2], left[i])
                for i in range(18)
            ]
        )
        rotations += outlier(drops, float((left**2).sum()), 2, 27) is not None
    assert FALSE_ALARM == 0.001
    assert holds <= 7
    assert rotations <= 7


def test_a_disturbed_hold_stands_out() -> None:
    """Ten times the noise at one of eighteen, where nine parameters try to hide it."""
    rng = np.random.default_rng(3)
    up = even_directions(26, rng)
    pairs = [up[:, i] * up[:, j] for i in range(3) for j in range(i, 3)]
    columns = np.column_stack([up, *pairs])
    noise = rng.standard_normal(26)
    noise[11] += 12.0
    errors = noise - columns @ np.linalg.pinv(columns) @ noise
    found = _odd_hold(errors, columns)
    assert found is not None
    assert found.index == 11
    assert found.ratio > 5.0


@pytest.mark.parametrize("size", [10.0, 14.0])
def test_the_suspects_probability_is_that_of_a_studentised_residual(size: float) -> None:
    """Against a refit without the hold: its error there over the spread of the others, by t."""
    rng = np.random.default_rng(4)
    columns = rng.standard_normal((26, 9))
    noise = rng.standard_normal(26)
    noise[5] += size
    errors = noise - columns @ np.linalg.pinv(columns) @ noise
    found = _odd_hold(errors, columns)
    assert found is not None
    others = np.delete(np.arange(26), 5)
    inverse = np.linalg.inv(columns[others].T @ columns[others])
    refit = inverse @ columns[others].T @ noise[others]
    left = noise[others] - columns[others] @ refit
    spread = left @ left / (25 - 9)
    ratio = (noise[5] - columns[5] @ refit) / np.sqrt(
        spread * (1.0 + columns[5] @ inverse @ columns[5])
    )
    assert found.ratio == pytest.approx(abs(ratio))
    assert found.probability == pytest.approx(26.0 * 2.0 * stats.t.sf(abs(ratio), 16), rel=1e-6)


@pytest.mark.parametrize("size", [9.0, 15.0])
def test_the_probability_of_a_suspect_rotation_is_fishers(size: float) -> None:
    """Two components against the spread of all others: F with 2 and ν − 2 degrees of freedom."""
    rng = np.random.default_rng(5)
    closure = np.column_stack([rng.standard_normal((18, 2)), np.zeros(18)])
    closure[7, 0] = size
    drops = (closure**2).sum(axis=1)  # nothing was fitted, so that each takes but its own away
    found = outlier(drops, float(drops.sum()), 2, 36)
    assert found is not None
    assert found.index == 7
    spread = np.delete(drops, 7).sum() / 34.0
    expected = 18.0 * stats.f.sf(0.5 * drops[7] / spread, 2, 34)
    assert found.probability == pytest.approx(expected, rel=1e-9)
    assert found.ratio == pytest.approx(np.sqrt(0.5 * drops[7] / spread))


def test_too_little_is_left_to_suspect_anything() -> None:
    """With two degrees of freedom one outlier cannot be told from another; zero errors neither."""
    assert outlier(np.array([0, 0, 0, 0, 0, 0, 0, 25.0, 1.0]), 26.0, 1, 2) is None
    assert outlier(np.zeros(9), 0.0, 1, 6) is None
    assert outlier(np.zeros(6), 0.0, 2, 9) is None
    assert outlier(np.array([1e6, 1.0, 1.0]), 1e6 + 2.0, 2, 4) is None


def test_a_direction_is_no_longer_than_its_limit() -> None:
    """At 0°, 11° and 13° the last two are closest, and the first is too far from the third."""
    angles = np.radians([0.0, 11.0, 13.0, 40.0])
    up = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(4)])
    assert group_directions(up).tolist() == [0, 1, 1, 2]


def test_the_noise_is_the_mean_and_not_the_median_of_what_single_holds_show() -> None:
    """With four degrees of freedom the median of χ² is 16 % below its mean."""
    rng = np.random.default_rng(12)
    batches = rng.standard_normal((2000, 5, 3))
    holds = [
        replace(
            hold(np.zeros(3), 0.0, 2.0, gyroscope=np.zeros(3)),
            accelerometer_covariance=np.cov(one.T) / 5.0,
            gyroscope_covariance=np.cov(one.T) / 5.0,
        )
        for one in batches
    ]
    noise = hold_noise(holds)
    assert rate_noise(holds) == pytest.approx(np.full(3, 2.0 / 5.0), rel=0.05)
    assert noise.accelerometer[0] == pytest.approx(1.0 / 5.0, rel=0.03)


def test_a_hand_that_trembles_turns_gravity_more_than_it_changes_it() -> None:
    """Along gravity and across it are then two numbers; a device that lies still has one."""
    rng = np.random.default_rng(13)
    holds = []
    signs = np.tile([1.0, -1.0], 60)[:, None]
    for index, up in enumerate(signs * np.repeat(np.eye(3), 40, axis=0)):
        sigma = np.where(up == 0.0, 3.0, 1.0)
        batches = sigma * rng.standard_normal((5, 3))
        one = hold(9.8 * up, 10.0 * index)
        holds.append(replace(one, accelerometer_covariance=np.cov(batches.T) / 5.0))
    noise = hold_noise(holds)
    assert noise.accelerometer == pytest.approx(np.full(120, 0.2), rel=0.3)
    assert noise.across == pytest.approx(np.full(120, 9.0 * 0.2), rel=0.25)
    still = [replace(one, accelerometer_covariance=np.eye(3)) for one in holds]
    assert (hold_noise(still).across == hold_noise(still).accelerometer).all()


def test_noise_of_a_hand_is_at_most_what_the_fit_leaves() -> None:
    """The mean shows less of a sway than its lowest frequencies; misfits and tables change nothing.

    Of 120 holds, with three directions fitted, the variance is found within a fifth, which is 1.5
    of its standard errors, and more than 117 degrees of freedom leave cannot come from less noise.
    """
    rng = np.random.default_rng(15)
    columns, told = rng.standard_normal((120, 3)), rng.uniform(0.5, 2.0, 120)
    held = HoldNoise(told, 5.0 * told, held=True)
    errors = 0.5 * np.sqrt(told) * rng.standard_normal(120) + columns @ [3.0, -2.0, 1.0]
    assert held.bounded(errors, columns).accelerometer == pytest.approx(0.25 * told, rel=0.2)
    assert (held.bounded(errors, columns).across == held.across).all()
    assert (held.bounded(4.0 * errors, columns).accelerometer == told).all()
    few = HoldNoise(told[:5], told[:5], held=True)
    assert few.bounded(errors[:5], columns[:5]) is few
    on_table = HoldNoise(told, told)
    assert on_table.bounded(errors, columns) is on_table


@pytest.mark.parametrize("offset", [0.0, 32768.0])
def test_gravity_is_seen_from_the_middle_of_the_readings(offset: float) -> None:
    """Raw counts around 32768 point nowhere; what is left of their middle does.

    Each axis holds 1 along gravity and 9 on either component across it. All holds show the same; as
    variances with ν degrees of freedom their logarithms are low by log(ν/2) − ψ(ν/2) on average.
    """
    holds = [
        replace(
            hold(offset + 980.0 * up, 10.0 * index),
            accelerometer_covariance=np.diag(np.where(up == 0.0, 9.0, 1.0)),
        )
        for index, up in enumerate(np.concatenate([np.eye(3), -np.eye(3)]))
    ]
    noise = hold_noise(holds)
    assert noise.accelerometer == pytest.approx(
        np.full(6, 2.0 / np.exp(special.digamma(2.0))), rel=1e-3
    )
    assert noise.across == pytest.approx(np.full(6, 36.0 / np.exp(special.digamma(4.0))), rel=1e-3)


def test_a_hold_without_a_number_of_the_gyroscope_has_no_rate() -> None:
    assert has_rate(hold(np.zeros(3), 0.0, gyroscope=np.ones(3)))
    assert not has_rate(hold(np.zeros(3), 0.0, gyroscope=np.array([1.0, np.nan, 1.0])))
    assert not has_rate(hold(np.zeros(3), 0.0))
