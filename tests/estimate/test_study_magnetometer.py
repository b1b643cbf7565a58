"""Intervals of the magnetometer's parameters, small and with fixed seeds.

The whole of it is ``python -m benchmarks.magnetometer intervals``.
"""

import numpy as np
import pytest

from benchmarks.magnetometer import MOTIONS, NOISES, intervals
from tests.estimate.field_truth import TEN_BITS

pytestmark = pytest.mark.study

RUNS = 30
POSES, CIRCLES, REPEATED = "26 poses of 3 s", "six circles at 25 Hz", "26 poses of 3 s twice"
FEW, SOME_REPEATED = "18 poses of 3 s", "26 + 12 poses of 3 s"


@pytest.mark.parametrize(
    ("motion", "noise", "step"),
    [
        (POSES, "white", TEN_BITS),
        (POSES, "0.05 µT from pose to pose", 1.0),
        (CIRCLES, "0.05 µT from pose to pose", 1.0),
        (CIRCLES, "random walk 0.02 µT/√s", 1.0),
        (REPEATED, "field drifts by 0.2 µT", 1.0),
    ],
)
def test_intervals_hold_the_truth_where_samples_share_their_errors(
    motion: str, noise: str, step: float
) -> None:
    """Rounding in still poses, and what differs from one place to the next.

    The ten parameters of one session go together, so that thirty sessions know the share of all to
    three per cent. The rms of errors over standard errors is held to what 99 and 90 % of a normal
    distribution mean, 1.96 / 2.58 and 1.96 / 1.64.
    """
    shares, rms, *_ = intervals(MOTIONS[motion], NOISES[noise], step, RUNS, 8_800)
    assert 0.90 < np.mean(shares) < 0.99
    assert 0.76 < rms < 1.19


@pytest.mark.parametrize("motion", [FEW, SOME_REPEATED, CIRCLES])
def test_intervals_under_white_noise_are_those_of_least_squares(motion: str) -> None:
    """Without repeats too: measured noise explains what is left, and no slow noise is added to it.

    Slow noise assumed without regard to the measured noise makes the rms of errors over standard
    errors 0.83 to 0.87 (poses without repeats, circles); Student's t of 9 to 111 degrees of freedom
    has 1.13 to 1.01, which sixty sessions know to about 5 %.
    """
    shares, rms, *_ = intervals(MOTIONS[motion], NOISES["white"], 1.0, 2 * RUNS, 8_900)
    assert np.mean(shares) == pytest.approx(0.95, abs=0.03)
    assert 0.9 < rms < 1.25


def test_poses_that_do_not_come_again_do_not_measure_slow_noise() -> None:
    """Eighteen poses once each; of the second design twelve poses come again."""
    for motion, unknown in ((FEW, 1.0), (SOME_REPEATED, 0.0)):
        assert intervals(MOTIONS[motion], NOISES["white"], 1.0, 5, 8_901)[-1] == unknown
