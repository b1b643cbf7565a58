"""Power fails while the wizard writes: a file system that drops what was not synced.

The real program runs in a terminal with a device on a port. ``power_loss.c`` records every write,
truncation, sync, creation and removal that it asks for in the folder of its sessions. From the
record follows what a disk holds after a loss of power at any moment: a file has the content of its
last sync, and a name is there or gone as at the last sync of its folder. At every second cut a
random part of the sectors and names since then is kept as well, as disks write in any order.

Lost is a notice or a command that the screen has shown before, bytes that the device has sent more
than a second before, and a session that cannot be opened or gives other measurements than its bytes
and commands without a loss of power.
"""

import shutil
import sqlite3
import struct
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.attacks.performed import (
    PATIENCE,
    ROTATIONS,
    Device,
    Shown,
    difference,
    lines_held,
    performance,
)
from imucal_wizard.core.errors import ImucalError
from tests.terminal.terminal import Terminal, program

MAX_LOST_SECONDS = 1.0
"""Seconds of samples that a loss of power may cost."""
SECTOR = 512
"""Bytes that a disk writes whole."""
REPLAYED = 0.05
"""Share of the cuts after which the session is also replayed and compared."""
UNDONE = 0.15
"""Share of the holds that are taken back."""
_HEAD = struct.Struct("<dQQIc3x")
_RECORDER = Path(__file__).with_suffix(".c")


@dataclass(frozen=True)
class Call:
    """What the program has asked of a file; ``kind`` as in the recorder."""

    time: float
    kind: str
    path: Path
    offset: int
    length: int
    data: bytes


def calls(record: bytes) -> Iterator[Call]:
    """The calls of a record."""
    place = 0
    while place < len(record):
        moment, offset, length, name, kind = _HEAD.unpack_from(record, place)
        place += _HEAD.size + name
        size = length if kind == b"W" else 0
        path = Path(record[place - name : place].decode())
        yield Call(moment, kind.decode(), path, offset, length, record[place : place + size])
        place += size


@dataclass
class File:
    """A file: what a sync has made safe, and the calls since then."""

    safe: bytearray = field(default_factory=bytearray)
    since: list[Call] = field(default_factory=list)

    def content(self, kept: np.random.Generator | None) -> bytearray:
        """What is left of it, with a random part of the sectors since the last sync if ``kept``."""
        left = bytearray(self.safe)
        for call in self.since if kept is not None else ():
            for start in range(0, max(len(call.data), 1), SECTOR):
                if kept is not None and kept.random() < 0.5:
                    _apply(left, call, start, start + SECTOR)
        return left

    def sync(self) -> None:
        """Make everything safe."""
        for call in self.since:
            _apply(self.safe, call, 0, len(call.data))
        self.since.clear()


def _apply(content: bytearray, call: Call, first: int, past: int) -> None:
    """Make a part of a call."""
    if call.kind == "T":
        del content[call.offset :]
        content.extend(bytes(call.offset - len(content)))
        return
    part, place = call.data[first:past], call.offset + first
    content.extend(bytes(max(place - len(content), 0)))
    content[place : place + len(part)] = part


class Disk:
    """A folder as the program sees it, and as a loss of power leaves it."""

    def __init__(self) -> None:
        self._seen: dict[Path, File] = {}
        self._safe: dict[Path, File] = {}

    def take(self, call: Call) -> None:
        """Take the next call."""
        if call.kind == "U":
            self._seen.pop(call.path, None)
        elif call.kind == "S" and call.path not in self._seen:  # a folder
            here = {path: file for path, file in self._seen.items() if path.parent == call.path}
            there = {path: file for path, file in self._safe.items() if path.parent != call.path}
            self._safe = there | here
        elif call.kind == "S":
            self._seen[call.path].sync()
        elif call.kind == "C":
            self._seen[call.path] = File()
        elif call.path in self._seen:
            self._seen[call.path].since.append(call)

    def lose(self, folder: Path, kept: np.random.Generator | None) -> None:
        """Write what a loss of power leaves.

        Args:
            folder: an empty folder.
            kept: draws what is left of the calls since the last syncs; None to drop all of them.
        """
        names = dict(self._safe)
        for path in {*self._safe, *self._seen} if kept is not None else ():
            if kept is not None and kept.random() < 0.5:
                names.pop(path, None)
                names |= {path: self._seen[path]} if path in self._seen else {}
        for path, file in names.items():
            if not path.name.endswith("-shm"):  # its memory is shared by processes, not kept
                (folder / path.name).write_bytes(file.content(kept))


@dataclass
class Sitting:
    """A recorded run.

    Attributes:
        record: the calls.
        shown: what the screen has confirmed, each with the time at which it was seen, s.
        sent: number of lines that the device had sent, each with its time, s.
    """

    record: list[Call]
    shown: list[tuple[float, Shown]] = field(default_factory=list)
    sent: list[tuple[float, int]] = field(default_factory=list)


def recorder(folder: Path) -> Path:
    """The compiled recorder.

    Raises:
        SystemExit: there is no C compiler.
    """
    compiler = shutil.which("cc")
    if compiler is None:
        raise SystemExit("the loss of power is recorded by a C library: install a C compiler (cc)")
    made = folder / "power_loss.so"
    command = [compiler, "-shared", "-fPIC", "-O2", "-o", str(made), str(_RECORDER), "-ldl"]
    subprocess.run(command, check=True)
    return made


def sit(speed: float, seconds: float, rng: np.random.Generator) -> Sitting:
    """Run the program on the device at a speed, for at most so many seconds, and record it."""
    with tempfile.TemporaryDirectory() as name:
        folder, log = Path(name, "sessions").resolve(), Path(name, "record")
        environment = {
            "LD_PRELOAD": str(recorder(Path(name))),
            "POWER_FOLDER": str(folder.parent / "sessions"),
            "POWER_LOG": str(log),
        }
        device, sitting = Device(speed, performance()), Sitting([])
        options = ["--sessions", str(folder), "--rotations", str(ROTATIONS)]
        command = program("--port", device.port.path, *options)
        with device.sending(0), Terminal(command, environment=environment) as terminal:
            terminal.wait_for("is this what you expect", PATIENCE)
            terminal.press("\r")
            terminal.wait_for("▸SETTLE", PATIENCE)
            device.started.set()
            end, before = time.monotonic() + seconds, Shown()
            while time.monotonic() < end and device.next < len(performance()):
                sitting.sent.append((time.monotonic(), device.next))
                terminal.pump()
                now = Shown.on(terminal.text)
                if now != before:
                    sitting.shown.append((time.monotonic(), now))
                if now.done > before.done and rng.random() < UNDONE:
                    terminal.press("u")
                before = now
        device.port.close()
        sitting.record = list(calls(log.read_bytes()))
    return sitting


def cut_power(speed: float, seconds: float, cuts: int, seed: int = 1) -> list[str]:
    """What each of so many losses of power in one run has cost; "" for nothing.

    Args:
        speed: device seconds per second.
        seconds: duration of the run, s.
        cuts: number of losses of power.
        seed: of the random numbers.
    """
    rng = np.random.default_rng(seed)
    return list(lost(sit(speed, seconds, rng), cuts, rng))


def moments(sitting: Sitting, cuts: int, rng: np.random.Generator) -> list[float]:
    """The times of the cuts, s: at each confirmation, the others at random calls."""
    begin = sitting.shown[0][0]
    at_random = [call.time for call in sitting.record if call.time > begin]
    at_once = [moment for moment, _ in sitting.shown]
    rest = max(cuts - len(at_once), 0)
    return sorted([*at_once[:cuts], *rng.choice(at_random, rest).tolist()])


def lost(sitting: Sitting, cuts: int, rng: np.random.Generator) -> Iterator[str]:
    """What each loss of power has cost that must not be lost, "" for nothing."""
    disk, left = Disk(), iter(sitting.record)
    call = next(left, None)
    for number, moment in enumerate(moments(sitting, cuts, rng)):
        while call is not None and call.time <= moment:
            disk.take(call)
            call = next(left, None)
        with tempfile.TemporaryDirectory() as folder:
            disk.lose(Path(folder), rng if number % 2 else None)
            whole = rng.random() < REPLAYED
            problem = _missing(Path(folder), sitting, moment, whole=whole)
        yield f"{moment - sitting.shown[0][0]:.3f} s after the start: {problem}" if problem else ""


def _missing(folder: Path, sitting: Sitting, moment: float, *, whole: bool) -> str:
    """What is missing in the session that a loss of power at a moment has left."""
    paths = list(folder.glob("*.imucal"))
    if not paths:
        return "there is no session"
    notices = [shown.notice for at, shown in sitting.shown if at <= moment and shown.notice]
    undone = sum("back" in notice for notice in dict.fromkeys(notices))
    sent = max((count for at, count in sitting.sent if at <= moment - MAX_LOST_SECONDS), default=0)
    try:
        held = lines_held(paths[0])
        with closing(sqlite3.connect(paths[0])) as connection:
            written = {text for (text,) in connection.execute("SELECT text FROM event")}
            names = [name for (name,) in connection.execute("SELECT name FROM command")]
        if unwritten := [notice for notice in notices if notice not in written]:
            return f"{unwritten[-1]!r} was shown and is not kept"
        if "start" not in names or names.count("undo") < undone:
            return f"{1 + undone} commands were shown, {len(names)} are kept"
        if held < sent:
            return f"{sent} lines were sent {MAX_LOST_SECONDS:g} s before, {held} are kept"
        return difference(paths[0]) if whole else ""
    except (sqlite3.Error, ImucalError) as error:
        return f"{type(error).__name__}: {error}"
