"""``imucal-wizard fit`` as a person and a script meet it."""

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.hand_motion import Device, placed, recorded, settling_alike
from imucal_wizard.api import load
from imucal_wizard.cli import main as cli
from imucal_wizard.core.readings import Series
from imucal_wizard.simulate.recording import simulate_recording
from tests.cli.documents import fit_json, saved
from tests.cli.flat import flat_recording
from tests.shared_data import shared_data
from tests.simulate.sensors import truth


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of the virtual IMU with 18 poses and rotations."""
    path = tmp_path_factory.mktemp("simulated") / "recording.csv"
    simulate_recording(path, seed=11)
    return path


def test_a_simulated_recording_gives_back_the_true_calibration(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Within 4.5 standard errors each: 21 numbers exceed that by chance once in 7,000 runs."""
    document = fit_json(capsys, str(recording))
    sensors = document["sensors"]
    assert isinstance(sensors, dict)
    known = truth(11)
    for name, bias in (
        ("accelerometer", known.accelerometer_bias),
        ("gyroscope", known.gyroscope_bias),
    ):
        parameters = sensors[name]["parameters"]
        for axis, true in zip("xyz", bias, strict=True):
            found = parameters[f"bias_{axis}"]
            assert abs(found["value"] - true) < 4.5 * found["standard_error"]
        matrix = known.accelerometer_matrix if name == "accelerometer" else known.gyroscope_matrix
        for i, axis in enumerate("xyz"):
            found = parameters[f"sensitivity_{axis}"]
            assert abs(found["value"] - 1.0 / matrix[i, i]) < 4.5 * found["standard_error"]


def test_the_document_has_every_key_of_the_contract(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    document = fit_json(capsys, str(recording))
    assert document["schema"] == "imucal-wizard/fit/1"
    assert {"rate", "warnings", "holds", "rotations", "sensors"} <= document.keys()
    holds, rotations, sensors = document["holds"], document["rotations"], document["sensors"]
    assert isinstance(holds, list)
    assert isinstance(rotations, list)
    assert isinstance(sensors, dict)
    wanted = {"start", "end", "direction", "pose", "mean_accelerometer", "mean_gyroscope"}
    assert wanted | {"temperature"} <= holds[0].keys()
    assert np.linalg.norm(holds[0]["direction"]) == pytest.approx(1.0)
    assert {"start", "end", "axis", "angle"} <= rotations[0].keys()
    assert {rotation["axis"] for rotation in rotations} >= {"x", "y", "z"}
    for sensor, frame in (("accelerometer", "own"), ("gyroscope", "accelerometer")):
        assert sensors[sensor]["frame"] == frame
        for key in ("model", "method", "matrix", "bias", "bias_unit", "parameters", "unit"):
            assert key in sensors[sensor]
        for key in ("rms_before", "rms_fitted", "rms_held_out"):
            assert sensors[sensor][key] > 0.0
        for parameter in sensors[sensor]["parameters"].values():
            assert {"value", "standard_error", "unit"} <= parameter.keys()
    assert np.array(sensors["accelerometer"]["matrix"])[np.tril_indices(3, -1)].tolist() == [0] * 3


def test_rotations_whose_angle_nobody_can_tell_are_listed_all_the_same(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The method ``offset`` finds a bias and no scale, so that nothing says how far each went."""
    whole = fit_json(capsys, str(recording))["rotations"]
    alone = fit_json(capsys, str(recording), "--gyro-method", "offset")["rotations"]
    assert isinstance(whole, list)
    assert isinstance(alone, list)
    assert [one["start"] for one in alone] == [one["start"] for one in whole]
    assert {one["angle"] for one in alone} == {None}


def test_figures_of_the_usual_fit_are_not_said_of_a_method(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Rates at rest have no closure, and judge no scale."""
    assert cli.main(["fit", str(recording), "--gyro-method", "offset", "--json", "-"]) == 0
    one = json.loads(capsys.readouterr().out)["sensors"]["gyroscope"]
    assert (one["unit"], one["could_be"], one["grade"]) == ("rad/s", None, "doubtful")


def test_the_summary_names_parameters_with_standard_errors(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["fit", str(recording)]) == 0
    text = capsys.readouterr().out
    assert "ACCELEROMETER" in text
    assert "GYROSCOPE" in text
    assert "sensitivity_x" in text
    assert "±" in text
    assert "held out" in text
    assert max(map(len, text.splitlines())) <= 80


def test_what_a_method_leaves_out_is_not_blamed_on_the_data(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """These poses carry the angles; six positions do not fit them."""
    methods = "--method", "six-position", "--gyro-method", "static"
    assert cli.main(["fit", str(recording), *methods]) == 0
    text = capsys.readouterr().out
    assert "0 rad  nominal: the static method does not fit it" in text
    assert "0 rad  nominal: the six-position method does not fit it" in text
    assert "data do not carry" not in text


def test_a_saved_calibration_reads_back_to_the_same_numbers(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = tmp_path / "calibration.json"
    assert cli.main(["fit", str(recording), "--json", "-", "--save", str(place)]) == 0
    printed = capsys.readouterr()
    assert printed.err.endswith(f"saved: {place}\n")
    sensors = json.loads(printed.out)["sensors"]
    assert isinstance(sensors, dict)
    saved = load(place)
    assert saved.sensors["accelerometer"].matrix == sensors["accelerometer"]["matrix"]
    assert saved.sensors["gyroscope"].bias == sensors["gyroscope"]["bias"]
    assert saved.gravity.unit == "m/s^2"


def test_applying_a_saved_calibration_brings_gravity_to_its_size(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = tmp_path / "calibration.json"
    document = fit_json(capsys, str(recording), "--save", str(place))
    holds = document["holds"]
    assert isinstance(holds, list)
    means = np.array([hold["mean_accelerometer"] for hold in holds])
    corrected = load(place).sensors["accelerometer"].apply(means)
    errors = np.linalg.norm(corrected, axis=1) - 9.80665
    sensors = document["sensors"]
    assert isinstance(sensors, dict)
    fitted = sensors["accelerometer"]["rms_fitted"]
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(fitted, rel=1e-9)


def test_the_real_xsens_pair_gives_its_certificates_sensitivities(
    capsys: pytest.CaptureFixture[str],
) -> None:
    files = [str(shared_data(f"imu_tk_xsens/xsens_{name}.mat")) for name in ("acc", "gyro")]
    document = fit_json(capsys, *files, "--as", "imu_tk")
    holds, sensors = document["holds"], document["sensors"]
    assert isinstance(holds, list)
    assert isinstance(sensors, dict)
    assert 36 <= len(holds) <= 42
    found = sensors["accelerometer"]["parameters"]
    for axis, certified in zip("xyz", (414.9, 412.5, 415.1), strict=True):
        assert found[f"sensitivity_{axis}"]["value"] == pytest.approx(certified, rel=0.0015)
    mg = 9.80665e-3
    assert sensors["accelerometer"]["rms_fitted"] <= 0.12 * mg
    assert sensors["accelerometer"]["rms_held_out"] <= 0.20 * mg
    gyroscope = sensors["gyroscope"]
    expected = (2.093e-4, 2.099e-4, 2.095e-4)
    assert np.diag(gyroscope["matrix"]) == pytest.approx(expected, rel=0.005)
    assert gyroscope["rms_fitted"] <= np.radians(0.60)
    assert gyroscope["rms_held_out"] <= np.radians(0.70)


@pytest.mark.parametrize("name", ["imu0", "imu1"])
def test_the_real_mpu9150_logs_close(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(shared_data(f"mikoff_mpu9150/{name}.log"))
    options = ["--columns", "ax,ay,az,gx,gy,gz", "--rate", "100"]
    units = ["--accel-unit", "m/s^2", "--gyro-unit", "rad/s"]
    sensors = fit_json(capsys, path, *options, *units)["sensors"]
    assert isinstance(sensors, dict)
    assert sensors["accelerometer"]["rms_held_out"] <= 0.6 * 9.80665e-3
    assert sensors["gyroscope"]["rms_held_out"] <= np.radians(0.15)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["fit"], "--help"),
        (["fit", "no-such-file.csv"], "no-such-file.csv"),
        (["fit", "x.csv", "--gravity", "981"], "gravity on Earth"),
        (["fit", "x.csv", "--rate", "-5"], "above zero"),
        (["fit", "x.csv", "--method", "magic"], "magic"),
        (["--port", "a", "--replay", "b"], "two sources"),
        (["--no-such-option"], "--no-such-option"),
        (["simulate", "/no/such/folder/x.csv"], "/no/such/folder"),
    ],
)
def test_wrong_usage_is_one_clear_line_and_exit_status_two(
    arguments: list[str], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert says in captured.err


def test_data_that_determine_nothing_exit_with_one_and_the_document_says_why(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["fit", str(flat_recording(tmp_path)), "--json", "-"]) == 1
    captured = capsys.readouterr()
    document = json.loads(captured.out)
    assert "six" in document["error"]
    assert document["sensors"] == {}
    assert captured.err.count("\n") == 1


@pytest.mark.parametrize(
    ("command", "option"),
    [("fit", "--json"), ("fit", "--save"), ("compare", "--json"), ("bench", "--json"),
     ("wizard", "--save")],
)  # fmt: skip
def test_nothing_is_written_over_the_recording(
    command: str, option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also where it is named in another way."""
    path = flat_recording(tmp_path)
    before = path.read_bytes()
    (tmp_path / "folder").mkdir()
    other = str(tmp_path / "folder" / ".." / path.name)
    files = ["--replay", str(path)] if command == "wizard" else [str(path)]
    assert cli.main([command, *files, option, other]) == 2
    assert "is an input file" in capsys.readouterr().err
    assert path.read_bytes() == before


def test_a_simulated_recording_replaces_another_and_nothing_that_was_measured(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    measured, simulated = flat_recording(tmp_path), tmp_path / "simulated.csv"
    before = measured.read_bytes()
    assert cli.main(["simulate", str(measured), "--poses", "6"]) == 2
    assert "exists and is not a simulated recording" in capsys.readouterr().err
    assert measured.read_bytes() == before
    for seed in ("1", "2"):
        assert cli.main(["simulate", str(simulated), "--poses", "6", "--seed", seed]) == 0


def test_control_characters_in_a_file_name_never_reach_the_terminal(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert cli.main(["fit", "bad\x1b[2Jname.csv"]) == 2
    assert "\x1b" not in capsys.readouterr().err


@pytest.mark.parametrize("span", ["5", "5:", "a:b", "7:5", "1:2:3", "nan:3"])
def test_a_span_needs_two_ends_in_their_order(
    recording: Path, capsys: pytest.CaptureFixture[str], span: str
) -> None:
    assert cli.main(["fit", str(recording), "--without", span]) == 2
    assert "give its ends, like 12.5:18" in capsys.readouterr().err


@pytest.mark.parametrize("options", [(), ("--json", "-")])
def test_the_calibration_is_saved_although_nobody_reads_what_is_printed(
    options: tuple[str, ...], recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As ``| head -3`` closes the pipe before the text ends."""
    read, write = os.pipe()
    os.close(read)
    with open(write, "w", buffering=1) as closed:  # noqa: PTH123 (a number)
        monkeypatch.setattr("sys.stdout", closed)
        place = tmp_path / "my.json"
        given = "fit", str(recording), "--no-verdict", "--save", str(place)
        assert cli.main([*given, *options]) == 0
    assert set(load(place)) == {"accelerometer", "gyroscope"}


@pytest.mark.parametrize("reason", ["settling", "unit", "turned field"])
def test_what_is_saved_as_doubtful_is_read_by_all_commands(
    reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its reason may be none of the figures in the file, and a mean may be corrected."""
    rng, device = np.random.default_rng(25_980), Device()
    motion = placed(device, rng, turns=2)
    if reason == "settling":
        motion = settling_alike(motion, np.array([5.0, -2.5, 5.0]), 2.0)
    readings = recorded(motion, device, rng)
    if reason == "turned field":
        late = motion.time > 0.5 * motion.time[-1]
        level = 20.0 * np.exp(1j * np.radians(20.0) * late)
        world = np.column_stack([level.real, level.imag, np.full(len(late), -43.0)])
        field = motion.attitude.inv().apply(world) * [1.05, 1.0, 0.95] + [3.0, -8.0, 5.0]
        field += 0.04 * rng.standard_normal(world.shape)
        readings = replace(readings, magnetometer=Series(motion.time, field, "uT"))
    unit = "deg/s" if reason == "unit" else "rad/s"
    path, place = saved(readings, tmp_path / "a.csv", unit), tmp_path / "a.json"
    assert cli.main(["fit", str(path), "--save", str(place)]) == 0
    assert "DOUBTFUL" in capsys.readouterr().out
    assert "doubtful" in {one.grade for one in load(place).sensors.values()}
    assert cli.main(["report", str(place), "--output", str(tmp_path / "a.html")]) == 0
    assert cli.main(["diff", str(place), str(place)]) == 0
