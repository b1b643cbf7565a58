"""Exports: every target is read back in the consumer's own formula."""

import json
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from imucal_wizard.cli import main as cli
from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.output import encode_json
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.report.axes import named_values
from imucal_wizard.report.calibration_file import Calibration, SavedEffect, Value
from imucal_wizard.report.exports import ExportSettings, adafruit, targets, write_export
from imucal_wizard.report.reduced import Kept
from tests.report.devices import (
    BIAS,
    DRIFT,
    FELT,
    FIELD,
    HARD_IRON,
    IRON,
    MATRIX,
    MOUNTED,
    TURNING,
    G,
    calibration,
)

WHOLE = {name for name, one in targets().items() if one.keeps["accelerometer"].base == Kept().base}
"""Targets that hold bias, scale and non-orthogonality."""
NAMES = (
    *("json", "numpy", "c-header", "arduino", "ros-imu-calib", "kalibr", "imu_tk", "imucal"),
    *("adafruit", "ardupilot", "px4", "inav", "betaflight"),
)


def values_of(path: Path) -> dict[str, float]:
    """The parameters of a file with one name and one number per line."""
    rows = [line.split() for line in path.read_text().splitlines() if line[0] != "#"]
    px4 = [row[2:4] for row in rows if len(row) == 5]
    return {name: float(value) for name, value in px4 or rows}


def xyz(values: dict[str, float], names: str) -> FloatArray:
    """The values of three axes."""
    return np.array([values[names.format(axis)] for axis in "XYZ"])


@pytest.mark.parametrize("name", targets())
def test_every_target_is_proven_by_what_the_file_has_measured(name: str, tmp_path: Path) -> None:
    """The device is known: a whole model is exact, a smaller one lies between nothing and it."""
    done = write_export(calibration(felt=False), name, tmp_path / "out")
    for sensor, one in done.sensors.items():
        assert one.rms_calibration < 1e-5
        if name in WHOLE or sensor == "magnetometer":
            assert one.rms_exported < 2e-4
        elif one.rms_before is not None and sensor == "accelerometer":
            assert 10.0 * one.rms_calibration < one.rms_exported < one.rms_before
    assert done.sensors["accelerometer"].rms_exported == done.rms_exported
    assert done.direction
    assert all(path.exists() for path in done.files)


def test_a_target_is_found_by_its_file_alone() -> None:
    assert set(targets()) >= set(NAMES)


def test_the_bias_of_imu_calib_acts_after_the_matrix(tmp_path: Path) -> None:
    """``SM · raw − bias``: the file's bias is M b."""
    path = tmp_path / "imu.yaml"
    write_export(calibration(), "ros-imu-calib", path)
    lines = [line.split(":") for line in path.read_text().splitlines()]
    found = {key: json.loads(text) for key, text in lines}
    np.testing.assert_array_equal(np.reshape(found["SM"], (3, 3)), MATRIX)
    np.testing.assert_allclose(found["bias"], MATRIX @ BIAS, rtol=1e-15)


def forces_and_rates() -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """True forces and rates of no particular kind, and what the device reads of them."""
    random = np.random.default_rng(8)
    force, rate = random.standard_normal((50, 3)) * 9.0, random.standard_normal((50, 3))
    felt = force / G @ np.radians(FELT).T
    read = force @ np.linalg.inv(MATRIX).T + BIAS
    return force, rate, read, (rate + felt) @ TURNING.T + DRIFT


def test_imucal_itself_corrects_both_sensors_with_its_file(tmp_path: Path) -> None:
    """Its K_ga acts in the reading: K_ga = S · G, with S far from one."""
    path = tmp_path / "imu.json"
    write_export(calibration(), "imucal", path)
    found = json.loads(path.read_text())
    expected = TURNING @ np.radians(FELT) / G
    np.testing.assert_allclose(found["K_ga"], expected, rtol=1e-12)
    assert np.abs(expected - np.radians(FELT) / G).max() > 0.2 * np.abs(expected).max()
    imucal = pytest.importorskip("imucal", reason="imucal does not support this Python")
    force, rate, read_a, read_g = forces_and_rates()
    loaded = imucal.CalibrationInfo.from_json_file(path)
    acc, gyr = loaded.calibrate(read_a, read_g, acc_unit="m/s^2", gyr_unit="rad/s")
    np.testing.assert_allclose(acc, force, atol=1e-10)
    np.testing.assert_allclose(np.radians(gyr), rate, atol=1e-10)


def kalibr_matrices(path: Path) -> dict[str, FloatArray]:
    """Matrices of an ``imu.yaml`` by section and name."""
    found: dict[str, list[list[float]]] = {}
    section, name = "", ""
    for line in path.read_text().splitlines():
        if line.startswith("  - "):
            found.setdefault(f"{section}/{name}", []).append(json.loads(line[4:]))
        elif line.endswith(":"):
            section, name = (section, line.strip(" :")) if line[0] == " " else (line[:-1], "")
    return {key: np.array(rows) for key, rows in found.items()}


def test_kalibrs_model_makes_the_readings_of_true_values(tmp_path: Path) -> None:
    """``y = M C w + A (C a) + b`` in a body frame in which the accelerometer's M is lower."""
    path = tmp_path / "imu.yaml"
    done = write_export(calibration(), "kalibr", path)
    assert path.read_text().count("] m/s^2\n") == path.read_text().count("] rad/s\n") == 1
    assert "-0," not in path.read_text()
    assert done.sensors["gyroscope"].rms_exported < 2e-4
    m = kalibr_matrices(path)
    M_a, M, A = m["accelerometers/M"], m["gyroscopes/M"], m["gyroscopes/A"]
    C = m["gyroscopes/C_gyro_i"]
    force, rate, read_a, read_g = forces_and_rates()
    for one in (M_a, M):
        np.testing.assert_allclose(np.triu(one, 1), 0.0, atol=1e-12)
    np.testing.assert_allclose(C @ C.T, np.eye(3), atol=1e-12)
    body = np.linalg.solve(M_a, np.linalg.inv(MATRIX))  # ours to Kalibr's body frame
    np.testing.assert_allclose(body @ body.T, np.eye(3), atol=1e-12)
    a, w = force @ body.T, rate @ body.T
    np.testing.assert_allclose(a @ M_a.T + BIAS, read_a, atol=1e-10)
    np.testing.assert_allclose(w @ C.T @ M.T + a @ C.T @ A.T + DRIFT, read_g, atol=1e-10)
    assert path.read_text().count("noise_density") == 2


def test_the_noise_of_an_allan_deviation_replaces_typical_values(tmp_path: Path) -> None:
    noise = {"accelerometer": {"white": 1e-3, "random_walk": 2e-4}}
    path = tmp_path / "imu.yaml"
    done = write_export(calibration(), "kalibr", path, ExportSettings(noise=noise))
    lines = dict(line.split(":")[:2] for line in path.read_text().splitlines() if ": " in line)
    assert float(lines["accelerometer_noise_density"].split()[0]) == 1e-3
    assert float(lines["accelerometer_random_walk"].split()[0]) == 2e-4
    assert any("random walk of the gyroscope" in note for note in done.notes)


def test_imu_tk_reads_upper_unit_triangles(tmp_path: Path) -> None:
    path = tmp_path / "acc.calib"
    done = write_export(calibration(felt=False), "imu_tk", path)
    T, K, B = np.split(np.array(path.read_text().split(), float), (9, 18))
    T, K = T.reshape(3, 3), K.reshape(3, 3)
    np.testing.assert_array_equal(np.diag(T), 1.0)
    np.testing.assert_array_equal(np.tril(T, -1), 0.0)
    np.testing.assert_allclose(T @ K, MATRIX, rtol=1e-14)
    np.testing.assert_array_equal(B, BIAS)
    assert [one.name for one in done.files] == ["acc.calib", "acc_gyro.calib"]


def best_axes(scaled: bool) -> tuple[FloatArray, FloatArray]:
    """Offset and scale that fit the device's readings best, found by another optimiser."""
    from scipy.optimize import least_squares

    readings = calibration().means()

    def errors(p: FloatArray) -> FloatArray:
        scale = p[3:] if scaled else 1.0
        return np.asarray(np.linalg.norm((readings - p[:3]) * scale, axis=1) - G)

    found = least_squares(errors, np.r_[0, 0, 0, 1, 1, 1][: 6 if scaled else 3], xtol=1e-14).x
    return found[:3], found[3:] if scaled else np.ones(3)


def test_a_smaller_model_is_the_best_one_and_not_cut_out_of_the_matrix(tmp_path: Path) -> None:
    done = write_export(calibration(felt=False), "ardupilot", tmp_path / "v.param")
    found = values_of(tmp_path / "v.param")
    offset, scale = best_axes(scaled=True)
    np.testing.assert_allclose(xyz(found, "INS_ACCOFFS_{}"), offset, atol=2e-5)
    np.testing.assert_allclose(xyz(found, "INS_ACCSCAL_{}"), scale, atol=2e-6)
    cut = (calibration().means() - BIAS) * np.diag(MATRIX)
    assert done.rms_exported is not None
    assert done.rms_exported < 0.97 * np.std(np.linalg.norm(cut, axis=1) - G)
    assert any("fitted again without non-orthogonality" in note for note in done.notes)


def test_offsets_alone_are_the_best_offsets(tmp_path: Path) -> None:
    write_export(calibration(felt=False), "adafruit", tmp_path / "c.json")
    document = json.loads((tmp_path / "c.json").read_text())
    np.testing.assert_allclose(document["accel_zerog"], best_axes(scaled=False)[0], atol=1e-4)
    assert list(document) == [
        *("mag_hardiron", "mag_softiron", "mag_field", "gyro_zerorate", "accel_zerog"),
    ]


@pytest.mark.parametrize("name", ["adafruit", "px4"])
def test_a_symmetric_magnetometer_loses_its_alignment_and_says_so(
    name: str, tmp_path: Path
) -> None:
    path = tmp_path / "mag.txt"
    done = write_export(calibration(felt=False), name, path)
    if name == "adafruit":
        document = json.loads(path.read_text())
        soft, hard = np.reshape(document["mag_softiron"], (3, 3)), document["mag_hardiron"]
        assert document["mag_field"] == pytest.approx(48.0, rel=1e-6)
    else:
        values = values_of(path)
        soft = np.diag(xyz(values, "CAL_MAG0_{}SCALE"))
        x, y, z = xyz(values, "CAL_MAG0_{}ODIAG")
        soft += np.array([[0, x, y], [x, 0, z], [y, z, 0]])
        hard = 100.0 * xyz(values, "CAL_MAG0_{}OFF")
    np.testing.assert_allclose(soft, IRON, atol=1e-8)
    np.testing.assert_allclose(hard, HARD_IRON, rtol=1e-8)
    angle = np.degrees(np.arctan2(MOUNTED[1, 0], MOUNTED[0, 0]))
    lost = [text for text in done.cannot_hold if "alignment of the magnetometer" in text]
    assert f"{angle:.2f}°" in lost[0]


def test_readings_of_another_size_than_a_known_field_err_by_the_difference(
    tmp_path: Path,
) -> None:
    """An unknown field says only that the size is constant."""
    made = calibration(felt=False)
    readings = np.array([one.reading for one in made.field_means])
    sizes = np.linalg.norm(readings, axis=1)
    done = write_export(made, "px4", tmp_path / "known.txt").sensors["magnetometer"]
    assert done.rms_before == pytest.approx(np.sqrt(np.mean((sizes - FIELD) ** 2)))
    unknown = {"field": Value(FIELD, "uT", None)}
    sensor = msgspec.structs.replace(made["magnetometer"], parameters=unknown)
    made = msgspec.structs.replace(made, sensors={**made.sensors, "magnetometer": sensor})
    done = write_export(made, "px4", tmp_path / "unknown.txt").sensors["magnetometer"]
    assert done.rms_before == pytest.approx(np.std(sizes))


@pytest.mark.parametrize("mirrored", [1.0, -1.0])
def test_a_magnetometer_fitted_again_without_its_drift_stays_turned_as_it_was(
    mirrored: float, tmp_path: Path
) -> None:
    made = calibration(felt=False)
    matrix = mirrored * MOUNTED @ IRON
    drift = SavedEffect("bias-drift", "magnetometer", "", ["x", "y", "z"], [0.01] * 3, "µT/min")
    sensor = msgspec.structs.replace(
        made["magnetometer"],
        matrix=matrix.tolist(),
        effects=[drift],
        model=["bias", "soft-iron", "misalignment", "bias-drift"],
    )
    made = msgspec.structs.replace(made, sensors={**made.sensors, "magnetometer": sensor})
    done = write_export(made, "numpy", tmp_path / "a.npz")
    assert "bias-drift of the magnetometer" in done.cannot_hold
    assert any("its rotation to the accelerometer is kept" in text for text in done.notes)
    with np.load(tmp_path / "a.npz") as arrays:
        np.testing.assert_allclose(arrays["magnetometer_matrix"], matrix, atol=1e-9)
    done = write_export(made, "adafruit", tmp_path / "a.json")
    assert any("alignment of the magnetometer" in text for text in done.cannot_hold)


def test_motioncals_packet_is_the_one_that_its_firmware_takes() -> None:
    """A packet of the wire format's description, with its checksum."""
    packet = bytes.fromhex(
        "7554cdcc4c3dcdccccbd9a99193e6f12833a6f1203bba69b443b000048410000e8c00000f041000042"
        "42ae47813f48e17a3f5c8f823fa69b443b6f1283bb0ad7a33bfe0d"
    )
    sent = adafruit._received(packet)
    np.testing.assert_allclose(sent[:3], [0.05, -0.1, 0.15], rtol=1e-6)
    np.testing.assert_allclose(sent[6:10], [12.5, -7.25, 30.0, 48.5], rtol=1e-6)
    with pytest.raises(ValueError, match="no packet"):
        adafruit._received(packet[:-1] + b"\0")


OFFSET, SCALE = np.array([0.1, -0.2, 0.05]), np.array([1.02, 0.98, 1.01])
BOTH = (*zip("XYZ", OFFSET, strict=True),), (*zip("XYZ", SCALE, strict=True),)
PRESENT = {
    "ardupilot": "\n".join(
        [f"INS_ACCOFFS_{axis} {value}" for axis, value in BOTH[0]]
        + [f"INS_ACCSCAL_{axis},{value}" for axis, value in BOTH[1]]
    ),
    "px4": "# a comment\n1 1 CAL_ACC0_ID 1310988 6\n"
    + "\n".join(
        [f"1\t1\tCAL_ACC0_{axis}OFF\t{value}\t9" for axis, value in BOTH[0]]
        + [f"1\t1\tCAL_ACC0_{axis}SCALE\t{value}\t9" for axis, value in BOTH[1]]
    ),
}
"""What a controller corrected already."""


@pytest.mark.parametrize("name", list(PRESENT))
def test_what_the_controller_corrected_is_composed_and_not_corrected_twice(
    name: str, tmp_path: Path
) -> None:
    """The new file, applied to what the sensor read, does both corrections at once."""
    settings = ExportSettings(present=PRESENT[name].encode())
    done = write_export(calibration(felt=False), name, tmp_path / "v", settings)
    alone = write_export(calibration(felt=False), name, tmp_path / "w")
    assert done.rms_exported == pytest.approx(alone.rms_exported, rel=1e-3)
    values = values_of(tmp_path / "v")
    words = (
        ("INS_ACCOFFS_{}", "INS_ACCSCAL_{}")
        if name == "ardupilot"
        else (
            "CAL_ACC0_{}OFF",
            "CAL_ACC0_{}SCALE",
        )
    )
    offset, scale = (xyz(values, word) for word in words)
    corrected = calibration().means()
    raw = corrected / SCALE + OFFSET
    best, gain = best_axes(scaled=True)
    np.testing.assert_allclose(scale * (raw - offset), gain * (corrected - best), atol=1e-4)
    if name == "px4":
        assert values["CAL_ACC0_ID"] == 1310988


@pytest.mark.parametrize(
    ("name", "present", "says"),
    [
        ("px4", "hello", "none of px4"),
        ("px4", PRESENT["ardupilot"], "none of px4: no name begins with CAL_"),
        ("inav", "set gyro_lpf = OFF\nset looptime = 1000", "no name begins with acczero_"),
        ("c-header", PRESENT["px4"], "takes no present parameters"),
        ("px4", PRESENT["px4"] + "\n1\t1\tTC_A_ENABLE\t1\t6", "switch that off"),
    ],
)
def test_present_parameters_that_do_not_compose_are_refused(
    name: str, present: str, says: str, tmp_path: Path
) -> None:
    settings = ExportSettings(present=present.encode())
    with pytest.raises(UsageError, match=says):
        write_export(calibration(felt=False), name, tmp_path / "v", settings)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "settings", "says"),
    [
        ("px4", ExportSettings(noise={"gyroscope": {"white": 1e-4}}), "px4 takes no noise"),
        ("kalibr", ExportSettings(slot=1), "kalibr takes no number of a sensor"),
        ("px4", ExportSettings(counts_per_g=4096.0), "px4 takes no counts per g"),
    ],
)
def test_a_setting_that_would_change_nothing_is_refused(
    name: str, settings: ExportSettings, says: str, tmp_path: Path
) -> None:
    with pytest.raises(UsageError, match=says):
        write_export(calibration(felt=False), name, tmp_path / "v", settings)
    assert not list(tmp_path.iterdir())


def test_inav_composes_with_the_settings_of_its_own_dump(tmp_path: Path) -> None:
    """``(adc − zero) · gain / 4096``, and then the calibration of that."""
    dump = "# dump\nset gyro_lpf = OFF\nset acczero_x = 40\nset accgain_x = 4200\nsave\n"
    settings = ExportSettings(present=dump.encode())
    write_export(calibration(felt=False), "inav", tmp_path / "i.txt", settings)
    lines = (tmp_path / "i.txt").read_text().splitlines()
    offset, scale = best_axes(scaled=True)
    zero = 40 + offset[0] * 2048 / G * 4096 / 4200
    assert f"set acczero_x = {round(zero)}" in lines
    assert f"set accgain_x = {round(4200 * scale[0])}" in lines


def test_inav_and_betaflight_have_whole_counts(tmp_path: Path) -> None:
    offset, scale = best_axes(scaled=True)
    write_export(calibration(felt=False), "inav", tmp_path / "i.txt")
    lines = [one for one in (tmp_path / "i.txt").read_text().splitlines() if one[0] != "#"]
    zero = np.rint(offset * 2048 / G).astype(int)
    gain = np.rint(4096 * scale).astype(int)
    expected = [f"set acczero_{a} = {v}" for a, v in zip("xyz", zero, strict=True)]
    expected += [f"set accgain_{a} = {v}" for a, v in zip("xyz", gain, strict=True)]
    assert lines == [*expected, "save"]
    done = write_export(
        calibration(felt=False), "betaflight", tmp_path / "b.txt", ExportSettings(counts_per_g=512)
    )
    x, y, z = np.rint(best_axes(scaled=False)[0] * 512 / G).astype(int)
    assert f"set acc_calibration = {x},{y},{z},1" in (tmp_path / "b.txt").read_text()
    assert "scale and non-orthogonality of the accelerometer" in done.cannot_hold


@pytest.mark.parametrize("name", ["inav", "betaflight"])
def test_counts_of_an_unusual_range_are_exported_only_where_the_controller_has_them(
    name: str, tmp_path: Path
) -> None:
    """A range of ±24 g makes 1366 counts of 1 g, 1.33 times the nearest power of two."""
    made = calibration(felt=False)
    per_g = 1366.0 / np.cbrt(1.0 / np.linalg.det(MATRIX))
    sensor = msgspec.structs.replace(
        made["accelerometer"],
        matrix=(MATRIX * G / per_g).tolist(),
        bias=(BIAS * per_g / G).tolist(),
        bias_unit="count",
    )
    holds = [
        msgspec.structs.replace(
            one,
            accelerometer=(np.array(one.accelerometer) * per_g / G).tolist(),
            accelerometer_covariance=(1e-8 * (per_g / G) ** 2 * np.eye(3)).tolist(),
            accelerometer_scatter=[1e-8 * (per_g / G) ** 2] * 3,
        )
        for one in made.hold_means
    ]
    made = msgspec.structs.replace(made, sensors={"accelerometer": sensor}, hold_means=holds)
    for counts in (None, 2048.0):
        with pytest.raises(UsageError, match="most chips have a power of two") as caught:
            write_export(made, name, tmp_path / "a.txt", ExportSettings(counts_per_g=counts))
        assert caught.value.settings == ("counts_per_g",)
    done = write_export(made, name, tmp_path / "a.txt", ExportSettings(counts_per_g=1366.0))
    assert "1 g is taken for 1366 counts in the readings" in done.notes
    values = [*named_values((tmp_path / "a.txt").read_bytes()).values()]
    np.testing.assert_allclose(values[:3], BIAS * per_g / G, atol=12.0)
    if name == "inav":
        np.testing.assert_allclose(values[3:], 4096.0 * np.diag(MATRIX), rtol=0.03)


def warm(made: Calibration) -> Calibration:
    """Another accelerometer: axes at right angles, and a bias on x of 3 mg/°C."""
    gains, holds = np.diag(MATRIX), []
    for k, hold in enumerate(made.hold_means):
        degrees = 20.0 + 7.0 * k % 11
        force = MATRIX @ (np.array(hold.accelerometer) - BIAS)
        force[0] += 3.0e-3 * G * (degrees - 25.0)
        reading = (force / gains + BIAS).tolist()
        holds.append(msgspec.structs.replace(hold, accelerometer=reading, temperature=degrees))
    effect = SavedEffect(
        term="bias-temperature",
        sensor="accelerometer",
        equation="",
        parameters=["x", "y", "z"],
        sizes=[3.0, 0.0, 0.0],
        unit="mg/°C",
        reference_temperature=25.0,
    )
    sensor = made["accelerometer"]
    sensor = msgspec.structs.replace(
        sensor,
        matrix=np.diag(gains).tolist(),
        effects=[effect],
        model=[*sensor.model, "bias-temperature"],
    )
    return msgspec.structs.replace(
        made, hold_means=holds, sensors={**made.sensors, "accelerometer": sensor}
    )


@pytest.mark.parametrize("name", ["ardupilot", "px4"])
def test_the_temperature_is_corrected_as_it_was_fitted(name: str, tmp_path: Path) -> None:
    done = write_export(warm(calibration(felt=False)), name, tmp_path / "v")
    assert done.rms_exported == pytest.approx(0.0, abs=2e-4)
    values = values_of(tmp_path / "v")
    if name == "ardupilot":
        slope = values["INS_TCAL1_ACC1_X"] / 1e6
        assert values["INS_TCAL1_ENABLE"] == 1
        # what the vehicle may have of the gyroscope would be enabled with it
        others = [f"INS_TCAL1_GYR{order}_{axis}" for order in (1, 2, 3) for axis in "XYZ"]
        assert [values[one] for one in others] == [0.0] * 9
    else:
        slope = values["TC_A0_X1_0"]
        assert values["TC_A_ENABLE"] == 1
    assert slope == pytest.approx(3e-3 * G / MATRIX[0, 0], rel=1e-3)


def test_a_gyroscope_of_counts_far_from_its_data_sheet_is_fitted_again(tmp_path: Path) -> None:
    """Scales of 0.8 to 1.3 and large cross-axis gains: the fit begins from the file's matrix."""
    made, counts = calibration(), 917.0
    holds = [
        msgspec.structs.replace(
            one,
            gyroscope=(counts * np.array(one.gyroscope)).tolist(),
            gyroscope_covariance=(counts**2 * np.array(one.gyroscope_covariance)).tolist(),
            gyroscope_scatter=[counts**2 * 1e-12] * 3,
        )
        for one in made.hold_means
    ]
    rotations = [
        msgspec.structs.replace(one, gyroscope=(counts * np.array(one.gyroscope)).tolist())
        for one in made.rotation_increments
    ]
    sensor = msgspec.structs.replace(
        made["gyroscope"],
        matrix=(np.array(made["gyroscope"].matrix) / counts).tolist(),
        bias=(counts * DRIFT).tolist(),
        bias_unit="count",
    )
    sensors = {**made.sensors, "gyroscope": sensor}
    raw = msgspec.structs.replace(
        made, hold_means=holds, rotation_increments=rotations, sensors=sensors
    )
    done = write_export(raw, "numpy", tmp_path / "raw.npz").sensors["gyroscope"]
    plain = write_export(made, "numpy", tmp_path / "si.npz").sensors["gyroscope"]
    assert done.rms_exported == pytest.approx(plain.rms_exported, rel=1e-3)
    with np.load(tmp_path / "raw.npz") as arrays:
        found = np.linalg.inv(arrays["gyroscope_matrix"]) / counts
    np.testing.assert_allclose(found, TURNING, atol=0.02)


def powered(unit: str, unity: float, sizes: FloatArray) -> Calibration:
    """A magnetometer beside a lead whose current or throttle is recorded."""
    made = calibration(felt=False)
    draws = [unity * (0.3 + 0.5 * (k % 3)) for k in range(len(made.field_means))]
    inverse = np.linalg.inv(MOUNTED @ IRON)
    means = [
        msgspec.structs.replace(
            one, reading=(np.array(one.reading) + inverse @ sizes * draw).tolist(), current=draw
        )
        for one, draw in zip(made.field_means, draws, strict=True)
    ]
    effect = SavedEffect("current", "magnetometer", "", ["x", "y", "z"], sizes.tolist(), unit)
    sensor = msgspec.structs.replace(made["magnetometer"], effects=[effect])
    sensors = {**made.sensors, "magnetometer": sensor}
    return msgspec.structs.replace(made, field_means=means, sensors=sensors)


@pytest.mark.parametrize(("unit", "kind", "unity"), [("µT/A", 2, 1000.0), ("µT/%", 1, 100.0)])
def test_px4_compensates_the_field_of_the_motors(
    unit: str, kind: int, unity: float, tmp_path: Path
) -> None:
    """``raw + P · COMP`` before offset and scale: P in kA or from 0 to 1, COMP in gauss per P."""
    sizes = 20.0 / unity * np.array([1.0, -2.0, 0.5])
    done = write_export(powered(unit, unity, sizes), "px4", tmp_path / "v")
    assert done.sensors["magnetometer"].rms_exported < 2e-4
    assert done.sensors["magnetometer"].rms_calibration < 1e-5
    values = values_of(tmp_path / "v")
    assert values["CAL_MAG_COMP_TYP"] == kind
    lead = np.linalg.solve(MOUNTED @ IRON, sizes * unity) / 100.0  # gauss in the reading
    np.testing.assert_allclose(xyz(values, "CAL_MAG0_{}COMP"), -lead, rtol=1e-6)
    present = ExportSettings(present=b"1 1 CAL_MAG_COMP_TYP 2 6")
    with pytest.raises(UsageError, match="CAL_MAG_COMP_TYP"):
        write_export(calibration(felt=False), "px4", tmp_path / "w", present)


def test_the_files_of_an_earlier_calibration_are_written_over_together(tmp_path: Path) -> None:
    """Adafruit's JSON and packet belong together; one of them may be gone."""
    path, packet = tmp_path / "c.json", tmp_path / "c-packet.bin"
    write_export(calibration(felt=False), "adafruit", path)
    before = path.read_text()
    for gone in (None, path, packet):
        if gone is not None:
            gone.unlink()
        write_export(warm(calibration(felt=False)), "adafruit", path)
        assert path.read_text() != before
        assert packet.exists()
    packet.write_bytes(b"mine")
    with pytest.raises(UsageError, match="is not a file for adafruit"):
        write_export(calibration(felt=False), "adafruit", path)


def test_a_file_of_another_kind_is_not_written_over(tmp_path: Path) -> None:
    path = tmp_path / "notes.yaml"
    path.write_text("keep: this\n")
    for name in (*WHOLE, "inav"):
        with pytest.raises(UsageError, match=f"exists and is not a file for {name}"):
            write_export(calibration(felt=False), name, path)
    assert path.read_text() == "keep: this\n"


def test_counts_are_refused_where_the_consumer_has_si(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="calibrate what the driver publishes"):
        write_export(calibration("count"), "ros-imu-calib", tmp_path / "imu.yaml")
    assert not list(tmp_path.iterdir())


def test_an_unknown_target_is_told_with_those_that_there_are(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="give one of " + ", ".join(targets())):
        write_export(calibration(), "betamax", tmp_path / "x")


def test_the_command_proves_what_it_writes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    saved = calibration(felt=False).save(tmp_path / "my.json")
    assert cli.main(["export", str(saved), "--to", "imucal", "--json", "-"]) == 0
    document: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert document["schema"] == "imucal-wizard/export/1"
    assert document["rms_exported"] == pytest.approx(0.0, abs=1e-6)
    assert document["sensors"]["gyroscope"]["unit"] == "rad"
    assert Path(document["path"]).name == "my.imucal.json"
    assert cli.main(["export", str(saved), "--to", "adafruit"]) == 0
    said = capsys.readouterr().out
    for words in (
        "S (m − hardiron)",
        "cannot hold: effects",
        "note: gyroscope: fitted again",
    ):
        assert words in said
    assert said.count("written: ") == 2


def test_a_file_that_corrects_worse_than_none_fails_the_check(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = calibration(felt=False)
    wrong = msgspec.structs.replace(made["accelerometer"], bias=[9.0, 0.0, 0.0], rms_fitted=5.8)
    alone = msgspec.structs.replace(made, sensors={"accelerometer": wrong})
    saved = alone.save(tmp_path / "my.json", force=True)
    assert cli.main(["export", str(saved), "--to", "ros-imu-calib"]) == 1
    assert "worse than no calibration" in capsys.readouterr().out


def test_a_sampling_rate_that_the_file_does_not_show_is_marked(tmp_path: Path) -> None:
    path, made = tmp_path / "imu.yaml", calibration()
    bare = msgspec.structs.replace(made, hold_means=[], rotation_increments=[])
    for one, unknown in ((bare, True), (made, False)):
        write_export(one, "kalibr", path)
        assert ("Hz, not known: set your own" in path.read_text()) is unknown


def test_notes_are_about_the_sensors_that_the_calibration_has(tmp_path: Path) -> None:
    """Kalibr refuses a file with the noise of one sensor; a magnetometer shows no gravity."""
    made = calibration()
    alone = msgspec.structs.replace(
        made, sensors={"accelerometer": made["accelerometer"]}, rotation_increments=[]
    )
    for one, unknown in ((alone, True), (made, False)):
        notes = " ".join(write_export(one, "kalibr", tmp_path / "imu.yaml").notes)
        assert ("the gyroscope is not known" in notes) is unknown
        notes = " ".join(write_export(one, "px4", tmp_path / "my.params").notes)
        assert "length of vehicle_acceleration" in notes
    field = {"sensors": {"magnetometer": made["magnetometer"]}, "hold_means": []}
    alone = msgspec.structs.replace(made, **field, rotation_increments=[])
    notes = " ".join(write_export(alone, "px4", tmp_path / "field.params").notes)
    assert "CAL_ACC0_ID" in notes
    assert "vehicle_acceleration" not in notes


@pytest.mark.parametrize("name", sorted(targets().keys() - {"json", "numpy"}))
def test_words_of_a_calibration_add_no_line_to_the_file_of_another_program(
    name: str, tmp_path: Path
) -> None:
    """A calibration comes from anybody, and a controller obeys each line."""
    loose = json.loads(encode_json(calibration()))
    loose |= {"program": "1 */\nset evil = 1\\", "created": "2026-01-02 */\r\nset evil = 2"}
    for sensor in loose["sensors"].values():
        for one in sensor["effects"]:
            one |= {"equation": "*/ set evil = 3"}
    made = msgspec.convert(loose, Calibration)
    for path in write_export(made, name, tmp_path / "out").files:
        lines = path.read_bytes().decode(errors="replace").splitlines()
        assert not any(line.lstrip().startswith("set evil") for line in lines)
        assert not any("*/" in line.partition("evil")[0] for line in lines if "evil" in line)
        assert not any(line.endswith("\\") for line in lines)


def test_the_targets_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["export", "--list", "--json", "-"]) == 0
    listed = json.loads(capsys.readouterr().out)["targets"]
    assert {one["name"] for one in listed} == set(targets())
    assert all(one["title"] for one in listed)


def test_a_calibration_of_an_older_version_is_exported_whole_and_without_a_proof(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its file has no holds to apply the export to, nor to fit a smaller model to."""
    old = Path(__file__).parents[1] / "golden" / "data" / "calibration.json"
    assert cli.main(["export", str(old), "--to", "json", "-o", str(tmp_path / "o.json")]) == 0
    assert "not proven" in capsys.readouterr().out
    assert cli.main(["export", str(old), "--to", "px4", "-o", str(tmp_path / "o.params")]) == 2
    assert "an older version wrote it" in capsys.readouterr().err
    assert not (tmp_path / "o.params").exists()


@pytest.mark.parametrize(
    ("edit", "says"),
    [
        (lambda one: one["sensors"]["accelerometer"]["matrix"].pop(), "three rows"),
        (lambda one: one["sensors"]["accelerometer"]["matrix"][0].__setitem__(0, 0.0), "singular"),
        (lambda one: one["sensors"]["accelerometer"]["bias"].append(1.0), "three numbers"),
        (lambda one: one["sensors"]["gyroscope"]["effects"][0]["sizes"].pop(), "8 sizes for 9"),
        (lambda one: one["hold_means"].pop(), "missing hold"),
        (lambda one: one["sensors"].clear(), "holds no sensor"),
        (lambda one: one["sensors"]["accelerometer"].update(bias_unit="rad/s"), "be in 'rad/s'"),
        (lambda one: one["sensors"]["gyroscope"].update(bias_unit="furlong"), "be in 'furlong'"),
        (lambda one: one["sensors"]["accelerometer"].update(grade="fine"), "is no grade"),
        (
            lambda one: one["sensors"]["gyroscope"].update(parameter_covariance=[[1.0]]),
            "covariance of the parameters is not a valid one",
        ),
        (
            lambda one: one["sensors"]["accelerometer"].update(covariance=np.eye(8).tolist()),
            "not a valid one of 9 numbers",
        ),
        (
            lambda one: one["sensors"]["gyroscope"].update(covariance=(-np.eye(12)).tolist()),
            "not a valid one of 12 numbers",
        ),
        (  # twelve numbers cannot all oppose one another
            lambda one: one["sensors"]["gyroscope"].update(
                covariance=(1.6 * np.eye(12) - 0.6).tolist()
            ),
            "not a valid one of 12 numbers",
        ),
        (
            lambda one: one["hold_means"][2]["gyroscope_covariance"].__setitem__(1, []),
            "does not have a valid covariance of three axes",
        ),
        (
            lambda one: one["rotation_increments"][0].update(accelerometer=[[0.0, 0.0]]),
            "does not have the accelerometer's reading",
        ),
        (lambda one: one["hold_means"][2].update(previous=[]), "have three numbers"),
        (
            lambda one: one["hold_means"][2].update(accelerometer_scatter=[1.0, -1.0, 1.0]),
            "has a negative variance",
        ),
        (
            lambda one: one["hold_means"][2]["accelerometer"].__setitem__(0, 1e300),
            "the accelerometer's error on the measurements in the file is",
        ),
    ],
)
def test_a_file_edited_by_hand_is_refused_with_what_is_wrong(
    edit: Any, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    saved = calibration().save(tmp_path / "my.json")
    document = json.loads(saved.read_text())
    edit(document)
    saved.write_text(json.dumps(document))
    for command in ("export --to json", "report", "diff", "recheck"):
        name, *options = command.split()
        files = [str(saved), str(saved)] if name in ("diff", "recheck") else [str(saved)]
        assert cli.main([name, *files, *options]) == 2, command
        said = capsys.readouterr().err
        assert says in said
        assert said.count("\n") == 1


def test_the_calibration_itself_is_never_written_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    saved = calibration().save(tmp_path / "my.json")
    assert cli.main(["export", str(saved), "--to", "json", "-o", str(saved)]) == 2
    assert "give another name" in capsys.readouterr().err
