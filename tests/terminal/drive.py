"""Drives the installed program in a real terminal at 80×24: ``python -m tests.terminal.drive BIN``.

Seven sittings: the whole procedure unattended; a person at the keys who quits in the middle; the
same session taken up again; a hand that trembles; a student who finds a hidden effect; a
magnetometer that becomes a compass; a device on a port of its own. Each screen that passes is
read; what is saved is held against the virtual sensor's truth.
"""

import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from imucal_wizard.api import load
from tests.simulate.sensors import truth
from tests.terminal.compass import a_compass
from tests.terminal.second_terminal import on_a_port
from tests.terminal.student import a_student
from tests.terminal.terminal import Terminal
from tests.terminal.trouble import a_trembling_hand

STEPS = ("SETTLE", "UP/DOWN", "18 POSES", "ROTATIONS", "RESULT", "VALIDATE", "SAVE")
SEED = 3
ERRORS = 5.0
"""Standard errors within which the virtual sensor's parameters must be found (18 numbers)."""
UNATTENDED_SECONDS = 60.0


def unattended(binary: str, folder: Path) -> None:
    """The virtual hand performs everything; every step is seen, and the numbers are right."""
    place = folder / "calibration.json"
    command = [binary, "--auto", "--speed", "20", "--quit", "--seed", str(SEED)]
    command += ["--sessions", str(folder / "sessions"), "--save", str(place)]
    seen: list[str] = []
    start = time.monotonic()
    with Terminal(command) as terminal:
        while terminal.status() is None:
            terminal.pump(0.05)
            now = [step for step in STEPS if f"▸{step}" in terminal.text]
            seen += [step for step in now if step not in seen]
            if time.monotonic() - start > UNATTENDED_SECONDS:
                raise AssertionError(f"not done in time; the screen shows:\n{terminal.text}")
        status, bells = terminal.wait(), terminal.bells
        last = " ".join(terminal.text.split())
    spent = time.monotonic() - start
    assert status == 0, f"exit status {status}"
    assert seen == list(STEPS), f"steps seen: {seen}"
    assert bells > 30, f"only {bells} bells"
    assert "accelerometer GOOD; gyroscope GOOD. Next: imucal-wizard export" in last, last
    _check(place)
    print(f"unattended: {', '.join(seen)}; {bells} bells; {spent:.0f} s")


def _check(place: Path) -> None:
    """What was saved is the virtual sensor's truth within its standard errors."""
    known, saved = truth(SEED), load(place)
    for name, matrix, bias in (
        ("accelerometer", known.accelerometer_matrix, known.accelerometer_bias),
        ("gyroscope", known.gyroscope_matrix, known.gyroscope_bias),
    ):
        sensor = saved.sensors[name]
        for i, axis in enumerate("xyz"):
            for key, true in (("bias", bias[i]), ("sensitivity", 1.0 / matrix[i, i])):
                found = sensor.parameters[f"{key}_{axis}"]
                assert found.standard_error is not None, f"{name} {key}_{axis} has no error"
                off = abs(found.value - true) / found.standard_error
                assert off < ERRORS, f"{name} {key}_{axis} is {off:.1f} standard errors off"
    validated = saved.sensors["accelerometer"].rms_validation
    assert validated is not None, "no validation"
    assert np.isfinite(validated)


def at_the_keys(binary: str, folder: Path) -> Path:
    """A person opens the virtual IMU, asks for help, turns it by hand, and quits in the middle."""
    sessions = folder / "by-hand"
    command = [binary, "--speed", "10", "--seed", "5", "--sessions", str(sessions)]
    with Terminal(command) as terminal:
        terminal.wait_for("virtual IMU")
        terminal.press("\r")
        terminal.wait_for("is this what you expect")
        terminal.press("\r")
        terminal.wait_for("▸SETTLE")
        terminal.press("?")
        terminal.wait_for("help")
        terminal.press("\x1b")
        terminal.wait_for("▸UP/DOWN")
        terminal.press("\x1b[A")
        terminal.pump(0.3)
        terminal.press("H")
        terminal.wait_for("▸18 POSES")
        terminal.wait_for(lambda text: any(f"{n} of 18" in text for n in range(4, 18)))
        terminal.press("q")
        assert terminal.wait() == 0
    kept = sorted(sessions.glob("*.imucal"))
    assert len(kept) == 1, f"sessions: {kept}"
    print(f"by hand: quit at the poses; {kept[0].stat().st_size // 1024} KiB kept")
    return kept[0]


def taken_up_again(binary: str, session: Path) -> None:
    """The session goes on at the poses with the ones that were taken."""
    command = [binary, "--resume", str(session), "--speed", "10"]
    with Terminal(command) as terminal:
        text = terminal.wait_for(lambda shown: "▸18 POSES" in shown and " of 18" in shown)
        done = int(text.split(" of 18")[0].split()[-1])
        assert done >= 4, f"only {done} poses are left"
        terminal.resize(160, 50)
        terminal.wait_for("imucal-wizard ✓Source")  # only a wide screen names the program
        terminal.resize(60, 20)
        terminal.wait_for("80×24")
        terminal.resize(80, 24)
        terminal.wait_for("▸18 POSES")
        terminal.press("q")
        assert terminal.wait() == 0
    print(f"taken up again: {done} of 18 poses are there")


def quit_and_resumed(binary: str, folder: Path) -> None:
    """A person at the keys, and the session that this person left."""
    taken_up_again(binary, at_the_keys(binary, folder))


SITTINGS = (unattended, a_student, a_compass, a_trembling_hand, quit_and_resumed, on_a_port)
AT_ONCE = 2
"""A sitting uses about half of two cores."""


def main() -> None:
    """Drive the program named on the command line."""
    binary = sys.argv[1]
    with tempfile.TemporaryDirectory() as name, ProcessPoolExecutor(AT_ONCE) as pool:
        for sitting in [pool.submit(sitting, binary, Path(name)) for sitting in SITTINGS]:
            sitting.result()


if __name__ == "__main__":
    main()
