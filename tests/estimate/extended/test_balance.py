"""Variances of several kinds of rows against closed forms."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from imucal_wizard.estimate.variance_components import System, balanced, determined, inverted


def test_of_repeated_readings_it_is_the_sample_variance() -> None:
    """One unknown mean: variance with n − 1, standard error by its root over n."""
    rng = np.random.default_rng(0)
    readings = rng.normal(3.0, 0.7, 12)
    system = System(
        residual=-readings,
        columns=np.ones((12, 1)),
        own=np.full(12, 1e-12),
        kinds=np.zeros(12, np.int64),
        precision=np.zeros(1),
        value=np.zeros(1),
    )
    found = balanced(system)
    assert found.step[0] == pytest.approx(readings.mean())
    assert found.variance[0] == pytest.approx(readings.var(ddof=1), rel=1e-3)
    assert found.covariance[0, 0] == pytest.approx(readings.var(ddof=1) / 12, rel=1e-3)
    assert found.freedom[0] == pytest.approx(11.0)


def test_two_kinds_with_a_mean_of_their_own_do_not_disturb_each_other() -> None:
    """Each kind gets its own sample variance."""
    rng = np.random.default_rng(1)
    fine, coarse = rng.normal(0.0, 0.01, 8), rng.normal(0.0, 2.0, 20)
    kinds = np.repeat([0, 1], [8, 20])
    system = System(
        residual=np.concatenate([fine, coarse]),
        columns=np.eye(2)[kinds],
        own=np.full(28, 1e-12),
        kinds=kinds,
        precision=np.zeros(2),
        value=np.zeros(2),
    )
    found = balanced(system)
    assert found.variance[0] == pytest.approx(fine.var(ddof=1), rel=1e-3)
    assert found.variance[-1] == pytest.approx(coarse.var(ddof=1), rel=1e-3)


def test_a_common_mean_is_weighed_by_the_scatter_of_each_kind() -> None:
    """Over many draws the estimate beats the plain mean and its standard error is honest."""
    rng = np.random.default_rng(2)
    kinds = np.repeat([0, 1], [20, 20])
    estimates, claimed = [], []
    for _ in range(200):
        rows = np.concatenate([rng.normal(0.0, 0.1, 20), rng.normal(0.0, 1.0, 20)])
        system = System(
            -rows, np.ones((40, 1)), np.full(40, 1e-12), kinds, np.zeros(1), np.zeros(1)
        )
        found = balanced(system)
        estimates.append(found.step[0])
        claimed.append(found.covariance[0, 0])
    assert np.std(estimates) == pytest.approx(0.1 / np.sqrt(20.2), rel=0.15)
    assert np.sqrt(np.mean(claimed)) == pytest.approx(np.std(estimates), rel=0.15)


@pytest.mark.parametrize("seed", range(5))
def test_it_is_the_restricted_likelihoods_maximum_where_rows_differ_in_noise(seed: int) -> None:
    """Thirty rows, six of them a hundred times as noisy: against SciPy's minimum of −2 log L."""
    rng = np.random.default_rng(seed)
    own = np.where(np.arange(30) < 24, 0.1, 1000.0)
    columns = rng.normal(size=(30, 3))
    residual = rng.normal(scale=np.sqrt(own + 1.0))
    zeros = np.zeros(3)
    system = System(residual, columns, own, np.zeros(30, np.int64), zeros, zeros)

    def deviance(log_excess: float) -> float:
        variance = own + np.exp(log_excess)
        normal = columns.T @ (columns / variance[:, None])
        left = residual - columns @ np.linalg.solve(normal, columns.T @ (residual / variance))
        size = np.log(variance).sum() + np.linalg.slogdet(normal)[1]
        return float(size + (left**2 / variance).sum())

    expected = np.exp(minimize_scalar(deviance, bounds=(-8.0, 4.0), method="bounded").x)
    assert balanced(system).variance[0] - own[0] == pytest.approx(expected, rel=0.01)


def test_noise_that_is_known_to_be_larger_than_the_scatter_is_kept() -> None:
    """The rest on top of the known noise is never negative."""
    system = System(
        residual=np.array([0.1, -0.1, 0.05, -0.02]),
        columns=np.zeros((4, 0)),
        own=np.full(4, 1.0),
        kinds=np.zeros(4, np.int64),
        precision=np.zeros(0),
        value=np.zeros(0),
    )
    np.testing.assert_array_equal(balanced(system).variance, 1.0)


def test_a_prior_stands_in_for_what_no_row_shows() -> None:
    """A size without rows keeps its prior as its posterior."""
    system = System(
        residual=np.array([1.0, -1.0, 0.5]),
        columns=np.zeros((3, 1)),
        own=np.full(3, 1e-6),
        kinds=np.zeros(3, np.int64),
        precision=np.array([0.25]),
        value=np.zeros(1),
    )
    found = balanced(system)
    assert found.covariance[0, 0] == pytest.approx(4.0)
    assert found.step[0] == 0.0


@pytest.mark.parametrize("truth", [(0.0, 0.0), (3.0, 0.0), (0.0, -40.0), (25.0, 25.0)])
def test_the_interval_of_sizes_shown_as_a_sum_holds_each(truth: tuple[float, float]) -> None:
    """Rows that show a + b, c and d: a and b may each be all of the sum; c and d are as before."""
    rng = np.random.default_rng(4)
    columns = rng.normal(size=(30, 4))
    columns[:, 1] = columns[:, 0]
    right = np.array([*truth, 0.3, -0.2])
    noise = 0.05 * rng.normal(size=30)
    system = System(
        residual=noise - columns @ right,
        columns=columns,
        own=np.full(30, 0.05**2),
        kinds=np.zeros(30, np.int64),
        precision=np.full(4, 0.25),
        value=np.zeros(4),
        groups=(slice(0, 4),),
        open_groups=(slice(0, 4),),
    )
    found = balanced(system)
    errors = np.sqrt(np.diag(found.covariance))
    assert (np.abs(found.step - right) < 2.0 * errors)[:2].all()
    assert (np.abs(found.step - right) < 3.0 * errors).all()
    assert errors[0] < 0.6 * max(2.0 * np.sqrt(2.0), abs(sum(truth)))
    assert (errors[2:] < 0.02).all()


@pytest.mark.parametrize("kind", ["one size", "scatter"])
def test_hardly_any_freedom_tells_a_large_size_from_scatter(kind: str) -> None:
    """Ten rows and nine sizes: one of 30 times what is typical is fitted, scatter is none."""
    rng = np.random.default_rng(5)
    columns, none = rng.normal(size=(10, 9)), np.zeros(9)
    large = np.where(np.arange(9) == 2, 15.0, 0.0)
    scatter = 3.0 * rng.normal(size=10)
    made = columns @ large if kind == "one size" else scatter
    system = System(
        residual=0.05 * rng.normal(size=10) - made,
        columns=columns,
        own=np.full(10, 0.05**2),
        kinds=np.zeros(10, np.int64),
        precision=np.full(9, 4.0),
        value=none,
        groups=(slice(0, 9),),
        open_groups=(slice(0, 9),),
    )
    found = balanced(system)
    errors = np.sqrt(np.diag(found.covariance))
    truth = large if kind == "one size" else none
    assert (np.abs(found.step - truth) < 3.0 * errors).all()
    if kind == "one size":
        assert errors[2] < 1.0
        np.testing.assert_array_equal(found.variance, system.own)
    else:
        assert found.variance[0] > 1.0


def test_a_singular_matrix_is_inverted_over_what_it_determines() -> None:
    """The Moore–Penrose inverse; a regular one has the plain inverse."""
    rng = np.random.default_rng(3)
    root = rng.standard_normal((3, 5))
    regular = root @ root.T
    np.testing.assert_allclose(inverted(regular), np.linalg.inv(regular), rtol=1e-8)
    assert determined(regular)
    column = np.array([1.0, 2.0, 0.0])
    singular = np.outer(column, column)
    inverse = inverted(singular)
    np.testing.assert_allclose(singular @ inverse @ singular, singular, atol=1e-12)
    assert not determined(singular)
