"""What the commands say of themselves, and of where they may write."""

import argparse
import sys
from importlib import import_module
from pathlib import Path

import pytest

from imucal_wizard.cli import bench, wizard
from imucal_wizard.cli import main as cli
from imucal_wizard.core.poses import POSE_SETS
from imucal_wizard.estimate.accelerometer import BASE
from imucal_wizard.estimate.magnetometer.field_data import FIELD_BASE
from imucal_wizard.estimate.methods import MethodNames

METHODS = {"method": "accelerometer", "gyro_method": "gyroscope", "mag_method": "magnetometer"}


@pytest.mark.parametrize("command", cli.command_names())
def test_every_option_says_what_it_does(command: str) -> None:
    made = import_module(f"imucal_wizard.cli.{command}").parser()
    assert isinstance(made, argparse.ArgumentParser)
    silent = [action.dest for action in made._actions if not action.help]
    assert silent == []
    assert made.description


def test_only_available_options_are_offered() -> None:
    """The options say it again, since numpy waits until they are known to be right."""
    offered = {action.dest: action.choices for action in wizard.parser()._actions}
    for option, sensor in METHODS.items():
        assert tuple(offered[option] or ()) == tuple(MethodNames(sensor))
    assert offered["poses"] == tuple(POSE_SETS)
    assert bench.BASES == {
        "accelerometer": BASE,
        "gyroscope": BASE,
        "magnetometer": FIELD_BASE,
    }


def test_the_help_of_fit_and_bench_says_what_the_exit_status_means(
    capsys: pytest.CaptureFixture[str],
) -> None:
    for command in ("fit", "bench"):
        with pytest.raises(SystemExit):
            cli.main([command, "--help"])
        said = " ".join(capsys.readouterr().out.split())
        assert "Exit status: 0 done, whatever the verdict; 1 the data " in said


def test_the_first_help_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["--help"]) == 0
    said = capsys.readouterr().out
    assert all(f"imucal-wizard {name} " in said for name in cli.command_names())


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--baud", "0"], "'0' is no speed; give bits per second, like 115200"),
        (["noise", "--port", "x", "--baud", "fast"], "'fast' is no speed"),
        (["--speed", "0"], "'0' is not a speed from 0.001 to 1000"),
        (["recheck", "a.json", "--speed", "nan"], "'nan' is not a speed"),
        (["sessions", "--sessions", __file__], "is a file; give a folder"),
        (["recheck"], "arguments are required: CAL.json."),
    ],
)
def test_a_wrong_value_is_answered_before_anything_else(
    words: list[str], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(words) == 2
    assert says in capsys.readouterr().err


@pytest.mark.parametrize(
    ("typed", "answer"), [("fitt", "did you mean 'fit'?"), ("rec.csv", "the commands are wizard,")]
)
def test_a_command_that_is_unknown_is_named_with_the_nearest(
    typed: str, answer: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main([typed, "a.csv"]) == 2
    assert f"there is no command '{typed}'; {answer}" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments",
    [
        ["fit", "a.csv", "--save", "no/such/my.json"],
        ["fit", "a.csv", "--json", "no/such/my.json"],
        ["compare", "a.csv", "--json", "no/such/my.json"],
        ["bench", "a.csv", "--json", "no/such/my.json"],
        ["simulate", "no/such/a.csv"],
        ["--auto", "--save", "no/such/my.json"],
    ],
)
def test_a_folder_that_is_missing_is_no_place_to_write_and_is_not_made(
    arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is said before the work, which may be ten minutes of holding a device."""
    monkeypatch.chdir(tmp_path)
    assert cli.main(arguments) == 2
    assert list(tmp_path.iterdir()) == []


def test_the_missing_folder_and_what_to_do_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["fit", "a.csv", "--save", str(tmp_path / "no" / "my.json")]) == 2
    assert f"there is no folder {tmp_path / 'no'}; make it first" in capsys.readouterr().err


def test_a_file_that_is_written_has_a_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.main(["export", "my.json", "--to", "px4", "-o", "-"]) == 2
    assert "this goes to a file: give its name" in capsys.readouterr().err


def test_a_folder_given_as_a_file_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["fit", "a.csv", "--save", str(tmp_path)]) == 2
    assert "is a folder; give a file in it" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("command", "says"),
    [
        ("fit NAME", "File name too long"),
        ("noise NAME", "File name too long"),
        ("recheck NAME NAME", "File name too long"),
        ("bench recording.csv --effects NAME", "no Python file there"),
        ("sessions --sessions NAME", "File name too long; give another name"),
    ],
)
@pytest.mark.skipif(sys.platform == "win32", reason="another message there")
def test_a_name_that_no_file_can_have_is_answered_in_words(
    command: str, says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(command.replace("NAME", "x" * 300).split()) == 2
    assert says in capsys.readouterr().err
