"""The pictures of the screens: ``python -m assets.drawing.screens [steps] [circles] [bench]``.

The program itself runs in a pseudo-terminal on the virtual IMU; what it shows is drawn into
``assets/pictures/``. Nothing is made up, so they can be made again after every change.
"""

import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from assets.drawing.terminal import picture
from tests.terminal.terminal import Terminal, program

FOLDER = Path(__file__).resolve().parents[1] / "pictures"
COLUMNS, ROWS = 100, 30
SEED = "3"


@contextmanager
def wizard(folder: Path, *arguments: str) -> Iterator[Terminal]:
    """The wizard on the virtual IMU, opened and with the virtual hand at work."""
    command = program("--seed", SEED, "--sessions", str(folder), *arguments)
    with Terminal(command, COLUMNS, ROWS) as terminal:
        terminal.wait_for("virtual IMU")
        terminal.press("\r")
        terminal.wait_for("is this what you expect")
        terminal.press("\r")
        terminal.wait_for("▸SETTLE")
        terminal.press("H")
        yield terminal


def steps(folder: Path) -> Iterator[tuple[str, Terminal]]:
    """One calibration from the poses to its result."""
    with wizard(folder, "--speed", "4") as terminal:
        terminal.wait_for("▸18 POSES", timeout=120.0)
        terminal.wait_for(_on_the_way, timeout=120.0)
        yield "pose", terminal
        terminal.wait_for("▸ROTATIONS", timeout=120.0)
        terminal.wait_for(_amid_a_turn, timeout=120.0)
        yield "rotation", terminal
        terminal.wait_for("▸RESULT", timeout=120.0)
        terminal.wait_for("held out", timeout=120.0)
        terminal.wait_for("model is complete", timeout=120.0)
        yield "result", terminal


def circles(folder: Path) -> Iterator[tuple[str, Terminal]]:
    """The magnetometer's circles, and the heading they make."""
    with wizard(folder, "--magnetometer", "--speed", "10") as terminal:
        terminal.wait_for("▸FIELD", timeout=240.0)
        terminal.wait_for(_amid_a_circle, timeout=120.0)
        yield "field", terminal
        terminal.wait_for("▸RESULT", timeout=120.0)
        terminal.wait_for("h north", timeout=120.0)
        terminal.press("h")
        terminal.wait_for("when calibrated ✓")
        terminal.pump(0.5)
        yield "heading", terminal


def bench(folder: Path) -> Iterator[tuple[str, Terminal]]:
    """The README's exercise: what is left, who is suspected, and the ladder once it is added."""
    recording = str(folder / "exercise.csv")
    made = program("simulate", recording, "--mystery", "--seed", SEED, "--key", "newton")
    subprocess.run(made, check=True, capture_output=True)
    with Terminal(program("bench", recording), COLUMNS, ROWS) as terminal:
        terminal.wait_for("size ± error", timeout=120.0)
        terminal.wait_for("force along y")
        yield "bench", terminal
        terminal.press("\r")
        terminal.wait_for("is complete", timeout=120.0)
        terminal.press("3")
        terminal.wait_for("noise alone")
        terminal.pump(0.5)
        yield "ladder", terminal


def _on_the_way(text: str) -> bool:
    """Some poses are taken, and it moves to the next one."""
    done = re.search(r" (\d+) of 18 poses taken", text)
    moving = re.search(r"STILL\?\s+no", text) is not None and "away" in text
    return done is not None and 8 <= int(done[1]) <= 15 and moving


def _amid_a_turn(text: str) -> bool:
    """Some rotations are taken, and one has come far."""
    done = re.search(r"about [xyz] ([2-5]) of 6", text)
    angle = re.search(r"so far\s+[+−]?(\d+)°", text)
    return done is not None and angle is not None and int(angle[1]) > 30


def _amid_a_circle(text: str) -> bool:
    """Some circles are done, and one has come far."""
    done, angle = re.search(r" ([34]) of 6", text), re.search(r"turned (\d+)°", text)
    return done is not None and angle is not None and 150 < int(angle[1]) < 300


SCENES: dict[str, Callable[[Path], Iterator[tuple[str, Terminal]]]] = {
    "steps": steps,
    "circles": circles,
    "bench": bench,
}


def main() -> None:
    """Draw all of them, or those that are named."""
    FOLDER.mkdir(exist_ok=True)
    for scene in sys.argv[1:] or SCENES:
        with tempfile.TemporaryDirectory() as name:
            for title, terminal in SCENES[scene](Path(name)):
                place = FOLDER / f"{title}.svg"
                place.write_text(picture(terminal.screen, "imucal-wizard"), encoding="utf-8")
                print(f"written: {place}")


if __name__ == "__main__":
    main()
