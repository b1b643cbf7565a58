"""What nobody foresaw, and what a terminal must not be told."""

import os
import subprocess
import sys
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from imucal_wizard.cli import fit
from imucal_wizard.core import VERSION
from imucal_wizard.core.output import without_control_characters
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.run.faults import hide_tracebacks, print_faults
from imucal_wizard.run.reader import Reader
from imucal_wizard.run.session_replay import begin_session
from imucal_wizard.simulate.imu import VirtualImu
from imucal_wizard.simulate.recording import simulate_recording
from imucal_wizard.tui.app import WizardApp
from imucal_wizard.tui.run import BenchApp
from imucal_wizard.tui.sources import SourceChoice, SourceKind
from tests.tui import fakes
from tests.tui.bench_steps import nowhere
from tests.waiting import wait_for


def test_a_fault_of_the_program_is_one_line_and_a_file_without_readings(tmp_path: Path) -> None:
    code = (
        "from imucal_wizard.run.faults import hide_tracebacks, remember\n"
        "hide_tracebacks(['--key'])\n"
        "remember('hold_taken'); {}['never there, 9.80665 and 123456']"
    )
    home = {"HOME": str(tmp_path), "XDG_STATE_HOME": str(tmp_path), "LOCALAPPDATA": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", code, "--port", "COM3", "--key", "newton"],
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
    assert str(report) in done.stderr
    text = report.read_text()
    for words in ("never there, # and #", "hold_taken", "options: --port COM3 --key …", VERSION):
        assert words in text
    for kept in ("9.80665", "123456", "newton"):
        assert kept not in text
        assert kept not in done.stderr


def test_a_fault_of_the_reading_thread_closes_the_session_and_is_told_at_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setattr(threading, "excepthook", threading.excepthook)
    monkeypatch.setattr(sys, "excepthook", sys.excepthook)
    hide_tracebacks()
    imu = VirtualImu(seed=1, speed=1000.0)
    read = imu.read

    def broken(timeout: float = 0.05) -> bytes:
        if place.exists() and reader.snapshot().stream.samples > 100:
            raise KeyError("never there")
        return read(timeout)

    monkeypatch.setattr(imu, "read", broken)
    place = tmp_path / "sessions" / "a.imucal"
    reader = Reader(imu, begin_session(place))
    reader.start()
    wait_for(lambda: reader.finished and not reader._running)
    assert "because of a fault" in reader.snapshot().stream.problem
    assert [one.name for one in place.parent.iterdir()] == [place.name]  # closed
    wait_for(lambda: any((tmp_path / "state").rglob("fault-*.txt")))
    print_faults()
    (report,) = (tmp_path / "state").rglob("fault-*.txt")
    assert str(report) in capfd.readouterr().err


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

    return BenchApp(broken, nowhere)


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
        simulate_recording(path, poses="18", rotations=0)
    except OSError:
        pytest.skip("this file system takes no such name")
    assert fit.run([str(path), "--save", str(tmp_path / "out.json")]) == 0
    assert (tmp_path / "out.json").is_file()
