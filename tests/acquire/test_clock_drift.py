"""Files of two sensors whose clocks run at different rates."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.measurement.clock_drift import clock_drift


def _recorded(share: float, jump: float = 0.0) -> Readings:
    """A device turned now and then; the gyroscope's clock is fast by a share, or jumps once."""
    rng = np.random.default_rng(0)
    time = np.arange(0.0, 180.0, 0.01)
    speed = np.zeros(len(time))
    for begin in np.cumsum(rng.uniform(2.5, 5.0, 40)):
        speed += 2.0 * np.exp(-(((time - begin) / 0.4) ** 2))
    angle = np.cumsum(speed) * 0.01
    force = 9.8 * np.column_stack([np.sin(angle), 0.0 * angle, np.cos(angle)])
    rate = np.column_stack([0.0 * speed, speed, 0.0 * speed])
    force += 0.02 * rng.standard_normal(force.shape)
    rate += 0.002 * rng.standard_normal(rate.shape)
    own = time * (1.0 + share) + jump * (time > 90.0)
    return Readings(Series(time, force, "m/s^2"), Series(own, rate, "rad/s"))


@pytest.mark.parametrize(("share", "way"), [(0.01, "1.0 % fast"), (-0.003, "0.3[0-9]? % slow")])
def test_a_clock_that_runs_faster_is_told_with_its_share(share: float, way: str) -> None:
    (said,) = clock_drift(_recorded(share))
    assert said.sensor == "gyroscope"
    text = f"the gyroscope's clock is {way} against the accelerometer's: the motions"
    assert re.match(text, said)


def test_two_files_of_which_one_has_a_faster_clock_are_warned_of(tmp_path: Path) -> None:
    readings, paths = _recorded(0.01), []
    for letter, series in (("a", readings.accelerometer), ("g", readings.gyroscope)):
        assert series is not None
        columns = ",".join([f"{letter}{axis}[{series.unit}]" for axis in "xyz"])
        lines = np.column_stack([series.time, series.values])
        paths.append(tmp_path / f"{letter}.csv")
        np.savetxt(paths[-1], lines, "%.5f", ",", header=f"t[s],{columns}", comments="")
    assert any("clock is 1.0 % fast" in text for text in read_files(paths).warnings)


def test_clocks_that_agree_or_jump_are_not_said_to_run_at_other_rates() -> None:
    """A constant offset changes no angle, and one jump is no rate."""
    same = _recorded(0.0)
    assert same.gyroscope is not None
    late = replace(same.gyroscope, time=same.gyroscope.time + 0.4)
    assert clock_drift(same) == clock_drift(replace(same, gyroscope=late)) == []
    assert clock_drift(_recorded(0.0, jump=0.8)) == []
