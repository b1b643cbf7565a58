"""What is held out is what a complete refit without it would err."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, norm

from imucal_wizard.core.directions import group_directions
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.distributions import WITHIN_NINETY, chi_square
from imucal_wizard.estimate.gyroscope import GyroscopeExperiment
from imucal_wizard.estimate.hold_search import judge
from imucal_wizard.estimate.recording import fit_accelerometer
from tests.estimate.motions import experiment, hand_turns
from tests.estimate.truth import (
    EIGHTEEN,
    SIX,
    TWENTY_SIX,
    even_directions,
    hold,
    holds_of,
    random_triangular,
    tilted,
    typical_accelerometer,
    typical_gyroscope,
)

GRAVITY = 9.80665


@pytest.mark.parametrize("spread", [1.0, 6.0])
@pytest.mark.parametrize("method", ["least_squares", "newton"])
def test_each_direction_is_left_out_whole(method: str, spread: float) -> None:
    """A refit of all holds but those of one direction gives exactly its errors: of every second.

    Also where holds scatter so much that directions touch: a hold stays with its own.
    """
    rng = np.random.default_rng(0)
    up = tilted(np.concatenate([EIGHTEEN, SIX]), spread, rng)
    noise = 3e-3 * rng.standard_normal((24, 3))
    holds = holds_of(typical_accelerometer(), up, noise=noise, sigma=3e-3)
    result = fit_accelerometer(holds, GRAVITY, "m/s^2", method)
    assert result.held_out is not None
    assert result.reference is not None
    assert result.rms_held_out is not None
    labels = result.reference.labels
    assert labels.max() + 1 == 18 or spread > 1.0
    allowed = 2e-6 if method == "newton" else 1e-2 * result.rms_held_out
    for label in range(0, labels.max() + 1, 2):
        kept = [hold for hold, own in zip(holds, labels, strict=True) if own != label]
        refit = fit_accelerometer(kept, GRAVITY, "m/s^2", method)
        for index in np.flatnonzero(labels == label):
            corrected = refit.matrix @ (holds[index].accelerometer - refit.bias)
            error = np.linalg.norm(corrected) - GRAVITY
            # the fit without a direction follows by one step from the fit of all
            assert result.held_out[index] == pytest.approx(error, abs=allowed)


def test_no_two_holds_of_a_direction_are_far_apart() -> None:
    """Complete linkage: all of a direction lie within 12° of one another."""
    up = tilted(np.concatenate([EIGHTEEN] * 3), 6.0, np.random.default_rng(7))
    labels = group_directions(up)
    apart = np.degrees(np.arccos(np.clip(up @ up.T, -1.0, 1.0)))
    same = labels[:, None] == labels
    assert apart[same].max() < 12.0
    # and two directions could not be one
    for first in range(labels.max() + 1):
        for second in range(first):
            assert apart[np.ix_(labels == first, labels == second)].max() > 12.0


def test_held_out_errors_are_those_of_new_directions() -> None:
    """On average over experiments: the rms held out is the rms on orientations never seen.

    A new hold has its own noise as a held-out one has. 60 experiments know the ratio to 5 %.
    """
    rng = np.random.default_rng(1)
    truth = typical_accelerometer()
    new = holds_of(truth, even_directions(200, rng), noise=3e-3 * rng.standard_normal((200, 3)))
    readings = np.array([hold.accelerometer for hold in new])
    held, unseen = [], []
    for _ in range(60):
        noise = 3e-3 * rng.standard_normal((26, 3))
        fit = fit_accelerometer(holds_of(truth, TWENTY_SIX, noise=noise), GRAVITY, "m/s^2")
        lengths = np.linalg.norm((readings - fit.bias) @ fit.matrix.T, axis=1)
        unseen.append(np.mean((lengths - GRAVITY) ** 2))
        held.append((fit.rms_held_out or 0.0) ** 2)
    # leaving a direction out also leaves a hole, so it errs a little more
    assert 1.0 < np.sqrt(np.mean(held) / np.mean(unseen)) < 1.35


@pytest.mark.parametrize("method", ["least_squares", "newton", "algebraic"])
def test_the_floors_are_what_measured_noise_makes(method: str) -> None:
    """Of the errors held out and fitted of a complete model: 40 experiments know them to 4 %."""
    rng, truth, squares = np.random.default_rng(9), typical_accelerometer(), []
    for _ in range(40):
        noise = 1e-3 * rng.standard_normal((18, 3))
        holds = holds_of(truth, EIGHTEEN, noise=noise, sigma=1e-3)
        fit = fit_accelerometer(holds, GRAVITY, "m/s^2", method)
        assert fit.rms_held_out is not None
        assert fit.floor is not None
        assert fit.floor_fitted is not None
        squares.append([fit.rms_held_out, fit.floor, fit.rms_fitted, fit.floor_fitted])
    out, floor, fitted, floor_fitted = np.sqrt(np.mean(np.square(squares), axis=0))
    assert (out, fitted) == pytest.approx((floor, floor_fitted), rel=0.1)
    assert floor > 1.3 * floor_fitted


@pytest.mark.parametrize("tilt_sigma", [0.0, 1e-3])
def test_a_rotation_left_out_errs_as_under_a_complete_refit(tilt_sigma: float) -> None:
    """One Gauss–Newton step from the fit of all is all that it takes: of every second rotation.

    Refits also weigh the still means and the rotations anew, which moves an error by 3 % of its
    size at most.
    """
    rng = np.random.default_rng(2)
    data = experiment(
        hand_turns(6, rng), typical_gyroscope(), rng, sigma=0.0025, tilt_sigma=tilt_sigma
    )
    fit = data.fit()
    assert fit.held_out is not None
    rms = float(np.sqrt((fit.held_out**2).mean()))
    assert isinstance(fit.experiment, GyroscopeExperiment)
    closure = fit.experiment.closure
    for index in range(0, 18, 2):
        refit = data.only([i for i in range(18) if i != index]).fit()
        error = float(np.linalg.norm(closure.closures(refit.matrix, refit.bias)[index]))
        assert fit.held_out[index] == pytest.approx(error, abs=0.03 * (rms + error))


def test_too_few_rotations_cannot_be_left_out() -> None:
    """Five rotations have ten equations for nine gains: one less leaves eight."""
    rng = np.random.default_rng(3)
    data = experiment(hand_turns(6, rng), typical_gyroscope(), rng, sigma=0.0025)
    fit = data.only([0, 1, 6, 7, 12]).fit()
    assert fit.held_out is None or fit.not_determined


@pytest.mark.parametrize("seed", [3, 4])
def test_no_closure_is_expected_to_err_by_more_than_half_a_turn(seed: int) -> None:
    """Every second rotation has the other sense, so that no calibration closes them.

    Degrees of freedom as few as these would give angles of 5 to 8 rad, which no directions enclose.
    """
    rng = np.random.default_rng(seed)
    turns = hand_turns(6, rng)
    data = experiment(turns, typical_gyroscope(), rng, sigma=0.0025, tilt_sigma=1e-3)
    senses = np.resize([-1.0, 1.0], len(data.rotations))
    pairs = zip(data.rotations, senses, strict=True)
    fit = replace(data, rotations=[replace(one, rate=s * one.rate) for one, s in pairs]).fit()
    low, high = fit.held_out_interval or (np.inf, np.inf)
    assert 0.5 < low < high
    assert high == np.pi
    assert fit.rms_held_out is not None
    assert fit.rms_held_out <= np.pi


def test_judging_needs_no_refit() -> None:
    """The linearised left-out error follows the refitted one; the rest is geometry."""
    rng = np.random.default_rng(4)
    truth = typical_accelerometer()
    ratios = []
    noise = 1e-3 * rng.standard_normal((26, 3))
    for size in (1.0, 10.0):
        holds = holds_of(truth, TWENTY_SIX, noise=size * noise)
        fit = fit_accelerometer(holds, GRAVITY, "m/s^2")
        ratios.append(judge(holds, GRAVITY) / (fit.rms_held_out or 1.0))
    assert ratios[0] == pytest.approx(ratios[1], rel=0.02)
    assert 0.4 < ratios[0] < 1.0


def test_judging_prefers_good_holds_and_many_directions() -> None:
    """Less noise is better; eighteen directions are better than ten of them; nothing is worst."""
    rng = np.random.default_rng(5)
    truth = typical_accelerometer()
    noise = 1e-3 * rng.standard_normal((18, 3))
    good = holds_of(truth, EIGHTEEN, noise=noise)
    bad = holds_of(truth, EIGHTEEN, noise=10.0 * noise)
    assert judge(good, GRAVITY) < judge(bad, GRAVITY)
    assert judge(good, GRAVITY) < judge(good[:12], GRAVITY) < np.inf
    assert judge(good[:3], GRAVITY) == np.inf
    assert judge([], GRAVITY) == np.inf


def test_a_rest_in_pieces_is_judged_as_one() -> None:
    """A calm rest counts no more for being broken: the same error as of the whole."""
    noise = 1e-3 * np.random.default_rng(6).standard_normal((18, 3))
    holds = holds_of(typical_accelerometer(), EIGHTEEN, noise=noise)
    numbers = np.arange(len(holds))
    broken = [*[holds[0]] * 5, *holds[1:]]
    together = judge(broken, GRAVITY, np.concatenate([np.zeros(4, int), numbers]))
    assert together == pytest.approx(judge(holds, GRAVITY), rel=1e-9)
    assert together != pytest.approx(judge(broken, GRAVITY), rel=1e-3)


@pytest.mark.parametrize("freedom", [0.5, 1.0, 2.0, 4.0, 5.9, 6.0, 9.5, 30.0, 200.0])
def test_chi_square_is_that_of_the_tables(freedom: float) -> None:
    """Against SciPy: exact for few degrees of freedom, else Wilson and Hilferty's approximation."""
    for deviations in (-WITHIN_NINETY, 0.0, WITHIN_NINETY):
        exact = chi2.ppf(norm.cdf(deviations), freedom) / freedom
        near = 1e-6 if freedom < 6.0 else 0.02
        assert chi_square(deviations, freedom) == pytest.approx(exact, rel=near)


def relative_variance(up: FloatArray, sigma: FloatArray, unlike: float) -> float:
    """Of the mean square of new holds, about the one held out: 2 over its degrees of freedom.

    Args:
        up: direction of each hold, shape (n, 3).
        sigma: noise of each, shape (n,).
        unlike: variance of the variances by noise, over the square of their mean.
    """
    columns = np.column_stack([up[:, i] * up[:, j] for i in range(3) for j in range(i, 3)] + [up])
    weighted = columns / sigma[:, None] ** 2
    hat = columns @ np.linalg.solve(columns.T @ weighted, weighted.T)
    left = (np.eye(len(up)) - hat) * sigma / (1.0 - np.diag(hat))[:, None]
    pulled = hat * sigma
    new = np.mean(sigma**2 + (pulled**2).sum(axis=1))

    def of_sum(maps: FloatArray) -> float:
        return float(2.0 * ((maps @ maps.T) ** 2).sum())

    by_holds = unlike * (sigma**2).mean() ** 2 / len(up)
    by_fit = of_sum(pulled) / len(up) ** 2
    return float(of_sum(left) / (left**2).sum() ** 2 + (by_fit + by_holds) / new**2)


@pytest.mark.parametrize("up", [EIGHTEEN, TWENTY_SIX], ids=["18 poses", "26 poses"])
def test_unequally_noisy_holds_widen_the_interval_as_log_normal_noise_does(up: FloatArray) -> None:
    """Few variances that differ by factors lack the rare large ones that new holds have.

    The noises are the quantiles of a log-normal one of 0.7. The linear fit is written out: errors
    of the sensor of some per cent change its columns, and the interval by less than 1e-3.
    """
    rng, count = np.random.default_rng(0), len(up)
    sigma = 1e-3 * np.exp(0.7 * rng.permutation(norm.ppf((np.arange(count) + 0.5) / count)))
    read = typical_accelerometer().readings(GRAVITY * up)
    read += sigma[:, None] * rng.standard_normal((count, 3))
    pairs = enumerate(zip(read, sigma, strict=True))
    holds = [hold(reading, 10.0 * place, sigma=own) for place, (reading, own) in pairs]
    fit = fit_accelerometer(holds, GRAVITY, "m/s^2")
    assert fit.rows is not None
    low, high = fit.held_out_interval or (np.inf, -np.inf)
    noise = fit.rows.floor  # that of each hold, drawn a little to that of all
    variances = noise**2
    by_factors = float(np.expm1(np.log(variances).var()))
    as_they_are = float(variances.var() / variances.mean() ** 2)

    def spread(unlike: float) -> float:
        freedom = 2.0 / relative_variance(up, noise, unlike)
        ends = chi_square(WITHIN_NINETY, freedom) / chi_square(-WITHIN_NINETY, freedom)
        return float(ends**0.5)

    assert high / low == pytest.approx(spread(by_factors), rel=1e-3)
    assert high / low > 1.05 * spread(as_they_are)


@pytest.mark.study
@pytest.mark.parametrize(
    ("up", "sigma"),
    [(EIGHTEEN, 3e-3), (np.concatenate([TWENTY_SIX, TWENTY_SIX[:12]]), 3e-4)],
    ids=["18 poses", "26 + 12 poses"],
)
def test_the_interval_holds_the_error_of_new_holds(up: FloatArray, sigma: float) -> None:
    """Of 100 units nine in ten; between 87 and 93 % and 2.5 binomial deviations to either side."""
    rng = np.random.default_rng(31)
    units, inside = 100, 0
    for _ in range(units):
        truth = random_triangular(rng)
        placed = tilted(up, 1.0, rng)
        noise = sigma * rng.standard_normal((len(up), 3))
        fit = fit_accelerometer(holds_of(truth, placed, noise=noise, sigma=sigma), GRAVITY, "m/s^2")
        read = truth.readings(GRAVITY * even_directions(400, rng))
        read += sigma * rng.standard_normal(read.shape)
        errors = np.linalg.norm((read - fit.bias) @ fit.matrix.T, axis=1) - GRAVITY
        low, high = fit.held_out_interval or (np.inf, -np.inf)
        inside += low <= np.sqrt((errors**2).mean()) <= high
    spread = 2.5 * np.sqrt(0.9 * 0.1 / units)
    assert 0.87 - spread < inside / units < 0.93 + spread
