"""The magnetometer's way in a real terminal: circles, result, heading, all methods, saved.

The virtual hand moves a device with a magnetometer. A person watches the sphere fill, lets
something of steel pass, looks at the heading before and after, compares the methods, and saves.
"""

import re
import time
from pathlib import Path

import numpy as np

from imucal_wizard.api import load
from tests.terminal.terminal import Terminal

SEED = 3
SPEED = 20
STEPS = ("SETTLE", "UP/DOWN", "18 POSES", "ROTATIONS", "FIELD", "RESULT")
END = "\x1b[F"
HOME = "\x1b[H"
FACES = ("+x", "−x", "+y", "−y", "+z", "−z")


def a_compass(binary: str, folder: Path) -> None:
    """The whole way, at 80×24."""
    place, begun = folder / "compass.json", time.monotonic()
    command = [binary, "--auto", "--magnetometer", "--speed", str(SPEED), "--seed", str(SEED)]
    command += ["--sessions", str(folder / "compass"), "--save", str(place), "--mute"]
    with Terminal(command) as terminal:
        for step in STEPS[:-1]:
            terminal.wait_for(f"▸{step}", 60.0)
        circles = _circles(terminal)
        _result(terminal)
        heading = _heading(terminal)
        _methods(terminal)
        terminal.press("s")
        terminal.wait_for("x export", 60.0)
        terminal.press(HOME)
        terminal.wait_for(str(place)[:40])
        terminal.press("q")
        assert terminal.wait() == 0
    sensor = load(place).sensors["magnetometer"]
    assert sensor.frame == "accelerometer"
    assert sensor.rms_held_out is not None
    assert sensor.rms_before is not None
    assert sensor.rms_held_out < 0.05 * sensor.rms_before
    assert np.linalg.det(sensor.matrix) > 0.0
    spent = time.monotonic() - begun
    print(f"a compass: {circles} circles, heading {heading}; {spent:.0f} s")


def _circles(terminal: Terminal) -> int:
    """The sphere fills from circle to circle until the step is over."""
    terminal.wait_for("◆ now")
    most = 0
    while "▸FIELD" in terminal.text:
        terminal.pump(0.1)
        most = max(most, sum(f"{face} ●" in terminal.text for face in FACES))
        assert terminal.status() is None, terminal.text
    assert most >= 4, f"only {most} circles were seen to be done"
    return most


def _result(terminal: Terminal) -> None:
    terminal.wait_for("begins by itself", 60.0)
    terminal.press(HOME)  # any key keeps the result on the screen
    terminal.wait_for("v: validate")
    terminal.wait_for("limit 2.0 mg", 60.0)
    for text in ("magnetometer |m|", "iron that turns with it", "SECOND STAGE"):
        terminal.scroll_to(text)


def _heading(terminal: Terminal) -> str:
    terminal.press("h")
    text = terminal.wait_for(lambda shown: shown.count("when calibrated ✓") == 2)
    terminal.resize(160, 50)
    terminal.wait_for("after calibration")
    terminal.resize(80, 24)
    found = re.search(r"after (\S+°, ±\S+°) from", text)
    assert found is not None, text
    terminal.press("h")
    terminal.wait_for("c compare")
    return found[1]


def _methods(terminal: Terminal) -> None:
    terminal.press("c")
    terminal.wait_for("newton (Q)", 60.0)
    terminal.press(END)
    terminal.wait_for("orthogonal")
    terminal.wait_for("Niespodziany")
    terminal.press("c")
    terminal.wait_for("c compare")
