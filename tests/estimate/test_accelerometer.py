"""The accelerometer's fit: exact where the data are, in any unit, by every method."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.errors import DataError, UsageError
from imucal_wizard.core.poses import FACES, NAMED, POSE_SETS
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.fit_warnings import accelerometer_warnings, uncovered_directions
from imucal_wizard.estimate.magnitude import make_problem, sphere
from imucal_wizard.estimate.methods.six_position import six_position
from imucal_wizard.estimate.recording import FitOptions, fit_accelerometer, fit_holds
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.measurement.holds import Hold
from tests.estimate.truth import (
    EIGHTEEN,
    SIX,
    TWENTY_SIX,
    Truth,
    even_directions,
    hold,
    holds_of,
    in_counts,
    random_triangular,
    tilted,
    typical_accelerometer,
)

GRAVITY = 9.80665


def _values(fit: SensorFit) -> dict[str, float]:
    return {parameter.name: parameter.value for parameter in fit.parameters}


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("gain", [None, 133.0, 415.0, 2048.0])
def test_all_nine_parameters_come_back_exactly(seed: int, gain: float | None) -> None:
    """In m/s², and in raw counts around 32768, to the accuracy of the arithmetic."""
    rng = np.random.default_rng(seed)
    truth = random_triangular(rng)
    if gain is not None:
        truth = in_counts(truth, gain)
    holds = holds_of(truth, tilted(EIGHTEEN, 2.0, rng))
    fit = fit_accelerometer(holds, GRAVITY, "m/s^2" if gain is None else "count")
    size = 1.0 if gain is None else gain
    assert np.abs(fit.matrix * size - truth.matrix * size).max() < 1e-11
    assert np.abs(fit.bias - truth.bias).max() < 1e-10 * size
    assert fit.rms_fitted < 1e-10


def test_parameters_are_those_of_the_paper() -> None:
    """M = K T (eq. 8), eq. 3 being the inverse of T; a sensitivity is 1/k."""
    k, (yz, zy, zx) = np.array([0.98, 1.02, 1.01]), (0.013, -0.009, 0.017)
    inverse = np.array([[1.0, -yz, zy], [0.0, 1.0, -zx], [0.0, 0.0, 1.0]])
    matrix = np.diag(k) @ np.linalg.inv(inverse)
    truth = Truth(np.linalg.inv(matrix), np.array([0.1, 0.2, -0.3]))
    values = _values(fit_accelerometer(holds_of(truth, EIGHTEEN), GRAVITY, "m/s^2"))
    expected = {
        **dict(zip(("bias_x", "bias_y", "bias_z"), truth.bias, strict=True)),
        **dict(zip(("sensitivity_x", "sensitivity_y", "sensitivity_z"), 1.0 / k, strict=True)),
        "theta_yz": yz,
        "theta_zy": zy,
        "theta_zx": zx,
    }
    assert values == pytest.approx(expected, abs=1e-11)


def test_a_scale_far_from_one_is_found() -> None:
    """Readings in g, in mg or with a gain of two per axis are no other problem."""
    for gains in ((1.0 / GRAVITY,) * 3, (1e3 / GRAVITY,) * 3, (1.0, 2.0, 0.7)):
        truth = Truth(np.diag(gains), np.zeros(3) + 0.03 * gains[0])
        fit = fit_accelerometer(holds_of(truth, TWENTY_SIX), GRAVITY, "m/s^2")
        assert np.abs(fit.matrix @ truth.sensitivity - np.eye(3)).max() < 1e-9


def test_local_gravity_is_the_scale() -> None:
    """G of the pole instead of the equator changes M by their ratio and nothing else."""
    holds = holds_of(typical_accelerometer(), EIGHTEEN)
    equator = fit_accelerometer(holds, 9.780, "m/s^2")
    pole = fit_accelerometer(holds, 9.832, "m/s^2")
    assert np.allclose(pole.matrix, equator.matrix * 9.832 / 9.780, rtol=1e-12)
    assert np.allclose(pole.bias, equator.bias, atol=1e-11)


def test_the_six_position_method_is_eq_13_and_14() -> None:
    """(up + down)/2 and (up − down)/(2g) of each axis's own reading, exactly."""
    rng = np.random.default_rng(2)
    readings = GRAVITY * SIX + rng.normal(scale=0.1, size=(6, 3))
    holds = [hold(reading, 10.0 * i) for i, reading in enumerate(readings)]
    fit = fit_accelerometer(holds, GRAVITY, "m/s^2", "six-position")
    up, down = np.diag(readings[0::2]), np.diag(readings[1::2])
    assert np.allclose(fit.bias, (up + down) / 2.0, atol=1e-14)
    assert np.allclose(fit.matrix, np.diag(2.0 * GRAVITY / (up - down)), atol=1e-14)
    values = _values(fit)
    assert values["sensitivity_y"] == pytest.approx((up[1] - down[1]) / (2.0 * GRAVITY), rel=1e-12)
    angles = [p for p in fit.parameters if p.name.startswith("theta")]
    assert [(p.value, p.carried, p.standard_error) for p in angles] == [(0.0, False, None)] * 3


def test_a_sensitivity_is_a_reading_per_input_and_the_matrix_corrects() -> None:
    """Q mixes the two (eq. 5 against 13); table II's 0.9831 is 9.63/9.80, a sensitivity."""
    readings = {"+z": np.array([0.0, 0.0, 9.63]), "-z": np.array([0.0, 0.0, -9.63])}
    for axis, unit in zip("xy", np.eye(3), strict=False):
        readings |= {f"+{axis}": 9.8 * unit, f"-{axis}": -9.8 * unit}
    _, sensitivity = six_position(readings, 9.8)
    assert sensitivity[2] == pytest.approx(0.98265, abs=1e-5)


def test_a_missing_face_is_named() -> None:
    """The six-position method cannot do without one."""
    holds = holds_of(typical_accelerometer(), EIGHTEEN)
    with pytest.raises(DataError, match=r"missing.*-z"):
        fit_accelerometer([*holds[:5], *holds[6:]], GRAVITY, "m/s^2", "six-position")


def test_newton_starts_from_the_sphere_where_a_face_is_missing() -> None:
    """Q's start needs all six; the method does not."""
    truth = typical_accelerometer()
    holds = holds_of(truth, np.delete(EIGHTEEN, 5, axis=0))
    fit = fit_accelerometer(holds, GRAVITY, "m/s^2", "newton")
    assert np.abs(fit.matrix - truth.matrix).max() < 1e-9


def test_a_direction_that_alone_determines_a_parameter_cannot_be_left_out() -> None:
    """Its error would say nothing of the calibration; there is none rather than a wild one."""
    fit = fit_accelerometer(holds_of(typical_accelerometer(), EIGHTEEN[:5]), 9.8, "m/s^2")
    assert fit.rms_held_out is None
    assert fit.held_out is None


def test_the_sphere_is_found_exactly() -> None:
    """Centre and radius of points on a sphere, by linear least squares."""
    rng = np.random.default_rng(5)
    points = np.array([300.0, -20.0, 32768.0]) + 4000.0 * even_directions(8, rng)
    problem = make_problem(points, GRAVITY)
    matrix, bias = problem.matrix_and_bias(sphere(problem))
    assert np.allclose(bias, [300.0, -20.0, 32768.0], atol=1e-8)
    assert np.allclose(matrix, GRAVITY / 4000.0 * np.eye(3), rtol=1e-12)


def test_a_noisy_hold_weighs_less() -> None:
    """A hold taken hand-held, with a larger covariance, pulls less than the others."""
    rng = np.random.default_rng(8)
    truth, up = typical_accelerometer(), tilted(EIGHTEEN, 1.0, rng)
    noise = 0.001 * rng.standard_normal((18, 3))
    noise[4] = 0.08 * np.array([1.0, -1.0, 1.0])
    holds = holds_of(truth, up, noise=noise, sigma=0.001)
    shaky = hold(holds[4].accelerometer, holds[4].start, sigma=0.08)
    marked = [*holds[:4], replace(shaky, hand_held=True), *holds[5:]]

    def error(fit: SensorFit) -> float:
        return float(np.linalg.norm(fit.bias - truth.bias))

    plain = fit_accelerometer(holds, GRAVITY, "m/s^2")
    weighed = fit_accelerometer(marked, GRAVITY, "m/s^2")
    assert error(weighed) < 0.3 * error(plain)
    calm = [*holds[:4], replace(holds[4], hand_held=True), *holds[5:]]
    assert np.array_equal(fit_accelerometer(calm, GRAVITY, "m/s^2").bias, plain.bias)
    said = "1 of 18 holds was taken hand-held: the weight of each hold follows from the noise"
    assert any(one.startswith(said) for one in accelerometer_warnings(weighed, marked))


def test_a_hold_that_shows_nothing_hides_no_angle() -> None:
    """One hold a thousand times as noisy as the others: these determine the angles as before."""
    rng = np.random.default_rng(11)
    truth, up = typical_accelerometer(), tilted(EIGHTEEN, 1.0, rng)
    noise = 0.001 * rng.standard_normal((18, 3))
    noise[4] *= 1000.0
    holds = holds_of(truth, up, noise=noise, sigma=0.001)
    shaken = hold(holds[4].accelerometer, holds[4].start, sigma=1.0)
    fit = fit_accelerometer([*holds[:4], shaken, *holds[5:]], GRAVITY, "m/s^2")
    values = _values(fit)
    others = _values(fit_accelerometer([*holds[:4], *holds[5:]], GRAVITY, "m/s^2"))
    angles = [name for name in values if name.startswith("theta")]
    # a hold of no weight moves them by less than their errors
    assert [values[one] for one in angles] == pytest.approx(
        [others[one] for one in angles], abs=1e-4
    )
    assert all(values[one] != 0.0 for one in angles)


def test_a_long_hold_does_not_outvote_the_others() -> None:
    """Beyond the noise, errors of placement are the same for every hold, however long."""
    rng = np.random.default_rng(9)
    noise = 0.01 * rng.standard_normal((18, 3))
    holds = holds_of(typical_accelerometer(), EIGHTEEN, noise=noise, sigma=1e-4)
    long = replace(holds[7], end=holds[7].start + 2000.0)
    plain = fit_accelerometer(holds, GRAVITY, "m/s^2")
    other = fit_accelerometer([*holds[:7], long, *holds[8:]], GRAVITY, "m/s^2")
    assert other.bias == pytest.approx(plain.bias, abs=1e-4)
    assert np.abs(other.residuals[7]) == pytest.approx(np.abs(plain.residuals[7]), rel=0.02)


@pytest.mark.parametrize("method", ["least_squares", "newton", "six-position"])
def test_the_error_before_is_that_of_the_plain_reading(method: str) -> None:
    """|y| − g in SI; for counts, of the best sphere, since their scale is nobody's."""
    truth = typical_accelerometer()
    holds = holds_of(truth, EIGHTEEN)
    fit = fit_accelerometer(holds, GRAVITY, "m/s^2", method)
    lengths = [np.linalg.norm(h.accelerometer) - GRAVITY for h in holds]
    assert fit.rms_before == pytest.approx(np.sqrt(np.mean(np.square(lengths))), rel=1e-12)
    counted = fit_accelerometer(holds_of(in_counts(truth, 415.0), EIGHTEEN), GRAVITY, "count")
    assert 0.02 < (counted.rms_before or 0.0) < (fit.rms_before or 0.0)


def test_an_unknown_method_is_a_mistake_of_the_user() -> None:
    """It is not silently another one."""
    with pytest.raises(UsageError, match="least_squares"):
        fit_accelerometer(holds_of(typical_accelerometer(), EIGHTEEN), 9.8, "m/s^2", "guess")


def test_directions_of_the_result_are_the_true_ones() -> None:
    """What the gyroscope takes as its reference."""
    up: FloatArray = even_directions(20, np.random.default_rng(11))
    result = fit_accelerometer(holds_of(typical_accelerometer(), up), GRAVITY, "m/s^2")
    assert result.reference is not None
    assert np.abs(result.reference.up - up).max() < 1e-11


@pytest.mark.parametrize("plan", [*POSE_SETS.values(), tuple(FACES)])
def test_poses_all_around_leave_no_direction_uncovered(plan: tuple[str, ...]) -> None:
    """All plans of the wizard, and six faces, by a careless hand."""
    up = np.array([NAMED[name] for name in plan])
    rng = np.random.default_rng(3)
    assert not any(uncovered_directions(tilted(up, 8.0, rng)) for _ in range(20))


def test_a_hemisphere_without_poses_is_named() -> None:
    """By the pose in the middle of it, and how far the nearest hold is from that."""
    (said,) = uncovered_directions(TWENTY_SIX[TWENTY_SIX[:, 2] > 0.1])
    assert said.startswith("no hold comes near the −z face on top: the nearest is 125° away")
    (said,) = uncovered_directions(np.delete(SIX, 0, axis=0))
    assert "the +x face on top: the nearest is 90° away" in said


def test_the_fit_warns_of_uncovered_directions_until_validation_covers_them() -> None:
    """Poses of a validation show the error there, too."""
    holds = holds_of(typical_accelerometer(), TWENTY_SIX)
    above = [one for one, up in zip(holds, TWENTY_SIX, strict=True) if up[2] > -0.1]

    def warned(validation: list[Hold]) -> bool:
        rates, units = {"accelerometer": 100.0}, {"accelerometer": "m/s^2"}
        report = fit_holds(above, [], rates, units, FitOptions(), validation, ())
        return any("−z face" in one for one in report.warnings)

    assert warned([])
    assert not warned([holds[5]])
