"""Faults in all parts of the program, at random moments of an unattended run."""

import sys
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.attacks import CLOCK, Outcome
from imucal_wizard.core.errors import ImucalError
from imucal_wizard.sessions import KeptSession
from tests.terminal.terminal import Terminal

NUMBER = 8
ATTACK = "faults of the program in all its threads"

TRIES = {True: 60, False: 6}
PLACES = (
    ("imucal_wizard.simulate.imu", "VirtualImu", "read", 60),
    ("imucal_wizard.run.engine", "Engine", "receive", 60),
    ("imucal_wizard.run.engine", "Engine", "snapshot", 40),
    ("imucal_wizard.run.journal", "Journal", "raw", 60),
    ("imucal_wizard.sessions.session", "Session", "commit", 10),
    ("imucal_wizard.tui.app", "WizardApp", "_tick", 60),
    ("imucal_wizard.tui.sounds", "Sounds", "hear", 10),
    ("imucal_wizard.tui.screens.base", "LiveScreen", "take", 20),
    ("imucal_wizard.tui.services", "WizardServices", "fit", 1),
    ("imucal_wizard.tui.services", "WizardServices", "diagnose", 1),
    ("imucal_wizard.tui.services", "WizardServices", "save", 1),
    ("imucal_wizard.tui.services", "WizardServices", "open_source", 1),
)
"""Module, class and method that fails, at one of its first so many calls."""
READING = 9.806651
PATIENCE = 600.0
"""Seconds until a run has ended, however busy the machine is."""
CODE = f"""
import sys
from importlib import import_module
module, name, method, left = {{place!r}}
kind = getattr(import_module(module), name)
whole = getattr(kind, method)
def broken(*given, **named):
    global left
    left -= 1
    if left == 0:
        raise KeyError("a reading of {READING}")
    return whole(*given, **named)
setattr(kind, method, broken)
sys.argv[0] = "imucal-wizard"
from imucal_wizard.cli.main import main
sys.exit(main())
"""


def run(full: bool) -> Outcome:
    """Make one method after the other fail."""
    chance, outcome = np.random.default_rng(8), Outcome()
    for number in CLOCK.attempts(TRIES[full]):
        *names, most = PLACES[number % len(PLACES)]
        call = int(chance.integers(1, most + 1))
        problem = _failed((*names, call))
        outcome.count(f"{names[1]}.{names[2]}, call {call}: {problem}" if problem else "")
    return outcome


def _failed(place: tuple[object, ...]) -> str:
    """What a fault lost, or did not tell."""
    with tempfile.TemporaryDirectory() as name:
        home = Path(name)
        options = ["--sessions", str(home / "sessions")]
        command = [sys.executable, "-c", CODE.format(place=place), "--auto", "--quit", *options]
        surroundings = {"HOME": name, "XDG_STATE_HOME": str(home / "state")}
        with Terminal([*command, "--speed", "60"], environment=surroundings) as terminal:
            status = terminal.wait(PATIENCE)
            terminal.pump(0.3)
            _, _, last = bytes(terminal.received).rpartition(b"\x1b[?1049l")
            said = "".join(last.decode().split())
        reports = list(home.rglob("fault-*.txt"))
        if len(reports) != 1:
            return f"{len(reports)} reports, exit status {status}, the terminal says {said[-200:]}"
        (report,) = reports
        text = report.read_text()
        if status == 0 or str(report) not in said or "Traceback" in said:
            return f"exit status {status}, the terminal says {said[-200:]}"
        if str(READING) in text or "imucal-wizard" not in text:
            return "the report has what it must not have, or not what it must"
        return _session(home)


def _session(home: Path) -> str:
    """Why the session cannot be read again, or ""."""
    for path in (home / "sessions").glob("*.imucal"):
        try:
            with KeptSession.look(path) as kept:
                _ = sum(len(data) for _, _, data in kept.raw())
        except ImucalError as error:
            return str(error)
    return ""
