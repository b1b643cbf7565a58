"""What well-known firmware prints is recognised by itself, with the right columns and units."""

import numpy as np
import pytest

from imucal_wizard.acquire.intake import Intake
from imucal_wizard.acquire.setup import StreamSetup
from tests.acquire.firmware import ASKING, DPS, FIRMWARE, heard
from tests.acquire.streams import same


@pytest.mark.parametrize("firmware", FIRMWARE)
def test_the_firmware_is_recognised_and_read_without_a_question(firmware: str) -> None:
    name, sample, acceleration, rate = FIRMWARE[firmware]
    intake, readings = heard(sample)
    assert intake.format == name
    assert intake.needs == ()
    assert intake.malformed == 0
    assert readings is not None
    assert readings.gyroscope is not None
    np.testing.assert_allclose(readings.accelerometer.values[-1], acceleration, rtol=1e-9)
    np.testing.assert_allclose(readings.gyroscope.values[-1], rate, rtol=1e-9)


@pytest.mark.parametrize("firmware", ASKING)
def test_where_the_gyroscope_unit_is_not_said_only_that_is_asked(firmware: str) -> None:
    name, sample, acceleration = ASKING[firmware]
    intake, _ = heard(sample)
    assert (intake.format, intake.needs) == (name, ("gyroscope unit",))
    answered, readings = intake.reconfigured(StreamSetup(gyroscope_unit="deg/s"))
    assert answered.ready
    assert readings is not None
    np.testing.assert_allclose(readings.accelerometer.values[-1], acceleration, rtol=1e-9)
    stored, again = intake.reconfigured(answered.setup)
    assert again is not None
    assert same(readings, again)
    assert stored.rate == answered.rate


def test_slower_lines_belong_to_the_next_sample_only() -> None:
    def sample(i: int) -> bytes:
        slow = b"T,%d,25.5\r\nM,1,0.1,0.2,0.3\r\n" % i if i % 10 == 0 else b""
        return slow + b"I,%d,0.1,-0.2,0.3,0.0,0.01,0.9985\r\n" % (1_000_000 + i * 10_000)

    intake, readings = heard(sample)
    assert intake.format == "ximu3"
    assert readings is not None
    assert readings.temperature is not None
    assert readings.magnetometer is not None
    assert len(readings) == 300
    assert len(readings.temperature) == len(readings.magnetometer) == 30
    assert intake.rate == pytest.approx(100.0)


def test_a_format_without_signs_of_its_own_is_chosen_by_name() -> None:
    line = b"%d, 0.01, -0.02, 1.00, 0.12, -0.06, 0.00, 21.30, -8.10, -40.20\r\n"
    _, readings = heard(lambda i: line % (12345 + i * 10), StreamSetup(format="razor-m0"))
    assert readings is not None
    assert readings.gyroscope is not None
    assert readings.gyroscope.values[0, 0] == pytest.approx(0.12 * DPS)


def test_the_fields_of_a_ros_message_are_read_from_json() -> None:
    line = (
        b'{"header":{"seq":%d},"angular_velocity":{"x":0.1,"y":0.2,"z":0.3},'
        b'"linear_acceleration":{"x":0.1,"y":-0.2,"z":9.8}}\n'
    )
    intake, readings = heard(lambda i: line % i, StreamSetup(gyroscope_unit="rad/s"))
    assert intake.format == "json"
    assert readings is not None
    assert readings.gyroscope is not None
    np.testing.assert_allclose(readings.accelerometer.values[0], [0.1, -0.2, 9.8])
    np.testing.assert_allclose(readings.gyroscope.values[0], [0.1, 0.2, 0.3])


def test_yaw_pitch_and_roll_are_not_taken_for_a_gyroscope() -> None:
    """Words say that the first three are angles, gravity that the last three are accelerations."""
    intake, _ = heard(b"ypr\t1.20\t-2.10\t3.30\tacc\t0.10\t0.20\t9.80\r\n")
    assert [c.channel for c in intake.columns] == ["", "", "", "ax", "ay", "az"]
    intake, _ = heard(b"ypr\t1.20\t-2.10\t3.30\tareal\t0.10\t0.20\t9.80\r\n")
    assert intake.needs == ("columns",)


def test_a_boot_banner_does_not_mislead() -> None:
    banner = (
        b"ets Jun  8 2016 00:22:57\r\nrst:0x1 (POWERON_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)\r\n"
        b"configsip: 0, SPIWP:0xee\r\nload:0x3fff0030,len:1184\r\nentry 0x400805f0\r\n"
        b"Accelerometer sample rate = 119.00 Hz\r\nI (312) main: start\r\nX\tY\tZ\r\n"
    )
    intake = Intake()
    intake.feed(banner, 0.0)
    for i in range(300):
        intake.feed(b"0.01\t-0.02\t1.00\r\n", i * 0.01)
    assert intake.format == "csv"
    assert intake.ready
    assert intake.malformed == 0
