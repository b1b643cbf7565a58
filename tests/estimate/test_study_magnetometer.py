"""Intervals of the magnetometer's parameters, small and with fixed seeds.

The whole of it is ``python -m benchmarks.magnetometer intervals``.
"""

import numpy as np
import pytest

from benchmarks.magnetometer import MOTIONS, NOISES, intervals
from tests.estimate.field_truth import TEN_BITS

pytestmark = pytest.mark.study

RUNS = 50
POSES, CIRCLES, REPEATED = "26 poses of 3 s", "six circles at 25 Hz", "26 poses of 3 s twice"


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

    The ten parameters of one session go together, so that fifty sessions know the share of all to
    two per cent. The rms of errors over standard errors is held to what 99 and 90 % of a normal
    distribution mean, 1.96 / 2.58 and 1.96 / 1.64.
    """
    shares, rms, *_ = intervals(MOTIONS[motion], NOISES[noise], step, RUNS, 8_800)
    assert 0.90 < np.mean(shares) < 0.99
    assert 0.76 < rms < 1.19
