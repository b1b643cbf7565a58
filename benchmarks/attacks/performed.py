"""A procedure that a device performs on a port, and what the screen confirms of it.

The lines are those of a prepared hand on a virtual IMU, so that a session that was cut short and
continued can be compared with the same bytes and commands without a disturbance.
"""

import re
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from imucal_wizard.guide.kinds import TITLES, StepKind
from imucal_wizard.guide.plan import standard
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.procedure_settings import ProcedureSettings
from imucal_wizard.run.session_replay import SessionReplay
from imucal_wizard.sessions import KeptSession
from imucal_wizard.simulate.imu import VirtualImu
from imucal_wizard.simulate.terminal import Pty
from tests.run.performance import same

RATE = 100
"""Samples per second of device time."""
ROTATIONS = 2
"""Rotations about each axis."""
LINES_BEFORE_START = 200
"""Lines that the device sends before the procedure is started; then it waits for the start."""
PATIENCE = 300.0
"""Seconds after which what has not happened will not happen, however busy the machine is."""

_STEPS = (
    StepKind.SETTLE,
    StepKind.UP_DOWN,
    StepKind.POSES,
    StepKind.ROTATIONS,
    StepKind.RESULT,
)


@cache
def performance() -> tuple[bytes, ...]:
    """The lines of a whole procedure, performed by the hand of a virtual IMU."""
    imu = VirtualImu(RATE, seed=3, speed=float("inf"), following=True)
    engine = Engine(settings=ProcedureSettings(standard(ROTATIONS)))
    engine.listen(imu.follow)
    imu.open()
    lines: list[bytes] = []
    while engine.step is not StepKind.RESULT:
        more = (imu.read(0.0) or imu.rest()).splitlines(keepends=True)
        if len(lines) < LINES_BEFORE_START <= len(lines) + len(more):
            first, more = (
                more[: LINES_BEFORE_START - len(lines)],
                more[LINES_BEFORE_START - len(lines) :],
            )
            engine.receive(b"".join(first), 0.0)
            engine.command("start")
            lines += first
        engine.receive(b"".join(more), 0.0)
        lines += more
    return tuple(lines)


class Device:
    """A device on a port that sends the lines of the performance by the clock to one program.

    A program empties the port after opening it, which on a busy machine takes a while. The device
    begins after that with its header, like a device that is reset when its port is opened. Lines
    that do not fit into the port wait.

    Args:
        speed: device seconds per second.
        lines: what it sends, first the header.

    Attributes:
        next: number of the line after the last one sent.
        started: the procedure is started, so the device goes on.
    """

    def __init__(self, speed: float, lines: Sequence[bytes]) -> None:
        self.port = Pty()
        self.next = 0
        self.started = threading.Event()
        self._speed = speed
        self._lines = lines
        self._over = threading.Event()

    @contextmanager
    def sending(self, first: int) -> Iterator[None]:
        """Send from a line on to the program that opens the port next, until the block ends."""
        self.next = first
        self._over.clear()
        sender = threading.Thread(target=self._send, daemon=True)
        sender.start()
        try:
            yield
        finally:
            self._over.set()
            sender.join()

    def _send(self) -> None:
        while not self.port.connected():
            if self._over.wait(0.01):
                return
        self.port.settle(PATIENCE)
        lines = self._lines
        waiting, due, last = lines[0], 0.0, time.monotonic()
        while not self._over.wait(0.005):
            self.port.read()
            now = time.monotonic()
            due, last = min(due + (now - last) * RATE * self._speed, 0.25 * RATE * self._speed), now
            until = len(lines) if self.started.is_set() else LINES_BEFORE_START
            if not waiting:
                past = max(min(self.next + int(due), until), self.next)
                waiting = b"".join(lines[self.next : past])
                due -= past - self.next
                self.next = past
            waiting = waiting[self.port.write(waiting) :]


@dataclass(frozen=True)
class Shown:
    """What the screen has confirmed.

    Attributes:
        step: place of the step in the procedure; -1 before it.
        done: number of holds or rotations that the step counts.
        notice: the newest notice of something taken, or "".
    """

    step: int = -1
    done: int = 0
    notice: str = ""

    @classmethod
    def on(cls, text: str) -> "Shown":
        """What stands on a screen."""
        names = [TITLES[kind].upper() for kind in _STEPS]
        names[names.index("POSES")] = "18 POSES"
        step = next((place for place, name in enumerate(names) if f"▸{name}" in text), -1)
        count = re.search(r"(\d+) of \d+ (?:poses|rotations) taken", text)
        notice = re.search(r"^ [✓↶] (.+?(?:taken|taken back)[^.]*\.)", text, re.MULTILINE)
        done = int(count[1]) if count else 0
        return cls(step, done, notice[1].strip() if notice else "")


def lines_held(path: Path) -> int:
    """Number of lines of the performance that a session holds."""
    with KeptSession.look(path) as kept:
        data = b"".join(piece for _, _, piece in kept.raw())
    numbers = _numbers()
    lines = reversed(data.splitlines(keepends=True))
    return next((numbers[line] + 1 for line in lines if line in numbers), 0)


@cache
def _numbers() -> dict[bytes, int]:
    """Number of each line of the performance; the header has none, because it is sent again."""
    header = performance()[0]
    return {line: number for number, line in enumerate(performance()) if line != header}


def difference(path: Path) -> str:
    """How a session differs from its bytes and commands in one undisturbed run, or ""."""
    with KeptSession.look(path) as kept:
        past = SessionReplay(kept)
        resumed, alone = past.engine(), past.engine()
        past.replay(resumed)
        lines = iter(performance())
        for command in kept.commands():
            while alone.samples < command.sample_index:
                alone.receive(next(lines), 0.0)
            alone.command(command.name, command.argument)
    while alone.samples < resumed.samples:
        alone.receive(next(lines), 0.0)
    if not same(resumed.collected(), alone.collected()) or resumed.status() != alone.status():
        return f"after {resumed.samples} samples the session differs from an undisturbed one"
    return ""
