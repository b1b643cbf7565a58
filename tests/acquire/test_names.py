"""Names decide what a column is; where they say nothing known, nobody guesses in their place."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imucal_wizard.acquire.decode.labelled import describe_line
from imucal_wizard.acquire.decode.vocabulary import column_of_name, header_columns
from imucal_wizard.acquire.intake import Intake
from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.readings import FloatArray
from tests.acquire.streams import at_rest, feed, printed, read
from tests.characters import CHARACTERS

T, A, G = slice(0, 1), slice(1, 4), slice(4, 7)


@pytest.mark.parametrize(
    ("name", "channel", "unit"),
    [
        ("ax[m/s^2]", "ax", "m/s^2"),
        ("AccelX", "ax", ""),
        ("acc_y_mg", "ay", "mg"),
        ("acc_x", "ax", ""),
        ("AccX", "ax", ""),
        ("accel_x", "ax", ""),
        ("gyr_z", "gz", ""),
        ("GyroY", "gy", ""),
        ("gyro_x_dps", "gx", "deg/s"),
        ("gyro_x_rad_s", "gx", "rad/s"),
        ("mag_y [µT]", "my", "uT"),
        ("ax (m/s²)", "ax", "m/s^2"),
        ("n_samples", "counter", ""),
        ("rtcTime", "t", "s"),
        ("humidity_%", "", ""),
        ("part", "", ""),
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
        ("ax[furlong]", "ax", "furlong"),
        ("gx [m/s^2]", "gx", "m/s^2"),
        ("temp", "temp", "degC"),
        ("temp[K]", "temp", "K"),
        ("humidity [%]", "", ""),
        ("pressure_Pa", "", ""),
        ("field.angular_velocity.x", "gx", ""),
        ("/imu/data/angular_velocity/y", "gy", ""),
        ("w_RS_S_z [rad s^-1]", "gz", "rad/s"),
        ("a_RS_S_x [m s^-2]", "ax", "m/s^2"),
        ("accelerometer_m_s2[0]", "ax", "m/s^2"),
        ("gyro_rad[2]", "gz", "rad/s"),
        ("accelerometerAccelerationX(G)", "ax", "g"),
        ("accelerationIncludingGravity.y", "ay", ""),
        ("Shimmer_Accel_LN_X_CAL", "ax", ""),
        ("MAGNETIC FIELD Z (μT)", "mz", "uT"),
        ("x_gyro", "gx", ""),
        ("imu0_acc_z", "az", ""),
        ("rate of turn x", "gx", ""),
        ("Time since start in ms", "t", "ms"),
        ("accelerometerTimestamp_sinceReboot(s)", "t", "s"),
        ("T(°)", "temp", "degC"),
        ("X (rad/s)", "gx", "rad/s"),
        ("x", "", ""),
        ("accelerometer_timestamp_relative", "", ""),
        ("header.stamp.nanosec", "", ""),
        ("gyro_integral_dt", "", ""),
        ("acc_bias_x", "", ""),
        ("user_acceleration_x", "", ""),
        ("linear_acceleration.x", "", ""),
        ("gravity_x", "", ""),
        ("angle_x", "", ""),
        ("AccelX:0.12", "", ""),
    ],
)
def test_a_name_is_understood_or_left_alone(name: str, channel: str, unit: str) -> None:
    found = column_of_name(name)
    assert (found.channel, found.unit) == (channel, unit)


@settings(max_examples=60, deadline=None)
@given(text=st.text(CHARACTERS, max_size=80))
def test_arbitrary_text_does_not_make_the_vocabulary_fail(text: str) -> None:
    _, columns = describe_line(text)
    column_of_name(text)
    header_columns(text.split(","))
    assert len({c.channel for c in columns if c.channel}) == sum(bool(c.channel) for c in columns)


def test_names_that_mean_nothing_are_asked_about_and_shown() -> None:
    """Gravity is plain in the middle three, but the names may say what nobody here knows."""
    rows = printed(at_rest(200)[:, [4, 5, 6, 1, 2, 3]])
    intake, _ = read(b"start\r\nbx,by,bz,fx,fy,fz\r\n" + rows)
    assert intake.needs == ("columns",)
    assert [c.name for c in intake.columns] == ["bx", "by", "bz", "fx", "fy", "fz"]


def test_bare_axes_are_an_accelerometer_where_gravity_says_so() -> None:
    intake, readings = read(b"start\r\ntime,x,y,z\r\n" + printed(at_rest(200)[:, :4]))
    assert intake.needs == ()
    np.testing.assert_allclose(readings.accelerometer.values, at_rest(200)[:, A], atol=1e-6)


def test_an_index_beside_the_time_moves_no_column() -> None:
    values = at_rest(200)
    rows = np.column_stack([np.arange(200.0), values[:, :7]])
    intake, _ = read(printed(rows))
    assert [c.channel for c in intake.columns][:5] == ["counter", "t", "ax", "ay", "az"]


def test_an_unknown_first_column_is_not_skipped() -> None:
    """Seven columns may be an unknown one and two sensors, not two sensors and a temperature."""
    values = at_rest(200)
    rows = np.column_stack([np.full(200, 0.5), values[:, 1:7]])
    intake, _ = read(printed(rows))
    assert intake.needs == ("columns",)


def test_a_second_sensor_of_a_kind_is_named() -> None:
    values = at_rest(200)
    header = b"t[s],imu1_ax,imu1_ay,imu1_az,imu2_ax,imu2_ay,imu2_az\r\n"
    intake, _ = read(header + printed(np.column_stack([values[:, :4], -values[:, A]])))
    assert intake.needs == ("columns",)
    assert any("Two columns are ax: 'imu1_ax' and 'imu2_ax'" in text for text in intake.warnings)


@pytest.mark.parametrize("separator", [";", "|", "\t"])
def test_any_usual_separator_and_quotes_are_understood(separator: str) -> None:
    names = [f"{c}[{u}]" for u, cs in (("m/s^2", "xyz"), ("rad/s", "xyz")) for c in cs]
    header = separator.join(["t[s]", *("ag"[i > 2] + name for i, name in enumerate(names))])
    data = header.encode() + b"\r\n" + printed(at_rest(100)[:, :7], separator=separator)
    assert read(data)[0].samples == 100
    quoted = header.encode() + b"\r\n" + printed(at_rest(100)[:, :7], '"%.6f"', separator)
    assert read(quoted)[0].samples == 100


def test_decimal_commas_between_semicolons_are_understood() -> None:
    header = b"t[s];ax[m/s^2];ay[m/s^2];az[m/s^2]\r\n"
    rows = printed(at_rest(100)[:, :4], separator=";").replace(b".", b",")
    intake, readings = read(header + rows)
    assert intake.malformed == 0
    np.testing.assert_allclose(readings.accelerometer.values, at_rest(100)[:, A], atol=1e-6)


def test_dates_are_a_time() -> None:
    intake = Intake(StreamSetup(gyroscope_unit="rad/s"))
    rows = printed(at_rest(200)[:, 1:7]).splitlines(keepends=True)
    stamped = [b"2024-05-03T10:00:%07.4fZ," % (i / 100) + row for i, row in enumerate(rows)]
    readings = feed(intake, b"timestamp,ax,ay,az,gx,gy,gz\r\n" + b"".join(stamped))
    np.testing.assert_allclose(readings.accelerometer.time, np.arange(200) / 100, atol=1e-4)


def test_the_unit_that_gravity_has_is_proposed_with_the_columns() -> None:
    values = at_rest(200)
    counts: FloatArray = np.hstack([values[:, A] * 1670.0, values[:, G] * 7500.0])
    intake, _ = read(printed(counts, "%.0f"))
    assert intake.needs == ("columns",)
    assert [c.unit for c in intake.columns] == ["count"] * 3 + [""] * 3
