"""The public Python interface, as a notebook uses it."""

import doctest
import lzma
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import imucal_wizard as iw
from imucal_wizard import api
from imucal_wizard.core import quantities
from imucal_wizard.core.errors import DataError, UsageError

RECORDINGS = Path(__file__).parent / "golden" / "data"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a recording in 18 poses, ``imu.csv``, where the examples run."""
    recording = lzma.decompress((RECORDINGS / "eighteen-poses.csv.xz").read_bytes())
    (tmp_path / "imu.csv").write_bytes(recording)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_examples_of_the_interface_hold(folder: Path) -> None:
    assert folder.is_dir()
    done = doctest.testmod(api)
    assert done.attempted > 8
    assert done.failed == 0


def test_the_examples_of_the_formatters_hold() -> None:
    assert doctest.testmod(quantities) == (0, 3)


def test_a_term_that_is_asked_for_is_in_the_calibration(folder: Path) -> None:
    """It is saved with its size, and applied with it."""
    recording = iw.read(folder / "imu.csv")
    plain, fit = (
        iw.calibrate(recording),
        iw.calibrate(recording, {"accelerometer": ["second-order"]}),
    )
    sensor = iw.load(fit.calibration.save(folder / "my.json"))["accelerometer"]
    assert sensor.model[-1] == "second-order"
    assert sensor.parameters["second-order_x"].standard_error
    readings = recording.readings.accelerometer.values[::1000]
    difference = sensor.apply(readings) - plain["accelerometer"].apply(readings)
    assert 0.0 < np.abs(difference).max() < 0.1


def test_a_sensor_that_is_not_there_has_no_terms(folder: Path) -> None:
    recording = iw.read(folder / "imu.csv")
    with pytest.raises(UsageError, match="no magnetometer in this recording"):
        iw.calibrate(recording, {"magnetometer": ["bias-drift"]})


def test_nothing_is_taken_for_a_misspelt_sensor(folder: Path) -> None:
    with pytest.raises(UsageError, match="no sensor 'gyro'"):
        iw.read(folder / "imu.csv", units={"gyro": "deg/s"})
    with pytest.raises(UsageError, match="choose one of accelerometer"):
        iw.calibrate(iw.read(folder / "imu.csv"), methods={"acc": "newton"})


def test_data_that_determine_nothing_say_so(tmp_path: Path) -> None:
    rest = tmp_path / "rest.csv"
    rest.write_text("t[s],ax[g],ay[g],az[g]\n" + "".join(f"{i / 100},0,0,1\n" for i in range(900)))
    with pytest.raises(DataError):
        iw.calibrate(iw.read(rest))


def test_the_package_alone_imports_neither_numpy_nor_textual() -> None:
    """The same for the help, so that it appears at once."""
    code = (
        "import sys, imucal_wizard; assert imucal_wizard.__version__;"
        "sys.exit('numpy' in sys.modules or 'textual' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("size", [-1.0, 0.0, 981.0, math.nan])
def test_a_gravity_or_a_field_that_is_none_of_the_earth_is_refused(
    folder: Path, size: float
) -> None:
    recording = iw.read(folder / "imu.csv")
    with pytest.raises(UsageError, match=r"it lies between 9\.75 and 9\.84") as no:
        iw.calibrate(recording, gravity=size)
    assert no.value.settings == ("gravity",)
    with pytest.raises(UsageError, match="the Earth's field; it lies between 20 and 70") as no:
        iw.calibrate(recording, field=size)
    assert no.value.settings == ("field",)
    for nearly in (9.74, 9.85):
        with pytest.raises(UsageError, match="not a gravity on Earth"):
            iw.calibrate(recording, gravity=nearly)
