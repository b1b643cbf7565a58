"""Values that betray a bad recording: too few digits, repeats, axes that are dead or clipped."""

from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.errors import RecordingError
from imucal_wizard.core.readings import FloatArray
from tests.acquire.files.lines import samples, write


def _moving(seed: int = 2) -> FloatArray:
    """Rows of a device that rests in several positions, with noise."""
    values = samples(3000)
    rng = np.random.default_rng(seed)
    turned = np.repeat(rng.permutation(np.linspace(-9.8, 9.8, 10)), 300)
    values[:, 1] += turned
    values[:, 4] += np.where(np.arange(3000) % 300 < 60, rng.normal(0.0, 1.0, 3000), 0.0)
    return values


def test_too_few_digits_are_named(tmp_path: Path) -> None:
    values = samples()
    values[:, 1] += np.linspace(-1.0, 1.0, 400)
    values[:, 1:4] = np.round(values[:, 1:4] / 9.80665, 2) * 9.80665
    readings = read_files([write(tmp_path / "a.csv", values)])
    assert any("steps of 10 mg" in text and "Serial.print" in text for text in readings.warnings)


def test_coarse_digits_that_the_noise_dithers_are_not_complained_of(tmp_path: Path) -> None:
    """Steps of 0.01 m/s² under noise of 0.02 m/s² average away."""
    rng = np.random.default_rng(4)
    time = np.arange(0.0, 3.0, 0.01)
    values = np.round(rng.normal((0.0, 0.0, 9.8), 0.02, (len(time), 3)), 2)
    path = tmp_path / "dithered.csv"
    header = "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2]"
    np.savetxt(path, np.column_stack([time, values]), delimiter=",", header=header, comments="")
    assert not any(
        "digits" in warning for warning in read_files([path], RecordingOptions()).warnings
    )


def test_samples_that_repeat_now_and_then_are_named(tmp_path: Path) -> None:
    values = samples()
    for row in np.flatnonzero(np.arange(len(values)) % 5 > 2):
        values[row, 1:] = values[row - 1, 1:]
    readings = read_files([write(tmp_path / "a.csv", values)])
    assert any("40% of the samples repeat" in text for text in readings.warnings)


def test_an_axis_that_is_dead_or_given_twice_is_named(tmp_path: Path) -> None:
    values = samples()
    values[:, 5] = 0.0
    values[:, 2] = values[:, 1]
    warnings = read_files([write(tmp_path / "a.csv", values)]).warnings
    assert any("gyroscope's y axis never changes" in text for text in warnings)
    assert any("x and y axes are the same" in text for text in warnings)


@pytest.mark.parametrize(
    ("place", "name", "end"),
    [(1, "accelerometer's x", 9.0), (4, "gyroscope's x", 1.2)],
)
def test_an_axis_at_the_end_of_its_range_is_named(
    tmp_path: Path, place: int, name: str, end: float
) -> None:
    values = _moving()
    if place == 4:  # a slow turn beyond the range
        values[600:640, 4] = 2.0 * np.sin(np.linspace(0.0, np.pi, 40))
    values[:, place] = np.clip(values[:, place], -end, end)
    warnings = read_files([write(tmp_path / "a.csv", values)]).warnings
    assert any(f"{name} axis is at the end of its range" in text for text in warnings)


def test_coarse_readings_and_readings_in_range_are_not_called_clipped(tmp_path: Path) -> None:
    for decimals in (6, 1):
        values = np.round(_moving(), decimals)
        values[:, 0] = np.arange(len(values)) / 100.0
        warnings = read_files([write(tmp_path / "a.csv", values)]).warnings
        assert not any("is at the end of its range" in text for text in warnings)


def test_a_gyroscope_that_takes_its_own_bias_out_is_pointed_out(tmp_path: Path) -> None:
    values = _moving()
    values[np.arange(3000) % 300 >= 60, 4:7] = 0.0
    warnings = read_files([write(tmp_path / "a.csv", values)]).warnings
    assert any("reads exactly zero at rest" in text for text in warnings)


def test_a_gyroscope_without_a_number_is_left_out_and_an_accelerometer_refused(
    tmp_path: Path,
) -> None:
    values = samples()
    values[:, 5] = np.nan
    readings = read_files([write(tmp_path / "a.csv", values)])
    assert readings.gyroscope is None
    assert any("gy[rad/s] hold no number: the gyroscope" in text for text in readings.warnings)
    values[:, 2] = np.nan
    with pytest.raises(RecordingError, match=r"ay\[m/s\^2\] hold no number"):
        read_files([write(tmp_path / "b.csv", values)])


def test_a_file_in_which_no_sensor_says_anything_is_told_why(tmp_path: Path) -> None:
    """The columns are there and named; what is missing is a number in them."""
    path = tmp_path / "field.csv"
    path.write_text("t[s],mx[uT],my[uT],mz[uT]\n" + "".join(f"{i},nan,,\n" for i in range(20)))
    with pytest.raises(RecordingError, match=r"no sensor is left\. .* hold no number: the magnet"):
        read_files([path], field_alone=True)
