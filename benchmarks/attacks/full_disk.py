"""Runs of the wizard on a disk that becomes full, and calibrations that find no room."""

import os
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from benchmarks.attacks import CLOCK, Outcome
from imucal_wizard.core.errors import ImucalError
from imucal_wizard.run.session_replay import SessionReplay
from imucal_wizard.sessions import KeptSession
from tests.terminal.terminal import Terminal, program

NUMBER = 3
ATTACK = "disks, quotas and limits that are used up during a run"

ROUNDS = {True: 12, False: 1}
SESSION_KIB = 60, 2400
"""Room that a session finds; a whole one needs more."""
RESULT_KIB = 4, 200
"""Room that a calibration finds; it needs about 260."""
PATIENCE = 600.0
"""Seconds until a run has ended, however busy the machine is."""
LIMITED = ("/bin/sh", "-c", 'ulimit -f "$1"; shift; exec "$@"', "sh")
"""Runs a command whose files cannot become larger than so many blocks of 512 bytes."""


def run(full: bool) -> Outcome:
    """Run the wizard unattended where there is too little room."""
    chance, outcome = np.random.default_rng(3), Outcome()
    for _ in CLOCK.attempts(ROUNDS[full]):
        outcome.count(_session(chance, limited=True))
        if os.geteuid() == 0:  # who else may mount a small disk?
            outcome.count(_session(chance, limited=False))
            outcome.count(_result(chance))
    if os.geteuid() != 0:
        outcome.notes.append("without small disks: only root may mount them")
    return outcome


@contextmanager
def _disk(kib: int) -> Iterator[Path]:
    """A disk of this size."""
    with tempfile.TemporaryDirectory() as folder:
        command = ["mount", "-t", "tmpfs", "-o", f"size={kib}k", "tmpfs", folder]
        subprocess.run(command, check=True)
        try:
            yield Path(folder)
        finally:
            subprocess.run(["umount", folder], check=True)


def _unattended(home: Path, *options: str, blocks: int = 0) -> tuple[int, str]:
    """The exit status of an unattended run, and what it leaves on the terminal."""
    command = program("--auto", "--quit", "--mute", "--speed", "60", *options)
    limited = [*LIMITED, str(blocks), *command] if blocks else command
    with Terminal(limited, environment={"HOME": str(home)}) as terminal:
        status = terminal.wait(PATIENCE)
        terminal.pump(0.3)
        _, _, last = bytes(terminal.received).rpartition(b"\x1b[?1049l")
        return status, " ".join(last.decode().split())


def _session(chance: np.random.Generator, *, limited: bool) -> str:
    """What was lost of a session that found too little room."""
    kib = int(chance.integers(*SESSION_KIB))
    with tempfile.TemporaryDirectory() as name:
        home = Path(name)
        if limited:
            place = home / "sessions"
            said = _unattended(home, "--sessions", str(place), blocks=2 * kib)
            return _judged(said, "the limit of the size of a file", place, home, f"{kib} KiB")
        with _disk(kib) as place:
            said = _unattended(home, "--sessions", str(place))
            return _judged(said, "the disk is full", place, home, f"a disk of {kib} KiB")


def _judged(said: tuple[int, str], cause: str, place: Path, home: Path, what: str) -> str:
    status, last = said
    if status != 2 or cause not in last:
        return f"{what}: exit status {status}, and the terminal says {last[-200:]}"
    if "holds" in last and "corrected = M" not in last:
        return f"{what}: the calibration was not printed"
    first, moved = (sorted(one.glob("*.imucal")) for one in (place, home))
    if cause == "the disk is full" and not moved:
        return f"{what}: no second place was used"
    try:
        holds = [_holds(one) for one in (*first, *moved)]
    except ImucalError as error:
        return f"{what}: {error}"
    return "" if holds == sorted(holds) else f"{what}: {holds} holds in the two places"


def _holds(path: Path) -> int:
    """Number of holds of a session, from its bytes and commands."""
    with KeptSession.look(path) as kept:
        past = SessionReplay(kept)
        engine = past.engine()
        past.replay(engine)
    return len(engine.collected().holds)


def _result(chance: np.random.Generator) -> str:
    """What was lost of a calibration that found too little room."""
    kib = int(chance.integers(*RESULT_KIB))
    with tempfile.TemporaryDirectory() as name, _disk(kib) as folder:
        home, place = Path(name), folder / "result.json"
        options = ("--sessions", str(home / "sessions"), "--save", str(place))
        status, last = _unattended(home, *options)
        what, left = f"a result on {kib} KiB", [one.name for one in folder.iterdir()]
        if status != 2 or "the disk is full" not in last or left:
            return f"{what}: exit status {status}, left {left}, the terminal says {last[-200:]}"
        if "corrected = M" not in last or f"--save {home / place.name}" not in last:
            return f"{what}: the terminal says {last[-200:]}"
        return ""
