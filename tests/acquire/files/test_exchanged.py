"""Columns that were exchanged are never fitted in silence: gravity tells which sensor is which."""

from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.errors import RecordingError
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.measurement.data_quality import refuse_without_gravity, sensors_exchanged
from tests.acquire.files.lines import write
from tests.shared_data import shared_data

SHOWN = "t[s],ax[{0}],ay[{0}],az[{0}],gx[{1}],gy[{1}],gz[{1}]"


def _session(scale: float = 1.0, offset: float = 0.0) -> FloatArray:
    """Times, specific force and rate of a device that rests in twelve positions, 3 s each."""
    rng = np.random.default_rng(3)
    up = np.repeat(rng.normal(size=(12, 3)), 300, axis=0)
    force = scale * 9.8 * up / np.linalg.norm(up, axis=1, keepdims=True)
    turning = (np.arange(3600) % 300 < 60)[:, None] * rng.normal(0.0, 1.0, (3600, 3))
    rate = np.array([0.02, -0.01, 0.03]) + turning + rng.normal(0.0, 0.002, (3600, 3))
    force += scale * rng.normal(0.0, 0.02, (3600, 3))
    return np.column_stack([np.arange(3600) / 100.0, force + offset, scale * rate + offset])


@pytest.mark.parametrize(
    ("units", "scale"),
    [(("m/s^2", "rad/s"), 1.0), (("g", "deg/s"), 1.0), (("count", "count"), 400.0)],
)
def test_a_header_that_exchanges_the_sensors_is_refused(
    tmp_path: Path, units: tuple[str, str], scale: float
) -> None:
    values = _session(scale)[:, [0, 4, 5, 6, 1, 2, 3]]
    with pytest.raises(RecordingError, match="gx,gy,gz show gravity in every position"):
        read_files([write(tmp_path / "a.csv", values, SHOWN.format(*units))])


@pytest.mark.parametrize(
    ("units", "scale", "offset"),
    [(("m/s^2", "rad/s"), 1.0, 0.0), (("count", "count"), 400.0, 0.0),
     (("count", "count"), 400.0, 32768.0)],
)  # fmt: skip
def test_a_right_header_is_not(
    tmp_path: Path, units: tuple[str, str], scale: float, offset: float
) -> None:
    path = write(tmp_path / "a.csv", _session(scale, offset), SHOWN.format(*units))
    assert len(read_files([path])) == 3600


def test_a_motor_that_turns_as_evenly_as_the_device_rests_is_no_exchange() -> None:
    """At its one speed a coarse gyroscope repeats a code; at rest noise moves it between two."""
    rng = np.random.default_rng(1)
    time, step = np.arange(6000) / 100.0, 0.008
    moves = np.arange(6000) % 300 >= 150
    speed = 100.25 * step
    axes = np.repeat(np.eye(3)[np.arange(20) % 3], 300, axis=0)
    rate = 0.5 * step + moves[:, None] * (speed - 0.5 * step) * axes
    rate = np.round((rate + rng.normal(0.0, 0.03 * step, (6000, 3))) / step) * step
    tilt = speed * np.cumsum(moves) / 100.0
    up = np.column_stack([np.sin(tilt), np.cos(tilt) * np.sin(0.3 * tilt), np.cos(tilt)])
    force = 9.8 * up / np.linalg.norm(up, axis=1, keepdims=True)
    force += rng.normal(0.0, 0.02, (6000, 3))
    assert not sensors_exchanged(Series(time, force, "m/s^2"), Series(time, rate, "rad/s"))


def test_sensors_with_clocks_of_their_own_are_not_compared_block_by_block() -> None:
    """As many samples of each, at 100 and 104 Hz, as two files give them."""
    values = _session()
    force, rate = values[:, 1:4], values[:, 4:7]
    own, other = np.arange(3600) / 100.0, np.arange(3600) / 104.0
    assert not sensors_exchanged(Series(own, force, "m/s^2"), Series(other, rate, "rad/s"))
    assert sensors_exchanged(Series(own, rate, "m/s^2"), Series(other, force, "rad/s"))


def test_a_rate_table_is_not_taken_for_an_exchange() -> None:
    """Constant rates look like rests, but their size is not that of gravity."""
    rng = np.random.default_rng(0)
    time = np.arange(4000) / 100.0
    rates = np.repeat([0.0, 1.0, -1.0, 2.0, -2.0, 0.5, 3.0, -3.0], 500)
    rate = np.column_stack([0 * rates, 0 * rates, rates]) + rng.normal(0.0, 0.002, (4000, 3))
    force = np.array([0.0, 0.0, 9.8]) + rng.normal(0.0, 0.02, (4000, 3))
    assert not sensors_exchanged(Series(time, force, "m/s^2"), Series(time, rate, "rad/s"))


def test_an_accelerometer_without_gravity_is_refused() -> None:
    rng = np.random.default_rng(0)
    force = Series(np.arange(4000) / 100.0, rng.normal(0.0, 0.02, (4000, 3)), "m/s^2")
    with pytest.raises(RecordingError, match="has removed gravity"):
        refuse_without_gravity(Readings(force))


NAMELESS = RecordingOptions(columns=("t", "ax", "ay", "az"), accelerometer_unit="count")


def _pair(folder: Path, *, together: bool = True) -> list[Path]:
    """An accelerometer's file and a gyroscope's, or the accelerometer at rest in one position."""
    values = _session(400.0)
    motion = np.random.default_rng(4).normal(size=(3600, 3))
    turning = (np.arange(3600) % 300 < 60)[:, None] * motion
    moved = values[:, 1:4] + 1000.0 * turning
    other = values[:, 4:] if together else values[:1, 1:4] + 8.0 * values[:, 4:] * (turning == 0.0)
    return [
        write(folder / f"{name}.mat", np.column_stack([values[:, 0], own]), "")
        for name, own in (("first", moved), ("second", other))
    ]


def test_a_gyroscopes_file_is_not_read_as_more_of_the_accelerometer(tmp_path: Path) -> None:
    for paths in (_pair(tmp_path), _pair(tmp_path)[::-1]):
        with pytest.raises(RecordingError, match="only one of them shows gravity") as caught:
            read_files(paths, NAMELESS)
        assert caught.value.settings == ("as_format imu_tk",)
    assert len(read_files(_pair(tmp_path, together=False), NAMELESS)) == 7200


def test_the_format_of_a_pair_is_proposed_for_two_files_without_names(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="the gyroscope's file of one session") as caught:
        read_files(_pair(tmp_path))
    assert caught.value.settings == ("as_format imu_tk",)


def test_real_recordings_are_far_from_both() -> None:
    pair = [shared_data(f"imu_tk_xsens/xsens_{name}.mat") for name in ("acc", "gyro")]
    readings = read_files(pair, RecordingOptions(as_format="imu_tk"))
    assert readings.gyroscope is not None
    assert not sensors_exchanged(readings.accelerometer, readings.gyroscope)
    assert sensors_exchanged(readings.gyroscope, readings.accelerometer)
