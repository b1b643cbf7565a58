"""``imucal-wizard compare``: both papers' methods and our own on one recording."""

import json
import re
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from imucal_wizard.cli import main as cli
from imucal_wizard.simulate.recording import simulate_recording
from tests.cli.flat import flat_recording
from tests.estimate.field_truth import recorded, six_circles

METHODS = {
    "accelerometer": [
        "least_squares",
        "newton",
        "six-position",
        "numeric",
        "two-step",
        "algebraic",
    ],
    "gyroscope": ["vector", "static", "dynamic", "offset"],
    "magnetometer": ["orthogonal", "numeric", "two-step", "algebraic"],
}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """A session: accelerometer and gyroscope in one file, the magnetometer in another."""
    folder = tmp_path_factory.mktemp("session")
    simulate_recording(folder / "imu.csv", seed=5)
    rng = np.random.default_rng(5)
    series = recorded(six_circles(rng), rng).series
    rows = np.column_stack([series.time, 0.1 * series.values])
    header = "t[s],mx[uT],my[uT],mz[uT]"
    np.savetxt(folder / "field.csv", rows, "%.6g", ",", header=header, comments="")
    return [str(folder / "imu.csv"), str(folder / "field.csv")]


@pytest.fixture(scope="module")
def compared(
    files: list[str], tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, dict[str, Any]]:
    """What ``compare`` prints and writes of the session."""
    path = tmp_path_factory.mktemp("compared") / "compare.json"
    with redirect_stdout(StringIO()) as printed:
        assert cli.main(["compare", *files, "--json", str(path)]) == 0
    return printed.getvalue(), json.loads(path.read_text())


def test_all_methods_stand_on_one_screen(compared: tuple[str, dict[str, Any]]) -> None:
    """Every method of every sensor in a row, in 80 columns, with its paper."""
    lines = compared[0].splitlines()
    assert max(map(len, lines)) <= 80
    assert len(lines) <= 36
    text = "\n".join(lines)
    for names in METHODS.values():
        for name in names:
            assert any(line[2:].startswith(name) for line in lines), name
    assert "two-step (N)" in text
    assert "newton (Q)" in text
    assert "▸ orthogonal" in text
    assert "▸ six-position" not in text
    assert not re.search(r"%\d", text), "two columns touch"


def test_the_document_holds_every_result_whole(compared: tuple[str, dict[str, Any]]) -> None:
    """For scripts: matrix, bias and errors of each; the default has the least error held out."""
    _, document = compared
    assert document["schema"] == "imucal-wizard/compare/1"
    for sensor, names in METHODS.items():
        rows = document["sensors"][sensor]
        found = [row["method"] for row in rows]
        assert found[0] == names[0]
        assert [name for name in found if name in names] == names
        first = rows[0]["result"]
        assert np.shape(first["matrix"]) == (3, 3)
        for row in rows[1:]:
            held_out = row["result"]["rms_held_out"]
            if held_out is not None and row["result"]["unit"] == first["unit"]:
                assert first["rms_held_out"] <= 1.02 * held_out


def test_a_magnetometer_alone_is_compared_too(
    files: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """N's figure of merit for each of its methods."""
    assert cli.main(["compare", files[1], "--json", "-"]) == 0
    sensors = json.loads(capsys.readouterr().out)["sensors"]
    assert list(sensors) == ["magnetometer"]
    found = {row["method"]: row for row in sensors["magnetometer"]}
    for row in map(found.__getitem__, METHODS["magnetometer"]):
        assert 0.0005 < row["relative_error"] < 0.015


def test_a_method_that_finds_nothing_says_why(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Between tilted poses no turn is about one axis alone, as Q's two approaches need it."""
    path = tmp_path / "tilted.csv"
    simulate_recording(path, seed=6, poses="8", rotations=0)
    assert cli.main(["compare", str(path), "--json", "-"]) == 0
    rows = {
        row["method"]: row for row in json.loads(capsys.readouterr().out)["sensors"]["gyroscope"]
    }
    assert rows["offset"]["result"]["model"] == ["bias"]
    assert rows["vector"]["why"] is None
    for method in ("static", "dynamic"):
        assert rows[method]["result"] is None
        assert "about one level axis at a time" in rows[method]["why"]
    assert cli.main(["fit", str(path), "--gyro-method", "offset"]) == 0
    text = capsys.readouterr().out
    assert "(offset)" in text
    assert "°/s" in text


def test_tilted_poses_of_the_simulator_are_n_s_procedure(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """``simulate --poses 8``: bias and scale come out, the off-diagonals are left at zero."""
    path = tmp_path / "tilted.csv"
    simulate_recording(path, seed=7, poses="8", rotations=0)
    assert cli.main(["fit", str(path), "--method", "numeric", "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)["sensors"]["accelerometer"]
    carried = {name: one["carried"] for name, one in found["parameters"].items()}
    assert carried["sensitivity_z"]
    assert not carried["theta_yz"]


def test_nothing_to_compare_is_exit_status_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A device that lay still; the document says why, as every command's does."""
    path = str(flat_recording(tmp_path))
    assert cli.main(["compare", path]) == 1
    assert capsys.readouterr().err.count("\n") == 1
    assert cli.main(["compare", path, "--json", "-"]) == 1
    captured = capsys.readouterr()
    document = json.loads(captured.out)
    assert document["schema"] == "imucal-wizard/compare/1"
    assert "six" in document["error"]
    assert document["sensors"] == {}
    assert captured.err.count("\n") == 1
