"""The wizard is killed in the middle of a session, in a real terminal with a device on a port.

A session is performed by a prepared hand, whose lines a device sends to a pseudo-terminal. Again
and again the program is killed with SIGKILL, at a random moment or as soon as the screen confirms
a hold, a rotation or a command. Then the session is resumed, and the device goes on with the first
line that the session does not hold, so that the input is that of an undisturbed run.

Lost is a step, a count or a notice that the screen has shown and the session does not know; and a
session that differs at its end, in any bit, from the same bytes and commands without any kill.
"""

import os
import re
import signal
import sqlite3
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.attacks import CLOCK, Outcome
from imucal_wizard.guide.kinds import TITLES, StepKind
from imucal_wizard.guide.plan import standard
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.procedure_settings import ProcedureSettings
from imucal_wizard.run.session_replay import SessionReplay
from imucal_wizard.sessions import KeptSession
from imucal_wizard.simulate.imu import VirtualImu
from imucal_wizard.simulate.terminal import OPEN_SECONDS, Pty
from tests.run.performance import same
from tests.terminal.terminal import POLL, Terminal, program

NUMBER = 1
ATTACK = "killed at random and at each confirmation; power lost"

RATE = 100
"""Samples per second of device time."""
ROTATIONS = 2
"""Rotations about each axis."""
LINES_BEFORE_START = 200
"""Lines that the device sends before the procedure is started; then it waits for the start."""
SPEEDS = (1.0, 20.0)
AT_ONCE = 8
"""Sessions at once: at true speed a session uses a tenth of a core, and its start one second."""
MOST_KILLS = 250
"""Kills of a sitting: those at random moments reach the end of the procedure at true speed."""
SOON = 2.5
"""Seconds after the program is back into which kills at random fall; a fifth of them at 20 times
the true speed, which are ten seconds of device time."""
UNDONE = 0.5
"""Share of the kills, in a sitting with commands, that wait for a hold to be taken back."""
PATIENCE = 300.0
"""Seconds after which what has not happened will not happen, however busy the machine is."""

_STEPS = (
    StepKind.SETTLE,
    StepKind.UP_DOWN,
    StepKind.POSES,
    StepKind.ROTATIONS,
    StepKind.RESULT,
)


@dataclass(frozen=True)
class Sitting:
    """What one process does.

    Attributes:
        kills: number of kills.
        speed: device seconds per second.
        confirmed: kill as soon as something is confirmed, else at random moments.
        commands: take the last hold back now and then, and kill when that is confirmed.
        seed: of the random moments.
        end: when no further kill is made, on ``time.monotonic``.
    """

    kills: int
    speed: float
    confirmed: bool
    commands: bool
    seed: int
    end: float = float("inf")


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


class Device(threading.Thread):
    """A device on a pseudo-terminal that sends the lines of the performance by the clock.

    Like a real one it prints its header first. Lines that do not fit into the port wait.

    Attributes:
        next: number of the line after the last one sent; set it while nobody has the port open.
        started: the procedure is started, so the device goes on.
    """

    def __init__(self, speed: float) -> None:
        super().__init__(daemon=True)
        self.port = Pty()
        self.next = 0
        self.started = threading.Event()
        self._speed = speed
        self._over = threading.Event()

    def run(self) -> None:
        """Send whenever somebody has the port open."""
        while not self._over.is_set():
            if self.port.connected():
                self.port.settle(OPEN_SECONDS)
                self._send()
            self._over.wait(0.01)

    def _send(self) -> None:
        lines = performance()
        waiting, due, last = lines[0], 0.0, time.monotonic()
        while not self._over.is_set():
            self.port.read()
            if not self.port.connected():
                return
            now = time.monotonic()
            due, last = min(due + (now - last) * RATE * self._speed, 0.25 * RATE * self._speed), now
            until = len(lines) if self.started.is_set() else LINES_BEFORE_START
            if not waiting:
                past = min(self.next + int(due), until)
                waiting = b"".join(lines[self.next : past])
                due -= past - self.next
                self.next = max(past, self.next)
            waiting = waiting[self.port.write(waiting) :]
            self._over.wait(0.005)

    def stop(self) -> None:
        """Unplug it."""
        self._over.set()
        self.join()
        self.port.close()


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
        count = re.search(r"(\d+) of \d+ done", text)
        notice = re.search(r"^ [✓↶] (.+?(?:taken|taken back)[^.]*\.)", text, re.MULTILINE)
        done = int(count[1]) if count else 0
        return cls(step, done, notice[1].strip() if notice else "")


class Killed:
    """A session that is killed and resumed until its end.

    Args:
        sitting: what is done to it.
        folder: where the session is kept.
        rng: of the random moments.
    """

    def __init__(self, sitting: Sitting, folder: Path, rng: np.random.Generator) -> None:
        self._sitting = sitting
        self._folder = folder
        self._rng = rng
        self._device = Device(sitting.speed)
        self._device.start()
        self._before = Shown()

    @property
    def _path(self) -> Path:
        return next(self._folder.glob("*.imucal"))

    def lost(self, kills: int) -> Iterator[str]:
        """Kill so many times, or until the lines have ended; what each kill has lost."""
        for number in range(kills):
            late = number > 0 and time.monotonic() > self._sitting.end
            if late or self._device.next >= len(performance()):
                break
            with self._started() as terminal:
                try:
                    self._wait(terminal)
                except AssertionError as error:
                    yield f"it did not come back: {error}"
                    break
                resumed = Shown.on(terminal.text)
                missing = self._missing(resumed)
                if not self._moment(terminal):
                    break
                os.kill(terminal.pid, signal.SIGKILL)
                terminal.wait(PATIENCE)
                self._before = Shown.on(terminal.text)
            yield missing or self._unwritten()
            self._device.next = lines_held(self._path)

    def _started(self) -> Terminal:
        """The program, with a new session or the one that was killed."""
        port = ["--port", self._device.port.path]
        if any(self._folder.glob("*.imucal")):
            return Terminal(program("--resume", str(self._path), *port))
        options = ["--sessions", str(self._folder), "--rotations", str(ROTATIONS)]
        return Terminal(program(*port, *options))

    def _wait(self, terminal: Terminal) -> None:
        """Wait until the program shows the procedure.

        Raises:
            AssertionError: it does not.
        """
        if not self._device.started.is_set():
            terminal.wait_for("is this what you expect", PATIENCE)
            terminal.press("\r")
        terminal.wait_for(lambda text: Shown.on(text).step >= 0, PATIENCE)
        self._device.started.set()

    def _moment(self, terminal: Terminal) -> bool:
        """Return when the program is to be killed; False if the lines end before."""
        if not self._sitting.confirmed:
            terminal.pump(self._rng.uniform(0.0, SOON) / min(self._sitting.speed, 5.0))
            return True
        before, end = Shown.on(terminal.text), time.monotonic() + PATIENCE
        undoing = self._sitting.commands and self._rng.random() < UNDONE
        while time.monotonic() < end and self._device.next < len(performance()):
            if not terminal.pump_piece(POLL):
                continue
            now = Shown.on(terminal.text)
            if now == before:
                continue
            if not undoing or "back" in now.notice:
                return True
            if now.done > before.done:
                terminal.press("u")
            before = now
        return False

    def _missing(self, resumed: Shown) -> str:
        """What the resumed program does not show that the killed one has shown."""
        before = self._before
        if self._sitting.commands or (resumed.step, resumed.done) >= (before.step, before.done):
            return ""
        return f"{before} was shown, after it {resumed}"

    def _unwritten(self) -> str:
        """The notice that was shown and is not in the session."""
        notice = self._before.notice
        with closing(sqlite3.connect(self._path)) as connection:
            written = {text for (text,) in connection.execute("SELECT text FROM event")}
        return f"{notice!r} was shown and is not kept" if notice and notice not in written else ""

    def end(self) -> str:
        """Unplug the device; how the session differs from an undisturbed one, or ""."""
        self._device.stop()
        return difference(self._path)


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


def sit(sitting: Sitting) -> tuple[list[str], int]:
    """What was lost at each kill, and the number of sessions compared with undisturbed ones."""
    rng = np.random.default_rng(sitting.seed)
    problems: list[str] = []
    sessions = 0
    while len(problems) < sitting.kills and time.monotonic() < sitting.end:
        with tempfile.TemporaryDirectory() as folder:
            killed = Killed(sitting, Path(folder), rng)
            problems += killed.lost(sitting.kills - len(problems))
            if difference := killed.end():
                problems[-1] = problems[-1] or difference
            sessions += 1
    return problems, sessions


def sittings(random: int, confirmed: int) -> list[Sitting]:
    """The sittings of a study, half of the kills at each speed.

    Args:
        random: kills at random moments.
        confirmed: kills at the instant of a confirmation, one in four with commands.
    """
    made: list[Sitting] = []
    for speed in SPEEDS:
        at_once = confirmed // len(SPEEDS)
        kinds = (
            (random // len(SPEEDS), False, False),
            (at_once - at_once // 4, True, False),
            (at_once // 4, True, True),
        )
        for count, at_confirmation, commands in kinds:
            for done in range(0, count, MOST_KILLS):
                kills, seed = min(MOST_KILLS, count - done), len(made)
                made.append(Sitting(kills, speed, at_confirmation, commands, seed, CLOCK.end))
    return made


def study(every: Sequence[Sitting]) -> Outcome:
    """All sittings, some at once."""
    outcome = Outcome()
    sessions, made = 0, Counter[str]()
    performance()  # made once; the processes inherit it
    with ProcessPoolExecutor(AT_ONCE) as pool:
        for one, (problems, count) in zip(every, pool.map(sit, every), strict=True):
            outcome.add(problems)
            sessions += count
            at = "at a confirmation" if one.confirmed else "at random"
            made[f"{at} at {one.speed:g} times the true speed"] += len(problems)
    kinds = ", ".join(f"{count} {kind}" for kind, count in made.items())
    outcome.notes += [kinds, f"{sessions} sessions compared with undisturbed ones"]
    return outcome


def run(full: bool) -> Outcome:
    """1,000 kills at random, 200 at a confirmation, 600 losses of power; few if not ``full``."""
    from benchmarks.attacks.power_loss import cut_power  # its device and screen are those of here

    outcome = study(sittings(1000, 200) if full else sittings(16, 16))
    cuts = 0
    for speed, seconds in zip(SPEEDS, (200.0, 10.0) if full else (15.0, 3.0), strict=True):
        problems = cut_power(speed, seconds, 300 if full else 12)
        outcome.add(problems)
        cuts += len(problems)
    outcome.notes.append(f"{cuts} losses of power, half of them at each speed")
    return outcome
