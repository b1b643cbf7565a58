"""The error that the poses do not show, against the true one."""

import numpy as np
import pytest

from benchmarks.could_be import one_unit
from benchmarks.hidden.designs import PLANS
from benchmarks.hidden.fitted import measured_of
from benchmarks.hidden.noise import COLOURS
from benchmarks.hidden.recording import record
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.model.effect import ACCELEROMETER


def test_fewer_poses_leave_more_open() -> None:
    """Of one sensor with nothing hidden, 38 holds leave less open than 18."""
    said = []
    for design in ("18", "26+12"):
        units = [_said(design, seed) for seed in range(3)]
        said.append(np.median(units))
    assert said[1] < said[0]


def _said(design: str, seed: int) -> float:
    rng = np.random.default_rng(seed)
    bench = Bench(ACCELEROMETER, measured_of(record(PLANS[design], COLOURS["white"], (), rng)))
    return bench.look().could_be or np.inf


@pytest.mark.study
def test_it_covers_the_error_of_units_with_and_without_a_hidden_effect() -> None:
    """The rms error in new directions: 93 to 97 % of units, and 2.5 binomial deviations."""
    rng = np.random.default_rng(77)
    units = [one_unit("18", "consumer", rng) for _ in range(40)]
    true = np.array([np.sqrt(np.mean(one.errors**2)) for one in units])
    said = np.array([one.could_be for one in units])
    spread = 2.5 * np.sqrt(0.95 * 0.05 / len(units))
    assert np.mean(true <= said) > 0.93 - spread
    assert np.median(said / true) < 3.0
