"""The sketch for N's pair of chips: two rates, one clock, read without a question."""

from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.acquire.intake import Intake
from tests.firmware.sketches import needs_compiler, printed_by

NAME = "mag3110_lsm6ds3_csv"
HEADER = "t[s],mx[uT],my[uT],mz[uT],ax[count],ay[count],az[count],gx[count],gy[count],gz[count]"
pytestmark = needs_compiler


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> str:
    """What the sketch printed in twelve seconds, half a second of them without the LSM6DS3."""
    return printed_by(NAME, "CHIP_MAG3110", tmp_path_factory.mktemp("sketch"))


def test_both_chips_print_at_their_own_rate(printed: str) -> None:
    """1666 samples a second of accelerometer and gyroscope, 80 of the field, one time for each."""
    rows = [line.split(",") for line in printed.replace("\r", "").splitlines() if line[0].isdigit()]
    assert {len(row) for row in rows} == {10}
    seconds = float(rows[-1][0]) - float(rows[0][0]) - 0.5
    field = [row for row in rows if row[1]]
    assert len(rows) / seconds == pytest.approx(1666.0, rel=0.06)
    assert len(field) / seconds == pytest.approx(80.0, rel=0.06)
    assert rows[0][4:] == ["8197", "-100", "-1", "57", "-114", "1"]
    assert field[0][1:4] == ["88.4", "-113.5", "-0.5"]


def test_the_header_and_what_is_lost_are_said(printed: str) -> None:
    lines = printed.replace("\r", "").splitlines()
    assert lines.count(HEADER) >= 3
    assert "# the LSM6DS3 does not answer: starting it again" in lines


def test_the_stream_is_understood_without_a_question(printed: str) -> None:
    """Counts of two sensors, µT of the third at 80 Hz."""
    intake = Intake()
    readings = intake.feed(printed.encode(), 0.0)
    assert intake.needs == ()
    assert readings is not None
    assert readings.accelerometer.unit == "count"
    assert readings.magnetometer is not None
    assert readings.magnetometer.unit == "uT"
    assert readings.magnetometer.values[-1] == pytest.approx([88.4, -113.5, -0.5])
    assert readings.magnetometer.rate == pytest.approx(80.0, rel=0.06)
    assert len(readings.accelerometer) > 15 * len(readings.magnetometer)


def test_its_log_is_a_recording(printed: str, tmp_path: Path) -> None:
    """What a terminal program wrote down reads the same."""
    path = tmp_path / "log.csv"
    path.write_text("".join(f"{line}\n" for line in printed.splitlines() if "page" not in line))
    readings = read_files([path])
    assert readings.magnetometer is not None
    assert readings.magnetometer.rate == pytest.approx(80.0, rel=0.06)
    assert np.isfinite(readings.accelerometer.values).all()


def test_the_chips_are_set_as_documented(printed: str) -> None:
    """1666 Hz, ±4 g, ±500 °/s; both bytes of a reading belong together."""
    page = next(line.split()[3:] for line in printed.splitlines() if line.startswith("# page 0"))
    assert (page[0x10], page[0x11], page[0x12]) == ("88", "84", "44")
