"""What two calibrations leave in doubt, and what it does to the direction of up and field."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.core.quaternions import rotation_vector
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.magnitude import up_moved
from imucal_wizard.estimate.result import Parameter, SensorFit
from imucal_wizard.estimate.second_stage.alignment import align
from imucal_wizard.estimate.second_stage.error_modes import (
    ErrorModes,
    field_moved,
    of_accelerometer,
    of_magnetometer,
)
from imucal_wizard.estimate.split import principal_steps
from tests.estimate.field_truth import FACES, all_over

GRAVITY = 9.80665
PLACES = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def _covariance(rng: np.random.Generator, errors: FloatArray) -> FloatArray:
    """Of nine correlated parameters with about these standard errors."""
    mixed = np.eye(9) + 0.3 * rng.standard_normal((9, 9))
    return np.asarray(errors[:, None] * (mixed @ mixed.T) * errors)


def _fit(sensor: str, matrix: FloatArray, bias: FloatArray, covariance: FloatArray) -> SensorFit:
    angles = ("theta_yz", "theta_zy", "theta_zx")
    return SensorFit(
        sensor,
        ("bias", "scale", "non-orthogonality"),
        "least_squares",
        "own",
        matrix,
        bias,
        "count",
        tuple(Parameter(name, 0.0, 0.01, "rad") for name in angles),
        "m/s^2",
        None,
        0.0,
        None,
        None,
        np.zeros(0),
        covariance=covariance,
    )


def test_principal_error_modes_make_the_covariance_up_again_in_any_units() -> None:
    """A bias of 1 count and a gain of 1e-9 per count: neither is rounded away beside the other."""
    errors = np.concatenate([np.full(3, 1.0), np.full(6, 1e-9)])
    covariance = _covariance(np.random.default_rng(0), errors)
    found = principal_steps(covariance)
    assert found.shape == (9, 9)
    scaled = (found @ found.T) / np.outer(errors, errors)
    assert scaled == pytest.approx(covariance / np.outer(errors, errors), abs=1e-9)


def test_what_is_not_fitted_has_no_uncertainty_of_its_own() -> None:
    covariance = _covariance(np.random.default_rng(1), np.ones(9))
    covariance[4], covariance[:, 4] = 0.0, 0.0
    found = principal_steps(covariance)
    assert (found[4] == 0.0).all()
    assert found @ found.T == pytest.approx(covariance, abs=1e-9)


def test_an_error_mode_of_the_magnetometer_moves_the_field_as_another_calibration_does() -> None:
    """Readings of counts far from zero, corrected by both."""
    rng = np.random.default_rng(2)
    matrix, bias = 0.1 * np.diag([1.0, 1.1, 0.9]), np.array([900.0, -1100.0, -300.0])
    fit = _fit("magnetometer", matrix, bias, np.eye(9))
    readings = bias + 400.0 * all_over(rng, 20)
    change = np.concatenate([rng.normal(0.0, 3.0, 3), rng.normal(0.0, 1e-3, 6)])
    other = matrix.copy()
    for value, (i, j) in zip(change[3:], PLACES, strict=True):
        other[i, j] += value
        other[j, i] = other[i, j]
    moved = field_moved(fit, (readings - bias) @ matrix.T, change)
    assert moved == pytest.approx((readings - bias - change[:3]) @ other.T, abs=1e-9)


def test_error_modes_of_the_accelerometer_move_up_as_other_calibrations_would() -> None:
    """Up by many calibrations drawn from the covariance scatters as the doubts say."""
    rng = np.random.default_rng(3)
    matrix = GRAVITY / 16384.0 * np.array([[1.0, 0.02, -0.01], [0.0, 1.03, 0.01], [0.0, 0.0, 0.98]])
    bias = np.array([32768.0, 32000.0, 33100.0])
    errors = np.concatenate([np.full(3, 30.0), np.full(6, 1e-3 * GRAVITY / 16384.0)])
    covariance = _covariance(rng, errors)
    fit = _fit("accelerometer", matrix, bias, covariance)
    up = all_over(rng, 30)
    doubts = of_accelerometer(fit, up, GRAVITY)
    assert doubts.shape == (9, 9)
    readings = bias + GRAVITY * up @ np.linalg.inv(matrix).T
    seen = []
    for change in rng.multivariate_normal(np.zeros(9), covariance, 4000, method="cholesky"):
        other = matrix.copy()
        other[tuple(np.transpose(PLACES))] += change[3:]
        vectors = (readings - bias - change[:3]) @ other.T
        seen.append(vectors / np.linalg.norm(vectors, axis=1)[:, None])
    spread = np.array(seen).std(axis=0)
    expected = np.linalg.norm(ErrorModes(np.zeros((9, 0)), doubts).of_up(up), axis=2)
    assert expected == pytest.approx(spread, rel=0.08, abs=2e-5)


def test_an_angle_left_at_its_nominal_value_is_a_doubt_of_the_usual_size() -> None:
    """Six faces carry no angle: the doubts bend up by about a degree, and no face's length."""
    rng = np.random.default_rng(4)
    covariance = np.diag(np.r_[np.full(3, 1e-6), 1e-10, 0.0, 0.0, 1e-10, 0.0, 1e-10])
    fit = _fit("accelerometer", np.eye(3), np.zeros(3), covariance)
    faces = Attitude.concatenate(FACES).apply([0.0, 0.0, 1.0])
    doubts = of_accelerometer(fit, faces, GRAVITY)
    nominal = doubts[:, np.linalg.norm(doubts[[4, 5, 7]], axis=0) > 1e-3]
    assert nominal.shape[1] == 3
    for doubt in nominal.T:
        assert np.linalg.norm(up_moved(faces, doubt), axis=1) == pytest.approx(1.0, abs=2e-4)
    bent = np.linalg.norm(
        ErrorModes(np.zeros((9, 0)), doubts).of_up(all_over(rng, 200)), axis=(1, 2)
    )
    assert 0.3 < np.degrees(np.median(bent)) < 1.5


def test_all_angles_determined_leave_nothing_nominal() -> None:
    covariance = _covariance(np.random.default_rng(5), np.full(9, 1e-4))
    fit = _fit("accelerometer", np.eye(3), np.zeros(3), covariance)
    assert of_accelerometer(fit, all_over(np.random.default_rng(6), 20), GRAVITY).shape == (9, 9)


def test_a_method_without_errors_still_leaves_its_nominal_angles_uncertain() -> None:
    """Six holds of six faces: no residual, and so no covariance."""
    fit = _fit("accelerometer", np.eye(3), np.zeros(3), np.eye(9))
    parameters = tuple(Parameter(one.name, 0.0, None, "rad", False) for one in fit.parameters)
    fit = SensorFit(**{**vars(fit), "covariance": None, "parameters": parameters})
    faces = Attitude.concatenate(FACES).apply([0.0, 0.0, 1.0])
    assert of_accelerometer(fit, faces, GRAVITY).shape == (9, 3)
    assert of_magnetometer(fit).shape == (9, 0)


def test_an_uncertain_vertical_makes_the_angles_uncertain() -> None:
    """Shifts of R have sign and size of an alignment with the ups moved by the doubt."""
    rng = np.random.default_rng(7)
    body = Attitude.random(15, random_state=8)
    up, field = body.inv().apply([0.0, 0.0, 1.0]), body.inv().apply([0.0, 0.5, -np.sqrt(0.75)])
    doubt = np.einsum("ni,ijk->njk", up, 1e-4 * rng.standard_normal((3, 3, 2)))
    plain, whole = align(up, field), align(up, field, up_modes=doubt)
    for k in range(2):
        moved = align(up + doubt[:, :, k], field)
        change = rotation_vector(moved.rotation @ plain.rotation.T)
        assert whole.shifts[:, k] == pytest.approx(change, rel=0.02, abs=2e-6)
    assert whole.covariance == pytest.approx(whole.own + whole.shifts @ whole.shifts.T, abs=1e-15)


def test_a_position_explained_by_uncertainty_is_kept() -> None:
    """Three positions tell of a bent axis; without the doubt about it they look disturbed."""
    body = Attitude.random(18, random_state=9)
    up, field = body.inv().apply([0.0, 0.0, 1.0]), body.inv().apply([0.0, 0.5, -np.sqrt(0.75)])
    doubt = np.zeros((18, 3, 1))
    doubt[:3, :, 0] = 0.01 * np.cross(np.cross(up, field), up)[:3]
    noisy = up + doubt[:, :, 0] + 1e-4 * np.random.default_rng(10).standard_normal(up.shape)
    assert align(noisy, field).used.sum() < 18
    assert align(noisy, field, up_modes=doubt).used.all()
