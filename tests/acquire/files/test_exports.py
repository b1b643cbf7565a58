"""What well-known programs export is read by the names in its header, and nothing is mixed up."""

import gzip
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.errors import RecordingError
from imucal_wizard.core.readings import FloatArray
from tests.acquire.files.lines import samples

S = samples()
T, A, G, HEAT = S[:, 0], S[:, 1:4], S[:, 4:7], S[:, 7]
FIELD = np.tile([20.0, 5.0, -40.0], (len(S), 1))
TURN = np.tile([0.0, 0.0, 0.0, 1.0], (len(S), 1))
NONE = np.zeros(len(S))
RADIANS = RecordingOptions(gyroscope_unit="rad/s")


def table(header: str, *columns: FloatArray, separator: str = ",") -> str:
    """A header and rows, whole numbers without a point."""
    rows = np.column_stack(columns)
    lines = [separator.join(f"{value:.9g}" for value in row) for row in rows]
    return "\n".join([header, *lines, ""])


def _stamped(header: str, stamps: Sequence[str]) -> str:
    rows = table("", A, G).splitlines()[1:]
    return "\n".join([header, *(f"{s},{r}" for s, r in zip(stamps, rows, strict=True)), ""])


_ROS = (
    "%time,field.header.seq,field.header.stamp,field.orientation.x,field.orientation.y,"
    "field.orientation.z,field.orientation.w,field.orientation_covariance0,"
    "field.angular_velocity.x,field.angular_velocity.y,field.angular_velocity.z,"
    "field.linear_acceleration.x,field.linear_acceleration.y,field.linear_acceleration.z,"
    "field.linear_acceleration_covariance0"
)
_EUROC = (
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]"
)
_PX4 = (
    "timestamp,gyro_rad[0],gyro_rad[1],gyro_rad[2],gyro_integral_dt,"
    "accelerometer_timestamp_relative,accelerometer_m_s2[0],accelerometer_m_s2[1],"
    "accelerometer_m_s2[2],accelerometer_integral_dt,accelerometer_clipping"
)
_ANDROSENSOR = (
    "ACCELEROMETER X (m/s²);ACCELEROMETER Y (m/s²);ACCELEROMETER Z (m/s²);GRAVITY X (m/s²);"
    "GRAVITY Y (m/s²);GRAVITY Z (m/s²);LINEAR ACCELERATION X (m/s²);LINEAR ACCELERATION Y (m/s²);"
    "LINEAR ACCELERATION Z (m/s²);GYROSCOPE X (rad/s);GYROSCOPE Y (rad/s);GYROSCOPE Z (rad/s);"
    "MAGNETIC FIELD X (μT);MAGNETIC FIELD Y (μT);MAGNETIC FIELD Z (μT);Time since start in ms"
)
_SENSORLOG = (
    "loggingTime(txt),accelerometerTimestamp_sinceReboot(s),accelerometerAccelerationX(G),"
    "accelerometerAccelerationY(G),accelerometerAccelerationZ(G),gyroRotationX(rad/s),"
    "gyroRotationY(rad/s),gyroRotationZ(rad/s)"
)
_SHIMMER = (
    "sep=\t\nShimmer_Timestamp_Unix_CAL\tShimmer_Accel_LN_X_CAL\tShimmer_Accel_LN_Y_CAL\t"
    "Shimmer_Accel_LN_Z_CAL\tShimmer_Gyro_X_CAL\tShimmer_Gyro_Y_CAL\tShimmer_Gyro_Z_CAL\n"
    "ms\tm/(s^2)\tm/(s^2)\tm/(s^2)\tdeg/s\tdeg/s\tdeg/s"
)

EXPORTS: dict[str, tuple[str, RecordingOptions | None]] = {
    "rostopic echo -p": (
        table(_ROS, T * 1e9, NONE, T * 1e9, TURN, NONE, G, A, NONE),
        RADIANS,
    ),
    "PlotJuggler": (
        table(
            "__time,/imu/data/angular_velocity/x,/imu/data/angular_velocity/y,"
            "/imu/data/angular_velocity/z,/imu/data/linear_acceleration/x,"
            "/imu/data/linear_acceleration/y,/imu/data/linear_acceleration/z",
            T,
            G,
            A,
        ),
        RADIANS,
    ),
    "EuRoC": (table(_EUROC, T * 1e9, G, A), None),
    "PX4 ulog2csv": (table(_PX4, T * 1e6 + 12e6, G, NONE, NONE, A, NONE, NONE), None),
    "ArduPilot mavlogdump": (
        table(
            "timestamp,TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz",
            *(T, T * 1e6, NONE, G, A, NONE, NONE, HEAT, NONE, NONE, NONE, NONE),
        ),
        RADIANS,
    ),
    "AndroSensor": (
        table(_ANDROSENSOR, A, A, 0 * A, G, FIELD, T * 1e3, separator=";"),
        None,
    ),
    "SensorLog": (
        table(_SENSORLOG, NONE, T + 5000.0, A / 9.80665, G),
        None,
    ),
    "Shimmer": (table(_SHIMMER, T * 1e3, A, np.degrees(G), separator="\t"), None),
    "axis in front": (table("time,x_acc,y_acc,z_acc,x_gyro,y_gyro,z_gyro", T, A, G), RADIANS),
    "units in a line of their own": (
        table("t,ax,ay,az,gx,gy,gz\ns,g,g,g,deg/s,deg/s,deg/s", T, A / 9.80665, np.degrees(G)),
        None,
    ),
    "bars": (table("t[s]|ax[g]|ay[g]|az[g]|gx[dps]|gy[dps]|gz[dps]", T, A / 9.80665,
                   np.degrees(G), separator="|"), None),
    "ISO 8601": (
        _stamped("timestamp,ax,ay,az,gx,gy,gz", [f"2024-05-03T23:59:{59 + t:07.4f}Z" for t in T]),
        RADIANS,
    ),
    "date and time": (
        _stamped("time,ax,ay,az,gx,gy,gz", [f"2024-05-03 10:00:{t:07.4f}" for t in T]),
        RADIANS,
    ),
}  # fmt: skip


@pytest.mark.parametrize("program", EXPORTS)
def test_the_export_of_a_well_known_program_is_read_by_its_names(
    tmp_path: Path, program: str
) -> None:
    text, options = EXPORTS[program]
    path = tmp_path / "export.csv"
    path.write_text(text, encoding="utf-8")
    readings = read_files([path], options)
    assert readings.gyroscope is not None
    np.testing.assert_allclose(readings.accelerometer.values, A, atol=1e-6)
    np.testing.assert_allclose(readings.gyroscope.values, G, atol=1e-7)
    time = readings.accelerometer.time
    np.testing.assert_allclose(time - time[0], T, atol=1e-3)


@pytest.mark.parametrize(
    ("unit", "size"),
    [("m s^-2", 1.0), ("m·s⁻²", 1.0), ("m/(s^2)", 1.0), ("m/sec²", 1.0), ("mps2", 1.0),
     ("G", 1 / 9.80665), ("mG", 1000 / 9.80665), ("milli-g", 1000 / 9.80665),
     ("cm/s²", 100.0), ("Gal", 100.0)],
)  # fmt: skip
def test_the_unit_of_acceleration_is_known_however_it_is_spelled(
    tmp_path: Path, unit: str, size: float
) -> None:
    path = tmp_path / "a.csv"
    path.write_text(table(f"t[s],ax [{unit}],ay [{unit}],az [{unit}]", T, A * size))
    np.testing.assert_allclose(read_files([path]).accelerometer.values, A, atol=1e-6)


@pytest.mark.parametrize("unit", ["deg/s", "dps", "°/s", "º/s", "degrees/s", "DEG/SEC", "deg s-1"])
def test_the_unit_of_rate_is_known_however_it_is_spelled(tmp_path: Path, unit: str) -> None:
    path = tmp_path / "a.csv"
    header = f"t[s],ax[g],ay[g],az[g],gx({unit}),gy({unit}),gz({unit})"
    path.write_text(table(header, T, A / 9.80665, np.degrees(G)), encoding="utf-8")
    readings = read_files([path])
    assert readings.gyroscope is not None
    np.testing.assert_allclose(readings.gyroscope.values, G, atol=1e-8)


@pytest.mark.parametrize("unit", ["rpm", "r/min", "rev/min"])
def test_rates_in_turns_a_minute_are_read(tmp_path: Path, unit: str) -> None:
    path = tmp_path / "a.csv"
    header = f"t[s],ax[g],ay[g],az[g],gx[{unit}],gy[{unit}],gz[{unit}]"
    path.write_text(table(header, T, A / 9.80665, G * 30.0 / np.pi))
    readings = read_files([path])
    assert readings.gyroscope is not None
    np.testing.assert_allclose(readings.gyroscope.values, G, atol=1e-8)


def test_bare_axes_belong_to_the_sensor_in_the_name_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "TotalAcceleration.csv").write_text(table("time,z,y,x", T, A[:, ::-1]))
    (tmp_path / "Gyroscope.csv").write_text(table("time,z,y,x", T, G[:, ::-1]))
    readings = read_files([tmp_path / "Gyroscope.csv", tmp_path / "TotalAcceleration.csv"], RADIANS)
    assert readings.gyroscope is not None
    np.testing.assert_allclose(readings.accelerometer.values, A, atol=1e-6)
    np.testing.assert_allclose(readings.gyroscope.values, G, atol=1e-7)
    (tmp_path / "a.csv").write_text(table("time,x,y,z", T, A))
    readings = read_files([tmp_path / "a.csv"])
    np.testing.assert_allclose(readings.accelerometer.values, A, atol=1e-6)
    assert any("read as t, ax, ay, az" in text for text in readings.warnings)


def test_bare_axes_with_a_unit_belong_to_the_sensor_of_the_unit(tmp_path: Path) -> None:
    path = tmp_path / "Raw Data.csv"
    path.write_text(table('"Time (s)","X (m/s^2)","Y (m/s^2)","Z (m/s^2)"', T, A))
    np.testing.assert_allclose(read_files([path]).accelerometer.values, A, atol=1e-6)


def test_two_sensors_of_one_kind_are_named_and_none_is_chosen(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(table("t,imu1_ax,imu1_ay,imu1_az,imu2_ax,imu2_ay,imu2_az", T, A, A))
    with pytest.raises(RecordingError, match="Two columns are ax: 'imu1_ax' and 'imu2_ax'"):
        read_files([path])


@pytest.mark.parametrize("name", ["user_acc_x", "gravity_x", "acc_bias_x", "angle_x", "free_acc_x"])
def test_derived_columns_are_not_taken_for_readings(tmp_path: Path, name: str) -> None:
    header = ",".join(["t", *(name[:-1] + axis for axis in "xyz")])
    path = tmp_path / "a.csv"
    path.write_text(table(header, T, A))
    with pytest.raises(RecordingError, match="without known names") as caught:
        read_files([path])
    assert caught.value.settings[0].startswith("columns")


def test_a_file_packed_by_gzip_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.csv.gz"
    path.write_bytes(gzip.compress(table("t[s],ax[g],ay[g],az[g]", T, A / 9.80665).encode()))
    np.testing.assert_allclose(read_files([path]).accelerometer.values, A, atol=1e-6)
