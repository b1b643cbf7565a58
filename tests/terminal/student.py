"""A student's way in a real terminal: from moving the device to the name, and the error's fall.

The virtual hand moves a device in which an effect is hidden. The student opens the bench at the
result, reads a lesson, commits to a guess, adds the effect, sees the held-out error fall to the
noise, takes it back, adds it again, has the bench ask for more poses, and saves the model.
"""

import re
import time
from functools import partial
from pathlib import Path

from imucal_wizard.api import load
from tests.terminal.terminal import Terminal

HIDDEN = "second-order:5:y"
SEED = 7
SPEED = 60
SHARE = 0.25
"""The held-out error falls to less than this of what it was."""
FLOORS = 2.5
"""Times the noise, in which the held-out error then is."""


def a_student(binary: str, folder: Path) -> None:
    """The whole way, at 80×24."""
    place, begun = folder / "found.json", time.monotonic()
    command = [binary, "--auto", "--speed", str(SPEED), "--hidden", HIDDEN, "--seed", str(SEED)]
    command += ["--sessions", str(folder / "student"), "--save", str(place), "--mute"]
    with Terminal(command) as terminal:
        terminal.wait_for("▸RESULT", 60.0)
        terminal.wait_for("f find missing")
        terminal.wait_for("limit 2.0 mg")
        terminal.press("f")
        terminal.wait_for("▸ second-order")
        _trace(terminal)
        _lesson(terminal)
        _guess(terminal)
        before, after = _ladder(terminal)
        _more(terminal)
        terminal.press("\x1b")
        terminal.wait_for("from the bench: accelerometer + second-order; not saved yet")
        terminal.press("s")
        terminal.wait_for("▸SAVE")
        terminal.wait_for(str(place)[:40])
        terminal.press("q")
        assert terminal.wait() == 0
    sensor = load(place).sensors["accelerometer"]
    (effect,) = sensor.effects
    assert effect.term == "second-order"
    assert abs(effect.sizes[1] - 5.0) < 0.5, effect.sizes
    spent = time.monotonic() - begun
    print(f"a student: held out {before} mg, with second-order {after} mg; {spent:.0f} s")


def _trace(terminal: Terminal) -> None:
    """The readings of the hold that stands out are there: the session has kept them."""
    terminal.press("t")
    terminal.wait_for("accelerometer x   mean")
    terminal.press("t")
    terminal.wait_for("enter add it")


def _lesson(terminal: Terminal) -> None:
    """The lesson is one key away and closed by the same."""
    terminal.press("l")
    terminal.wait_for("SECOND-ORDER NON-LINEARITY")
    terminal.press("l")
    terminal.wait_for("enter add it")


def _guess(terminal: Terminal) -> None:
    """Predict first: nothing is told before the guess is committed to; then it is judged."""
    terminal.press("p")
    terminal.wait_for(lambda text: "Predict first" in text and "<0.003" not in text)
    while (chosen := _chosen(terminal.text)) != "second-order":
        terminal.press("\x1b[B")
        terminal.wait_for(partial(_chose_another, chosen))
    terminal.press("\r")
    terminal.wait_for("predict: second-order")
    terminal.press("\r")
    terminal.wait_for("✓ you: second-order")
    terminal.press("\r")


def _chosen(shown: str) -> str:
    """The suspect that the list has selected, or "".

    Figures arrive beside the list meanwhile, so that another screen is not yet another selection.
    """
    found = re.search(r"▸ (\S+)", shown)
    return found.group(1) if found else ""


def _chose_another(before: str, shown: str) -> bool:
    """Whether another suspect is selected than before."""
    return _chosen(shown) != before


def _ladder(terminal: Terminal) -> tuple[float, float]:
    """The held-out error falls to the noise; undo and adding again change nothing of that."""
    terminal.press("3")
    before, after, floor = _errors(terminal)
    assert after < SHARE * before, terminal.text
    assert after < FLOORS * floor, terminal.text
    terminal.wait_for("model is complete")
    terminal.press("u")
    terminal.wait_for(lambda text: "+ second-order" not in text)
    terminal.press("1")
    terminal.wait_for("▸ second-order")
    terminal.press("\r")
    terminal.wait_for("model is complete")
    terminal.press("3")
    assert _errors(terminal) == (before, after, floor), terminal.text
    return before, after


def _errors(terminal: Terminal) -> tuple[float, float, float]:
    """Held out of the base, held out with the effect, noise; mg, once the ladder shows them."""
    rows = ("bias scale non-orth.", r"\+ second-order", "noise alone")
    found = [re.compile(row + r"\s+[\d.]+ \S*\s+([\d.]+)") for row in rows]
    text = terminal.wait_for(lambda shown: all(row.search(shown) for row in found))
    before, after, floor = (float(row.findall(text)[0]) for row in found)
    return before, after, floor


def _more(terminal: Terminal) -> None:
    """The bench asks for exactly the poses it lists, and opens again with the model kept."""
    terminal.press("n")
    terminal.wait_for("MEASURE NEXT")
    terminal.press("m")
    # at this speed a busy machine may draw no frame of the step of more poses
    terminal.wait_for(lambda text: "MEASURE NEXT" not in text)
    terminal.wait_for("BENCH  accelerometer", 60.0)
    terminal.wait_for("model is complete")
    terminal.press("2")
    terminal.wait_for("✓ second-order")
