"""A small edition of ``benchmarks.hold_intervals``: intervals and scatter of the accelerometer."""

import numpy as np
import pytest

from benchmarks.hold_intervals import NOISES, coverage, scatter
from benchmarks.hold_sessions import DESIGNS, GRAVITY, MG, Noise, session
from imucal_wizard.estimate.recording import fit_accelerometer

pytestmark = pytest.mark.study


@pytest.mark.parametrize(
    ("poses", "noise", "rest"),
    [
        ("18", "white", 0.0),
        ("18", "uneven, 0.7", 0.0),
        ("18", "0.3 mg from hold to hold", 0.0),
        ("18", "random walk 0.01 mg/√s", 90.0),
    ],
)
def test_intervals_hold_the_truth(poses: str, noise: str, rest: float) -> None:
    """Of each parameter 95 % within 4 standard deviations of 30 sessions, of all within 5.8 %."""
    found = coverage(DESIGNS[poses], NOISES[noise], 30, 31, rest)
    assert found == pytest.approx(np.full(9, 0.95), abs=4.0 * np.sqrt(0.95 * 0.05 / 30.0))
    assert found.mean() == pytest.approx(0.95, abs=0.058)


@pytest.mark.parametrize("uneven", [0.0, 1.0])
def test_no_weights_would_make_the_parameters_scatter_much_less(uneven: float) -> None:
    """Weighed by duration alone, holds whose noise differs by e make 2.9 times the bound."""
    found = scatter(DESIGNS["18"], Noise(uneven=uneven), 50, 32)
    # nine parameters of 50 sessions know the mean to 0.033
    assert np.sqrt((found**2).mean()) == pytest.approx(1.0, abs=0.115)


def test_the_report_says_whether_slow_noise_was_measured() -> None:
    """By repeats or by a long rest; not by eighteen poses once each."""
    rng = np.random.default_rng(33)
    for poses, rest, expected in (
        ("18", 0.0, False),
        ("18", 90.0, True),
        ("26 + 12", 0.0, True),
    ):
        one = session(DESIGNS[poses], Noise(flicker=0.05 * MG), rng, rest=rest)
        fit = fit_accelerometer(one.holds, GRAVITY, "m/s^2", readings=one.readings)
        assert fit.slow_noise_measured is expected
        assert ("not measured" in fit.slow_noise_note) is not expected
