"""The sensor's forward model and its noise against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.simulate.actions import PlacePose
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.noise import SensorNoise
from imucal_wizard.simulate.samples import VirtualStream
from imucal_wizard.simulate.sensor import DEGREE, MILLI_G, SensorModel, Triad
from tests.simulate.sensors import ideal, offset_binary, truth

FACES = {"+x": 0, "-x": 0, "+y": 1, "-y": 1, "+z": 2, "-z": 2}


def _silent(model: SensorModel) -> SensorModel:
    """The same errors without noise and rounding."""
    return replace(
        model,
        accelerometer=replace(model.accelerometer, density=0.0, floor=0.0, step=0.0),
        gyroscope=replace(model.gyroscope, density=0.0, floor=0.0, step=0.0),
    )


@pytest.mark.parametrize("face", FACES)
def test_a_face_on_top_reads_one_column_of_the_sensitivity(face: str) -> None:
    """At rest the reading is ``S·g·u + b`` and the gyroscope reads its bias."""
    model = _silent(SensorModel.drawn(5))
    hand = VirtualHand()
    hand.perform([PlacePose(face, error=0.0)])
    hand.advance(600)
    samples = VirtualStream(hand, model).take(10)
    sign = 1.0 if face[0] == "+" else -1.0
    column = model.accelerometer.sensitivity[:, FACES[face]]
    expected = sign * STANDARD_GRAVITY * column + model.accelerometer.bias
    np.testing.assert_allclose(samples.accelerometer, np.tile(expected, (10, 1)), atol=1e-8)
    np.testing.assert_allclose(samples.gyroscope, np.tile(model.gyroscope.bias, (10, 1)))


def test_the_true_correction_gives_back_rate_and_specific_force() -> None:
    """``M·(y − b)`` with the true parameters is the true motion."""
    model = _silent(SensorModel.drawn(6))
    hand, twin = VirtualHand(), VirtualHand()
    for each in (hand, twin):
        each.perform([PlacePose("+x-y"), PlacePose("-z")])
    samples, motion = VirtualStream(hand, model).take(400), twin.advance(400)
    t = truth(model=model)
    force = (samples.accelerometer - t.accelerometer_bias) @ t.accelerometer_matrix.T
    rate = (samples.gyroscope - t.gyroscope_bias) @ t.gyroscope_matrix.T
    np.testing.assert_allclose(force, motion.specific_force, atol=1e-12)
    np.testing.assert_allclose(rate, motion.rate, atol=1e-12)


@pytest.mark.parametrize("seed", range(8))
def test_drawn_sensors_have_errors_worth_calibrating(seed: int) -> None:
    """Bias of tens of mg, scale of per cents, non-orthogonality near 1°, as the class has them."""
    model = SensorModel.drawn(seed)
    scale = np.diag(model.accelerometer.sensitivity) - 1.0
    off = model.accelerometer.sensitivity[np.triu_indices(3, 1)]
    assert (np.abs(model.accelerometer.bias / MILLI_G) >= 15.0).all()
    assert (np.abs(model.accelerometer.bias / MILLI_G) <= 60.0).all()
    assert ((np.abs(scale) >= 0.01) & (np.abs(scale) <= 0.03)).all()
    assert ((np.abs(off) >= 0.5 * DEGREE) & (np.abs(off) <= 1.2 * DEGREE)).all()
    assert not np.tril(model.accelerometer.sensitivity, -1).any()
    assert (np.abs(model.gyroscope.bias / DEGREE) >= 0.3).all()
    turned = model.gyroscope.sensitivity - np.diag(np.diag(model.gyroscope.sensitivity))
    assert 0.2 * DEGREE < np.abs(turned).max() < 2.5 * DEGREE


def test_readings_are_multiples_of_the_step_within_the_range() -> None:
    """The converter rounds and clips."""
    triad = Triad(np.eye(3), np.zeros(3), "m/s^2", step=0.25, lowest=-2.0, highest=2.0)
    felt = np.array([[0.1, 0.13, -1.9], [5.0, -5.0, 0.0]])
    np.testing.assert_array_equal(triad.reading(felt), [[0.0, 0.25, -2.0], [2.0, -2.0, 0.0]])


def test_raw_counts_are_whole_numbers_around_their_offset() -> None:
    """Offset-binary lies around 32768, with the gain as named, and clips at its 16 bits."""
    counts, gain = offset_binary(SensorModel.drawn(2)), 415.0
    assert counts.accelerometer.unit == counts.gyroscope.unit == "count"
    samples = VirtualStream(VirtualHand(), counts).take(500)
    for values in (samples.accelerometer, samples.gyroscope):
        np.testing.assert_array_equal(values, np.round(values))
    g = samples.accelerometer.mean(0) - counts.accelerometer.bias
    assert g[2] == pytest.approx(gain * STANDARD_GRAVITY, rel=0.04)
    np.testing.assert_allclose(counts.accelerometer.bias, 32768.0, atol=gain)
    huge = counts.accelerometer.reading(np.array([[1e4, -1e4, 0.0]]))[0]
    assert huge[0] - huge[1] == 65535.0


def test_the_chip_warms_up_after_switching_on() -> None:
    """It ends one rise above the ambient temperature, 63 % of it after one time constant."""
    thermal = ideal().thermal
    at = thermal.at(np.array([0.0, thermal.tau, 1e5]))
    np.testing.assert_allclose(
        at - thermal.ambient, thermal.rise * np.array([0.0, 0.632121, 1.0]), rtol=1e-5
    )


def _allan(values: FloatArray, m: int) -> float:
    """Allan deviation of clusters of ``m`` samples, non-overlapping."""
    means = values[: len(values) // m * m].reshape(-1, m).mean(1)
    return float(np.sqrt(0.5 * np.mean(np.diff(means) ** 2)))


def test_white_noise_has_the_density_of_the_data_sheet() -> None:
    """Density times the root of half the rate, and averages as the root of their number."""
    noise = SensorNoise(np.random.default_rng(1), 100.0, np.array([2.0]), np.zeros(1)).take(
        100_000
    )[:, 0]
    assert noise.std() == pytest.approx(2.0 * np.sqrt(50.0), rel=0.02)
    assert _allan(noise, 100) == pytest.approx(noise.std() / 10.0, rel=0.1)


@pytest.mark.parametrize("seconds", [4, 16, 60])
def test_bias_instability_has_a_flat_allan_deviation(seconds: int) -> None:
    """Flicker noise stays at its floor however long one averages."""
    rng = np.random.default_rng(7)
    noise = SensorNoise(rng, 8.0, np.zeros(6), np.full(6, 3.0)).take(40_000)
    floor = np.sqrt(np.mean([_allan(noise[:, c], 8 * seconds) ** 2 for c in range(6)]))
    assert floor == pytest.approx(3.0, rel=0.15)


def test_noise_does_not_depend_on_how_it_is_cut() -> None:
    """One stream, whatever is asked for at a time."""

    def stream() -> SensorNoise:
        return SensorNoise(np.random.default_rng(1), 100.0, np.ones(2), np.ones(2))

    whole, cut = stream().take(300), stream()
    np.testing.assert_array_equal(
        np.concatenate([cut.take(n) for n in (1, 63, 64, 65, 107)]), whole
    )
