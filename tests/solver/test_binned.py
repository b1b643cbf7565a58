"""The linear problem summed by areas, against the same problem written out sample by sample."""

import numpy as np
import pytest

from imucal_wizard.ellipsoid import binned
from imucal_wizard.ellipsoid.bins import BINS, folds
from imucal_wizard.ellipsoid.orthogonal import Rows
from imucal_wizard.readings import FloatArray

COUNTS = np.array([3, 40, 7, 1, 25, 60, 12, 5, 18, 33, 9, 50])
"""Samples in each of twelve areas: some crowded, some nearly empty."""
AREAS = np.repeat(np.arange(12) * 8, COUNTS)
SIGMA, TAU = 0.3, 0.2


def _rows(rng: np.random.Generator, parameters: int = 4) -> Rows:
    """Distances with noise σ in each sample and τ in each area; slopes differ between areas."""
    middles = rng.standard_normal((parameters, 12))
    slope = np.repeat(middles, COUNTS, axis=1) + 0.2 * rng.standard_normal((parameters, len(AREAS)))
    shared = np.repeat(TAU * rng.standard_normal(12), COUNTS)
    return Rows(shared + SIGMA * rng.standard_normal(len(AREAS)), slope)


def _together() -> FloatArray:
    """1 where two samples are in one area, shape (n, n)."""
    return np.asarray(AREAS[:, None] == AREAS, float)


def test_the_sums_are_those_of_each_area() -> None:
    """Also of some directions of the parameters only."""
    now = _rows(np.random.default_rng(0))
    basis = np.linalg.qr(np.random.default_rng(1).standard_normal((4, 4)))[0]
    for free in (np.eye(4), basis[:, :2]):
        sums = binned.summed(now, AREAS, free)
        assert sums.free == free.shape[1]
        assert (sums.area == np.unique(AREAS)).all()
        for k, area in enumerate(sums.area):
            own = area == AREAS
            slope, distance = free.T @ now.slope[:, own], now.distance[own]
            assert sums.count[k] == own.sum()
            assert sums.square[k] == pytest.approx((distance**2).sum())
            assert sums.mean[k] == pytest.approx(distance.mean())
            assert sums.slope[k] == pytest.approx(slope.sum(axis=1))
            assert sums.pull[k] == pytest.approx(slope @ distance)
            assert sums.normal[k] == pytest.approx(slope @ slope.T)


def test_step_and_covariance_are_those_of_the_samples_written_out() -> None:
    """Weighted least squares with the covariance ``σ² I + τ² (same area)`` of the samples."""
    now = _rows(np.random.default_rng(2))
    found = binned.weigh(binned.summed(now, AREAS, np.eye(4)))
    assert found.misfit > 0.0
    slope, count = now.slope.T, np.repeat(COUNTS, COUNTS)
    weight = 1.0 / (1.0 + count * found.misfit / found.noise)
    weighted = slope * weight[:, None]
    normal = slope.T @ weighted
    estimate = np.linalg.solve(normal, weighted.T)
    scatter = found.noise * np.eye(len(AREAS)) + found.misfit * _together()
    assert np.repeat(found.weight, COUNTS) == pytest.approx(weight)
    assert found.normal == pytest.approx(normal)
    assert found.step == pytest.approx(estimate @ now.distance)
    assert found.covariance == pytest.approx(estimate @ scatter @ estimate.T)
    assert found.freedom == 12 - 4


def test_the_two_variances_are_the_true_ones_on_average() -> None:
    """Over 2,000 sets; and the steps scatter as the covariance says."""
    rng = np.random.default_rng(3)
    slope = _rows(rng).slope
    found = []
    for _ in range(2000):
        sums = binned.summed(Rows(_rows(rng).distance, slope), AREAS, np.eye(4))
        found.append(binned.weigh(sums))
    # τ² is cut at zero in a few of the sets, which makes its mean a little too large
    assert np.mean([one.noise for one in found]) == pytest.approx(SIGMA**2, rel=0.02)
    assert np.mean([one.misfit for one in found]) == pytest.approx(TAU**2, rel=0.06)
    said = np.mean([np.diag(one.covariance) for one in found], axis=0)
    assert said == pytest.approx(np.var([one.step for one in found], axis=0), rel=0.1)


def test_without_misfit_all_samples_count_alike() -> None:
    """Noise alone: plain least squares with as many degrees of freedom as samples leave."""
    rng = np.random.default_rng(4)
    now = Rows(SIGMA * rng.standard_normal(len(AREAS)), _rows(rng).slope)
    found = binned.weigh(binned.summed(now, AREAS, np.eye(4)))
    while found.misfit > 0.0:  # by chance in every other set
        now = Rows(SIGMA * rng.standard_normal(len(AREAS)), now.slope)
        found = binned.weigh(binned.summed(now, AREAS, np.eye(4)))
    assert (found.weight == 1.0).all()
    assert found.freedom == len(AREAS) - 4
    assert found.step == pytest.approx(np.linalg.lstsq(now.slope.T, now.distance, rcond=None)[0])
    assert found.covariance == pytest.approx(found.noise * np.linalg.inv(now.slope @ now.slope.T))


def test_hardly_two_samples_in_an_area_make_all_of_the_rest_noise() -> None:
    """Then nothing tells noise from misfit, and the residual of all is taken."""
    rng = np.random.default_rng(5)
    areas = np.repeat(np.arange(30), rng.integers(1, 3, 30))
    now = Rows(rng.standard_normal(len(areas)), rng.standard_normal((4, len(areas))))
    found = binned.weigh(binned.summed(now, areas, np.eye(4)))
    plain = np.linalg.lstsq(now.slope.T, now.distance, rcond=None)[0]
    left = now.distance - now.slope.T @ plain
    assert found.noise == pytest.approx(left @ left / (len(areas) - 4))


def test_areas_left_out_are_judged_by_the_others() -> None:
    """Against a refit without the samples of the fold, weighted as before."""
    now = _rows(np.random.default_rng(6))
    sums = binned.summed(now, AREAS, np.eye(4))
    weight, fold = np.random.default_rng(7).uniform(0.2, 1.0, 12), folds()
    found = binned.left_out(sums, weight, fold)
    assert found is not None
    each = np.repeat(weight, COUNTS)
    for k, area in enumerate(sums.area):
        kept = fold[AREAS] != fold[area]
        root = np.sqrt(each[kept])
        design = now.slope[:, kept].T * root[:, None]
        refit = np.linalg.lstsq(design, now.distance[kept] * root, rcond=None)[0]
        own = area == AREAS
        left = now.distance[own] - now.slope[:, own].T @ refit
        assert found[k] == pytest.approx((left**2).mean())
        assert binned.mean_square(sums, -refit)[k] == pytest.approx((left**2).mean())


def test_areas_that_are_needed_cannot_be_left_out() -> None:
    """One area alone shows the last parameter."""
    now = _rows(np.random.default_rng(8))
    slope = now.slope.copy()
    slope[3, AREAS != 40] = 0.0
    sums = binned.summed(Rows(now.distance, slope), AREAS, np.eye(4))
    assert binned.left_out(sums, np.ones(12), folds()) is None


def test_areas_without_samples_are_empty() -> None:
    """A hundred counts, whatever the samples."""
    assert (binned.fill(AREAS)[np.unique(AREAS)] == COUNTS).all()
    assert binned.fill(AREAS).sum() == COUNTS.sum()
    assert len(binned.fill(AREAS)) == BINS
