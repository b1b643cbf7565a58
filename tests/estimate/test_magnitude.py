"""The residual |M (y − b)| − g and its Jacobian."""

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.accelerometer import ENTRY_OF
from imucal_wizard.estimate.magnitude import calibrated_points, make_problem, residuals, triangle
from imucal_wizard.model.effect import Circumstances
from imucal_wizard.model.rows.gravity_magnitude import GravityMagnitude
from imucal_wizard.model.rows.source import Parameters, RowLabels
from imucal_wizard.model.terms import Terms
from tests.estimate.truth import EIGHTEEN, even_directions, in_counts, random_triangular

GRAVITY = 9.80665


def _theta(rng: np.random.Generator) -> FloatArray:
    theta = rng.uniform(-0.1, 0.1, 9)
    theta[[3, 6, 8]] += 1.0
    return theta


def _jacobian(theta: FloatArray, points: FloatArray) -> FloatArray:
    """Derivative of the rows of an accelerometer, in units of gravity, by the nine parameters."""
    count, unknown = len(points), np.full((len(points), 3), np.nan)
    zeros, numbers = np.zeros(count), np.zeros(count, np.int64)
    where = Circumstances(unknown, unknown, zeros, zeros, unknown, zeros, gravity=1.0)
    spans = np.zeros((count, 2))
    labels = RowLabels(numbers, numbers, numbers, numbers, zeros, spans, numbers)
    source = GravityMagnitude(points, np.ones(count), where, 1.0, labels)
    rows = source.at(Parameters(triangle(theta), theta[:3]), Terms("accelerometer", ()))
    return rows.base_columns()[:, list(ENTRY_OF)]


def test_the_residual_is_the_length_of_the_corrected_reading_less_one() -> None:
    """By hand: M = diag(2, 3, 6), b = (1, 0, 0) takes (2, 1, 1/2) to (2, 3, 3)."""
    theta = np.array([1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 3.0, 0.0, 6.0])
    point = np.array([[2.0, 1.0, 0.5]])
    assert calibrated_points(theta, point).tolist() == [[2.0, 3.0, 3.0]]
    assert residuals(theta, point)[0] == pytest.approx(np.sqrt(22.0) - 1.0, rel=1e-15)


@pytest.mark.parametrize("seed", range(5))
def test_the_jacobian_is_the_numeric_one(seed: int) -> None:
    """Against differences of fourth order, to 1e-9 of its largest entry."""
    rng = np.random.default_rng(seed)
    theta, points = _theta(rng), rng.uniform(0.7, 1.3, (12, 1)) * even_directions(12, rng)
    numeric = np.empty((12, 9))
    step = 1e-3
    for column, unit in enumerate(np.eye(9)):
        f = [residuals(theta + k * step * unit, points) for k in (-2, -1, 1, 2)]
        numeric[:, column] = (f[0] - 8.0 * f[1] + 8.0 * f[2] - f[3]) / (12.0 * step)
    analytic = _jacobian(theta, points)
    assert np.abs(analytic - numeric).max() < 1e-9 * np.abs(analytic).max()


def test_the_jacobian_is_that_of_complex_numbers() -> None:
    """The complex step has no cancellation, so it must agree to rounding."""
    rng = np.random.default_rng(7)
    theta, points = _theta(rng), even_directions(9, rng)

    def length(t: np.ndarray[tuple[int], np.dtype[np.complex128]]) -> FloatArray:
        b, (xx, xy, xz, yy, yz, zz) = t[:3], t[3:]
        x, y, z = (points - b).T
        squares = (xx * x + xy * y + xz * z) ** 2 + (yy * y + yz * z) ** 2 + (zz * z) ** 2
        return np.asarray(np.sqrt(squares).imag)

    columns = [length(theta + 1e-30j * unit) / 1e-30 for unit in np.eye(9)]
    assert np.abs(_jacobian(theta, points) - np.array(columns).T).max() < 1e-14


def test_a_point_at_the_centre_pulls_nowhere() -> None:
    """Where a reading is the bias itself, nothing is divided by zero."""
    theta = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0])
    assert np.isfinite(_jacobian(theta, np.zeros((1, 3)))).all()


def test_problems_are_the_same_in_any_unit() -> None:
    """Counts around 32768 and m/s² give the same dimensionless points, and convert back."""
    rng = np.random.default_rng(3)
    truth, theta = random_triangular(rng), _theta(rng)
    plain = make_problem(truth.readings(GRAVITY * EIGHTEEN), GRAVITY)
    counted = make_problem(in_counts(truth, 415.0).readings(GRAVITY * EIGHTEEN), GRAVITY)
    assert np.abs(counted.points - plain.points).max() < 1e-10
    (matrix, bias), (counts, offset) = plain.matrix_and_bias(theta), counted.matrix_and_bias(theta)
    assert np.allclose(counts * 415.0, matrix, rtol=1e-12)
    assert np.allclose(offset, 415.0 * bias + 32768.0, rtol=1e-12)


def test_matrix_and_bias_correct_readings_to_si() -> None:
    """M (y − b) is the dimensionless corrected vector times gravity."""
    rng = np.random.default_rng(4)
    theta, readings = _theta(rng), rng.uniform(-12.0, 12.0, (10, 3))
    problem = make_problem(readings, GRAVITY)
    matrix, bias = problem.matrix_and_bias(theta)
    expected = GRAVITY * calibrated_points(theta, problem.points)
    assert np.allclose((readings - bias) @ matrix.T, expected, rtol=1e-12)
