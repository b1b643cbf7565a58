"""``fit --save --device`` and ``devices``: a device keeps its history."""

import json
from pathlib import Path
from typing import Any

import pytest

from imucal_wizard.cli import main as cli
from imucal_wizard.report.calibration_file import read_calibration
from tests.cli.kept_sessions import printed

Capture = pytest.CaptureFixture[str]


def devices(capsys: Capture, folder: Path, *options: str) -> dict[str, Any]:
    """What ``devices --json -`` writes."""
    assert cli.main(["devices", *options, "--sessions", str(folder), "--json", "-"]) == 0
    document: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert document["schema"] == "imucal-wizard/devices/1"
    return document


def test_a_device_keeps_its_history(tmp_path: Path, capsys: Capture) -> None:
    """Three dates of one device: as found, as left, drift, a plot; and what is asked in vain."""
    recording, folder, saved = tmp_path / "r.csv", tmp_path / "s", tmp_path / "cal.json"
    head, _, rest = printed().decode().partition("temp[degC]\n")
    lines = rest.splitlines()
    for month, fewer in (("01", 0), ("02", 40), ("03", 80)):
        recording.write_text("\n".join([f"{head}temp[degC]", *lines[fewer:]]))
        command = ["fit", str(recording), "--no-verdict", "--save", str(saved)]
        about = ["--device", "arm", "--serial", "77", "--place", "bench 3", "--note", "cold"]
        when = ["--date", f"2031-{month}-10", "--sessions", str(folder)]
        assert cli.main([*command, *about, *when]) == 0
        assert "kept in the history of arm" in capsys.readouterr().out
    kept = read_calibration(saved)
    assert kept.device is not None
    assert (kept.device.name, kept.device.serial, kept.place["name"]) == ("arm", "77", "bench 3")
    assert kept.measured is not None
    assert kept.measured.startswith("2031-03-10T00:00:00")
    (listed,) = devices(capsys, folder)["devices"]
    assert (listed["name"], listed["serial"], listed["calibrations"]) == ("arm", "77", 3)
    document = devices(capsys, folder, "ARM")
    first, second, third = (one["sensors"]["accelerometer"] for one in document["calibrations"])
    assert first["as_found_by"] is None
    assert first["as_found"] > 20.0 * first["as_left"]  # the nominal conversion
    assert second["as_found_by"] == "2031-01-10_000000.calibration.json"
    assert second["as_found"] < 2.0 * second["as_left"]  # nothing has changed
    course = document["drift"]["accelerometer"]["bias_x"]
    assert course["dates"] == 3
    assert course["newest"] == third["parameters"]["bias_x"]["value"]
    assert abs(course["per_month"]) < 4.0 * course["standard_error"]
    assert cli.main(["devices", "77", "--sessions", str(folder)]) == 0
    text = capsys.readouterr().out
    assert max(map(len, text.splitlines())) <= 78
    assert cli.main(["devices", "77", "--sessions", str(folder), "--view", "bias_x"]) == 0
    assert "days since 2031-01-10" in capsys.readouterr().out
    for wrong, says in (
        (["devices", "leg"], "there is no device 'leg' here; known: arm"),
        (["devices", "arm", "--view", "bias_q"], "arm has no parameter 'bias_q'"),
        (["devices", "--view", "bias_x"], "of one device"),
        (["fit", str(recording), "--date", "tomorrow"], "'tomorrow' is no date"),
    ):
        assert cli.main([*wrong, "--sessions", str(folder)]) == 2
        assert says in capsys.readouterr().err
