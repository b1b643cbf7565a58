"""``sessions``: what was measured, how far each session came, and what its verdict was."""

import json
from pathlib import Path

import msgspec
import pytest

from imucal_wizard.cli import main as cli
from imucal_wizard.cli.arguments import kept_session
from imucal_wizard.cli.wizard import parser
from imucal_wizard.sessions import Session
from tests.cli.kept_sessions import sat
from tests.report.devices import calibration

Capture = pytest.CaptureFixture[str]


def test_the_sessions_are_listed_with_device_step_holds_and_verdict(
    tmp_path: Path, capsys: Capture
) -> None:
    kept = sat(tmp_path / "2031-01-01_080000.imucal", share=0.6).collected()
    about = {"created": 2e9, "step": "save", "description": {"device": "arm", "serial": "7"}}
    Session.create(tmp_path / "2033-05-18_033320.imucal", about).close()
    made = calibration(turns=4, felt=False)
    sensors = {
        name: msgspec.structs.replace(one, grade="good" if name == "gyroscope" else "doubtful")
        for name, one in made.sensors.items()
    }
    name = "2033-05-18_033320.imucal"
    msgspec.structs.replace(made, session=name, sensors=sensors).save(tmp_path / "cal.json")
    (tmp_path / "broken.imucal").write_bytes(b"no database")
    assert cli.main(["sessions", "--sessions", str(tmp_path), "--json", "-"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "imucal-wizard/sessions/1"
    rows = {Path(one["path"]).stem: one for one in document["sessions"]}
    first, second = rows["2031-01-01_080000"], rows["2033-05-18_033320"]
    assert (first["step"], first["holds"], first["finished"]) == ("poses", len(kept.holds), False)
    assert (first["grades"], first["problem"]) == ({}, None)
    assert (second["device"], second["finished"]) == ("arm", True)
    assert second["grades"]["gyroscope"] == "good"
    assert "is not a session" in rows["broken"]["problem"]
    assert cli.main(["sessions", "--sessions", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines[:4])) <= 80
    (row,) = [line for line in lines if line.startswith("2033-05-18_033320")]
    assert row.split()[-4:] == ["Save", "0", "DOUBTFUL", "arm"]


def test_a_session_is_found_by_the_name_in_the_list(tmp_path: Path) -> None:
    Session.create(tmp_path / "2031-01-01_080000.imucal", {}).close()
    for name in ("2031-01-01_080000", "2031-01-01_080000.imucal"):
        arguments = parser().parse_args(["--resume", name, "--sessions", str(tmp_path)])
        assert kept_session(arguments.resume, arguments) == tmp_path / "2031-01-01_080000.imucal"
    arguments = parser().parse_args(["--resume", "other", "--sessions", str(tmp_path)])
    assert kept_session(arguments.resume, arguments) == Path("other")


def test_no_sessions_and_no_folder_are_no_fault(tmp_path: Path, capsys: Capture) -> None:
    assert cli.main(["sessions", "--sessions", str(tmp_path / "none")]) == 0
    assert "no sessions in" in capsys.readouterr().out
    assert not (tmp_path / "none").exists()
    (tmp_path / "file").write_text("x")
    assert cli.main(["sessions", "--sessions", str(tmp_path / "file")]) == 2
