"""A slow sensor in the lines of a fast one: its fields are empty in most of them."""

import pytest

from imucal_wizard.acquire.intake import Intake
from imucal_wizard.core.readings import join_readings

IMU = "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2]", "gx[rad/s],gy[rad/s],gz[rad/s]"
FIELD = "mx[uT],my[uT],mz[uT]"
HEADERS = {"last": f"{IMU[0]},{IMU[1]},{FIELD}", "between": f"{IMU[0]},{FIELD},{IMU[1]}"}


@pytest.mark.parametrize("place", HEADERS)
def test_lines_without_a_sample_of_the_field_are_samples_of_the_others(place: str) -> None:
    """Also where the empty fields are the last of the line."""
    lines = [HEADERS[place]]
    for i in range(2000):
        field = f"{20 + i % 7}.5,-3.25,40.125" if i % 20 == 0 else ",,"
        force, rate = f"0.{i % 10},0.2,9.8", f"0.01,0.0{i % 9},0.03"
        parts = (force, rate, field) if place == "last" else (force, field, rate)
        lines.append(f"{i / 1000:.4f}," + ",".join(parts))
    intake = Intake()
    readings = intake.feed("\r\n".join([*lines, ""]).encode(), 0.0)
    assert readings is not None
    assert len(readings.accelerometer) == 2000
    assert intake.malformed == 0
    assert readings.magnetometer is not None
    assert len(readings.magnetometer) == 100
    assert readings.magnetometer.values[1] == pytest.approx([20 + 20 % 7 + 0.5, -3.25, 40.125])


def test_a_current_that_comes_seldom_is_not_replaced_by_the_throttle_meanwhile() -> None:
    """In most pieces of the stream there is no current at all."""
    intake, parts = Intake(), []
    for i in range(600):
        header = f"{IMU[0]},current[A],throttle[%]\n" if i == 0 else ""
        current = "2.5" if i % 50 == 0 else ""
        line = f"{header}{i / 100:.3f},0.{i % 10},0.2,9.8,{current},40\n"
        parts.append(intake.feed(line.encode(), i / 100))
    readings = join_readings([part for part in parts if part is not None])
    assert readings.current is not None
    assert (readings.current.unit, len(readings.current)) == ("A", 12)
    assert set(readings.current.values[:, 0]) == {2.5}


def test_one_separator_too_many_is_still_no_field() -> None:
    """A line that ends in a comma and has all its fields."""
    lines = ["t[s],ax[m/s^2],ay[m/s^2],az[m/s^2]"]
    lines += [f"{i / 100:.3f},0.{i % 10},0.2,9.8," for i in range(300)]
    intake = Intake()
    readings = intake.feed("\n".join([*lines, ""]).encode(), 0.0)
    assert readings is not None
    assert len(readings.accelerometer) == 300
    assert intake.malformed == 0
