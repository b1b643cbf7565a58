"""The wizard is killed in the middle of a session, in a real terminal with a device on a port.

A session is performed by a prepared hand, whose lines a device sends to a pseudo-terminal. Again
and again the program is killed with SIGKILL, at a random moment or as soon as the screen confirms
a hold, a rotation or a command. Then the session is resumed, and the device goes on with the first
line that the session does not hold, so that the input is that of an undisturbed run.

Lost is a step, a count or a notice that the screen has shown and the session does not know; and a
session that differs at its end, in any bit, from the same bytes and commands without any kill.
"""

import os
import signal
import sqlite3
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.attacks import CLOCK, Outcome
from benchmarks.attacks.performed import (
    PATIENCE,
    ROTATIONS,
    Device,
    Shown,
    difference,
    lines_held,
    performance,
)
from benchmarks.attacks.power_loss import cut_power
from tests.terminal.terminal import POLL, Terminal, program

NUMBER = 1
ATTACK = "killed at random and at each confirmation; power lost"

SPEEDS = (1.0, 20.0)
AT_ONCE = 4
"""Sessions at once: at true speed a session uses a tenth of a core, and its start one second."""
MOST_KILLS = 250
"""Kills of a sitting: those at random moments reach the end of the procedure at true speed."""
SOON = 2.5
"""Seconds after the program is back into which kills at random fall; a fifth of them at 20 times
the true speed, which are ten seconds of device time."""
UNDONE = 0.5
"""Share of the kills, in a sitting with commands, that wait for a hold to be taken back."""


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
        self._device = Device(sitting.speed, performance())
        self._before = Shown()

    @property
    def _path(self) -> Path:
        return next(self._folder.glob("*.imucal"))

    def lost(self, kills: int) -> Iterator[str]:
        """Kill so many times, or until the lines have ended; what each kill has lost."""
        for number in range(kills):
            late, first = number > 0 and time.monotonic() > self._sitting.end, self._held()
            if late or first >= len(performance()):
                break
            with self._device.sending(first), self._started() as terminal:
                try:
                    self._wait(terminal)
                except AssertionError as error:
                    yield f"it did not come back: {error}"
                    break
                resumed = Shown.on(terminal.text)
                missing = self._missing(resumed)
                if not self._moment(terminal):
                    break
                self._before = _killed(terminal)
            yield missing or self._unwritten(resumed)

    def _held(self) -> int:
        """Number of lines that the session holds; the device goes on with the next one."""
        return max((lines_held(path) for path in self._folder.glob("*.imucal")), default=0)

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

    def _unwritten(self, resumed: Shown) -> str:
        """The notice that was shown and is not in the session.

        A notice that the resumed program has shown at once was found again in the bytes.
        """
        notice = self._before.notice
        if notice == resumed.notice:
            return ""
        with closing(sqlite3.connect(self._path)) as connection:
            written = {text for (text,) in connection.execute("SELECT text FROM event")}
        return f"{notice!r} was shown and is not kept" if notice and notice not in written else ""

    def end(self) -> str:
        """Unplug the device; how the session differs from an undisturbed one, or ""."""
        self._device.port.close()
        return difference(self._path)


def _killed(terminal: Terminal) -> Shown:
    """Kill the program; what stands in the last frame that it has drawn as a whole."""
    os.kill(terminal.pid, signal.SIGKILL)
    text = terminal.text
    while terminal.pump_piece(POLL) is not None:
        text = terminal.text
    terminal.wait(PATIENCE)
    return Shown.on(text)


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
    outcome = study(sittings(1000, 200) if full else sittings(16, 16))
    cuts = 0
    for speed, seconds in zip(SPEEDS, (200.0, 10.0) if full else (15.0, 3.0), strict=True):
        problems = cut_power(speed, seconds, 300 if full else 12)
        outcome.add(problems)
        cuts += len(problems)
    outcome.notes.append(f"{cuts} losses of power, half of them at each speed")
    return outcome
