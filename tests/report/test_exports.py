"""Exports: every target is read back in the consumer's own formula."""

import json
from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.cli import main as cli
from imucal_wizard.core.errors import UsageError
from imucal_wizard.report.calibration_file import Calibration, Sensor, Value
from imucal_wizard.report.exports import targets, write_export
from imucal_wizard.report.measured import HoldMeans

G = 9.80665
MATRIX = np.array([[1.02, 0.03, -0.01], [0.0, 0.97, 0.02], [0.0, 0.0, 1.05]])
BIAS = np.array([0.3, -0.5, 0.8])


def calibration(unit: str = "m/s^2") -> Calibration:
    """An exact calibration far from identity, with the readings of six faces."""
    up = G * np.concatenate([np.eye(3), -np.eye(3)])
    readings = up @ np.linalg.inv(MATRIX).T + BIAS
    means = [
        HoldMeans(5.0 * k, 5.0 * k + 3.0, row.tolist(), (1e-8 * np.eye(3)).tolist())
        for k, row in enumerate(readings)
    ]
    sensor = Sensor(
        model=["bias", "scale", "non-orthogonality"],
        method="least_squares",
        frame="own",
        matrix=MATRIX.tolist(),
        bias=BIAS.tolist(),
        bias_unit=unit,
        parameters={},
        unit="m/s^2",
        rms_before=0.5,
        rms_fitted=1e-4,
        rms_held_out=1e-4,
    )
    return Calibration(
        schema="imucal-wizard/calibration/1",
        program="0",
        created="2026-01-01T00:00:00+00:00",
        source="a test",
        gravity=Value(G, "m/s^2"),
        temperature=None,
        holds=6,
        rotations=0,
        sensors={"accelerometer": sensor},
        hold_means=means,
    )


@pytest.mark.parametrize("name", list(targets()))
def test_every_target_reads_back_what_was_written(name: str, tmp_path: Path) -> None:
    done = write_export(calibration(), name, tmp_path / "out")
    assert done.rms_before is not None
    assert done.rms_before > 0.3
    assert done.rms_calibration == pytest.approx(0.0, abs=1e-12)
    assert done.rms_exported == pytest.approx(0.0, abs=1e-12)


def test_the_bias_of_imu_calib_acts_after_the_matrix(tmp_path: Path) -> None:
    """``SM · raw − bias``: the file's bias is M b."""
    path = tmp_path / "imu.yaml"
    write_export(calibration(), "ros-imu-calib", path)
    lines = [line.split(":") for line in path.read_text().splitlines()]
    found = {key: json.loads(text) for key, text in lines}
    np.testing.assert_array_equal(np.reshape(found["SM"], (3, 3)), MATRIX)
    np.testing.assert_allclose(found["bias"], MATRIX @ BIAS, rtol=1e-15)


def test_a_file_of_another_kind_is_not_written_over(tmp_path: Path) -> None:
    path = tmp_path / "notes.yaml"
    path.write_text("keep: this\n")
    with pytest.raises(UsageError, match="is there already and is no file for ros-imu-calib"):
        write_export(calibration(), "ros-imu-calib", path)
    assert path.read_text() == "keep: this\n"


def test_counts_are_refused_where_the_consumer_has_si(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="calibrate what the driver publishes"):
        write_export(calibration("count"), "ros-imu-calib", tmp_path / "imu.yaml")
    assert not list(tmp_path.iterdir())


def test_an_unknown_target_is_told_with_those_that_there_are(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="there are " + ", ".join(targets())):
        write_export(calibration(), "betamax", tmp_path / "x")


def test_the_command_proves_what_it_writes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    saved = calibration().save(tmp_path / "my.json")
    assert cli.main(["export", str(saved), "--to", "ros-imu-calib", "--json", "-"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "imucal-wizard/export/1"
    assert document["rms_exported"] == pytest.approx(0.0, abs=1e-12)
    assert Path(document["path"]).name == "my.ros-imu-calib.yaml"
    assert cli.main(["export", str(saved), "--to", "ros-imu-calib"]) == 0
    assert "SM · raw − bias" in capsys.readouterr().out


def test_the_targets_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["export", "--list", "--json", "-"]) == 0
    listed = json.loads(capsys.readouterr().out)["targets"]
    assert {"json", "ros-imu-calib"} <= {one["name"] for one in listed}
    assert all(one["title"] for one in listed)


def test_a_calibration_of_an_older_version_is_exported_without_a_proof(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its file has no holds to apply the export to."""
    old = Path(__file__).parents[1] / "golden" / "data" / "calibration.json"
    path = tmp_path / "imu.yaml"
    assert cli.main(["export", str(old), "--to", "ros-imu-calib", "-o", str(path)]) == 0
    assert "not proven" in capsys.readouterr().out


def test_the_calibration_itself_is_never_written_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    saved = calibration().save(tmp_path / "my.json")
    assert cli.main(["export", str(saved), "--to", "json", "-o", str(saved)]) == 2
    assert "give another name" in capsys.readouterr().err
