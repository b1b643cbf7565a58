"""Standard errors hold the truth as often as they say, from the residual and from the repeats.

Coverage is counted over seeded repetitions; tolerances are binomial. With n repetitions a true
95 % scatters by σ = sqrt(0.95 · 0.05 / n); one parameter may be 3.5 σ off (nine are looked at).
"""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate import slow_noise
from imucal_wizard.estimate.distributions import quantile
from imucal_wizard.estimate.parameters import (
    covariance_of,
    full_parameters,
    triangular_parameters,
    with_errors,
)
from imucal_wizard.estimate.recording import fit_accelerometer
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.measurement.holds import Hold
from tests.estimate.motions import experiment, hand_turns
from tests.estimate.truth import (
    EIGHTEEN,
    SIX,
    Truth,
    holds_of,
    random_triangular,
    tilted,
    typical_gyroscope,
)

GRAVITY = 9.80665
SIGMA = 3e-3
"""Noise of a hold, m/s²: 0.3 mg."""


def _allowed(repetitions: int) -> float:
    return float(3.5 * np.sqrt(0.95 * 0.05 / repetitions))


def _check(inside: Counter[str], repetitions: int) -> None:
    """Every parameter covers, and all of them together to half of that."""
    assert inside
    for count in inside.values():
        assert abs(count / repetitions - 0.95) < _allowed(repetitions)
    mean = sum(inside.values()) / len(inside) / repetitions
    assert abs(mean - 0.95) < 0.5 * _allowed(repetitions)


def _one(rng: np.random.Generator, up: FloatArray, method: str) -> tuple[Truth, SensorFit]:
    truth = random_triangular(rng)
    noise = SIGMA * rng.standard_normal((len(up), 3))
    holds = holds_of(truth, tilted(up, 1.0, rng), noise=noise, sigma=SIGMA)
    return truth, fit_accelerometer(holds, GRAVITY, "m/s^2", method)


@pytest.mark.study
@pytest.mark.parametrize("method", ["least_squares", "newton"])
def test_eighteen_poses_cover_by_students_t(method: str) -> None:
    """Nine degrees of freedom: ±2.26 standard errors hold the truth 95 % of the time."""
    rng, repetitions = np.random.default_rng(1), 40
    inside: Counter[str] = Counter()
    normal = 0
    for _ in range(repetitions):
        truth, fit = _one(rng, EIGHTEEN, method)
        assert fit.degrees_of_freedom == 9
        true = triangular_parameters(truth.matrix, truth.bias)
        for parameter in fit.parameters:
            assert parameter.standard_error is not None
            off = abs(parameter.value - true[parameter.name]) / parameter.standard_error
            inside[parameter.name] += off < quantile(0.95, 9)
            normal += off < 1.96 and not parameter.name.startswith("bias")
    _check(inside, repetitions)
    # 1.96 of them would hold it 91.8 % of the time only, here within 1.8 %
    assert normal / repetitions / 6 < 0.95


@pytest.mark.parametrize("again", [False, True], ids=["poses-once", "poses-twice"])
def test_six_tilted_poses_cover_with_the_angles_that_they_leave_nominal(again: bool) -> None:
    """The angles of a usual sensor move bias and scale where no face is exactly up.

    Either the last pose alone is repeated, which shows the noise only, or all are, a few degrees
    off the first time, which shows some of the angles, too.
    """
    rng, repetitions = np.random.default_rng(3), 30
    inside: Counter[str] = Counter()
    for _ in range(repetitions):
        matrix = np.diag(rng.normal(1.0, 0.02, 3))
        matrix[np.triu_indices(3, 1)] = rng.normal(0.0, 0.015, 3)
        truth = Truth(np.asarray(np.linalg.inv(matrix), float), rng.normal(0.0, 0.3, 3))
        up = tilted(np.concatenate([SIX, SIX]) if again else SIX, 3.0, rng)
        up = up if again else np.concatenate([up, np.repeat(up[-1:], 6, axis=0)])
        noise = SIGMA * rng.standard_normal(up.shape)
        holds = holds_of(truth, up, noise=noise, sigma=SIGMA)
        fit = fit_accelerometer(holds, GRAVITY, "m/s^2")
        true = triangular_parameters(truth.matrix, truth.bias)
        for parameter in fit.parameters:
            if parameter.name.startswith(("bias", "sensitivity")):
                off = abs(parameter.value - true[parameter.name])
                inside[parameter.name] += off < 1.96 * (parameter.standard_error or 0.0)
    _check(inside, repetitions)


@pytest.mark.parametrize("seed", range(6))
def test_one_degree_of_freedom_gives_standard_errors(seed: int) -> None:
    """Six faces and one of them again; a sum of leverages is one but for its last bit."""
    rng = np.random.default_rng(seed)
    up = tilted(np.concatenate([SIX, SIX[:1]]), 1.0, rng)
    noise = SIGMA * rng.standard_normal(up.shape)
    fit = fit_accelerometer(holds_of(random_triangular(rng), up, noise=noise), GRAVITY, "m/s^2")
    assert fit.degrees_of_freedom == 1
    assert all(one.standard_error is not None for one in fit.parameters if one.value != 0.0)


def test_repeats_cover_by_their_own_degrees_of_freedom() -> None:
    """The six faces twice: six degrees of freedom from the repeats alone."""
    rng, repetitions = np.random.default_rng(2), 60
    inside: Counter[str] = Counter()
    for _ in range(repetitions):
        truth, fit = _one(rng, np.concatenate([EIGHTEEN, SIX]), "least_squares")
        assert fit.repeatability is not None
        assert fit.repeatability.freedom == 6
        true = triangular_parameters(truth.matrix, truth.bias)
        for parameter in fit.parameters:
            assert parameter.standard_error_repeats is not None
            off = abs(parameter.value - true[parameter.name]) / parameter.standard_error_repeats
            inside[parameter.name] += off < quantile(0.95, 6)
    _check(inside, repetitions)


def test_the_repeats_do_not_see_what_the_model_lacks() -> None:
    """With 3 mg/g² of second order the residual grows and the repeats stay at the noise."""
    rng = np.random.default_rng(3)
    up = tilted(np.concatenate([EIGHTEEN, EIGHTEEN, SIX]), 0.2, rng)
    force = GRAVITY * up
    force[:, 0] += 3e-3 / GRAVITY * force[:, 0] ** 2
    readings = force + SIGMA / 10.0 * rng.standard_normal(up.shape)
    plain = holds_of(Truth(np.eye(3), np.zeros(3)), up)
    holds = [_with_reading(hold, y) for hold, y in zip(plain, readings, strict=True)]
    fit = fit_accelerometer(holds, GRAVITY, "m/s^2")
    assert fit.repeatability is not None
    assert fit.repeatability.rms == pytest.approx(SIGMA / 10.0, rel=0.4)
    assert fit.rms_fitted > 10.0 * fit.repeatability.rms
    first = fit.parameters[0]
    assert first.standard_error is not None
    assert first.standard_error_repeats is not None
    assert first.standard_error > 10.0 * first.standard_error_repeats


def _with_reading(hold: Hold, reading: FloatArray) -> Hold:
    return replace(hold, accelerometer=reading)


@pytest.mark.parametrize("noisier", [1.0, 30.0])
def test_repeatability_is_the_scatter_about_the_mean_of_each_direction(noisier: float) -> None:
    """By hand: an ideal sensor, six faces twice, one pair 2 mm/s² apart: s² = 2 · (1e-3)² / 6.

    A hold of another pair that is noisier, but repeats, does not change how far visits differ.
    """
    holds = holds_of(Truth(np.eye(3), np.zeros(3)), np.concatenate([SIX, SIX]), sigma=1e-3)
    noisy = noisier**2 * holds[8].accelerometer_covariance
    holds[8] = replace(holds[8], accelerometer_covariance=noisy)
    holds[0] = _with_reading(holds[0], np.array([GRAVITY + 1e-3, 0.0, 0.0]))
    holds[6] = _with_reading(holds[6], np.array([GRAVITY - 1e-3, 0.0, 0.0]))
    fit = fit_accelerometer(holds, GRAVITY, "m/s^2")
    assert fit.repeatability is not None
    assert fit.repeatability.rms == pytest.approx(1e-3 * np.sqrt(2.0 / 6.0), rel=1e-3)
    assert fit.repeatability.freedom == 6


@pytest.fixture
def all_white(monkeypatch: pytest.MonkeyPatch) -> None:
    """Slow noise is out of the question, so that standard errors have closed forms."""
    monkeypatch.setattr(slow_noise, "ALL_WHITE", 2 * (1.0 - 1e-12,))


@pytest.mark.usefixtures("all_white")
def test_standard_errors_of_eighteen_poses_are_the_known_ones() -> None:
    """Closed form of the design: 6 faces and 12 edges.

    ``Cov = σ² (XᵀX)⁻¹``; with 6 + 12 poses the sum of u_x² is 2 + 8/2 = 6, so a bias has σ/√6; a
    product u_x u_y is ±1/2 at four edges and nothing else, so an angle has σ/g.
    """
    rng = np.random.default_rng(4)
    noise = SIGMA * rng.standard_normal((18, 3))
    holds = holds_of(Truth(np.eye(3), np.zeros(3)), EIGHTEEN, noise=noise)
    fit = fit_accelerometer(holds, GRAVITY, "m/s^2")
    sigma = fit.rms_fitted * np.sqrt(18.0 / 9.0)
    errors = {p.name: p.standard_error for p in fit.parameters}
    for axis in "xyz":
        assert errors[f"bias_{axis}"] == pytest.approx(sigma / np.sqrt(6.0), rel=1e-2)
    for angle in ("theta_yz", "theta_zy", "theta_zx"):
        assert errors[angle] == pytest.approx(sigma / GRAVITY, rel=1e-2)


def test_the_six_position_method_has_its_own_standard_errors() -> None:
    """Each axis is known from its own two faces alone: s/2 · sqrt(1/n₊ + 1/n₋), and it covers."""
    rng, repetitions = np.random.default_rng(5), 80
    inside: Counter[str] = Counter()
    up = np.concatenate([SIX, SIX, SIX])
    for _ in range(repetitions):
        truth = Truth(np.diag(rng.uniform(0.95, 1.05, 3)), rng.uniform(-0.5, 0.5, 3))
        noise = SIGMA * rng.standard_normal((18, 3))
        fit = fit_accelerometer(holds_of(truth, up, noise=noise), GRAVITY, "m/s^2", "six-position")
        true = triangular_parameters(truth.matrix, truth.bias)
        for parameter in fit.parameters:
            if parameter.standard_error is not None:
                off = abs(parameter.value - true[parameter.name]) / parameter.standard_error
                inside[parameter.name] += off < quantile(0.95, fit.degrees_of_freedom)
    assert len(inside) == 6
    _check(inside, repetitions)


def test_the_parameters_of_a_method_are_correlated_as_those_of_the_fit() -> None:
    """On 18 poses with faces twice on one side only, where biases and scales err together."""
    up = np.concatenate([EIGHTEEN, np.repeat(SIX[::2], 4, axis=0)])
    by_fit, by_newton = (
        covariance_of(_one(np.random.default_rng(8), up, method)[1])
        for method in ("least_squares", "newton")
    )
    assert by_fit is not None
    assert by_newton is not None
    one, other = (np.diag(np.diag(c) ** -0.5) @ c @ np.diag(np.diag(c) ** -0.5)
                  for c in (by_fit, by_newton))  # fmt: skip
    assert np.abs(one - np.eye(len(one))).max() > 0.3
    np.testing.assert_allclose(other, one, atol=0.1)


def test_the_six_position_covariance_is_that_of_its_formulae() -> None:
    """Against a shift of each hold in turn, with gains that differ and faces repeated unequally."""
    gains = np.array([1.0, 1.15, 0.9])
    up = np.repeat(SIX, [3, 1, 2, 1, 1, 4], axis=0)
    noise = SIGMA * gains * np.random.default_rng(6).standard_normal((12, 3))
    holds = holds_of(Truth(np.diag(gains), np.zeros(3)), up, noise=noise)

    def fitted(some: list[Hold]) -> FloatArray:
        fit = fit_accelerometer(some, GRAVITY, "m/s^2", "six-position")
        return np.concatenate([fit.bias, np.diag(fit.matrix)])

    columns = []
    for index, one in enumerate(holds):
        shift = 1e-5 * gains * np.abs(up[index])
        moved = replace(one, accelerometer=one.accelerometer + shift)
        others = [*holds[:index], moved, *holds[index + 1 :]]
        columns.append((fitted(others) - fitted(holds)) / 1e-5)
    fit = fit_accelerometer(holds, GRAVITY, "m/s^2", "six-position")
    variance = float(fit.residuals @ fit.residuals) / (len(holds) - 6)
    expected = variance * np.array(columns).T @ np.array(columns)
    assert fit.covariance is not None
    places = [0, 1, 2, 3, 6, 8]  # the biases, then M's diagonal
    found = fit.covariance[np.ix_(places, places)]
    size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    # angles left nominal act on the noise of the axes that are level
    assert found / size == pytest.approx(expected / size, abs=6e-3)


@pytest.mark.study
def test_the_gyroscopes_standard_errors_cover() -> None:
    """Six hand turns per axis, with noise of the rate and of gravity's direction."""
    rng, repetitions = np.random.default_rng(6), 30
    truth = typical_gyroscope()
    true = full_parameters(truth.matrix, truth.bias)
    motions = [hand_turns(6, np.random.default_rng(seed), rate=25.0) for seed in range(4)]
    inside: Counter[str] = Counter()
    for index in range(repetitions):
        data = experiment(motions[index % 4], truth, rng, sigma=0.00125, tilt_sigma=3e-4)
        fit = data.fit()
        assert fit.not_determined == ()
        parameters = with_errors(
            lambda t: full_parameters(t[:9].reshape(3, 3), t[9:]),
            np.concatenate([fit.matrix.ravel(), fit.bias]),
            fit.covariance,
            lambda _: "",
            (),
        )
        reach = quantile(0.95, fit.degrees_of_freedom)
        for parameter in parameters:
            off = abs(parameter.value - true[parameter.name])
            inside[parameter.name] += off < reach * (parameter.standard_error or 0.0)
    _check(inside, repetitions)


def test_an_angle_left_nominal_makes_its_axis_longer_to_second_order() -> None:
    """Exact faces show nothing of angles of 1.5° but their squares, which scales absorb."""
    matrix = np.array([[1.0, 0.026, 0.026], [0.0, 1.0, 0.026], [0.0, 0.0, 1.0]])
    truth = Truth(np.asarray(np.linalg.inv(matrix), float), np.zeros(3))
    rng, up = np.random.default_rng(5), np.concatenate([SIX, SIX])
    noise = 1e-4 * rng.standard_normal(up.shape)
    fit = fit_accelerometer(holds_of(truth, up, noise=noise, sigma=1e-4), GRAVITY, "m/s^2")
    off = {one.name: abs(one.value - 1.0) for one in fit.parameters}
    errors = {one.name: one.standard_error or 0.0 for one in fit.parameters}
    assert off["sensitivity_z"] > 20.0 * errors["sensitivity_x"]
    assert off["sensitivity_z"] < 3.0 * errors["sensitivity_z"]
