"""Real recordings of four devices, as they were published."""

import numpy as np
import pytest

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.errors import RecordingError, UsageError
from tests.shared_data import shared_data

_PAIR = ("imu_tk_xsens/xsens_acc.mat", "imu_tk_xsens/xsens_gyro.mat")
_SIX = ("ax", "ay", "az", "gx", "gy", "gz")


def test_the_text_pair_of_imu_tk_is_read_in_counts() -> None:
    readings = read_files(
        [shared_data(name) for name in _PAIR], RecordingOptions(as_format="imu_tk")
    )
    assert readings.gyroscope is not None
    assert (len(readings), len(readings.gyroscope)) == (51_175, 51_175)
    assert (readings.accelerometer.unit, readings.gyroscope.unit) == ("count", "count")
    assert readings.accelerometer.time[0] == 0.02984
    np.testing.assert_array_equal(readings.accelerometer.values[0], [33108, 33329, 36429])
    np.testing.assert_array_equal(readings.gyroscope.values[0], [32786, 32429, 32499])
    assert readings.accelerometer.rate == pytest.approx(100.0, rel=1e-4)
    assert readings.warnings == ()


def test_three_files_are_no_pair_of_imu_tk() -> None:
    paths = [shared_data(name) for name in (*_PAIR, _PAIR[0])]
    with pytest.raises(UsageError, match=r"ACC.mat GYRO.mat"):
        read_files(paths, RecordingOptions(as_format="imu_tk"))


@pytest.mark.parametrize("name", ["imu0.log", "imu1.log"])
def test_six_bare_columns_are_read_with_the_options_their_message_asks_for(name: str) -> None:
    path = shared_data(f"mikoff_mpu9150/{name}")
    with pytest.raises(RecordingError) as caught:
        read_files([path])
    assert caught.value.settings[:2] == ("columns ax,ay,az,gx,gy,gz", "rate 100")
    readings = read_files([path], RecordingOptions(_SIX, 100.0, "m/s^2", "rad/s"))
    assert readings.gyroscope is not None
    assert len(readings) == len(readings.gyroscope) > 15_900
    assert readings.warnings == ()


def test_words_beside_the_numbers_and_a_counter_with_gaps_are_read() -> None:
    options = RecordingOptions(rate=102.4, gyroscope_unit="count")
    readings = read_files([shared_data("imucal_example/annotated_session.csv")], options)
    assert (len(readings), readings.accelerometer.unit) == (9414, "count")
    assert np.all(np.diff(readings.accelerometer.time) > 0)
    assert any("sample counter went back" in text for text in readings.warnings)


def test_names_without_units_are_read_with_the_unit_of_the_gyroscope() -> None:
    options = RecordingOptions(rate=102.4, gyroscope_unit="deg/s")
    readings = read_files([shared_data("imucal_example/example_ferraris_session.csv")], options)
    assert readings.accelerometer.unit == "m/s^2"
    assert readings.gyroscope is not None
    assert readings.gyroscope.values[0, 0] == pytest.approx(np.radians(-0.6103515625))
