"""What well-known firmware prints is recognised by itself, with the right columns and units."""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imucal_wizard.devices.formats import decoder_for, format_names
from imucal_wizard.devices.formats.labels import described
from imucal_wizard.devices.formats.names import column, header
from imucal_wizard.devices.intake import Intake, StreamSetup
from imucal_wizard.readings import Readings, join
from tests.devices.streams import same
from tests.shared_data import shared_data

G = 9.80665
DPS = math.pi / 180


def heard(
    sample: Callable[[int], bytes] | bytes, setup: StreamSetup | None = None, count: int = 300
) -> tuple[Intake, Readings | None]:
    """An Intake that has heard some samples, 100 each second."""
    intake = Intake(setup)
    parts = []
    for i in range(count):
        data = sample if isinstance(sample, bytes) else sample(i)
        parts.append(intake.feed(data, i * 0.01))
    there = [p for p in parts if p is not None]
    return intake, join(there) if there else None


FIRMWARE: dict[str, tuple[str, bytes, list[float], list[float]]] = {
    "Adafruit_MPU6050 basic_readings": (
        "adafruit-mpu6050",
        (
            b"Acceleration X: 0.12, Y: -0.45, Z: 9.76 m/s^2\r\nRotation X: -0.02, Y: 0.01, Z: 0.00 "
            b"rad/s\r\nTemperature: 27.31 degC\r\n\r\n"
        ),
        [0.12, -0.45, 9.76],
        [-0.02, 0.01, 0.0],
    ),
    "Adafruit_BNO055 read_all_data": (
        "adafruit-bno055",
        (
            b"Accl:\tx= -0.12 |\ty= 0.33 |\tz= 9.71\r\nGyro:\tx= 0.06 |\ty= -0.06 |\tz= 0.00\r\n"
            b"Mag:\tx= -12.44 |\ty= 30.06 |\tz= -41.75\r\n"
        ),
        [-0.12, 0.33, 9.71],
        [0.06 * DPS, -0.06 * DPS, 0],
    ),
    "SparkFun ICM-20948 scaled": (
        "sparkfun-scaled",
        (
            b"Scaled. Acc (mg) [ -00069.34, -00276.37,  00965.82 ], Gyr (DPS) [ -00000.31,  "
            b" 00001.22, -00000.05 ], Mag (uT) [ -00028.05, -00051.00,  00032.40 ], "
            b"Tmp (C) [  00026.31 ]\r\n"
        ),
        [-0.06934 * G, -0.27637 * G, 0.96582 * G],
        [-0.31 * DPS, 1.22 * DPS, -0.05 * DPS],
    ),
    "SparkFun ICM-20948 raw": (
        "sparkfun-raw",
        (
            b"RAW. Acc [ -01136, -04528,  15824 ], Gyr [ -00041,  00160, -00007 ], Mag [ -00187, "
            b"-00340,  00216 ], Tmp [  01773 ]\r\n"
        ),
        [-1136, -4528, 15824],
        [-41, 160, -7],
    ),
    "i2cdevlib": (
        "i2cdev",
        b"a/g:\t-212\t1044\t16288\t-23\t11\t2\r\n",
        [-212, 1044, 16288],
        [-23, 11, 2],
    ),
    "Razor AHRS": (
        "razor-ahrs",
        b"#A-R=-21.00,4.00,251.00\r\n#M-R=91.00,-13.00,-480.00\r\n#G-R=-42.00,96.00,-18.00\r\n",
        [21, -4, -251],
        [-42, 96, -18],
    ),
    "MotionCal": (
        "raw-uni",
        (
            b"Raw:-58,-815,8362,76,-121,-95,-375,-159,-24\r\n"
            b"Uni:-0.07,-0.98,10.00,0.0832,-0.1327,-0.1046,-37.50,-15.93,-2.50\r\n"
        ),
        [-58 * 9.8 / 8192, -815 * 9.8 / 8192, 8362 * 9.8 / 8192],
        [0.0832, -0.1327, -0.1046],
    ),
    "MotionCal, Uni: alone": (
        "uni",
        b"Uni:-0.07,-0.98,10.00,0.0832,-0.1327,-0.1046,-37.50,-15.93,-2.50\r\n",
        [-0.07, -0.98, 10.0],
        [0.0832, -0.1327, -0.1046],
    ),
    "VectorNav VNIMU": (
        "vnimu",
        (
            b"$VNIMU,-00.0350,+00.4222,-00.6643,-00.015,+00.019,+09.948,+00.002066,-00.008442,"
            b"-00.044656,+20.7,+084.322*66\r\n"
        ),
        [-0.015, 0.019, 9.948],
        [0.002066, -0.008442, -0.044656],
    ),
    "OpenLog Artemis": (
        "openlog-artemis",
        (
            b"rtcDate,rtcTime,aX,aY,aZ,gX,gY,gZ,mX,mY,mZ,imu_degC,output_Hz,\r\n"
            b"01/07/2000,16:18:45.54,-638.67,153.32,782.23,-1.69,1.47,-0.42,21.45,37.80,-5.85,9.77,"
            b"1.00,\r\n"
        ),
        [-0.63867 * G, 0.15332 * G, 0.78223 * G],
        [-1.69 * DPS, 1.47 * DPS, -0.42 * DPS],
    ),
    "own labels with units": (
        "labels",
        b"acc=[0.10,0.20,9.80] m/s^2 gyro=[1.0,2.0,3.0] deg/s T=25.1 C\r\n",
        [0.1, 0.2, 9.8],
        [DPS, 2 * DPS, 3 * DPS],
    ),
}


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


@pytest.mark.parametrize("firmware", FIRMWARE)
def test_the_cuts_do_not_matter_to_any_format(firmware: str) -> None:
    name, sample, *_ = FIRMWARE[firmware]
    data = sample * 60
    one, other = decoder_for(name), decoder_for(name)
    whole = one.feed(data)
    pieces = [other.feed(data[i : i + 7]) for i in range(0, len(data), 7)]
    parts = [p.values for p in pieces if len(p.values)]
    np.testing.assert_array_equal(np.concatenate(parts), whole.values)
    assert sum(p.malformed for p in pieces) == whole.malformed
    assert pieces[-1].decimals == whole.decimals


ASKING: dict[str, tuple[str, bytes, list[float]]] = {
    "Adafruit_MPU6050 plotter": (
        "labels",
        b"AccelX:0.12,AccelY:-0.45,AccelZ:9.76, GyroX:-0.02,GyroY:0.01,GyroZ:0.00\r\n",
        [0.12, -0.45, 9.76],
    ),
    "CircuitPython tuple": (
        "csv",
        b"(0.12, -0.45, 9.76 , -0.02, 0.01, 0.00)\r\n",
        [0.12, -0.45, 9.76],
    ),
    "tabs": ("csv", b"0.01\t-0.02\t1.00\t0.1\t0.2\t0.3\r\n", [0.01 * G, -0.02 * G, G]),
    "blanks": ("csv", b"10 -20 1000 0.1 0.2 0.3\r\n", [0.01 * G, -0.02 * G, G]),
    "JSON": (
        "json",
        b'{"ax":0.12,"ay":-0.45,"az":9.76,"gx":-0.02,"gy":0.01,"gz":0.0}\r\n',
        [0.12, -0.45, 9.76],
    ),
    "nested JSON": (
        "json",
        b'{"imu":{"acc":[0.12,-0.45,9.76],"gyro":{"x":0,"y":0.01,"z":0.5}},"ok":true}\n',
        [0.12, -0.45, 9.76],
    ),
    "words in front": (
        "labels",
        b"Sensor readings with offsets:\t-0.01\t0.00\t9.81\t0.00\t0.00\t-0.00\r\n",
        [-0.01, 0.0, 9.81],
    ),
    "letters": ("labels", b"a 0.1 0.2 9.8 g 1.0 2.0 3.0\r\n", [0.1, 0.2, 9.8]),
}


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


def test_a_wrong_checksum_is_malformed_and_loses_one_sample() -> None:
    good = FIRMWARE["VectorNav VNIMU"][1]
    rows = decoder_for("vnimu").feed(good * 10 + good.replace(b"+09.948", b"+09.949") + good)
    assert (len(rows.values), rows.malformed) == (11, 1)
    assert rows.skipped[-1] == 1


def test_a_lost_line_of_a_block_spoils_one_sample_and_mixes_none() -> None:
    lines = [
        line
        for i in range(20)
        for line in (b"#A-R=%d,0,256\n" % i, b"#M-R=%d,0,0\n" % i, b"#G-R=%d,0,0\n" % i)
    ]
    del lines[31]  # the magnetometer of sample 10
    rows = decoder_for("razor-ahrs").feed(b"".join(lines))
    assert len(rows.values) == 19
    np.testing.assert_array_equal(rows.values[:, 0], -rows.values[:, 6])
    assert rows.malformed == 1


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


@settings(max_examples=40, deadline=None)
@given(data=st.binary(max_size=500))
@pytest.mark.parametrize("name", format_names())
def test_no_bytes_whatever_make_a_decoder_fail(name: str, data: bytes) -> None:
    decoder = decoder_for(name)
    decoder.feed(b"\n" + data)
    decoder.feed(data + b"\n")
    rows = decoder.feed(b"\n" + data + b"\n")
    assert rows.values.shape[1] == len(decoder.columns)


@settings(max_examples=60, deadline=None)
@given(text=st.text(max_size=80))
def test_no_text_whatever_makes_the_reading_of_words_fail(text: str) -> None:
    _, columns = described(text)
    column(text)
    header(text.split(","))
    assert len({c.channel for c in columns if c.channel}) == sum(bool(c.channel) for c in columns)


@pytest.mark.parametrize(
    ("name", "channel", "unit"),
    [
        ("ax[m/s^2]", "ax", "m/s^2"),
        ("AccelX", "ax", ""),
        ("acc_y_mg", "ay", "mg"),
        ("gyro.z [dps]", "gz", "deg/s"),
        ("aX (mg)", "ax", "mg"),
        ("wx[rad/s]", "gx", "rad/s"),
        ("mag_x[uT]", "mx", "uT"),
        ("timestamp_ms", "t", "ms"),
        ("micros", "t", "us"),
        ("temp[degC]", "temp", "degC"),
        ("imu_degC", "temp", "degC"),
        ("count", "counter", ""),
        ("linear_acceleration_x", "", ""),
        ("gravity_x", "", ""),
        ("ax[furlong]", "ax", ""),
        ("pressure_Pa", "", ""),
    ],
)
def test_names_say_channel_and_unit(name: str, channel: str, unit: str) -> None:
    found = column(name)
    assert (found.channel, found.unit) == (channel, unit)


def test_the_real_lines_are_read() -> None:
    lines = shared_data("wire/real_lines.txt").read_bytes().splitlines(keepends=True)
    vectornav = [line for line in lines if line.startswith(b"$VNIMU")]
    assert len(decoder_for("vnimu").feed(b"".join(vectornav)).values) == 2
    long_header = next(i for i, line in enumerate(lines) if line.startswith(b"rtcDate"))
    rows = decoder_for("openlog-artemis").feed(lines[long_header] + lines[long_header + 1])
    assert rows.values[0, 1:5].tolist() == [58725.54, -638.67, 153.32, 782.23]
    short_header = next(i for i, line in enumerate(lines) if line.startswith(b"aX,aY"))
    rows = decoder_for("openlog-artemis").feed(lines[short_header] + lines[short_header + 1])
    assert rows.values[0, :3].tolist() == [933.11, -44.43, -300.29]
    raw = [line for line in lines if line.startswith((b"Raw:", b"Uni:"))]
    assert len(decoder_for("raw-uni").feed(b"".join(raw)).values) == 1


def test_real_binary_captures_are_named_and_not_mistaken_for_text() -> None:
    for path, protocol in (
        ("wire/xsens/einride_1.output.bin", "Xsens"),
        ("wire/vectornav/jerabaul29_F00294_vn100_binary_logger.dat", "VectorNav"),
    ):
        intake = Intake()
        intake.feed(shared_data(path).read_bytes(), 0.0)
        assert not intake.ready
        assert protocol in intake.problem
        assert "text" in intake.problem


SPOIL = st.lists(
    st.tuples(
        st.floats(0, 1),
        st.one_of(st.binary(min_size=1, max_size=20), st.sampled_from([b"\r", b"\x00\n", b"nan"])),
    ),
    max_size=6,
)
STREAMS = {name: entry[1] for name, entry in FIRMWARE.items()}
STREAMS |= {name: entry[1] for name, entry in ASKING.items()}


@settings(max_examples=40, deadline=None)
@given(
    name=st.sampled_from(sorted(STREAMS)),
    spoil=SPOIL,
    cuts=st.lists(st.floats(0, 1), max_size=30),
)
def test_spoilt_streams_too_give_the_same_whatever_the_cuts(
    name: str, spoil: list[tuple[float, bytes]], cuts: list[float]
) -> None:
    data = STREAMS[name] * 60
    for where, what in spoil:
        place = int(where * len(data))
        data = data[:place] + what + data[place:]
    places = sorted({0, len(data), *(int(c * len(data)) for c in cuts)})
    setup = StreamSetup(gyroscope_unit="deg/s", rate=100.0)
    whole, pieces = Intake(setup), Intake(setup)
    one = whole.feed(data, 1.0)
    there = [pieces.feed(data[a:b], 1.0) for a, b in pairwise(places)]
    parts = [part for part in there if part is not None]
    assert (one is None) == (not parts)
    assert (whole.setup, whole.malformed, whole.lost) == (
        pieces.setup,
        pieces.malformed,
        pieces.lost,
    )
    if one is not None:
        assert same(join(parts), one)
        again = Intake(whole.setup).feed(data, 1.0)
        assert again is not None
        assert same(again, one)


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


def test_a_header_that_no_line_fits_is_given_up_and_the_columns_learned() -> None:
    """Lines with a word among their numbers fit neither; they must not be tried for ever."""
    decoder = decoder_for("csv")
    decoder.feed(b"first\nax,ay,az\n" + b"1.0,2.0,3.0,4.0,bad\n" * 5)
    rows = decoder.feed(b"1.0,2.0,3.0,4.0,5.0\n" * 40)
    assert rows.values.shape == (40, 5)


LINE = st.lists(st.sampled_from(["1", "2.5", "-3", "nan", "x", "ax", "10:00:00", ""]), max_size=7)


@settings(max_examples=60, deadline=None)
@given(lines=st.lists(st.tuples(LINE, st.sampled_from([",", ";", "\t", " "])), max_size=60))
def test_lines_of_any_width_and_words_are_read_without_end(
    lines: list[tuple[list[str], str]],
) -> None:
    data = "".join(sign.join(fields) + "\n" for fields, sign in lines).encode()
    intake = Intake(StreamSetup(gyroscope_unit="rad/s"))
    intake.feed(b"begin\n" + data * 3, 0.0)
    assert intake.preview.line.isprintable()
