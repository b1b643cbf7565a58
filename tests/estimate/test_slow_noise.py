"""The wandering of a bias: what it does to averages, how it is told, and that intervals know it."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from imucal_wizard.core.readings import FloatArray, Series
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.estimate.accelerometer import fit_accelerometer
from imucal_wizard.estimate.distributions import quantile
from imucal_wizard.estimate.gyroscope_report import fit_gyroscope
from imucal_wizard.estimate.parameters import full_parameters, triangular_parameters
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.estimate.slow_noise import (
    OCTAVES,
    RATIOS,
    Fitted,
    Shown,
    about_the_mean,
    averaged,
    complement,
    in_session,
    long_rest,
    slow_covariances,
    slow_rate,
    unseen,
    walked,
)
from tests.estimate.truth import hold
from tests.estimate.wandering import wandering

SPANS = np.array([[0.0, 2.0], [4.0, 7.0], [7.0, 11.0], [90.0, 93.0], [400.0, 402.0]])


def _regular(count: int) -> FloatArray:
    """Holds of 3 s, one every 5 s."""
    start = 5.0 * np.arange(count)
    return np.column_stack([start, start + 3.0])


def test_the_covariance_of_averages_is_the_mean_over_all_pairs_of_moments() -> None:
    """Brute force: each hold 400 moments, the processes' covariance between any two."""
    share = (np.arange(400) + 0.5) / 400.0
    moments = SPANS[:, :1] + share * (SPANS[:, 1:] - SPANS[:, :1])
    expected = np.empty((5, 5))
    for i, one in enumerate(moments):
        for j, other in enumerate(moments):
            apart = np.abs(one[:, None] - other)
            expected[i, j] = sum(0.5 * np.exp(-apart / tau).mean() for tau in OCTAVES)
    assert averaged(SPANS) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("seconds", [6.0, 20.0, 60.0])
def test_its_allan_deviation_is_flat_at_one(seconds: float) -> None:
    """Between the first correlation time and the last (IEEE 952, annex C)."""
    spans = np.array([[0.0, seconds], [seconds, 2.0 * seconds]])
    covariance = averaged(spans)
    allan = 0.5 * (covariance[0, 0] + covariance[1, 1]) - covariance[0, 1]
    assert np.sqrt(allan) == pytest.approx(1.0, rel=0.04)


def _expected_ratio(shown: list[Shown], spans: FloatArray) -> float:
    """B/N behind the covariance."""
    found = slow_covariances(spans, shown)[0]
    density = np.sqrt(2.0 * np.median(shown[0].noise * (spans[:, 1] - spans[:, 0])))
    return float(np.sqrt(found[0, 0] / averaged(spans)[0, 0]) / density)


@pytest.mark.parametrize("ratio", [0.1, 0.3, 1.0])
def test_many_holds_tell_how_large_it_is(ratio: float) -> None:
    """300 holds and three axes: to a fifth, whatever the unit of the readings."""
    rng, spans, unit = np.random.default_rng(0), _regular(300), 37.0
    white = unit**2 / (2.0 * 3.0)
    root = np.linalg.cholesky(white * np.eye(300) + (unit * ratio) ** 2 * averaged(spans))
    ones = np.ones((300, 1))
    shown = []
    for _ in range(3):
        values = root @ rng.standard_normal(300)
        shown.append(Shown(values - values.mean(), ones, np.full(300, white)))
    assert _expected_ratio(shown, spans) == pytest.approx(ratio, rel=0.2)


def test_scatter_without_order_in_time_is_not_taken_for_it() -> None:
    """Holds that scatter by three times their noise, each by itself: B stays below N/6."""
    rng, spans = np.random.default_rng(1), _regular(200)
    values = 3.0 * rng.standard_normal((200, 3))
    ones = np.ones((200, 1))
    shown = [Shown(one - one.mean(), ones, np.ones(200)) for one in values.T]
    assert _expected_ratio(shown, spans) < 1.0 / 6.0


def test_the_likelihood_is_that_of_what_the_fit_cannot_absorb() -> None:
    """By SciPy's normal density of the projected errors, over all ratios and scatters."""
    from imucal_wizard.estimate import slow_noise

    rng, spans = np.random.default_rng(2), _regular(12)
    columns, noise = rng.standard_normal((12, 3)), rng.uniform(0.5, 2.0, 12)
    alike = np.corrcoef(rng.standard_normal((12, 4)))
    errors = rng.standard_normal(12) * 2.0
    slow = 2.0 * np.median(3.0 * noise) * averaged(spans) * alike
    across = complement(columns / np.sqrt(noise)[:, None])
    scatter = np.exp(slow_noise._scatter_prior())
    prior = np.exp(slow_noise._prior(RATIOS))
    weights = []
    for square in RATIOS**2:
        whole = 0.0
        for size, share in zip(slow_noise.SCATTERS, scatter, strict=True):
            covariance = np.diag(size * noise) + square * slow
            white = covariance / np.sqrt(np.outer(noise, noise))
            density = stats.multivariate_normal(np.zeros(9), across.T @ white @ across)
            whole += share * density.pdf(across.T @ (errors / np.sqrt(noise)))
        weights.append(whole)
    mixed = prior * np.array(weights)
    expected = float(mixed @ RATIOS**2 / mixed.sum()) * slow
    found = slow_covariances(spans, [Shown(errors, columns, noise, alike)])[0]
    assert found == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("kernel", [averaged, walked])
def test_the_covariance_about_the_mean_of_a_session_is_that_of_its_moments(
    kernel: Callable[[FloatArray], FloatArray],
) -> None:
    """Against the same kernel over a thousand slices of the session, averaged by hand."""
    slices = np.linspace(10.0, 412.0, 2011)  # 0.2 s each, on which all spans below end
    pieces = np.column_stack([slices[:-1], slices[1:]]) - 10.0
    spans = 10.0 + SPANS
    shares = np.array([(pieces[:, 0] + 10.05 > a) & (pieces[:, 1] + 9.95 < b) for a, b in spans])
    shares = shares / shares.sum(axis=1)[:, None] - np.full(len(pieces), 1.0 / len(pieces))
    expected = shares @ kernel(pieces) @ shares.T
    assert about_the_mean(spans, kernel) == pytest.approx(expected, rel=1e-3, abs=1e-4)


def test_white_errors_have_the_intervals_of_least_squares() -> None:
    """A line through twelve holds: σ² (XᵀX)⁻¹, of which the doubt takes up to a tenth."""
    rng, columns = np.random.default_rng(7), np.column_stack([np.ones(12), np.tile([1.0, -1.0], 6)])
    pull, spans = np.linalg.pinv(columns), _regular(12)
    total = np.zeros((2, 2))
    for _ in range(300):
        errors = rng.standard_normal(12)
        errors -= columns @ pull @ errors
        found = in_session(
            spans, Fitted(errors, columns, np.ones(12), np.ones((12, 12)), pull), False
        )
        assert found is not None
        total += found / 300.0
    # 300 sets of ten degrees of freedom know a variance to 2.6 %
    assert np.diag(total) == pytest.approx(np.full(2, 1.0 / 12.0 * 0.94), rel=0.1)


def test_a_long_rest_tells_how_large_slow_noise_is() -> None:
    """Ninety seconds under three sizes of a random walk: the true one of five is the likeliest."""
    rng, sizes = np.random.default_rng(8), np.array([0.0, 1.0, 10.0, 100.0, 1000.0])
    time = np.arange(4500) / 50.0
    for true in (0.0, 10.0, 100.0):
        steps = np.sqrt(true / 50.0) * rng.standard_normal((4500, 3))
        values = np.cumsum(steps, axis=0) + rng.standard_normal((4500, 3))
        series = Series(time, values, "m/s^2")
        rest = long_rest(series, [hold(values.mean(axis=0), 0.0, 90.0)], 1.0)
        assert rest is not None
        assert sizes[rest.evidence(walked, sizes).argmax()] == true
    assert long_rest(series, [hold(values.mean(axis=0), 0.0, 50.0)], 1.0) is None


def test_without_noise_nothing_is_known_of_it() -> None:
    """Readings without any noise, as simulations have them, get none added."""
    shown = Shown(np.ones(5), np.ones((5, 1)), np.zeros(5))
    assert (slow_covariances(SPANS, [shown])[0] == 0.0).all()
    rests = [hold(np.zeros(3), 5.0 * k, gyroscope=np.full(3, 0.1 * k)) for k in range(5)]
    assert (slow_rate(rests) == 0.0).all()
    bare = [replace(one, gyroscope=None, gyroscope_covariance=None) for one in rests]
    assert (slow_rate(bare) == 0.0).all()


def test_the_rate_of_unequal_shares_is_known_less() -> None:
    """Of one hold alone it is the covariance of that hold; the mean of all is known better."""
    rng = np.random.default_rng(3)
    rests = [
        hold(np.zeros(3), 5.0 * k, 3.0, 0.02 * rng.standard_normal(3), gyroscope_sigma=0.01)
        for k in range(30)
    ]
    one, even = slow_rate(rests, np.eye(30)[0]), slow_rate(rests)
    kernel = averaged(_regular(30))
    seen = (np.trace(kernel) - 30.0 * kernel.mean()) / 29.0
    ratio = (kernel.mean() - seen / 30.0) / (kernel[0, 0] - seen)
    assert even / one == pytest.approx(np.full(3, ratio))


def test_the_rate_of_a_wandering_gyroscope_is_known_as_its_formula_says() -> None:
    """Two hundred rests of 3 s whose noise is told and whose bias wanders by B = N/2.

    What is added is then nearly the true variance of their mean less what their scatter shows.
    """
    rng, spans, ratio = np.random.default_rng(6), _regular(200), 0.5
    white = 1e-4 / (2.0 * 3.0)
    slow = ratio**2 * 1e-4 * averaged(spans)
    root = np.linalg.cholesky(white * np.eye(200) + slow)
    values = 0.3 + root @ rng.standard_normal((200, 3))
    rests = [
        hold(np.zeros(3), start, 3.0, rate, gyroscope_sigma=np.sqrt(white))
        for start, rate in zip(spans[:, 0], values, strict=True)
    ]
    seen = (np.trace(slow) - 200.0 * slow.mean()) / 199.0
    expected = slow.mean() - seen / 200.0
    assert slow_rate(rests) == pytest.approx(np.full(3, expected), rel=0.5)


def test_what_the_scatter_shows_already_is_not_counted_twice() -> None:
    """In 4000 sets of errors with known slow noise: the fit's own variance and this make the true.

    A line through 20 holds; the errors of its two numbers, over all sets, are the covariance.
    """
    rng, spans = np.random.default_rng(5), _regular(20)
    columns = np.column_stack([np.ones(20), np.linspace(-1.0, 1.0, 20)])
    slow = 0.5 * averaged(spans)
    errors = np.linalg.cholesky(np.eye(20) + slow) @ rng.standard_normal((20, 4000))
    fitted = np.linalg.pinv(columns)
    found = fitted @ errors
    scatter = ((errors - columns @ found) ** 2).sum(axis=0).mean() / 18.0
    own = scatter * fitted @ fitted.T
    whole = own + fitted @ unseen(slow, columns, scatter) @ fitted.T
    size = np.sqrt(np.outer(np.diag(whole), np.diag(whole)))
    # of 4000 a covariance is known to 1.6 % of that, a variance to 2.2 %
    assert whole / size == pytest.approx(np.cov(found) / size, abs=0.08)
    assert own[0, 0] < 0.3 * whole[0, 0]
    assert (unseen(slow, columns, 0.0) == slow).all()


@pytest.mark.parametrize("instability", [1.0, 4.0])
def test_intervals_hold_the_truth_where_the_bias_wanders(instability: float) -> None:
    """A consumer sensor's wandering and four times it: 95 % within 4 %, the biases within 10 %.

    The accelerometer's bias is its mean over the session; the gyroscope's is that of all times:
    nobody who measures for five minutes can know what takes ten.
    """
    rng, repetitions = np.random.default_rng(4), 30
    inside: Counter[str] = Counter()
    looked: Counter[str] = Counter()

    def count(fit: SensorFit, true: dict[str, float]) -> None:
        reach = quantile(0.95, fit.degrees_of_freedom)
        for one in fit.parameters:
            assert one.standard_error is not None
            kind = "bias" if one.name.startswith("bias") else "rest"
            looked[kind] += 1
            inside[kind] += abs(one.value - true[one.name]) < reach * one.standard_error

    for _ in range(repetitions):
        session = wandering(3, instability, rng)
        found = fit_accelerometer(session.holds, STANDARD_GRAVITY, "m/s^2")
        count(
            found,
            triangular_parameters(session.accelerometer.matrix, session.mean_bias),
        )
        fit = fit_gyroscope(session.holds, session.rotations, found, "rad/s").fit
        assert fit is not None
        count(fit, full_parameters(session.gyroscope.matrix, session.gyroscope.bias))
    assert abs(inside["bias"] / looked["bias"] - 0.95) < 0.10
    assert abs(sum(inside.values()) / sum(looked.values()) - 0.95) < 0.04
