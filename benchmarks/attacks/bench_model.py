"""A bench that is left by every key and killed, at every moment, while its model is in no file."""

import os
import signal
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.attacks import Outcome
from imucal_wizard.api import load
from imucal_wizard.simulate.recording import simulate_recording
from tests.terminal.terminal import Terminal, program

NUMBER = 13
ATTACK = "a bench left or killed while its model is in no file"

TRIES = {True: 40, False: 3}
KILLS = {True: 20, False: 2}
SIGNALS = ("SIGKILL", "SIGTERM", "SIGHUP", "SIGQUIT")
LEAVING = ("q", "\x1b", "b", "\x03", "\x11", "q\r", "\r\rq", "qqqq", "b\x1bb")
"""Keys that leave, also several of them."""
LATEST = 4.0
"""Seconds after the effect was chosen in which the bench is left."""
TERM = "second-order"
PATIENCE = 60.0


def run(full: bool) -> Outcome:
    """Leave the bench, and save when it asks."""
    chance, outcome = np.random.default_rng(13), Outcome()
    with tempfile.TemporaryDirectory() as folder:
        recording = Path(folder) / "a.csv"
        simulate_recording(recording, hidden=[f"{TERM}:5:y"], seed=3)
        for number in range(TRIES[full]):
            keys = LEAVING[number % len(LEAVING)]
            problem = _left(recording, Path(folder) / f"{number}.json", keys, chance)
            outcome.count(f"{keys!r}: {problem}" if problem else "")
        for number in range(KILLS[full]):
            name = SIGNALS[number % len(SIGNALS)]
            problem = _killed(
                recording, Path(folder) / f"killed {number}.json", getattr(signal, name)
            )
            outcome.count(f"{name}: {problem}" if problem else "")
    outcome.notes.append(f"{TRIES[full]} left by keys, {KILLS[full]} ended by signals")
    return outcome


def _bench(recording: Path, place: Path) -> Terminal:
    """The bench, with a folder of its own for the user's data."""
    command = program("bench", str(recording), "--save", str(place))
    return Terminal(command, environment={"XDG_DATA_HOME": str(recording.parent)})


def _left(recording: Path, place: Path, keys: str, chance: np.random.Generator) -> str:
    """What became of the model, "" if it is in the file."""
    with _bench(recording, place) as terminal:
        terminal.wait_for(f"▸ {TERM}", PATIENCE)
        terminal.press("\r")
        terminal.pump(chance.uniform(0.0, LATEST))
        terminal.press(keys)
        terminal.wait_for("save it and leave", PATIENCE)
        terminal.press("s")
        status = terminal.wait(PATIENCE)
    return _in_file(status, place)


def _killed(recording: Path, place: Path, number: int) -> str:
    """What became of a model that was on the screen when the program was ended by a signal."""
    with _bench(recording, place) as terminal:
        terminal.wait_for(f"▸ {TERM}", PATIENCE)
        terminal.press("\r")
        terminal.wait_for("model is complete", PATIENCE)
        os.kill(terminal.pid, number)
        terminal.wait(PATIENCE)
    with _bench(recording, place) as terminal:
        terminal.wait_for("Restored: ", PATIENCE)
        terminal.press("q")
        terminal.wait_for("save it and leave", PATIENCE)
        terminal.press("s")
        status = terminal.wait(PATIENCE)
    return _in_file(status, place)


def _in_file(status: int, place: Path) -> str:
    """Why the model is not in the file, or ""."""
    if status != 0 or not place.is_file():
        return f"exit status {status}, no file"
    effects = [one.term for one in load(place)["accelerometer"].effects]
    return "" if TERM in effects else f"the file has {effects}"
