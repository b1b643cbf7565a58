"""The wandering of a bias: what it does to averages, how it is told, and that intervals know it."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from benchmarks.gyroscope_bound import DEVICES, Session, fitted
from imucal_wizard.core.readings import BoolArray, FloatArray, Series, distinct
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.estimate.distributions import quantile
from imucal_wizard.estimate.gyroscope_report import fit_gyroscope
from imucal_wizard.estimate.parameters import full_parameters, triangular_parameters
from imucal_wizard.estimate.recording import fit_accelerometer
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.estimate.slow_errors import Fitted, SlowErrors, SlowKind
from imucal_wizard.estimate.slow_kernels import OCTAVES, about_the_mean, averaged, walked
from imucal_wizard.estimate.slow_noise import (
    estimate_slow_errors,
    in_session,
    slow_rate,
)
from imucal_wizard.estimate.slow_rests import RestPieces, long_rest
from imucal_wizard.model.rows.decorrelation import Decorrelation
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
            spans, [Fitted(errors, columns, np.ones(12), np.ones((12, 12)), pull)], False
        )
        assert found is not None
        total += found / 300.0
    # 300 sets of ten degrees of freedom know a variance to 2.6 %
    assert np.diag(total) == pytest.approx(np.full(2, 1.0 / 12.0 * 0.94), rel=0.1)


def test_slow_errors_weigh_holds_only_where_they_are_likely() -> None:
    """The mean of sixty holds of the field's magnitude: white errors weigh as they did."""
    rng, spans, ones = np.random.default_rng(9), _regular(60), np.ones((60, 1))
    for errors, few in (
        (rng.standard_normal(60), True),
        (np.cumsum(rng.standard_normal(60)), False),
    ):
        left = errors - errors.mean()
        alike = np.ones((60, 60))
        fitted = Fitted(left, ones, np.ones(60), alike, ones.T / 60.0, np.ones(60))
        found = estimate_slow_errors(spans, [fitted], False)
        assert found is not None
        assert (found.loading(Decorrelation()).shape[1] == 0) is few


def test_residuals_that_measured_noise_explains_leave_little_to_slow_errors() -> None:
    """Thirty holds: slow errors are less likely if the white ones have the noise that was measured.

    Noise measured far below what is left says nothing: then either may be what is left.
    """
    rng, spans, ones = np.random.default_rng(12), _regular(30), np.ones((30, 1))
    slow: dict[str, list[float]] = {"unknown": [], "measured": [], "far below": []}
    for _ in range(40):
        left = rng.standard_normal(30)
        left -= left.mean()
        alike = np.ones((30, 30))
        fitted = Fitted(left, ones, np.ones(30), alike, ones.T / 30.0, np.ones(30))
        own = {"unknown": None, "measured": np.ones(30), "far below": np.full(30, 1e-2)}
        for name, variance in own.items():
            found = estimate_slow_errors(spans, [replace(fitted, own=variance)], False)
            assert found is not None
            large = [one.weight[1:][one.size[0, 1:] > 0.3].sum() for one in found.kinds]
            slow[name].append(float(sum(large)))
    assert np.mean(slow["measured"]) < 0.6 * np.mean(slow["unknown"])
    assert np.mean(slow["far below"]) > np.mean(slow["unknown"])


def test_intervals_hold_their_share_of_all_kinds_and_sizes_of_errors() -> None:
    """Two parameters: nothing but white errors, and one large kind with a probability of 4 %."""
    pull = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.5, 0.0, 0.0]])
    fitted = Fitted(np.zeros(4), np.zeros((4, 0)), np.ones(4), np.eye(4), pull)
    slow = np.diag([0.0, 1.0, 1.0, 1.0])[None]
    sizes = np.array([0.96, 0.04]), np.ones((1, 2)), np.array([[0.0, 24.0]])
    kind = SlowKind(*sizes, slow, slow[0], np.ones(2), 1.0, True)
    found = SlowErrors((kind,), (np.ones(4),)).covariance_of_intervals(fitted, 9.0)
    reach, other = stats.t.isf(0.025, 9) * np.sqrt(np.diag(found))
    assert reach == pytest.approx(stats.t.isf(0.025, 9), rel=1e-3)
    beyond = 0.96 * stats.t.sf(other / 0.5, 9) + 0.04 * stats.t.sf(other / 2.5, 9)
    assert 2.0 * beyond == pytest.approx(0.05, rel=0.02)
    assert found[0, 1] == pytest.approx(0.0, abs=1e-9)


def test_the_errors_of_holds_are_the_same_whatever_a_second_fit_weighs_them_by() -> None:
    """One fit tells the errors; that by which another one weighs its holds is no part of them."""
    rng, spans, ones = np.random.default_rng(4), _regular(30), np.ones((30, 1))
    left = rng.standard_normal(30)
    left -= left.mean()
    first = Fitted(left, ones, np.full(30, 2.0), np.ones((30, 30)), ones.T / 30.0, np.ones(30))
    found = estimate_slow_errors(spans, [first], False)
    assert found is not None
    second = replace(first, variance=np.full(30, 0.1))
    assert found.covariance([second]) == pytest.approx(found.covariance([first]))


def test_the_next_session_may_have_slow_errors_although_this_one_shows_none() -> None:
    """Of white errors: a slow combination of holds is foreseen less certain than a fast one."""
    rng, spans, ones = np.random.default_rng(4), _regular(60), np.ones((60, 1))
    left = rng.standard_normal(60)
    left -= left.mean()
    fitted = Fitted(left, ones, np.ones(60), np.ones((60, 60)), ones.T / 60.0)
    found = estimate_slow_errors(spans, [fitted], False)
    assert found is not None
    halves, turns = np.repeat([1.0, -1.0], 30), np.tile([1.0, -1.0], 30)
    combinations = np.array([halves, turns]) / np.sqrt(60.0)
    shares, variances = found.foreseen([replace(fitted, pull=combinations)])
    assert shares.sum() == pytest.approx(1.0)
    slow, fast = shares @ variances
    assert 1.2 * left.var() < slow < 10.0 * left.var()
    assert fast == pytest.approx(left.var(), rel=0.3)
    # where repeats show that there is hardly any, another session is likely to have hardly any
    told = estimate_slow_errors(spans, [fitted], True)
    assert told is not None
    shares, variances = told.foreseen([replace(fitted, pull=combinations)])
    assert shares.sum() == pytest.approx(1.0)
    assert left.var() < (shares @ variances)[0] < 0.8 * slow


@pytest.mark.parametrize(("seconds", "rate"), [(90, 50.0), (240, 2.0), (7200, 10.0)])
def test_a_long_rest_tells_how_large_slow_noise_is(seconds: int, rate: float) -> None:
    """Under three sizes of a random walk the true one of five is the likeliest, in short time."""
    rng, sizes = np.random.default_rng(8), np.array([0.0, 1.0, 10.0, 100.0, 1000.0])
    time = np.arange(int(seconds * rate)) / rate
    for true in (0.0, 10.0, 100.0):
        steps = np.sqrt(true / rate) * rng.standard_normal((len(time), 3))
        values = np.cumsum(steps, axis=0) + rng.standard_normal((len(time), 3))
        series = Series(time, values, "m/s^2")
        rest = long_rest(series, [hold(values.mean(axis=0), 0.0, seconds)], np.eye(3))
        assert rest is not None
        assert len(rest) <= 300
        assert sizes[rest.evidence(walked, sizes[None], of_strength=False).argmax()] == true
    assert long_rest(series, [hold(values.mean(axis=0), 0.0, 50.0)], np.eye(3)) is None


@pytest.mark.parametrize("split", [False, True])
def test_a_long_rest_with_a_gap_is_one_in_parts(split: bool) -> None:
    """Half a second without samples, in one hold or between two; another pose is no part."""
    rng, sizes = np.random.default_rng(9), np.array([0.0, 1.0, 10.0, 100.0, 1000.0])
    time = np.delete(np.arange(7000) / 100.0, slice(3000, 3050))
    steps = np.sqrt(10.0 / 100.0) * rng.standard_normal((len(time), 3))
    values = np.cumsum(steps, axis=0) + rng.standard_normal((len(time), 3))
    series, up = Series(time, values, "m/s^2"), np.array([0.0, 0.0, 9.8])
    holds = [hold(up, 0.0, 29.9), hold(up, 30.6, 39.4)] if split else [hold(up, 0.0, 70.0)]
    rest = long_rest(series, holds, np.eye(3))
    assert rest is not None
    assert len(rest) == 22
    assert distinct(rest.rest).tolist() == [0, 1]
    assert not ((rest.spans[:, 0] < 30.4) & (rest.spans[:, 1] > 30.1)).any()
    assert sizes[rest.evidence(walked, sizes[None], of_strength=False).argmax()] == 10.0
    other = [hold(up, 0.0, 29.9), hold(up[::-1], 30.6, 39.4)]
    assert long_rest(series, other, np.eye(3)) is None


def _held(rng: np.random.Generator, walk: float) -> RestPieces:
    """Forty poses of 3 s, twelve parts each, whose readings walk; the white noise told is half."""
    parts, count = 12, 40
    steps = walk * np.sqrt(0.025) * rng.standard_normal((count, parts, 10)).reshape(count, -1)
    walked_within = np.cumsum(steps, axis=1).reshape(count, parts, 10).mean(axis=2)
    means = walked_within + 1.0 * rng.standard_normal((count, parts)) + rng.normal(size=(count, 1))
    start = (8.0 * np.arange(count)[:, None] + 0.25 * np.arange(parts)).ravel()
    return RestPieces(
        spans=np.column_stack([start, start + 0.25]),
        means=means.reshape(-1, 1),
        white=np.full((count * parts, 1), 0.5),
        levels=np.geomspace(0.3, 3.0, 24),
        lever=np.ones(count * parts),
        rest=np.repeat(np.arange(count), parts),
    )


def test_held_poses_show_slow_noise_by_what_changes_within_them() -> None:
    """Offsets of the poses and twice the white noise do not pass for it; a place has none of it."""
    rng, sizes = np.random.default_rng(2), np.array([0.0, 0.125, 0.25, 0.5, 1.0, 2.0, 4.0])
    still, walking = _held(rng, 0.0), _held(rng, 1.0)
    assert still.evidence(walked, sizes[None], of_strength=False).argmax() == 0
    told = walking.evidence(walked, sizes[None], of_strength=False)
    assert sizes[told.argmax()] == 1.0
    assert told[0] < told.max() - 10.0
    assert np.ptp(walking.evidence(None, sizes[None], of_strength=False)) == 0.0
    # half the lever shows a quarter of the variance of the bias, and all of that of the strength
    lighter = replace(walking, lever=0.5 * walking.lever)
    assert sizes[lighter.evidence(walked, sizes[None], of_strength=False).argmax()] == 4.0
    assert sizes[lighter.evidence(walked, sizes[None], of_strength=True).argmax()] == 1.0


def _of_places(spans: FloatArray, still: BoolArray) -> list[FloatArray]:
    """Covariance of averages over these spans by what places do, in the order of their seconds."""
    count = len(spans)
    one = Fitted(
        errors=np.random.default_rng(4).normal(size=count),
        columns=np.ones((count, 1)),
        variance=np.ones(count),
        alike=np.ones((count, count)),
        pull=np.full((1, count), 1.0 / count),
        strength=np.ones(count),
        still=still,
    )
    slow = estimate_slow_errors(spans, [one], measured=False)
    assert slow is not None
    return [kind.slow[0] for kind in slow.kinds if not kind.long]


def test_what_a_place_does_passes_while_the_device_moves() -> None:
    """All of a rest shares it, and what is measured in the motion after it, ever less of it.

    From one rest to another without a motion measured between them the device is carried.
    """
    spans = _regular(20)
    spans[1] = spans[0]  # two rows of one rest
    for covariance in _of_places(spans, np.arange(20) < 10):
        assert covariance[0, 1] == pytest.approx(covariance[0, 0])
        apart = covariance - np.diag(np.diag(covariance))
        assert apart[:10, 2:10] == pytest.approx(0.0, abs=1e-3)
        assert 0.0 < covariance[9, 10] < covariance[9, 9]
        assert (np.diff(covariance[9, 10:14]) <= 0.0).all()
        assert covariance[9, 13] == 0.0


def test_between_two_rests_the_one_place_goes_over_into_the_other() -> None:
    """A rest, a motion measured in four spans, and another rest; and a motion three times as long.

    A rest counts as a millisecond at its place.
    """
    spans = np.array([[0.0, 3.0], *([3.0 + k, 4.0 + k] for k in range(4)), [7.0, 10.0]])
    still = np.array([True, False, False, False, False, True])
    for covariance in _of_places(spans, still):
        assert covariance[0] == pytest.approx([1.0, 0.875, 0.625, 0.375, 0.125, 0.0], abs=1e-3)
        assert covariance[5] == pytest.approx(covariance[0][::-1], abs=1e-12)
    longer = 3.0 * spans
    for covariance, seconds in zip(_of_places(longer, still), (3.0, 6.0), strict=True):
        share = np.maximum(1.0 - np.linspace(0.0, 12.0, 1201) / seconds, 0.0)
        mean = [share[at : at + 301].mean() for at in (0, 300, 600, 900)]
        assert covariance[0, 1:5] == pytest.approx(mean, abs=5e-3)


def test_motion_without_a_rest_passes_places_too() -> None:
    """Brute force: what each of twenty places does at every millisecond of the way past them."""
    begin = np.cumsum(np.random.default_rng(8).uniform(0.5, 3.0, 30))
    spans = np.column_stack([begin, np.append(begin[1:], begin[-1] + 2.0)])
    moments = np.arange(begin[0], spans[-1, 1], 1e-3)
    of_span = np.searchsorted(begin, moments, side="right") - 1
    for covariance, seconds in zip(_of_places(spans, np.zeros(30, bool)), (3.0, 6.0), strict=True):
        places = begin[0] + seconds * np.arange(20)
        each = [np.bincount(of_span, np.interp(moments, places, one)) for one in np.eye(20)]
        shares = np.transpose(each) / np.bincount(of_span)[:, None]
        assert covariance == pytest.approx(shares @ shares.T, abs=1e-3)


def test_slow_errors_that_the_fit_takes_up_whole_are_of_no_size() -> None:
    """A place that acts on all spans alike is the bias: no residual shows how large it is."""
    rng, spans, ones = np.random.default_rng(6), np.arange(12.0)[:, None], np.ones((12, 1))
    left = rng.standard_normal(12)
    left -= left.mean()
    one = Fitted(left, ones, np.ones(12), np.ones((12, 12)), ones.T / 12.0, np.ones(12))
    slow = estimate_slow_errors(np.hstack([spans, spans + 1.0]), [one], measured=False)
    assert slow is not None
    assert np.sqrt(slow.covariance([one])[0, 0]) < 3.0 * left.std()


def test_a_long_rest_tells_how_much_of_the_scatter_of_rests_is_slow() -> None:
    """The same holds and rotations, by a long rest that wanders as they scatter or does not."""
    device = next(one for one in DEVICES if "2 min rest" in one.name)
    session, rng = Session(replace(device, jitter=0.01), 3), np.random.default_rng(3)
    calm = np.zeros_like(session.wandering(rng))
    holds, rotations = session.recorded(rng, slow=calm)
    errors = []
    for slow in (calm, session.wandering(rng)):
        rest, readings = session.rested(rng, slow)
        known = fit_accelerometer([*holds, rest], STANDARD_GRAVITY, "m/s^2", readings=readings)
        found = fitted([*holds, rest], rotations, known, readings)
        assert found.covariance is not None
        errors.append(np.sqrt(np.diag(found.covariance)[9:].mean()))
    # the scatter of independent holds averages out, that of slow noise hardly
    assert errors[1] > 1.3 * errors[0]


def test_without_noise_nothing_is_known_of_it() -> None:
    """Readings without any noise, as simulations have them, get none added."""
    rests = [hold(np.zeros(3), 5.0 * k, gyroscope=np.full(3, 0.1)) for k in range(5)]
    assert (slow_rate(rests) == 0.0).all()


def test_rests_that_follow_one_another_tell_less_of_a_walking_bias() -> None:
    """The mean of the first ten of forty rests, less the mean of the session: its mean square.

    Three axes walk 200 times; of rests spread evenly nothing is missing that their scatter hides.
    """
    rng, spans = np.random.default_rng(3), _regular(40)
    seconds = np.arange(198.0)
    inside = (seconds >= spans[:, :1]) & (seconds + 1.0 <= spans[:, 1:])
    first, off, predicted = (np.arange(40) < 10) / 10.0, [], []
    for _ in range(200):
        walk = np.cumsum(rng.standard_normal((198, 3)), axis=0)
        means = inside @ walk / 3.0
        rests = [hold(np.zeros(3), 5.0 * k, 3.0, gyroscope=one) for k, one in enumerate(means)]
        off.append(first @ means - walk.mean(axis=0))
        predicted.append(slow_rate(rests, first) + 0.1 * means.var(axis=0, ddof=1))
        assert (slow_rate(rests) < 0.01 * means.var(axis=0)).all()
    assert np.mean(predicted) == pytest.approx(np.mean(np.square(off)), rel=0.3)


@pytest.mark.study
@pytest.mark.parametrize("instability", [1.0, 4.0])
def test_intervals_hold_the_truth_where_the_bias_wanders(instability: float) -> None:
    """A consumer sensor's wandering and four times it: 95 % within 6.5 %, the biases within 15 %.

    The biases are their means over the session: nobody who measures for five minutes can know what
    takes ten.
    """
    rng, repetitions = np.random.default_rng(4), 12
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
            triangular_parameters(session.accelerometer.matrix, session.mean_bias[:3]),
        )
        fit = fit_gyroscope(session.holds, session.rotations, found, "rad/s").fit
        assert fit is not None
        count(fit, full_parameters(session.gyroscope.matrix, session.mean_bias[3:]))
    assert abs(inside["bias"] / looked["bias"] - 0.95) < 0.15
    assert abs(sum(inside.values()) / sum(looked.values()) - 0.95) < 0.065
