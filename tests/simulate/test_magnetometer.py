"""The virtual magnetometer: its own rate in the IMU's lines, a truth that the fit finds again."""

import json
from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.cli import main as cli
from imucal_wizard.simulate.magnetometer import TrueField
from imucal_wizard.simulate.recording import simulate_recording

SEED = 2


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All three sensors in one file."""
    path = tmp_path_factory.mktemp("field") / "all.csv"
    simulate_recording(path, rate=50.0, seed=SEED, magnetometer=True)
    return path


def test_the_field_has_its_own_rate_and_the_contracts_columns(tmp_path: Path) -> None:
    """80 samples a second of µT where accelerometer and gyroscope have 100; no warning."""
    recording = tmp_path / "all.csv"
    simulate_recording(recording, seed=SEED, poses="6", rotations=0, magnetometer=True)
    header = recording.read_text().splitlines()[1]
    assert header.endswith("gz[rad/s],mx[uT],my[uT],mz[uT],temp[degC]")
    readings = read_files([recording])
    field = readings.magnetometer
    assert field is not None
    assert field.unit == "uT"
    length = field.time[-1] - field.time[0]
    assert (len(field) - 1) / length == pytest.approx(80.0, rel=1e-3)
    assert not any("magnetometer" in text for text in readings.warnings)


def test_a_magnetometer_changes_nothing_of_the_other_sensors(
    recording: Path, tmp_path: Path
) -> None:
    """The same seed without it: the same lines up to the circles, but for three fields."""
    plain = tmp_path / "plain.csv"
    simulate_recording(plain, rate=50.0, seed=SEED)
    without = plain.read_text().splitlines()
    rows = [line.split(",") for line in recording.read_text().splitlines()[2 : len(without)]]
    assert [",".join([*row[:7], row[10]]) for row in rows] == without[2:]


def test_the_fit_finds_hard_iron_soft_iron_and_misalignment_again(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Within 4.5 standard errors each, in the one file; the clocks are one clock."""
    assert cli.main(["fit", str(recording), "--no-verdict", "--json", "-"]) == 0
    document = json.loads(capsys.readouterr().out)
    found = document["sensors"]["magnetometer"]["parameters"]
    truth = TrueField.drawn(SEED)
    gain = np.linalg.inv(truth.gain)
    gain /= np.cbrt(np.linalg.det(gain))
    true = {f"bias_{axis}": truth.hard_iron[i] for i, axis in enumerate("xyz")}
    true |= {f"misalignment_{axis}": truth.misalignment[i] for i, axis in enumerate("xyz")}
    for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        true[f"soft_iron_{'xyz'[i]}{'xyz'[j]}"] = gain[i, j]
    for name, value in true.items():
        assert abs(found[name]["value"] - value) < 4.5 * found[name]["standard_error"]
    stage = document["second_stage"]
    dip = -np.arctan2(truth.world[2], truth.world[1])
    assert stage["dip"] == pytest.approx(dip, abs=5.0 * stage["dip_standard_error"])
    offset = stage["clock_offset"]
    # a sample stands in the line of the first IMU sample after it is due, at most 10 ms
    assert abs(offset["seconds"]) < 2e-3


@pytest.mark.study
def test_the_command_writes_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """``simulate --magnetometer``, then ``compare``: every method of both papers on one file."""
    path = tmp_path / "all.csv"
    assert (
        cli.main(
            ["simulate", str(path), "--magnetometer", "--rate", "50", "--poses", "6", "--seed", "9"]
        )
        == 0
    )
    assert cli.main(["compare", str(path)]) == 0
    text = capsys.readouterr().out
    for word in ("newton (Q)", "two-step (N)", "numeric (N)", "vector + field", "orthogonal"):
        assert word in text
