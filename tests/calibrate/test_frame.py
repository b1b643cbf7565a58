"""The gyroscope's frame is the accelerometer's, and so is its doubt."""

from collections import Counter

import numpy as np
import pytest

from imucal_wizard.estimate.distributions import quantile
from imucal_wizard.estimate.gyroscope_report import fit_gyroscope
from imucal_wizard.estimate.parameters import full_parameters
from imucal_wizard.estimate.recording import fit_accelerometer
from tests.estimate.motions import hand_turns, recorded
from tests.estimate.truth import (
    EIGHTEEN,
    random_triangular,
    tilted,
    turn,
    typical_accelerometer,
    typical_gyroscope,
)


@pytest.mark.study
def test_the_gyroscopes_standard_errors_count_the_accelerometers() -> None:
    """A noisy accelerometer bends every rotation's frame alike; the truth is still covered.

    20 repetitions of 36 holds with 0.6 mg each and a gyroscope nearly without noise. The closure
    alone would give gains half as uncertain as they are. Tolerance: 3.5 binomial deviations.
    """
    gyroscope = typical_gyroscope()
    true = full_parameters(gyroscope.matrix, gyroscope.bias)
    repetitions = 20
    inside: Counter[str] = Counter()
    for seed in range(repetitions):
        rng = np.random.default_rng(seed)
        truth = random_triangular(rng)
        poses = [
            turn(up, np.array([1.5, 0.4, 0.7]), rate=25.0) for up in tilted(EIGHTEEN, 2.0, rng)
        ]
        motions = [*poses[:9], *hand_turns(3, rng, rate=25.0)]
        holds, rotations = recorded(
            motions, truth, gyroscope, rng, force_sigma=6e-3, rate_sigma=1e-4
        )
        accelerometer = fit_accelerometer(holds, 9.80665, "m/s^2")
        fit = fit_gyroscope(holds, rotations, accelerometer, "rad/s").fit
        assert fit is not None
        reach = quantile(0.95, fit.degrees_of_freedom)
        for parameter in fit.parameters:
            assert parameter.standard_error is not None
            off = abs(parameter.value - true[parameter.name])
            inside[parameter.name] += off < reach * parameter.standard_error
    allowed = 3.5 * np.sqrt(0.95 * 0.05 / repetitions)
    gains = {name: count for name, count in inside.items() if not name.startswith("bias")}
    assert min(gains.values()) / repetitions > 0.95 - allowed
    assert sum(gains.values()) / len(gains) / repetitions > 0.95 - 0.5 * allowed


def test_without_noise_the_frame_is_the_true_one() -> None:
    """Accelerometer and gyroscope together come back exactly, misalignment included."""
    rng = np.random.default_rng(1)
    accelerometer, gyroscope = typical_accelerometer(), typical_gyroscope()
    holds, rotations = recorded(hand_turns(6, rng), accelerometer, gyroscope, rng)
    found = fit_accelerometer(holds, 9.80665, "m/s^2")
    fit = fit_gyroscope(holds, rotations, found, "rad/s").fit
    assert fit is not None
    assert np.abs(found.matrix - accelerometer.matrix).max() < 1e-10
    assert np.abs(fit.matrix - gyroscope.matrix).max() < 1e-6
    assert np.abs(fit.bias - gyroscope.bias).max() < 1e-9
