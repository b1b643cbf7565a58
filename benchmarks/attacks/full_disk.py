"""Runs of the wizard on a disk that becomes full, and calibrations that find no room."""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
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
"""Room that a session finds; a whole one needs more, and with less than 330 none is begun."""
RESULT_KIB = 4, 200
"""Room that a calibration finds; it needs about 260."""
QUOTA_TOOLS = ("mkfs.btrfs", "btrfs")
SYNCING = ("/bin/sh", "-c", "while sleep 0.2; do sync -f disk; done")
COPYING_DISK_BYTES = 120 << 20
"""Size of a disk with quotas that copies on write; such a disk needs 109 MiB."""
PATIENCE = 600.0
"""Seconds until a run has ended, however busy the machine is."""
LIMITED = ("/bin/sh", "-c", 'ulimit -f "$1"; shift; exec "$@"', "sh")
"""Runs a command whose files cannot become larger than so many blocks of 512 bytes."""


def run(full: bool) -> Outcome:
    """Run the wizard unattended where there is too little room."""
    chance, outcome = np.random.default_rng(3), Outcome()
    mounts = os.geteuid() == 0  # who else may mount a small disk?
    quotas = mounts and all(map(shutil.which, QUOTA_TOOLS))
    for _ in CLOCK.attempts(ROUNDS[full]):
        outcome.count(_limited(chance))
        if mounts:
            outcome.count(_session(chance, _disk, "the disk is full"))
            outcome.count(_result(chance))
        if quotas:
            outcome.count(_session(chance, _quota, "the quota of the disk is used up"))
    if not mounts:
        outcome.notes.append("without small disks: only root may mount them")
    if not quotas:
        outcome.notes.append("without quotas: they need root and btrfs-progs")
    return outcome


def _call(*command: str) -> None:
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


@contextmanager
def _disk(kib: int) -> Iterator[Path]:
    """A disk of this size."""
    with tempfile.TemporaryDirectory() as folder:
        _call("mount", "-t", "tmpfs", "-o", f"size={kib}k", "tmpfs", folder)
        try:
            yield Path(folder)
        finally:
            _call("umount", folder)


@contextmanager
def _quota(kib: int) -> Iterator[Path]:
    """A folder with a quota of this size, on a disk that copies on write.

    Its pages are written all the time, as a long run leaves them: then each change needs new room.
    """
    with tempfile.TemporaryDirectory() as name:
        image, disk = Path(name, "image"), Path(name, "disk")
        disk.mkdir()
        with image.open("wb") as file:
            file.truncate(COPYING_DISK_BYTES)
        _call("mkfs.btrfs", "--quiet", str(image))
        _call("mount", "-o", "loop", str(image), str(disk))
        try:
            place = disk / "place"
            _call("btrfs", "quota", "enable", str(disk))
            _call("btrfs", "subvolume", "create", str(place))
            _call("btrfs", "qgroup", "limit", f"{kib}K", str(place))
            with subprocess.Popen(SYNCING, cwd=image.parent) as syncing:
                yield place
                syncing.kill()
        finally:
            _call("umount", str(disk))


def _unattended(home: Path, *options: str, blocks: int = 0) -> tuple[int, str]:
    """The exit status of an unattended run, and what it leaves on the terminal."""
    command = program("--auto", "--quit", "--mute", "--speed", "60", *options)
    limited = [*LIMITED, str(blocks), *command] if blocks else command
    with Terminal(limited, environment={"HOME": str(home)}) as terminal:
        status = terminal.wait(PATIENCE)
        terminal.pump(0.3)
        _, _, last = bytes(terminal.received).rpartition(b"\x1b[?1049l")
        return status, " ".join(last.decode().split())


def _limited(chance: np.random.Generator) -> str:
    """What was lost of a session whose files may not become large enough."""
    kib = int(chance.integers(*SESSION_KIB))
    with tempfile.TemporaryDirectory() as name:
        place = Path(name, "sessions")
        said = _unattended(Path(name), "--sessions", str(place), blocks=2 * kib)
        cause = "the limit of the size of a file is reached"
        return _judged(said, cause, place, None, f"files of {kib} KiB")


def _session(
    chance: np.random.Generator, room: Callable[[int], AbstractContextManager[Path]], cause: str
) -> str:
    """What was lost of a session that found too little room."""
    kib = int(chance.integers(*SESSION_KIB))
    with tempfile.TemporaryDirectory() as name, room(kib) as place:
        said = _unattended(Path(name), "--sessions", str(place))
        return _judged(said, cause, place, Path(name), f"{kib} KiB")


def _judged(said: tuple[int, str], cause: str, place: Path, second: Path | None, what: str) -> str:
    """What was lost of a session in ``place``; it goes on in the second place if there is one."""
    status, last = said
    what = f"{what}, {cause}"
    if status != 2 or cause not in last:
        return f"{what}: exit status {status}, and the terminal says {last[-200:]}"
    if "holds" in last and "corrected = M" not in last:
        return f"{what}: the calibration was not printed"
    first = sorted(place.glob("*.imucal"))
    moved = sorted(second.glob("*.imucal")) if second is not None else []
    if second is not None and not moved and first:
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
