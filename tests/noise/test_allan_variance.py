"""The Allan variance of a stream, against published values and exact theory."""

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.distributions import WITHIN_NINETY
from imucal_wizard.estimate.noise_coefficients import DETERMINED_SIGMA, AllanTheory, fit_noise
from imucal_wizard.measurement.allan_variance import AllanSums
from tests.noise.at_rest import three_axes

RATE = 50.0


def sums_of(values: FloatArray, pieces: int = 1) -> AllanSums:
    """The sums of readings that come in pieces."""
    sums = AllanSums(values.shape[1])
    for piece in np.array_split(values, pieces):
        sums.feed(piece)
    return sums


def by_definition(values: FloatArray, m: int) -> float:
    """NIST SP 1065, eq. 11, over every k."""
    x = np.concatenate([[0.0], np.cumsum(values - values.mean())])
    second = x[2 * m :] - 2.0 * x[m:-m] + x[: -2 * m]
    return float(np.sqrt(np.mean(second**2) / (2.0 * m**2)))


def test_the_test_set_of_nist_gives_the_published_deviations() -> None:
    """SP 1065, section 12.4: a thousand numbers of a generator, and their table."""
    numbers = [1234567890]
    while len(numbers) < 1000:
        numbers.append(16807 * numbers[-1] % 2147483647)
    values = np.array(numbers)[:, None] / 2147483647.0
    found = sums_of(values, pieces=7).result()
    published = {1: 2.922319e-01, 10: 9.159953e-02}
    for length, deviation in published.items():
        variance = found.variance[found.lengths == length][0, 0]
        assert np.sqrt(variance) == pytest.approx(deviation, rel=1e-6)


def test_long_averages_from_blocks_are_those_of_the_definition() -> None:
    values = three_axes(7001, 40_000, RATE, white=0.01, flicker=2e-3, walk=3e-4) + 9.81
    found = sums_of(values, pieces=23).result()
    for length, variance in zip(found.lengths.tolist(), found.variance, strict=True):
        if length <= 10_000:
            true = [by_definition(column, length) for column in values.T]
            # blocks of at most τ/32 lose less than a tenth of the standard error
            near = 1e-7 if length < 64 else 0.01
            np.testing.assert_allclose(np.sqrt(variance), true, rtol=near)


def test_the_pieces_make_no_difference() -> None:
    values = three_axes(7002, 20_000, RATE, white=0.01)
    one, other = sums_of(values).result(), sums_of(values, pieces=99).result()
    np.testing.assert_array_equal(one.lengths, other.lengths)
    np.testing.assert_allclose(one.variance, other.variance, rtol=1e-9)


def test_nothing_is_joined_across_an_interruption() -> None:
    values = three_axes(7003, 20_000, RATE, white=0.01)
    whole = sums_of(values).result()
    apart = AllanSums(3)
    for piece in (values[:9000], values[9000:] + 5.0):  # a new bias
        apart.interrupt()
        apart.feed(piece)
    found = apart.result()
    assert found.segments == (9000, 11_000)
    rows = found.lengths < 500
    np.testing.assert_allclose(found.variance[rows], whole.variance[: rows.sum()], rtol=0.2)


@pytest.mark.parametrize(("white", "walk"), [(1.0, 0.0), (0.0, 1.0), (8.0, 1.0)])
def test_allan_variances_move_together_as_their_quadratic_forms_do(
    white: float, walk: float
) -> None:
    """For Gaussian readings the covariance of ``y'Ay`` and ``y'By`` is ``2 tr(AΣBΣ)``."""
    count, lengths = 600, np.array([4, 8, 16, 32, 64, 128])
    step = np.arange(1.0, count + 1.0)
    readings = white**2 * np.eye(count) + walk**2 * np.minimum.outer(step, step)
    products = []
    for m in lengths.tolist():
        mean = np.kron([-1.0, 1.0], np.ones(m) / m)
        rows = np.array([np.pad(mean, (k, count - 2 * m - k)) for k in range(count - 2 * m + 1)])
        products.append(rows.T @ rows / (2.0 * len(rows)) @ readings)
    exact = np.array([[2.0 * np.sum(one * other.T) for other in products] for one in products])
    size = np.sqrt(np.diag(exact))
    taus, every = lengths.astype(np.float64), np.ones(len(lengths), bool)
    theory = AllanTheory(taus, np.ones(len(taus)), [float(count)], every)
    found = theory.covariance(np.array([white**2, 0.0, walk**2, 0.0]))
    # a walk in steps is that of the theory up to 1/m², here a sixteenth
    np.testing.assert_allclose(
        found / np.outer(size, size), exact / np.outer(size, size), atol=0.05
    )


@pytest.mark.study
def test_the_standard_errors_hold_the_truth_as_often_as_they_say() -> None:
    """Nine in ten, of each coefficient that the recording determines, with fresh seeds."""
    truth = {"white": 0.01, "bias_instability": 2e-3, "random_walk": 4e-4}
    rate, count, recordings = 10.0, 40_000, range(31_000, 31_020)
    held, below = dict.fromkeys(truth, 0), dict.fromkeys(truth, 0)
    for seed in recordings:
        values = three_axes(seed, count, rate, white=0.01, flicker=2e-3, walk=4e-4)
        for fit in fit_noise(sums_of(values).result(), 1.0 / rate):
            for name, true in truth.items():
                one = fit.coefficients[name]
                held[name] += abs(one.value - true) <= WITHIN_NINETY * one.standard_error
                below[name] += true <= one.below
    for name in truth:
        # binomials of 60 with p = 0.9 and 0.95: four standard deviations below
        assert 0.745 < held[name] / 60 < 1.0, (name, held)
        assert below[name] / 60 > 0.84, (name, below)


def test_an_interval_of_what_is_not_determined_reaches_from_zero_to_the_limit() -> None:
    """A random walk looks a little like flicker noise: the root of what is found is no evidence."""
    seen = 0
    for seed in range(31_100, 31_104):
        values = three_axes(seed, 20_000, 10.0, white=0.01, walk=4e-4)
        for fit in fit_noise(sums_of(values).result(), 0.1):
            one = fit.coefficients["bias_instability"]
            if not one.determined:
                assert one.value <= DETERMINED_SIGMA * one.standard_error
                assert one.below <= one.value + WITHIN_NINETY * one.standard_error + 1e-12
                seen += one.value > 0.0
    assert seen >= 3
