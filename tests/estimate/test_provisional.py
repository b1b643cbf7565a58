"""The ellipsoid while its readings come in, against N's own sensor; its doubt is true."""

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.ellipsoid.coverage import BINS, bin_of, centres, gaps, quality
from imucal_wizard.estimate.ellipsoid.provisional import MISFIT, Provisional, provisional
from tests.estimate.field_truth import CORRECTION, NOISE, OFFSET, all_over, recorded, six_circles


def circles(seed: int, faces: tuple[int, ...], share: float = 1.0) -> FloatArray:
    """Readings of N's sensor turned on some faces, some hundred, shape (n, 3)."""
    rng = np.random.default_rng(seed)
    samples = recorded(six_circles(rng, 4.0, faces=faces, share=share), rng).series.values
    return samples[::2]


def found(readings: FloatArray) -> Provisional:
    """What is found from nothing."""
    fit = provisional(readings)
    assert fit is not None
    return fit


def test_six_circles_give_hard_iron_and_size_as_well_as_their_noise_allows() -> None:
    """A hundredth of the field would be 4.4 counts; some hundred samples know it better."""
    fit = found(circles(0, (0, 1, 2, 3, 4, 5)))
    assert np.abs(fit.cloud.bias(fit.theta) - OFFSET).max() < 0.5 * NOISE
    # N's matrix has a determinant of nearly one, so that counts are what they were
    assert fit.magnitude == pytest.approx(438.2 / np.cbrt(np.linalg.det(CORRECTION)), rel=0.01)
    assert fit.worst() < 0.01


@pytest.mark.parametrize("faces", [(0,), (0, 1), (0, 2), (0, 1, 2), (1, 3, 5)])
def test_no_reading_of_the_same_field_looks_like_a_disturbance(faces: tuple[int, ...]) -> None:
    """Wherever the device is turned next, it is within what noise and doubt allow."""
    everywhere = circles(9, (0, 1, 2, 3, 4, 5))
    for seed in range(10):
        fit = found(circles(seed, faces))
        distance = np.abs(fit.look(everywhere)[0])
        limit = np.hypot(fit.doubt(everywhere), np.hypot(fit.noise, MISFIT))
        assert (distance < 6.0 * limit).all()


def test_uncertainty_is_large_where_nothing_was_seen_and_small_where_something_was() -> None:
    """One face tells nothing of the others."""
    seen, unseen = circles(1, (0,)), circles(2, (1,))
    fit = found(seen)
    assert fit.doubt(seen).max() < 0.05
    assert fit.doubt(unseen).min() > 0.1


def test_a_tenth_of_the_samples_may_be_anything() -> None:
    readings = circles(3, (0, 1, 2, 3, 4, 5))
    rng = np.random.default_rng(0)
    wrong = rng.choice(len(readings), len(readings) // 10, replace=False)
    readings[wrong] += rng.normal(0.0, 150.0, (len(wrong), 3))
    fit = found(readings)
    assert np.abs(fit.cloud.bias(fit.theta) - OFFSET).max() < NOISE


def test_what_came_before_serves_as_a_start_and_changes_nothing_else() -> None:
    """From another ellipsoid nearby it settles on the same one."""
    readings = circles(4, (0, 1, 2, 3, 4, 5))
    fresh, again = found(readings), provisional(readings, found(readings[:-300]))
    assert again is not None
    for _ in range(3):
        again = provisional(readings, again)
        assert again is not None
    assert again.magnitude == pytest.approx(fresh.magnitude, rel=1e-4)
    assert np.abs(again.cloud.bias(again.theta) - fresh.cloud.bias(fresh.theta)).max() < 0.1


@pytest.mark.parametrize(
    "readings",
    [
        np.zeros((0, 3)),
        np.ones((10, 3)),
        np.ones((500, 3)),
        np.random.default_rng(0).normal(0.0, 4.0, (500, 3)) + OFFSET,
        np.column_stack([np.linspace(0.0, 100.0, 500), np.zeros(500), np.zeros(500)]),
    ],
    ids=["nothing", "few", "one value", "noise", "a line"],
)
def test_no_effect_is_added_to_linear_data(readings: FloatArray) -> None:
    assert provisional(readings) is None


def test_a_perfect_sphere_has_no_gap_no_variance_no_wobble_and_no_error() -> None:
    """Three samples in the middle of each area."""
    seen = np.tile(centres().T, 3)
    figures = quality(seen, bin_of(seen))
    assert figures is not None
    assert figures.gaps == 0.0
    assert figures.variance == pytest.approx(0.0, abs=1e-9)
    assert figures.wobble == pytest.approx(0.0, abs=1e-9)
    assert figures.fit_error == pytest.approx(0.0, abs=1e-9)


def test_gaps_count_areas_as_motioncal_does() -> None:
    """An empty area one per cent, one sample a fifth of that, two samples a hundredth."""
    counts = np.full(BINS, 3)
    counts[:7], counts[7:12], counts[12:14] = 0, 1, 2
    assert gaps(counts) == pytest.approx(7.0 + 5 * 0.2 + 2 * 0.01)


def test_the_figures_of_a_cloud_that_is_off_are_those_of_closed_forms() -> None:
    """Half a sphere 2 % too long and half 2 % too short; the whole moved by 3 %."""
    middles = centres().T
    areas = np.arange(BINS)
    long = np.where(middles[2] > 0.0, 1.02, 0.98)
    figures = quality(middles * long, areas)
    assert figures is not None
    assert figures.variance == pytest.approx(2.0, rel=1e-6)
    assert figures.fit_error == pytest.approx(2.0, rel=1e-3)
    moved = quality(middles + np.array([[0.03], [0.0], [0.0]]), areas)
    assert moved is not None
    assert moved.wobble == pytest.approx(3.0, rel=0.02)


def test_too_few_samples_have_no_quality() -> None:
    assert quality(np.ones((3, 2)), np.array([1, 2])) is None


def test_uneven_density_is_weighed_out() -> None:
    """A long rest in one place beside a few samples everywhere does not pull the ellipsoid."""
    rng = np.random.default_rng(5)
    even = recorded(all_over(rng, 400), rng).series.values
    place = recorded(np.tile(all_over(rng, 1), (3000, 1)), rng).series.values
    one, other = found(even), found(np.concatenate([even, place]))
    off = np.abs(one.cloud.bias(one.theta) - other.cloud.bias(other.theta)).max()
    assert off < 0.5 * NOISE
