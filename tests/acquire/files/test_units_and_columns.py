"""What the columns are and in which unit: said by the header, by the options, or asked for."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.decode.vocabulary import column_of_name
from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.errors import RecordingError, UsageError
from imucal_wizard.core.limits.data_quality import RESTART_GAP_SECONDS
from imucal_wizard.core.units import STANDARD_GRAVITY
from tests.acquire.files.lines import HEADER, samples, write


def test_the_contract_csv_gives_si_values_and_no_warning(tmp_path: Path) -> None:
    values = samples()
    readings = read_files([write(tmp_path / "a.csv", values)])
    assert readings.warnings == ()
    np.testing.assert_allclose(readings.accelerometer.values, values[:, 1:4], atol=1e-6)
    np.testing.assert_allclose(readings.accelerometer.time, values[:, 0], atol=1e-9)
    assert readings.gyroscope is not None
    assert readings.temperature is not None
    assert (readings.accelerometer.unit, readings.gyroscope.unit) == ("m/s^2", "rad/s")
    assert readings.temperature.values.shape == (400, 1)


def test_the_unit_of_the_field_follows_from_all_readings(tmp_path: Path) -> None:
    """A magnet adds 220 uT, so that the first readings look like those of a field in mG."""
    rng = np.random.default_rng(9)
    directions = rng.normal(size=(600, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    values = 48.0 * directions + (-40.0, -220.0, -30.0)
    path = write(tmp_path / "a.csv", values, "mx,my,mz")
    readings = read_files([path], RecordingOptions(rate=50.0), field_alone=True)
    assert readings.magnetometer is not None
    assert readings.magnetometer.unit == "uT"
    np.testing.assert_allclose(readings.magnetometer.values, values, atol=1e-6)
    assert any("reads 48, so it is taken as uT" in text for text in readings.warnings)
    assert not any("mG" in text for text in readings.warnings)
    stated = read_files(
        [path], RecordingOptions(rate=50.0, magnetometer_unit="mG"), field_alone=True
    )
    assert stated.magnetometer is not None
    np.testing.assert_allclose(stated.magnetometer.values, 0.1 * values, atol=1e-6)


def test_names_that_are_not_known_are_told_where_the_accelerometer_is_missing(
    tmp_path: Path,
) -> None:
    """As a ROS tool names them: ``tx ty tz`` are the accelerations."""
    rng = np.random.default_rng(9)
    values = rng.normal((0.0, 0.0, 9.8, 0.0, 0.0, 0.0, 30.0, 20.0, -30.0), 0.01, (400, 9))
    path = write(tmp_path / "a.csv", values, "tx,ty,tz,wx,wy,wz,mx,my,mz")
    options = RecordingOptions(rate=50.0, gyroscope_unit="rad/s")
    readings = read_files([path], options, field_alone=True)
    assert len(readings.accelerometer) == 0
    assert any("tx, ty, tz are not used" in text for text in readings.warnings)


def test_a_field_in_whole_numbers_beside_counts_is_in_counts(tmp_path: Path) -> None:
    rng = np.random.default_rng(9)
    values = np.round(rng.normal((0.0, 0.0, 16384.0, 200.0, -180.0, 150.0), 3.0, (400, 6)))
    path = write(tmp_path / "a.csv", values, "ax,ay,az,mx,my,mz")
    readings = read_files([path], RecordingOptions(rate=50.0))
    assert readings.magnetometer is not None
    assert readings.magnetometer.unit == "count"


@pytest.mark.parametrize(
    ("accelerometer", "per_si", "gyroscope", "rate_per_si", "time", "ticks"),
    [
        ("g", 1 / STANDARD_GRAVITY, "deg/s", 180 / np.pi, "ms", 1e3),
        ("mg", 1000 / STANDARD_GRAVITY, "mdeg/s", 180e3 / np.pi, "us", 1e6),
    ],
)
def test_units_in_the_header_are_converted(
    tmp_path: Path,
    accelerometer: str,
    per_si: float,
    gyroscope: str,
    rate_per_si: float,
    time: str,
    ticks: float,
) -> None:
    values = samples()
    scaled = values * np.array([ticks, *[per_si] * 3, *[rate_per_si] * 3, 1.0])
    a, g = f"[{accelerometer}]", f"[{gyroscope}]"
    header = f"t[{time}],ax{a},ay{a},az{a},gx{g},gy{g},gz{g},temp[degC]"
    readings = read_files([write(tmp_path / "a.csv", scaled, header)])
    assert readings.gyroscope is not None
    np.testing.assert_allclose(readings.accelerometer.values, values[:, 1:4], atol=2e-5)
    np.testing.assert_allclose(readings.gyroscope.values, values[:, 4:7], atol=2e-6)
    assert readings.accelerometer.rate == pytest.approx(100.0)


def test_columns_may_stand_in_any_order_and_some_may_be_missing(tmp_path: Path) -> None:
    values = samples()
    order = [7, 3, 1, 2, 0]
    header = ",".join(HEADER.split(",")[i] for i in order)
    readings = read_files([write(tmp_path / "a.csv", values[:, order], header)])
    np.testing.assert_allclose(readings.accelerometer.values, values[:, 1:4], atol=1e-6)
    assert readings.gyroscope is None


@pytest.mark.parametrize("separator", [",", ";", "\t", " ", ", "])
def test_any_usual_separator_is_recognised(tmp_path: Path, separator: str) -> None:
    values = samples()
    header = HEADER.replace(",", separator)
    readings = read_files([write(tmp_path / "a.csv", values, header, separator)])
    np.testing.assert_allclose(readings.accelerometer.values, values[:, 1:4], atol=1e-6)


def test_comments_may_stand_anywhere(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", samples())
    lines = path.read_text().splitlines()
    path.write_text("\n".join(["# made by hand", *lines[:50], "# a pause", *lines[50:], ""]))
    readings = read_files([path])
    assert len(readings) == 400
    assert readings.warnings == ()


def test_a_header_in_a_comment_counts(tmp_path: Path) -> None:
    readings = read_files([write(tmp_path / "a.csv", samples(), "# " + HEADER)])
    assert len(readings) == 400


def test_a_log_that_begins_in_mid_line_and_repeats_its_header_is_read(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", samples())
    header, *lines = path.read_text().splitlines()
    path.write_text("\n".join(["3,9.81,0.1", *lines[:100], header, *lines[100:], header, ""]))
    readings = read_files([path])
    assert len(readings) == 400


@pytest.mark.parametrize(
    ("name", "channel", "unit"),
    [
        ("temp", "temp", "degC"),
        ("temp[K]", "temp", "K"),
        ("ax[furlong]", "ax", "furlong"),
        ("gx [m/s^2]", "gx", "m/s^2"),
        ("mag_y [µT]", "my", "uT"),
        ("humidity [%]", "", ""),
    ],
)
def test_a_unit_in_a_file_is_kept_as_it_was_written(name: str, channel: str, unit: str) -> None:
    """Also one that the sensor cannot have, so that it is refused by its name."""
    found = column_of_name(name)
    assert (found.channel, found.unit) == (channel, unit)


@pytest.mark.parametrize(
    ("gravity", "whole", "unit", "size"),
    [
        (9.80665, False, "m/s^2", 9.80665),
        (1.0, False, "m/s^2", 9.80665),
        (1000.0, False, "m/s^2", 9.80665),
        (1000.0, True, "m/s^2", 9.80665),
        (8192.0, True, "count", 8192.0),
        (256.0, True, "count", 256.0),
    ],
)
def test_the_acceleration_unit_is_guessed_by_gravity_and_the_guess_is_told(
    tmp_path: Path, gravity: float, whole: bool, unit: str, size: float
) -> None:
    values = samples(gravity=gravity)[:, :4]
    if whole:
        values[:, 1:] = np.round(values[:, 1:])
    readings = read_files([write(tmp_path / "a.csv", values, "t[s],acc_x,acc_y,acc_z")])
    assert readings.accelerometer.unit == unit
    assert np.median(readings.accelerometer.values[:, 2]) == pytest.approx(size, rel=1e-3)
    assert any("Gravity reads" in text for text in readings.warnings)


def test_a_size_of_gravity_that_fits_no_unit_is_asked_for(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", samples(gravity=42.42)[:, :4], "t[s],ax,ay,az")
    with pytest.raises(RecordingError, match=r"Gravity reads 42\.4"):
        read_files([path])


def test_the_gyroscope_unit_is_never_guessed(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", samples()[:, :7], "t,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z")
    with pytest.raises(RecordingError, match=r"unit of the gyroscope.* one of rad/s"):
        read_files([path])
    readings = read_files([path], RecordingOptions(gyroscope_unit="deg/s"))
    assert readings.gyroscope is not None
    expected = np.radians(samples()[:, 4:7])
    np.testing.assert_allclose(readings.gyroscope.values, expected, atol=1e-7)


@pytest.mark.parametrize(("gravity", "looks"), [(1000.0, "mg"), (1.0, "g")])
def test_gravity_that_contradicts_the_stated_unit_is_warned_about(
    tmp_path: Path, gravity: float, looks: str
) -> None:
    readings = read_files([write(tmp_path / "a.csv", samples(gravity=gravity))])
    assert any(f"looks like {looks} taken for m/s^2" in text for text in readings.warnings)


def test_without_a_header_the_message_gives_the_whole_command(tmp_path: Path) -> None:
    path = write(tmp_path / "my log.txt", samples()[:, 1:7], "", " ")
    with pytest.raises(RecordingError) as caught:
        read_files([path])
    assert caught.value.settings == (
        "columns ax,ay,az,gx,gy,gz",
        "rate 100",
        "gyroscope_unit rad/s",
    )


def test_without_a_header_the_options_say_what_the_columns_are(tmp_path: Path) -> None:
    values = samples(gravity=1.0)
    path = write(tmp_path / "a.txt", values[:, 1:], "", " ")
    options = RecordingOptions(("ax", "ay", "az", "gx", "gy", "gz", "-"), 50.0, "g", "deg/s")
    readings = read_files([path], options)
    assert readings.accelerometer.rate == pytest.approx(50.0)
    assert np.median(readings.accelerometer.values[:, 2]) == pytest.approx(9.80665, rel=1e-3)
    assert readings.temperature is None


def test_columns_that_are_all_left_out_are_wrong_options(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", samples())
    with pytest.raises(RecordingError, match="leave every column out; name at least ax,ay,az"):
        read_files([path], RecordingOptions(("-",) * 8))


def test_without_time_and_rate_the_rate_is_asked_for(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", samples()[:, 1:4], "ax[g],ay[g],az[g]")
    with pytest.raises(RecordingError, match="samples per second") as caught:
        read_files([path])
    assert caught.value.settings == ("rate 100",)


@pytest.mark.parametrize(
    ("header", "columns", "says"),
    [
        ("t[s],ax[g],ay[g]", 3, "az is missing"),
        ("t[s],ax[g],ay[g],ax[g]", 4, "Two columns are ax"),
        ("t[s],ax[V],ay[V],az[V]", 4, "'V' of column 'ax\\[V\\]' is not a unit"),
        ("t[h],ax[g],ay[g],az[g]", 4, "not a unit of time"),
        ("t[s],ax[g],ay[g],az[count]", 4, "only some axes"),
        ("t[s],ax[g],ay[g],az[g]", 5, "4 columns are named.* has 5"),
        ("t[s],gx[rad/s],gy[rad/s],gz[rad/s]", 4, "there is no accelerometer, only gyroscope"),
        ("t[s],mx[uT],my[uT],mz[uT]", 4, "a magnetometer alone is fitted"),
        ("one,two,three,four", 4, "without known names"),
    ],
)
def test_what_a_header_lacks_is_named(tmp_path: Path, header: str, columns: int, says: str) -> None:
    path = write(tmp_path / "a.csv", samples()[:, :columns], header)
    with pytest.raises(RecordingError, match=says):
        read_files([path])


def test_an_option_with_a_unit_that_is_none_is_named(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", samples())
    with pytest.raises(UsageError, match="'g' is not a unit of the gyroscope"):
        read_files([path], RecordingOptions(gyroscope_unit="g"))


def test_a_temperature_in_another_unit_does_no_harm(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", samples(), HEADER.replace("degC", "K"))
    readings = read_files([path])
    assert readings.temperature is None
    assert any("the temperature was left out: 'K'" in text for text in readings.warnings)


@pytest.mark.parametrize(
    ("name", "value", "unit", "read_as"),
    [
        ("current[A]", 2.5, "A", 2.5),
        ("current[mA]", 2500.0, "A", 2.5),
        ("throttle[%]", 40.0, "%", 40.0),
        ("Throttle (percent)", 40.0, "%", 40.0),
    ],
)
def test_a_current_or_throttle_is_read_beside_the_sensors(
    name: str, value: float, unit: str, read_as: float, tmp_path: Path
) -> None:
    values = samples()
    values[:, -1] = value
    path = write(tmp_path / "a.csv", values, HEADER.replace("temp[degC]", name))
    current = read_files([path]).current
    assert current is not None
    assert current.unit == unit
    np.testing.assert_allclose(current.values, read_as)


def test_a_current_without_a_unit_is_left_out_with_a_warning(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", samples(), HEADER.replace("temp[degC]", "current"))
    readings = read_files([path])
    assert readings.current is None
    assert any("write A or mA" in text for text in readings.warnings)


def test_a_field_in_arbitrary_units_is_read_as_counts(tmp_path: Path) -> None:
    header = HEADER.replace("temp[degC]", "mx[a.u.],my[a.u.],mz[a.u.]")
    values = np.column_stack([samples()[:, :7], np.tile([0.4, 0.1, -0.8], (400, 1))])
    readings = read_files([write(tmp_path / "a.csv", values, header)])
    assert readings.magnetometer is not None
    assert readings.magnetometer.unit == "count"


def test_files_with_different_sensors_become_one_recording(tmp_path: Path) -> None:
    slow, fast = samples(400, 80.0), samples(8000, 1600.0)
    first = write(tmp_path / "acc.csv", slow[:, :4], ",".join(HEADER.split(",")[:4]))
    header = "t[s],gx[rad/s],gy[rad/s],gz[rad/s]"
    second = write(tmp_path / "gyr.csv", fast[:, [0, 4, 5, 6]], header)
    for order in itertools.permutations([first, second]):
        readings = read_files(order)
        assert readings.gyroscope is not None
        assert (len(readings), len(readings.gyroscope)) == (400, 8000)
        assert readings.gyroscope.rate == pytest.approx(1600.0, rel=1e-2)


def test_files_with_the_same_sensors_follow_one_another(tmp_path: Path) -> None:
    """One file for each position, each with times from zero."""
    turned = samples()
    turned[:, 1:4] = turned[:, [3, 1, 2]]
    first, second = write(tmp_path / "z.csv", samples()), write(tmp_path / "x.csv", turned)
    readings = read_files([first, second])
    assert readings.gyroscope is not None
    assert len(readings) == 800
    assert readings.gyroscope.time is readings.accelerometer.time
    steps = np.diff(readings.accelerometer.time)
    assert steps.min() > 0.0
    assert steps.max() == pytest.approx(RESTART_GAP_SECONDS)
    assert readings.warnings == ()


def test_a_sensor_in_two_of_different_files_is_refused(tmp_path: Path) -> None:
    both = write(tmp_path / "a.csv", samples())
    one = write(tmp_path / "b.csv", samples()[:, :4], ",".join(HEADER.split(",")[:4]))
    with pytest.raises(RecordingError, match="both hold the accelerometer"):
        read_files([both, one])
    with pytest.raises(RecordingError, match="the same samples as another file"):
        read_files([both, both])


def test_files_of_the_same_sensors_with_dates_follow_one_another_by_them(tmp_path: Path) -> None:
    early, late = samples(), samples()
    early[:, 0] += 1.7e9
    late[:, 0] += 1.7e9 + 60.0
    late[:, 1:4] = late[:, [3, 1, 2]]
    first, second = write(tmp_path / "z.csv", early), write(tmp_path / "x.csv", late)
    readings = read_files([second, first])
    assert readings.accelerometer.values[0, 2] > 9.0
    assert readings.accelerometer.values[-1, 0] > 9.0


def test_files_of_the_same_sensors_may_differ_in_what_is_beside_them(tmp_path: Path) -> None:
    bare = samples()[:, :7]
    bare[:, 1:4] = bare[:, [3, 1, 2]]
    paths = [
        write(tmp_path / "a.csv", samples()),
        write(tmp_path / "b.csv", bare, HEADER.rpartition(",")[0]),
    ]
    readings = read_files(paths)
    assert readings.temperature is not None
    assert (len(readings), len(readings.temperature)) == (800, 400)


def test_two_devices_that_recorded_at_once_are_no_session(tmp_path: Path) -> None:
    one, other = samples(), samples()
    one[:, 0] += 1.7e9
    other[:, 0] += 1.7e9 + 2.0
    other[:, 1:4] += 0.3
    paths = [write(tmp_path / "a.csv", one), write(tmp_path / "b.csv", other)]
    with pytest.raises(RecordingError, match="recorded at once"):
        read_files(paths)


def test_files_whose_times_do_not_meet_are_refused(tmp_path: Path) -> None:
    late = samples()
    late[:, 0] += 1000.0
    first = write(tmp_path / "a.csv", samples()[:, :4], ",".join(HEADER.split(",")[:4]))
    second = write(tmp_path / "b.csv", late[:, [0, 4, 5, 6]], "t[s],gx[rad/s],gy[rad/s],gz[rad/s]")
    with pytest.raises(RecordingError, match="do not overlap"):
        read_files([first, second])


def test_no_file_and_an_unknown_format_are_wrong_usage(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="name at least one file"):
        read_files([])
    with pytest.raises(UsageError, match="format nothing is not known"):
        read_files([write(tmp_path / "a.csv", samples())], RecordingOptions(as_format="nothing"))
