"""Hidden effects of real sensors: what one of them has, and what two others only seem to have."""

from functools import cache

import numpy as np
import pytest

from benchmarks.injected import injected
from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.survey import diagnose_benches
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.recording import fit_readings
from tests.shared_data import shared_data

pytestmark = pytest.mark.usefixtures("rough_sizes_throughout")

PLAIN = RecordingOptions(
    columns=("ax", "ay", "az", "gx", "gy", "gz"),
    rate=100.0,
    accelerometer_unit="m/s^2",
    gyroscope_unit="rad/s",
)


@cache
def surveyed(*names: str) -> tuple[Diagnosis, ...]:
    """What ``bench --auto`` says of a real recording."""
    options = RecordingOptions(as_format="imu_tk") if len(names) > 1 else PLAIN
    readings = read_files([shared_data(name) for name in names], options)
    return diagnose_benches(Benches(fit_readings(readings), readings), {}, automatic=True)


def xsens() -> tuple[Diagnosis, ...]:
    return surveyed("imu_tk_xsens/xsens_acc.mat", "imu_tk_xsens/xsens_gyro.mat")


def test_the_xsens_accelerometer_is_complete() -> None:
    said = xsens()[0]
    assert said.verdict is Verdict.COMPLETE
    assert said.added == ()


def test_the_xsens_gyroscope_feels_gravity_and_without_that_its_turns_close() -> None:
    """The first suspect; added, rotations left out close within 0.20° instead of half a degree."""
    said = xsens()[1]
    assert said.findings is not None
    assert said.bench is not None
    assert said.findings.suspects[0].term == "g-sensitivity"
    assert said.verdict is Verdict.COMPLETE
    assert said.added == ("g-sensitivity",)
    assert [one.term for one in said.found] == ["g-sensitivity"]
    first, last = said.bench.ladder
    assert first.rms_held_out is not None
    assert last.rms_held_out is not None
    assert first.rms_held_out > np.radians(0.4)
    assert last.rms_held_out <= np.radians(0.20)


@pytest.mark.parametrize("log", ["imu0", "imu1"])
def test_no_g_sensitivity_is_added_to_the_mikoff_logs(log: str) -> None:
    """It lowers the fitted error and raises the one held out."""
    for said in surveyed(f"mikoff_mpu9150/{log}.log"):
        assert "g-sensitivity" not in said.added


@pytest.mark.study
@pytest.mark.parametrize(
    ("recording", "key"),
    [
        ("Xsens MTi", "accelerometer/second-order"),
        ("Xsens MTi", "gyroscope/bias-drift"),
        ("MPU-9150, first", "accelerometer/second-order"),
        ("MPU-9150, second", "gyroscope/bias-drift"),
    ],
)
def test_an_effect_added_to_real_samples_is_never_called_another(recording: str, key: str) -> None:
    """At three times the nameable size it is named, listed or probable, and no other is.

    Where something was added, fresh holds and rotations agree. A bias that drifts is not always
    separated from one that warms up, and two explanations are listed instead of one being added.
    The Xsens gyroscope feels gravity by itself, and both effects are named there.
    """
    shared_data("README.md")
    found = injected(recording, key, 3.0, 31, 0)
    assert found is not None
    assert found.outcome in {"right", "listed"}
    if found.outcome == "right":
        assert found.after < 0.6 * found.before
    else:
        assert found.after == found.before
