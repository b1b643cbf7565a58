"""Ellipsoid fits against closed forms, SciPy, and N's Matlab written out again."""

from collections.abc import Callable
from typing import Literal

import numpy as np
import pytest
from scipy.linalg import sqrtm
from scipy.optimize import least_squares

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.ellipsoid import coverage as bins
from imucal_wizard.estimate.ellipsoid.surface import (
    distances,
    make_cloud,
    orthogonal,
    parameters,
    symmetric_matrix,
)
from imucal_wizard.estimate.methods.algebraic import algebraic, quadrics
from imucal_wizard.estimate.methods.numeric import numeric, performance
from imucal_wizard.estimate.methods.two_step import two_step
from tests.estimate.field_truth import all_over, recorded, six_circles

THETA = parameters(
    np.array([[1.1, 0.06, -0.03], [0.06, 0.9, 0.02], [-0.03, 0.02, 1.0]]),
    np.array([0.2, -0.3, 0.1]),
)


def on_ellipsoid(count: int, rng: np.random.Generator, noise: float = 0.0) -> FloatArray:
    """Points of the ellipsoid THETA, shape (3, count)."""
    inverse = np.linalg.inv(symmetric_matrix(THETA))
    points = inverse @ all_over(rng, count).T + THETA[:3, None]
    return np.asarray(points + noise * rng.standard_normal(points.shape))


def test_the_algebraic_fit_is_exact_without_noise() -> None:
    points = on_ellipsoid(500, np.random.default_rng(0))
    assert np.abs(algebraic(points) - THETA).max() < 1e-10


def test_two_step_is_n_s_matlab() -> None:
    """Figure 2 line by line, on N's own kind of samples."""
    rng = np.random.default_rng(1)
    samples = recorded(six_circles(rng, 5.0), rng).series.values
    x = np.column_stack([samples, np.ones(len(samples))])
    y = (samples**2).sum(axis=1)
    beta = np.linalg.inv(x.T @ x) @ x.T @ y
    offset = beta[:3] / 2
    size = np.sqrt(beta[3] + offset @ offset)
    s = samples - offset
    x = np.column_stack([s**2, s[:, 0] * s[:, 1], s[:, 0] * s[:, 2], s[:, 1] * s[:, 2]])
    beta = np.linalg.inv(x.T @ x) @ x.T @ np.full(len(s), size**2)
    square = [
        [beta[0], beta[3] / 2, beta[4] / 2],
        [beta[3] / 2, beta[1], beta[5] / 2],
        [beta[4] / 2, beta[5] / 2, beta[2]],
    ]
    found = two_step(samples)
    assert found.magnitude == pytest.approx(size, rel=1e-7)
    assert found.offset == pytest.approx(offset, rel=1e-7)
    assert np.abs(found.matrix - np.real(sqrtm(np.array(square)))).max() < 1e-7


def test_two_step_does_not_depend_on_unit_or_origin() -> None:
    """Counts around 32768 and µT give the same calibration."""
    rng = np.random.default_rng(2)
    points = on_ellipsoid(800, rng, 0.01)
    plain, shifted = two_step(points.T), two_step(points.T * 50.0 + 300.0)
    assert shifted.magnitude == pytest.approx(50.0 * plain.magnitude, rel=1e-9)
    assert shifted.offset == pytest.approx(50.0 * plain.offset + 300.0, rel=1e-9)
    assert np.abs(shifted.matrix - plain.matrix).max() < 1e-9


def test_numeric_ends_at_the_minimum_of_figure_4() -> None:
    """The same minimum as SciPy's least squares on the same residuals."""
    rng = np.random.default_rng(3)
    points = on_ellipsoid(2000, rng, 0.01)
    start = two_step(points.T)

    def residuals(x: FloatArray) -> FloatArray:
        vectors = symmetric_matrix(x) @ (points - x[:3, None])
        return np.asarray(np.linalg.norm(vectors, axis=0) - start.magnitude)

    best = least_squares(residuals, parameters(np.eye(3), start.offset), xtol=1e-15, ftol=1e-15)
    found = numeric(points.T, start)
    assert np.abs(found.bias - best.x[:3]).max() < 1e-6
    assert np.abs(found.matrix * start.magnitude - symmetric_matrix(best.x)).max() < 1e-6
    assert found.iterations < 100


def test_the_numeric_fit_goes_down_the_true_slope() -> None:
    """N's figure of merit as his figure 4 has it, and its central differences."""
    points = on_ellipsoid(200, np.random.default_rng(14), 0.05)
    theta, size = THETA + 0.1, 1.3
    value, slope = performance(theta, points.T, size)
    lengths = np.linalg.norm(symmetric_matrix(theta) @ (points - theta[:3, None]), axis=0)
    assert value == pytest.approx(np.sqrt(np.mean((lengths - size) ** 2)) / size)
    for place in range(9):
        step = 1e-6 * np.eye(9)[place]
        ahead, behind = (performance(theta + s * step, points.T, size)[0] for s in (1.0, -1.0))
        assert slope[place] == pytest.approx((ahead - behind) / 2e-6, abs=1e-8)


def test_parameters_that_are_left_out_stay_nominal() -> None:
    """N's VII-A, by all methods: no off-diagonals, and without scales one for all axes."""
    rng = np.random.default_rng(4)
    points = on_ellipsoid(500, rng, 0.001)
    for places in ((0, 1, 2, 3, 6, 8), (0, 1, 2)):
        start = two_step(points.T, places)
        for matrix in (
            symmetric_matrix(algebraic(points, quadrics(places))),
            start.matrix,
            numeric(points.T, start, places).matrix,
        ):
            scales = np.diag(matrix)
            assert (matrix == np.diag(scales)).all()
            assert (np.ptp(scales) < 1e-12) == (len(places) == 3)


def test_orthogonal_slopes_are_derivatives_of_the_distance() -> None:
    """Central differences, for points on the surface, where distance and slope are exact."""
    points = on_ellipsoid(50, np.random.default_rng(5))
    slope = distances(THETA, points, 0.0).slope
    for place in range(9):
        step = np.zeros(9)
        step[place] = 1e-6
        ahead, behind = distances(THETA + step, points, 0.0), distances(THETA - step, points, 0.0)
        assert np.abs((ahead.distance - behind.distance) / 2e-6 - slope[place]).max() < 1e-7


LONG = parameters(np.diag([0.5, 1.0, 1.6]), np.array([0.2, -0.3, 0.1]))
"""An ellipsoid whose axes differ by three."""


def test_a_distance_is_that_from_the_surface() -> None:
    """Of points that were moved off it along its normal, by a thousandth of its size."""
    rng = np.random.default_rng(15)
    matrix, unit = symmetric_matrix(LONG), all_over(rng, 100).T
    normal = matrix @ unit
    normal /= np.linalg.norm(normal, axis=0)
    moved = rng.uniform(-1e-3, 1e-3, 100)
    points = np.linalg.inv(matrix) @ unit + LONG[:3, None] + moved * normal
    assert distances(LONG, points, 0.0).distance == pytest.approx(moved, abs=3e-6)


def test_what_noise_adds_to_the_distance_is_taken_off() -> None:
    """At any place of a long ellipsoid the mean over 40,000 noisy samples is zero to its error."""
    rng, sigma = np.random.default_rng(16), 0.05
    for unit in np.concatenate([np.eye(3), all_over(rng, 4)]):
        place = np.linalg.inv(symmetric_matrix(LONG)) @ unit + LONG[:3]
        points = place[:, None] + sigma * rng.standard_normal((3, 40_000))
        plain, right = (distances(LONG, points, variance).distance for variance in (0.0, sigma**2))
        assert abs(right.mean()) < 4.0 * sigma / 200.0 + 0.1 * abs(plain.mean())
        assert abs(plain.mean() - right.mean()) > 2.0 * sigma / 200.0


def test_orthogonal_has_no_bias_by_noise() -> None:
    """Noise of 3 %: the radius of 400,000 samples is right to a few ten thousandths.

    Plain least squares on the distance would find it too large by σ² = 9e-4.
    """
    rng = np.random.default_rng(6)
    points = on_ellipsoid(400_000, rng, 0.03)
    theta = orthogonal(points, THETA)
    assert np.abs(theta - THETA).max() < 3e-4


def test_orthogonal_needs_only_a_rough_start() -> None:
    """From a sphere about the middle of the readings."""
    points = on_ellipsoid(400, np.random.default_rng(7), 0.002)
    near = orthogonal(points, THETA)
    far = orthogonal(points, parameters(np.eye(3), np.zeros(3)))
    assert np.abs(near - far).max() < 1e-7


@pytest.mark.parametrize("fit", [algebraic, lambda points: two_step(points.T)])
def test_points_of_a_plane_are_refused(fit: Callable[[FloatArray], object]) -> None:
    """A single circle has no centre in space."""
    turn = np.linspace(0.0, 6.0, 300)
    points = np.array([np.cos(turn), np.sin(turn), np.zeros(300)])
    with pytest.raises(DataError, match="plane"):
        fit(points)


def test_readings_that_do_not_bend_are_refused() -> None:
    """A hyperboloid is no calibration."""
    rng = np.random.default_rng(8)
    x, y = rng.uniform(-1, 1, (2, 400))
    with pytest.raises(DataError):
        algebraic(np.array([x, y, np.sqrt(1.0 + x**2 + y**2)]))


def test_areas_are_equal_and_every_direction_has_one() -> None:
    """A million directions: each of the hundred areas gets a hundredth, to its own noise."""
    directions = all_over(np.random.default_rng(9), 1_000_000).T
    count = np.bincount(bins.bin_of(directions), minlength=bins.BINS)
    assert len(count) == bins.BINS
    assert np.abs(count / 1e4 - 1.0).max() < 5.0 / np.sqrt(1e4)


def test_the_middle_of_an_area_lies_in_it() -> None:
    """And so do the poles and directions along the axes in some area."""
    assert (bins.bin_of(bins.centres().T) == np.arange(bins.BINS)).all()
    faces = np.concatenate([np.eye(3), -np.eye(3)]).T
    assert ((bins.bin_of(faces) >= 0) & (bins.bin_of(faces) < bins.BINS)).all()


def test_a_single_value_is_not_an_outlier() -> None:
    with pytest.raises(DataError, match="always sends the same value"):
        make_cloud(np.ones((5, 3)))


@pytest.mark.parametrize("order", ["C", "F"])
def test_readings_stay_as_they_were_measured(order: Literal["C", "F"]) -> None:
    """Stored row by row, or column by column as they come from a session's raw bytes."""
    readings = np.array(on_ellipsoid(200, np.random.default_rng(8)).T, order=order)
    before = readings.copy()
    make_cloud(readings)
    np.testing.assert_array_equal(readings, before)
