"""The whole app at 2,000 samples/s: ``python -m benchmarks.app``.

A device process writes to one pseudo-terminal; the program runs in another, which is drained here
and read only afterwards. Frames are counted from outside: by the marks with which the program ends
each, and for the drawing of the device by looking at what the terminal shows after each.
"""

import compileall
import re
import statistics
import tempfile
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import pyte

import imucal_wizard
from benchmarks.device import REST, TURNING, Device
from benchmarks.measure import PYTHON, machine
from benchmarks.terminal import FRAME_ENDS, Terminal

RATE = 2000.0
SIZES = ((120, 40), (80, 24))
PHASES = ("turning all the time", "pose after pose")
MEASURED = TURNING - 3.0
"""Seconds of each phase that are measured."""
SECONDS = 75.0
RUNS = 3


@dataclass(frozen=True)
class Outcome:
    """One phase of one run.

    Attributes:
        share: CPU of the app, parts of a core.
        frames: screen updates per second.
        drawings: different drawings of the device per second.
        kilobytes: what is sent to the terminal per second.
        lost: samples that the program misses by then.
        taken: poses taken by then.
    """

    share: float
    frames: float
    drawings: float
    kilobytes: float
    lost: int
    taken: int


def run(columns: int, rows: int) -> list[Outcome]:
    """Open the app on the device, let it settle, and measure both phases.

    Raises:
        SystemExit: the program does not follow the stream, or the machine is too busy for that.
    """
    with tempfile.TemporaryDirectory() as folder, Device(RATE, SECONDS, "turning") as device:
        command = [PYTHON, "-m", "imucal_wizard", "--port", device.port, "--sessions", folder]
        with Terminal(command, columns, rows) as terminal:
            opened = terminal.wait_for("is this what you expect")
            terminal.press("\r")
            settled = terminal.wait_for("▸UP/DOWN")
            if settled > opened + REST:
                raise SystemExit(f"settled only {settled - opened:.0f} s after the port was opened")
            terminal.pump_until(opened + REST + 0.5)
            first = _measure(terminal, columns, rows)
            terminal.pump_until(opened + REST + TURNING + 1.0)
            second = _measure(terminal, columns, rows)
            if not device.sending:
                raise SystemExit("the device had nothing left to send before the end")
        if not second.taken > first.taken:
            raise SystemExit(f"{second.taken} poses were taken of a device that goes through them")
        return [first, second]


def _measure(terminal: Terminal, columns: int, rows: int) -> Outcome:
    cpu, before = terminal.cpu, len(terminal.drawn)
    terminal.pump(MEASURED)
    share = (terminal.cpu - cpu) / MEASURED
    pieces = [data for _, data in terminal.drawn]
    drawn = b"".join(pieces[before:])
    screen, stream = _screen(columns, rows)
    stream.feed(b"".join(pieces[:before]))
    pictures = _pictures(screen, stream, drawn)
    changes = sum(one != other for one, other in pairwise(pictures))
    return Outcome(
        share,
        drawn.count(FRAME_ENDS) / MEASURED,
        changes / MEASURED,
        len(drawn) / 1024.0 / MEASURED,
        *_told(screen),
    )


def _screen(columns: int, rows: int) -> tuple[pyte.Screen, pyte.ByteStream]:
    screen = pyte.Screen(columns, rows)
    return screen, pyte.ByteStream(screen)


def _told(screen: pyte.Screen) -> tuple[int, int]:
    """Samples lost and poses taken, as the screen says at the end of a phase.

    Raises:
        SystemExit: the program does not read any more: no figure must be made of that.
    """
    text = "\n".join(screen.display)
    reading = re.search(r"(\d+\.\d) Hz, (\d+) lost", text)
    poses = re.search(r"(\d) of 6 poses taken", text)
    if not (reading and poses) or abs(float(reading[1]) / RATE - 1.0) > 0.01:
        raise SystemExit(f"the program does not read {RATE:,.0f} samples/s; it shows:\n{text}")
    return int(reading[2]), int(poses[1])


def _pictures(screen: pyte.Screen, stream: pyte.ByteStream, drawn: bytes) -> list[tuple[str, ...]]:
    """What the frame titled "now" holds after each update of the screen."""
    place = _place_of(screen)
    found = []
    for update in drawn.split(FRAME_ENDS):
        stream.feed(update)
        found.append(tuple(row[place[1]] for row in screen.display[place[0]]))
    return found


def _place_of(screen: pyte.Screen) -> tuple[slice, slice]:
    """Rows and columns inside the frame titled "now"."""
    top = next(y for y, row in enumerate(screen.display) if "╭─ now" in row)
    left = screen.display[top].index("╭─ now")
    right = screen.display[top].index("╮", left)
    bottom = next(y for y in range(top, screen.lines) if screen.display[y][left] == "╰")
    return slice(top + 1, bottom), slice(left + 1, right)


def main() -> None:
    """Print CPU share and frames per second."""
    # the first start after an installation compiles the program: no measurement of it
    compileall.compile_dir(Path(imucal_wizard.__file__).parent, quiet=2)
    print(machine())
    print(
        f"{'terminal':>9}  {'the device is':22}{'% of a core':>12}{'each run':>16}"
        f"{'frames/s':>10}{'drawings/s':>12}{'KiB/s':>8}{'lost':>6}"
    )
    for columns, rows in SIZES:
        runs = [run(columns, rows) for _ in range(RUNS)]
        for phase, outcomes in zip(PHASES, zip(*runs, strict=True), strict=True):
            each = " ".join(f"{100.0 * one.share:.0f}" for one in outcomes)
            print(
                f"{f'{columns}×{rows}':>9}  {phase:22}"
                f"{100.0 * statistics.median(one.share for one in outcomes):12.1f}{each:>16}"
                f"{statistics.median(one.frames for one in outcomes):10.1f}"
                f"{statistics.median(one.drawings for one in outcomes):12.1f}"
                f"{statistics.median(one.kilobytes for one in outcomes):8.0f}"
                f"{max(one.lost for one in outcomes):6}",
                flush=True,
            )
    print(
        f"wanted: at {RATE:,.0f} samples/s under 40 % of a core with at least 15 frames/s, "
        "and at least 10 drawings/s of a device in motion"
    )


if __name__ == "__main__":
    main()
