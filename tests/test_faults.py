"""What nobody foresaw, and what a terminal must not be told."""

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from imucal_wizard.cli import fit
from imucal_wizard.core.output import without_control_characters
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.simulate.recording import simulate_recording
from imucal_wizard.tui.app import WizardApp
from imucal_wizard.tui.run import BenchApp
from imucal_wizard.tui.sources import SourceChoice, SourceKind
from tests.tui import fakes


def test_a_fault_of_the_program_is_one_line_and_a_file(tmp_path: Path) -> None:
    code = (
        "from imucal_wizard.run.faults import hide_tracebacks; hide_tracebacks(); {}['never there']"
    )
    home = {"HOME": str(tmp_path), "XDG_STATE_HOME": str(tmp_path), "LOCALAPPDATA": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env={**os.environ, **home},
        check=False,
    )
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert done.stderr.count("\n") == 1
    assert "has a fault (KeyError" in done.stderr
    (report,) = tmp_path.rglob("fault-*.txt")
    assert "never there" in report.read_text()


def wizard() -> WizardApp:
    """The wizard, on a source that cannot be opened for a reason nobody foresaw."""

    def broken(choice: SourceChoice) -> fakes.FakeSource:
        raise KeyError(choice.target)

    services = replace(fakes.services(fakes.FakeSource()), open_source=broken)
    return WizardApp(services, None, SourceChoice(SourceKind.PORT, "COM3", "COM3"))


def bench() -> BenchApp:
    """The bench, on a recording that fails for a reason nobody foresaw."""

    def broken() -> Benches:
        raise KeyError("never there")

    return BenchApp(broken)


@pytest.mark.parametrize("make", [wizard, bench])
def test_a_fault_in_an_app_is_printed_once_without_a_traceback(
    make: Callable[[], WizardApp | BenchApp],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setenv("HOME", str(tmp_path))
    app = make()
    app.run(headless=True, size=(80, 24))
    assert app.return_code == 1
    shown = capfd.readouterr().err.replace("\n", "")  # wrapped to the width of the terminal
    assert shown.count("has a fault (KeyError") == 1
    assert "Traceback" not in shown
    (report,) = tmp_path.rglob("fault-*.txt")
    assert str(report) in shown


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plain µ °\n", "plain µ °\n"),
        ("\x1b[2Jx\x07\x9b31m", "\ufffd[2Jx\ufffd\ufffd31m"),
        ("a\u202eb\udcff", "a\ufffdb\ufffd"),
    ],
)
def test_nothing_that_is_printed_steers_the_terminal(text: str, shown: str) -> None:
    assert without_control_characters(text) == shown


def test_a_name_that_is_no_text_is_fitted_and_saved(tmp_path: Path) -> None:
    path = tmp_path / os.fsdecode(b"\xff\x1b[2J.csv")
    try:
        simulate_recording(path, poses="6", rotations=0)
    except OSError:
        pytest.skip("this file system takes no such name")
    assert fit.run([str(path), "--save", str(tmp_path / "out.json")]) == 0
    assert (tmp_path / "out.json").is_file()
