"""What the sketches print is the contract's CSV, and the program reads it without a question."""

import re

import numpy as np
import pytest

from imucal_wizard.acquire.intake import Intake
from imucal_wizard.core.units import STANDARD_GRAVITY
from tests.firmware.sketches import needs_compiler, printed_by

HEADER = "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s],gz[rad/s],temp[degC]"
CHIPS = {"bno055_csv": "CHIP_BNO055", "lsm6ds3_csv": "CHIP_LSM6DS3"}
WANTED = {
    "bno055_csv": ([9.81, -0.12, -0.05], np.radians([1.0, -2.0, 1.0 / 16.0]), -3.0, 100.0),
    "lsm6ds3_csv": (
        np.array([8197, -100, -1]) * 0.122e-3 * STANDARD_GRAVITY,
        np.radians(np.array([57, -114, 1]) * 0.0175),
        24.0,
        104.0,
    ),
}
pytestmark = needs_compiler


@pytest.fixture(scope="module", params=CHIPS)
def run(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, str]:
    """The name of a sketch, and what it printed in twelve seconds."""
    name = str(request.param)
    return name, printed_by(name, CHIPS[name], tmp_path_factory.mktemp("sketch"))


def test_it_speaks_at_the_speed_that_the_program_expects(run: tuple[str, str]) -> None:
    assert run[1].startswith("# baud 115200\n")


def test_the_header_comes_at_the_start_every_five_seconds_and_when_asked(
    run: tuple[str, str],
) -> None:
    lines = run[1].replace("\r", "").splitlines()
    places = [i for i, line in enumerate(lines) if line == HEADER]
    times = [
        float(lines[place + 1].split(",")[0]) for place in places if lines[place + 1][0] != "#"
    ]
    assert times[0] < 0.05
    assert any(2.0 <= time < 2.05 for time in times)
    assert max(np.diff([*times, 12.0])) < 5.1


def test_every_line_has_all_columns_with_enough_digits(run: tuple[str, str]) -> None:
    pattern = re.compile(r"\d+\.\d{6}(,-?\d+\.\d{5}){3}(,-?\d+\.\d{6}){3},-?\d+(\.\d+)?")
    lines = run[1].replace("\r", "").splitlines()
    data = [line for line in lines if line != HEADER and not line.startswith("#")]
    assert len(data) > 1000
    assert [line for line in data if not pattern.fullmatch(line)] == []


def test_a_chip_that_is_away_is_named_and_taken_up_again(run: tuple[str, str]) -> None:
    name, printed = run
    chip = name.removesuffix("_csv").upper()
    assert f"# the {chip} does not answer: starting it again" in printed
    before, after = printed.split("does not answer", 1)
    assert before.count("\n") > 700
    assert after.count("\n") > 150


def test_the_program_reads_it_in_si_without_a_question(run: tuple[str, str]) -> None:
    name, printed = run
    force, rate, temperature, hertz = WANTED[name]
    intake = Intake()
    readings = intake.feed(printed.encode(), 0.0)
    assert intake.needs == ()
    assert readings is not None
    assert readings.gyroscope is not None
    assert readings.temperature is not None
    assert readings.accelerometer.values[-1] == pytest.approx(force, abs=1e-5)
    assert readings.gyroscope.values[-1] == pytest.approx(rate, abs=1e-6)
    assert readings.temperature.values[-1, 0] == temperature
    assert intake.rate == pytest.approx(hertz, rel=0.01)
    time = readings.accelerometer.time
    assert time[-1] - time[0] == pytest.approx(12.0, abs=0.1)  # across the wrap of micros()
    assert float(np.diff(time).max()) < 1.6  # the chip was away for half a second


def test_the_chip_is_set_to_give_raw_readings_in_the_range_that_is_documented(
    run: tuple[str, str],
) -> None:
    name, printed = run
    pages = [line.split()[3:] for line in printed.splitlines() if line.startswith("# page")]
    if name == "bno055_csv":
        assert pages[0][0x3D] == "07"  # accelerometer, magnetometer, gyroscope; no fusion
        assert pages[0][0x3B] == "00"  # m/s^2, deg/s, degC
        assert (pages[1][0x08], pages[1][0x0A]) == ("0D", "38")  # 4 g, 2000 deg/s
    else:
        assert (pages[0][0x10], pages[0][0x11]) == ("48", "44")  # 104 Hz; 4 g, 500 deg/s
        assert pages[0][0x12] == "44"  # both bytes of a reading belong together
