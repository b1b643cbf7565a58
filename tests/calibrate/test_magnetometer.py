"""``fit`` with a magnetometer in the recording: report, JSON, text, saved calibration."""

import json
from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.api import load
from imucal_wizard.cli import main as cli
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.simulate.recording import simulate_recording
from tests.cli.documents import fit_json
from tests.estimate.field_truth import (
    MAGNITUDE,
    OFFSET,
    recorded,
    six_circles,
    true_parameters,
)

FACTORS = {"uT": 0.1, "nT": 100.0, "G": 1e-3, "mG": 1.0, "count": 1.0}
"""What N's counts of 0.1 µT are in other units."""


def readings(seed: int = 0, extra: float = 0.0) -> FloatArray:
    """Time and N's counts while a hand makes six circles, shape (n, 4)."""
    rng = np.random.default_rng(seed)
    directions = six_circles(rng)
    off = np.zeros((len(directions), 3))
    off[4000:4200, 1] = extra
    series = recorded(directions, rng, extra=off).series
    return np.column_stack([series.time, series.values])


def write(path: Path, values: FloatArray, unit: str) -> Path:
    """A recording of the magnetometer alone."""
    header = f"t[s],mx[{unit}],my[{unit}],mz[{unit}]"
    rows = np.column_stack([values[:, 0], values[:, 1:] * FACTORS[unit]])
    np.savetxt(path, rows, fmt="%.7g", delimiter=",", header=header, comments="")
    return path


@pytest.mark.parametrize("unit", FACTORS)
def test_every_unit_of_the_field_is_read(
    unit: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The hard iron comes out in µT whatever the file is in; counts stay counts."""
    path = write(tmp_path / "field.csv", readings(), unit)
    sensors = fit_json(capsys, str(path))["sensors"]
    assert isinstance(sensors, dict)
    sensor = sensors["magnetometer"]
    size = 1.0 if unit == "count" else 0.1
    assert sensor["bias_unit"] == ("count" if unit == "count" else "uT")
    assert sensor["bias"] == pytest.approx(OFFSET * size, abs=1.0 * size)
    assert np.linalg.det(sensor["matrix"]) == pytest.approx(1.0)
    assert sensor["frame"] == "own"


def test_the_document_has_every_key_of_the_contract(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The sensor's keys, and beside them the field, N's relative error and what was left out."""
    path = write(tmp_path / "field.csv", readings(extra=120.0), "uT")
    document = fit_json(capsys, str(path))
    sensors, field = document["sensors"], document["magnetometer"]
    assert isinstance(sensors, dict)
    assert isinstance(field, dict)
    sensor = sensors["magnetometer"]
    for key in ("model", "method", "matrix", "bias", "bias_unit", "parameters", "unit"):
        assert key in sensor
    assert sensor["model"] == ["bias", "soft-iron"]
    assert sensor["unit"] == "uT"
    assert 0.02 < sensor["rms_fitted"] <= sensor["rms_held_out"] < 0.1 < sensor["rms_before"]
    true = true_parameters()
    for name, found in sensor["parameters"].items():
        scale = 1.0 if name.startswith("soft") else 0.1
        assert abs(found["value"] - scale * true[name]) < 4.5 * found["standard_error"]
    assert np.shape(sensor["covariance"]) == (9, 9)
    assert field["relative_error"] == pytest.approx(sensor["rms_fitted"] / field["field"])
    assert len(field["directions"]) == 100
    assert sum(field["directions"]) == field["samples"]
    assert any(run["start"] < 51.0 < run["end"] for run in field["left_out"])
    rate = document["rate"]
    assert isinstance(rate, dict)
    assert rate["magnetometer"] == pytest.approx(80.0)


def test_a_saved_calibration_brings_every_reading_to_the_field(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Fit with --field, save, load, apply: µT of the length given."""
    values = readings()
    path, place = write(tmp_path / "field.csv", values, "count"), tmp_path / "my.json"
    fit_json(capsys, str(path), "--field", "48.5", "--save", str(place))
    corrected = load(place).sensors["magnetometer"].apply(values[:, 1:])
    assert np.linalg.norm(corrected, axis=1).mean() == pytest.approx(48.5, rel=1e-3)
    assert load(place).sensors["magnetometer"].unit == "uT"


def test_the_covariance_gives_the_standard_errors(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of hard and soft iron, with a given field and with determinant 1."""
    path = write(tmp_path / "field.csv", readings(), "uT")
    for arguments in ((), ("--field", "43.8")):
        sensors = fit_json(capsys, str(path), *arguments)["sensors"]
        assert isinstance(sensors, dict)
        sensor = sensors["magnetometer"]
        names = [*(f"bias_{a}" for a in "xyz"), *(f"soft_iron_{a}" for a in _PAIRS)]
        errors = [sensor["parameters"][name]["standard_error"] for name in names]
        assert np.sqrt(np.diag(sensor["covariance"])) == pytest.approx(errors, rel=1e-4)


_PAIRS = ("xx", "xy", "xz", "yy", "yz", "zz")


def test_files_of_one_session_are_fitted_together(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Accelerometer and gyroscope at 100 Hz, the magnetometer at 80 with its own times."""
    inertial = tmp_path / "imu.csv"
    simulate_recording(inertial, seed=3)
    field = write(tmp_path / "field.csv", readings(), "uT")
    sensors = fit_json(capsys, str(inertial), str(field))["sensors"]
    assert isinstance(sensors, dict)
    assert set(sensors) == {"accelerometer", "gyroscope", "magnetometer"}
    assert cli.main(["fit", str(inertial), str(field)]) == 0
    text = capsys.readouterr().out
    assert "MAGNETOMETER" in text
    assert "of 100 directions covered" in text
    assert "mg" not in text.split("MAGNETOMETER")[1].split("\n\n")[0]
    assert max(map(len, text.splitlines())) <= 80


@pytest.mark.parametrize("method", ["orthogonal", "algebraic", "two-step", "numeric"])
def test_each_method_can_be_the_result(
    method: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path / "field.csv", readings(), "uT")
    document = fit_json(capsys, str(path), "--mag-method", method)
    sensors = document["sensors"]
    assert isinstance(sensors, dict)
    assert sensors["magnetometer"]["method"] == method
    field = document["magnetometer"]
    assert isinstance(field, dict)
    assert field["field"] == pytest.approx(0.1 * MAGNITUDE, rel=0.01)


def test_a_field_that_determines_nothing_is_refused_and_leaves_no_result(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Half a circle: exit status 1, the reason in the JSON, no sensor in it."""
    path = write(tmp_path / "field.csv", readings()[:700], "uT")
    assert cli.main(["fit", str(path), "--json", "-"]) == 1
    captured = capsys.readouterr()
    document = json.loads(captured.out)
    assert document["sensors"] == {}
    assert ". The magnetometer is not calibrated: " in document["error"]
    assert "one plane" in document["error"]


def test_a_bad_magnetometer_spoils_no_good_accelerometer(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The inertial sensors come out; of the magnetometer it is said why not."""
    inertial = tmp_path / "imu.csv"
    simulate_recording(inertial, seed=4, rotations=0)
    field = write(tmp_path / "field.csv", readings()[:700], "uT")
    document = fit_json(capsys, str(inertial), str(field))
    sensors, warnings = document["sensors"], document["warnings"]
    assert isinstance(sensors, dict)
    assert isinstance(warnings, list)
    assert "accelerometer" in sensors
    assert "magnetometer" not in sensors
    assert any("magnetometer is not calibrated" in text for text in warnings)


@pytest.mark.parametrize("field", ["0", "5", "500", "x"])
def test_a_field_that_is_not_the_earths_is_wrong_usage(
    field: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["fit", "x.csv", "--field", field]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_the_bench_of_a_recording_without_accelerometer_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The magnetometer alone stands on it; two circles are too few for that."""
    path = write(tmp_path / "field.csv", readings()[:2000], "uT")
    assert cli.main(["bench", str(path)]) == 0, "a verdict is a result"
    said = capsys.readouterr()
    assert "MAGNETOMETER  INSUFFICIENT" in said.out
    assert f"{said.out}{said.err}".count("has no accelerometer") == 1
    assert said.err.count("do not determine the off-diagonal soft iron") == 1


def test_the_fit_of_a_magnetometer_alone_says_once_that_there_is_no_accelerometer(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As a verdict; without verdicts as a warning."""
    path = str(write(tmp_path / "field.csv", readings()[:2000], "uT"))
    for options in ([], ["--no-verdict"]):
        assert cli.main(["fit", path, *options]) == 0
        said = " ".join(capsys.readouterr().out.split())
        assert said.count("accelerometer is not calibrated") == 1
