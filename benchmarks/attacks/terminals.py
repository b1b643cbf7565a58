"""Signals, stops and a terminal that goes away, at random moments of a run."""

import os
import signal
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.attacks import CLOCK, Outcome
from tests.terminal.terminal import FRAMES_ASKED, Terminal, program

NUMBER = 2
ATTACK = "signals, stops, and terminals that go away during a run"

ENDING = ("SIGTERM", "SIGQUIT", "SIGINT", "SIGHUP")
ROUNDS = {True: 15, False: 1}
FIRST_SECONDS, LAST_SECONDS = 0.05, 6.0
"""Between these, after the start of the program, it is attacked: on the first screen, while modules
are imported, in the steps."""
GONE_SECONDS = 1.0
PATIENCE = 20.0
START_SECONDS = 120.0
"""Until a busy machine has started the program; the attack begins after that."""
KEPT_ON = {7, 25}
"""Line wrap and cursor: the modes that are on in a terminal."""
HANGUP_IGNORED = ("/bin/sh", "-c", "trap '' HUP; exec \"$@\"", "sh")


def run(full: bool) -> Outcome:
    """End, stop and disconnect runs of the virtual IMU."""
    chance, outcome, slowest = np.random.default_rng(2), Outcome(), 0.0
    for _ in CLOCK.attempts(ROUNDS[full]):
        attacks: list[Callable[[np.random.Generator], str]] = [_stopped]
        attacks += [partial(_ended, getattr(signal, name)) for name in ENDING]
        for attack in attacks:
            try:
                outcome.count(attack(chance))
            except AssertionError as error:  # what was waited for has not come
                outcome.count(str(error))
        for ignored in (False, True):
            problem, seconds = _gone(chance, ignored=ignored)
            outcome.count(problem)
            slowest = max(slowest, seconds)
    outcome.notes.append(f"{slowest:.2f} s at most until a program without its terminal has ended")
    return outcome


def _command(folder: str) -> list[str]:
    return program("--auto", "--mute", "--speed", "5", "--sessions", folder)


def _attacked(terminal: Terminal, chance: np.random.Generator) -> None:
    """Wait for the first screen, and then for a random moment."""
    terminal.wait_for(lambda _: bool(terminal.received), START_SECONDS)
    terminal.pump(chance.uniform(FIRST_SECONDS, LAST_SECONDS))


def _ended(number: int, chance: np.random.Generator) -> str:
    """What a signal left behind."""
    with tempfile.TemporaryDirectory() as folder, Terminal(_command(folder)) as terminal:
        before = terminal.settings
        _attacked(terminal, chance)
        os.kill(terminal.pid, number)
        status = terminal.wait(PATIENCE)
        name = signal.Signals(number).name
        if status != 128 + number:
            return f"{name}: exit status {status}"
        return _left(terminal, before, name) or _open_session(folder, name)


def _stopped(chance: np.random.Generator) -> str:
    """What a stop without notice, and its continuation, left behind."""
    with tempfile.TemporaryDirectory() as folder, Terminal(_command(folder)) as terminal:
        before = terminal.settings
        _attacked(terminal, chance)
        os.kill(terminal.pid, signal.SIGSTOP)
        terminal.pump(0.2)
        taken = terminal.received.count(FRAMES_ASKED)
        os.kill(terminal.pid, signal.SIGCONT)
        terminal.wait_for(lambda _: terminal.received.count(FRAMES_ASKED) > taken, PATIENCE)
        terminal.press("\x11")  # the program listens again, and no key may be lost
        status = terminal.wait(PATIENCE)
        if status != 0:
            return f"SIGSTOP: exit status {status}"
        return _left(terminal, before, "SIGSTOP") or _open_session(folder, "SIGSTOP")


def _gone(chance: np.random.Generator, *, ignored: bool) -> tuple[str, float]:
    """What a lost terminal left behind, and the seconds until the program has ended."""
    with tempfile.TemporaryDirectory() as folder:
        command = [*(HANGUP_IGNORED if ignored else ()), *_command(folder)]
        with Terminal(command) as terminal:
            _attacked(terminal, chance)
            begin = time.monotonic()
            terminal.hang_up()
            while terminal.status() is None and time.monotonic() - begin < PATIENCE:
                time.sleep(0.005)
            seconds = time.monotonic() - begin
        if seconds > GONE_SECONDS:
            return f"a lost terminal: the program ran for {seconds:.1f} s", seconds
        return _open_session(folder, "a lost terminal"), seconds


def _left(terminal: Terminal, before: list[object], after: str) -> str:
    terminal.pump(0.2)
    on = {mode for mode, is_on in terminal.modes.items() if is_on}
    if terminal.settings != before:
        return f"{after}: stty is not as before"
    return "" if on <= KEPT_ON else f"{after}: the modes {sorted(on - KEPT_ON)} are on"


def _open_session(folder: str, after: str) -> str:
    """Whether a session was left with the log that SQLite removes when it closes a file."""
    left = sorted(path.name for path in Path(folder).iterdir())
    return f"{after}: left {left}" if any(name.endswith("-wal") for name in left) else ""
