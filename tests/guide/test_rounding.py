"""What the steps of readings do to averages, against readings that are truly rounded."""

from itertools import pairwise

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.measurement.rounding import (
    noise_at_one_place,
    resolution_of,
    rounding_covariance,
    rounding_noise,
    rounding_step,
    rounding_variance,
    shift_at_places,
    variance_before_rounding,
)


def _rounded(sigma: float, places: int = 4000, samples: int = 400) -> tuple[FloatArray, FloatArray]:
    """True values anywhere between two steps of 1, and readings of them."""
    rng = np.random.default_rng(0)
    true = rng.uniform(0.0, 1.0, places)
    return true, np.round(true[:, None] + sigma * rng.standard_normal((places, samples)))


@pytest.mark.parametrize("sigma", [0.0, 0.05, 0.1, 0.2, 0.3])
def test_the_shift_of_an_average_is_what_the_series_says(sigma: float) -> None:
    """From a twelfth of the squared step to next to nothing; 4,000 places know it to 3 %."""
    true, readings = _rounded(sigma)
    noise = readings.var(axis=1, ddof=1).mean() / readings.shape[1]
    seen = float(((readings.mean(axis=1) - true) ** 2).mean()) - noise
    expected = rounding_variance(np.array([sigma**2]), np.ones(1))[0]
    assert expected == pytest.approx(seen, rel=0.06)


@pytest.mark.parametrize("sigma", [0.0, 0.1, 0.2])
@pytest.mark.parametrize("apart", [0.0, 0.15, 0.5, 1.3])
def test_averages_share_the_shift_of_one_place_between_two_steps(
    sigma: float, apart: float
) -> None:
    """Alike at the same place, opposite half a step on; an uncertain distance takes it away."""
    rng = np.random.default_rng(2)
    first = rng.uniform(0.0, 1.0, 4000)
    for unsure in (0.0, 0.2):
        true = np.array([first, first + apart + unsure * rng.standard_normal(4000)])
        noise = sigma * rng.standard_normal((200, *true.shape))
        shift = np.round(true + noise).mean(axis=0) - true
        seen = float((shift[0] * shift[1]).mean())
        distance, doubt = np.array([apart]), np.array([unsure**2])
        expected = rounding_covariance(sigma**2, 1.0, distance, doubt)[0]
        assert expected == pytest.approx(seen, abs=0.08 / 12.0)


@pytest.mark.parametrize("sigma", [0.02, 0.1, 0.25, 0.4])
def test_the_shift_of_readings_at_one_place_is_not_claimed_too_small(sigma: float) -> None:
    """The variance near the edge of a step looks like that by far more noise anywhere."""
    true, readings = _rounded(sigma, places=1000, samples=2000)
    seen = readings.mean(axis=1) - true
    noise = readings.var(axis=1, ddof=1)
    before, shift = noise_at_one_place(noise, np.ones(1000))
    whole = shift + noise / readings.shape[1]
    assert np.mean(seen**2 / np.maximum(whole, 1e-12)) < 1.5
    assert np.mean(np.abs(seen) < 1.96 * np.sqrt(whole)) > 0.93
    assert np.sqrt(np.median(before)) == pytest.approx(sigma, abs=0.15)


@pytest.mark.parametrize("sigma", [0.0, 0.1, 0.15, 0.2, 0.25, 0.3])
def test_the_shift_of_averages_at_many_places_is_that_of_their_noise(sigma: float) -> None:
    """Sixty sessions of fifty averages each, from the variances alone: stated over true error."""
    true, readings = _rounded(sigma, places=3000, samples=300)
    noise, count = readings.var(axis=1, ddof=1), np.full(50, 300)
    stated = [shift_at_places(one, 1.0, count) for one in noise.reshape(60, 50)]
    whole = np.mean(stated) + noise.mean() / 300.0
    assert 0.85 < np.sqrt(whole / ((readings.mean(axis=1) - true) ** 2).mean()) < 1.2
    each = np.sqrt(np.mean(stated, axis=1))
    # the mean variance of fifty averages gives 14 % of it
    assert each.std() < 0.1 * each.mean()


@pytest.mark.parametrize("sigma", [0.1, 0.2])
def test_averages_of_a_hand_that_trembles_take_no_shift_from_the_others(sigma: float) -> None:
    """Every other one trembles by half a step, one is moved by ten: the still ones keep theirs."""
    true, still = _rounded(sigma, places=2000, samples=300)
    rng = np.random.default_rng(4)
    tremor = 0.5 * np.sqrt(2.0) * np.sin(0.5 * np.arange(300) + rng.uniform(0.0, 6.0, (2000, 1)))
    dither = np.round(true[:, None] + tremor + sigma * rng.standard_normal((2000, 300)))
    readings = np.where(np.arange(2000)[:, None] % 2, dither, still)
    noise, count = readings.var(axis=1, ddof=1), np.full(50, 300)
    noise[::50] = 100.0
    stated = np.array([shift_at_places(one, 1.0, count) for one in noise.reshape(40, 50)]).ravel()
    quiet = np.arange(2000) % 2 == 0
    quiet[::50] = False
    error = ((still.mean(axis=1) - true)[quiet] ** 2).mean()
    assert 0.85 < np.sqrt((stated[quiet].mean() + noise[quiet].mean() / 300.0) / error) < 1.2
    assert stated[::50].max() == 0.0
    assert stated[1::2].mean() < 0.1 * stated[quiet].mean()


def test_without_noise_it_is_a_twelfth_and_from_half_a_step_on_nothing() -> None:
    """The closed forms at either end; a step of 0 is none."""
    step = np.array([2.0, 2.0, 0.0])
    shift = rounding_variance(np.array([0.0, 1.0, 0.5]), step)
    assert shift[0] == pytest.approx(4.0 / 12.0, rel=5e-3)
    assert shift[1] < 1e-4 * shift[0]
    assert shift[2] == 0.0
    assert rounding_noise(step)[0] == pytest.approx(np.sqrt(4.0 / 12.0))


@pytest.mark.parametrize("sigma", [0.0, 0.1, 0.3, 0.7, 3.0])
def test_the_noise_before_rounding_is_found_again(sigma: float) -> None:
    """From the mean variance of rounded readings over many places, to 5 %."""
    _, readings = _rounded(sigma)
    seen = readings.var(axis=1, ddof=1).mean()
    assert variance_before_rounding(np.array([seen]), np.ones(1))[0] ** 0.5 == pytest.approx(
        sigma, rel=0.05
    )


def test_the_step_of_coarse_readings_is_their_resolution() -> None:
    """Also where single lines were garbled, an axis is dead, or samples are repeated."""
    rng = np.random.default_rng(1)
    values = np.round(rng.standard_normal((5000, 3)) * 0.3, 1)
    values[:, 2] = 7.0
    values = np.repeat(values, 2, axis=0)
    values[100, 0] += 0.0301
    assert resolution_of(values) == pytest.approx([0.1, 0.1, 0.0])


def test_the_step_of_fine_readings_is_far_below_their_noise() -> None:
    """So that it changes nothing."""
    values = np.random.default_rng(2).standard_normal((5000, 3))
    assert (resolution_of(values) < 0.1).all()


def test_a_recording_of_any_length_has_its_steps_taken_from_pieces_of_it() -> None:
    """The same steps from one sample, two, and a million."""
    rng = np.random.default_rng(3)
    long = np.round(rng.standard_normal((1_000_000, 1)), 1)
    assert resolution_of(long) == pytest.approx([0.1])
    assert resolution_of(long[:1]).tolist() == [0.0]
    assert resolution_of(np.array([[1.0], [1.5]])).tolist() == [0.5]


def _poses(seed: int, step: float, digits: int) -> FloatArray:
    """Forty poses with fast motion in between and no noise, in steps, printed with few digits."""
    rng = np.random.default_rng(seed)
    ends = rng.uniform(-10.0, 10.0, (41, 3))
    share = np.concatenate([0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 30)), np.ones(100)])
    values = np.concatenate([a + share[:, None] * (b - a) for a, b in pairwise(ends)])
    return np.round(np.round(values / step) * step if step else values, digits)


@pytest.mark.parametrize("digits", [2, 3, 4, 5])
def test_readings_of_few_digits_that_move_fast_have_the_step_of_their_digits(digits: int) -> None:
    """Their smallest usual change is one of several steps."""
    values = _poses(digits, 0.0, digits)
    assert digits == 2 or (resolution_of(values) > 1.5 * 10.0**-digits).all()
    assert rounding_step(values) == pytest.approx(np.full(3, 10.0**-digits))


@pytest.mark.parametrize("digits", [6, 9, 15])
def test_readings_of_many_digits_have_no_step(digits: int) -> None:
    """Even without any noise, where they are constant at rest."""
    values = _poses(digits, 0.0, digits)
    assert (resolution_of(values) > 1e-4).all()
    assert rounding_step(values).tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("digits", [3, 4, 9])
@pytest.mark.parametrize("bits", [8, 10, 12])
def test_the_codes_of_a_converter_are_its_step_however_they_are_printed(
    bits: int, digits: int
) -> None:
    """A converter over ±2 g: the digits are finer than its step, and its codes not even in them."""
    step = 4.0 * 9.80665 / 2**bits
    assert rounding_step(_poses(bits, step, digits)) == pytest.approx(np.full(3, step), rel=0.05)


def test_an_axis_that_is_constant_and_one_that_is_garbled_have_steps_of_their_own() -> None:
    """Each axis is judged alone."""
    values = _poses(1, 0.1, 9)
    values[:, 2] = 7.0
    values[100, 0] += 0.0301
    assert rounding_step(values) == pytest.approx([0.1, 0.1, 0.0])
    assert rounding_step(values[:1]).tolist() == [0.0, 0.0, 0.0]
