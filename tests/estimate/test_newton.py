"""Q's method: cost, gradient, Hessian, and Newton's way down."""

import numpy as np
import pytest

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.methods.newton import cost, gradient_and_hessian, newton
from imucal_wizard.estimate.recording import fit_accelerometer
from tests.estimate.truth import (
    EIGHTEEN,
    even_directions,
    holds_of,
    random_triangular,
    tilted,
    typical_accelerometer,
)

ComplexArray = np.ndarray[tuple[int], np.dtype[np.complex128]]


def _polynomial(theta: ComplexArray | FloatArray, points: FloatArray) -> complex:
    """Q's eq. 11 written out for one point after the other, also for complex parameters."""
    b, (xx, xy, xz, yy, yz, zz) = theta[:3], theta[3:]
    total = 0.0 + 0.0j
    for point in points:
        x, y, z = point - b
        square = (xx * x + xy * y + xz * z) ** 2 + (yy * y + yz * z) ** 2 + (zz * z) ** 2
        total += (square - 1.0) ** 2
    return total


def _case(seed: int) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    theta = rng.uniform(-0.1, 0.1, 9)
    theta[[3, 6, 8]] += 1.0
    return theta, rng.uniform(0.8, 1.2, (15, 1)) * even_directions(15, rng)


def _slope(theta: FloatArray | ComplexArray, points: FloatArray) -> FloatArray:
    columns = [_polynomial(theta + 1e-30j * unit, points).imag / 1e-30 for unit in np.eye(9)]
    return np.array(columns)


@pytest.mark.parametrize("seed", range(3))
def test_cost_and_gradient_are_those_of_the_written_out_sum(seed: int) -> None:
    """The gradient by the complex step has no cancellation, so both agree to rounding."""
    theta, points = _case(seed)
    gradient, _ = gradient_and_hessian(theta, points)
    assert cost(theta, points) == pytest.approx(_polynomial(theta, points).real, rel=1e-13)
    assert np.abs(gradient - _slope(theta, points)).max() < 1e-13 * np.abs(gradient).max()


@pytest.mark.parametrize("seed", range(3))
def test_the_hessian_is_the_slope_of_the_gradient(seed: int) -> None:
    """Fourth-order differences of the complex-step gradient agree to 1e-9; it is symmetric."""
    theta, points = _case(seed)
    _, hessian = gradient_and_hessian(theta, points)
    numeric = np.empty((9, 9))
    step = 1e-3
    for column, unit in enumerate(np.eye(9)):
        f = [_slope(theta + k * step * unit, points) for k in (-2, -1, 1, 2)]
        numeric[:, column] = (f[0] - 8.0 * f[1] + 8.0 * f[2] - f[3]) / (12.0 * step)
    assert np.abs(hessian - numeric).max() < 1e-9 * np.abs(hessian).max()
    assert np.abs(hessian - hessian.T).max() < 1e-12 * np.abs(hessian).max()


@pytest.mark.parametrize("seed", range(5))
def test_newton_and_least_squares_meet_where_there_is_no_noise(seed: int) -> None:
    """Two costs, one minimum: the true parameters, to rounding."""
    rng = np.random.default_rng(seed)
    truth = random_triangular(rng)
    holds = holds_of(truth, tilted(EIGHTEEN, 2.0, rng))
    by_newton = fit_accelerometer(holds, 9.80665, "m/s^2", "newton")
    by_squares = fit_accelerometer(holds, 9.80665, "m/s^2")
    assert np.abs(by_newton.matrix - truth.matrix).max() < 1e-9
    assert np.abs(by_newton.bias - truth.bias).max() < 1e-9
    assert np.abs(by_squares.matrix - truth.matrix).max() < 1e-12
    assert np.abs(by_squares.bias - truth.bias).max() < 1e-12


def test_newton_needs_fewer_than_ten_steps_from_the_up_and_down_positions() -> None:
    """As Q found with 18 hand-held poses (section IV-B)."""
    rng = np.random.default_rng(1)
    for _ in range(20):
        noise = rng.normal(scale=0.014, size=(18, 3))
        holds = holds_of(random_triangular(rng), tilted(EIGHTEEN, 3.0, rng), noise=noise)
        assert fit_accelerometer(holds, 9.80665, "m/s^2", "newton").iterations < 10


def test_newton_goes_downhill_where_the_cost_curves_the_wrong_way() -> None:
    """From far away the Hessian is not positive definite; the minimum is found all the same."""
    points = typical_accelerometer().readings(EIGHTEEN)
    start = np.array([0.3, -0.4, 0.2, 0.3, 0.0, 0.0, 0.4, 0.0, 0.3])
    assert np.linalg.eigvalsh(gradient_and_hessian(start, points)[1])[0] < 0.0
    assert cost(newton(points, start, np.eye(9))[0], points) < 1e-24


@pytest.mark.parametrize("seed", range(6))
def test_no_step_of_newton_goes_uphill(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A whole first step would; it is halved until the cost falls."""
    points = EIGHTEEN / np.linalg.norm(EIGHTEEN, axis=1)[:, None]
    begin = np.eye(9)[[3, 6, 8]].sum(axis=0)
    begin += np.random.default_rng(seed).uniform(-0.6, 0.6, 9)
    seen = []

    def watched(theta: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        seen.append(cost(theta, points))
        return gradient_and_hessian(theta, points)

    monkeypatch.setattr("imucal_wizard.estimate.methods.newton.gradient_and_hessian", watched)
    assert cost(newton(points, begin, np.eye(9))[0], points) < 1e-20
    assert max(np.diff(seen)) < 1e-12


def test_newton_says_so_when_it_cannot_find_a_minimum(monkeypatch: pytest.MonkeyPatch) -> None:
    """The message names the way out."""
    monkeypatch.setattr("imucal_wizard.estimate.methods.newton.NEWTON_ITERATIONS", 2)
    points = typical_accelerometer().readings(EIGHTEEN)
    start = np.array([0.3, -0.4, 0.2, 0.3, 0.0, 0.0, 0.4, 0.0, 0.3])
    with pytest.raises(DataError, match="least_squares"):
        newton(points, start, np.eye(9))


def test_what_angles_left_nominal_do_is_in_the_standard_errors() -> None:
    """A fixture is 3° off and turns the same angles into the same bias at each visit."""
    rng = np.random.default_rng(5)
    six = tilted(np.concatenate([np.eye(3), -np.eye(3)]), 3.0, rng)
    sigma = 1e-4 * 9.80665
    truth, up = typical_accelerometer(), np.tile(six, (3, 1))
    holds = holds_of(truth, up, noise=sigma * rng.standard_normal((18, 3)), sigma=sigma)
    usual, newtons = (
        {one.name: one for one in fit_accelerometer(holds, 9.80665, "m/s^2", *method).parameters}
        for method in ((), ("newton",))
    )
    for name in ("bias_x", "bias_y", "bias_z", "sensitivity_x", "sensitivity_y", "sensitivity_z"):
        assert newtons[name].standard_error == pytest.approx(usual[name].standard_error, rel=0.1)
    assert newtons["theta_yz"].standard_error is None
