"""A day of samples through the reader; the fit and the resume of a session of half a day."""

import os
import resource
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.attacks import CLOCK, Outcome
from benchmarks.measure import HERE, PYTHON, program_environment, run_once
from benchmarks.resume import resume
from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.instruction import Instruction
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.reader import Reader
from imucal_wizard.run.session_replay import begin_session
from imucal_wizard.simulate.actions import Action, LieStill, PlacePose
from imucal_wizard.simulate.imu import VirtualImu
from imucal_wizard.simulate.noise import RandomStream, generator
from imucal_wizard.simulate.recording import recording_script
from tests.run.performance import same

NUMBER = 10
ATTACK = "a day at 1,666 Hz; fit and resume of a session of 12 hours"

RATE = 1666.0
FULL_SECONDS, FEW_SECONDS = 86_400.0, 300.0
FULL_HOURS, FEW_HOURS = 12.0, 0.2
MAX_FIT_CPU_SECONDS, MAX_RESUME_CPU_SECONDS = 15.0, 5.0
MAX_GROWTH_MIB = 100.0
"""Growth of the process after a tenth of the stream."""
LINES_AT_ONCE = 1024
"""Lines of a read; with fewer, a day takes hours."""
PROCEDURE_HOLD_SECONDS, REST_SECONDS = 12.0, 298.0
LINES_TOGETHER = 200
"""Lines that the engine receives at once; each stays a piece with its own arrival."""


def run(full: bool) -> Outcome:
    """Lost samples, memory and descriptors of a stream; CPU time of a long session's fit."""
    outcome = Outcome()
    stream(FULL_SECONDS if full else FEW_SECONDS, outcome)
    _fit(FULL_HOURS if full else FEW_HOURS, outcome)
    return outcome


class Lines:
    """A source that hands over lines with a running time as fast as they are read.

    Args:
        count: number of lines.
    """

    hand = None
    waiting = True
    description = "lines"

    def __init__(self, count: int) -> None:
        rng = np.random.default_rng(10)
        rest = [
            b",".join(b"%+08.4f" % value for value in row) + b"\n"
            for row in rng.normal([0, 0, 9.81, 0, 0, 0], 0.01, (LINES_AT_ONCE, 6))
        ]
        self._lines = np.array([list(b"000000.000000," + one) for one in rest], np.uint8)
        self._index = np.arange(LINES_AT_ONCE, dtype=np.int64)
        self._count, self.left, self.ended = count, count, threading.Event()
        self._lock = threading.Lock()
        self._header = b"t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s],gz[rad/s]\n"

    def open(self) -> None:
        """Nothing has to be opened."""

    def read(self, timeout: float = 0.05) -> bytes:
        """The next lines; nothing after the last one."""
        if self.left <= 0:
            self.ended.set()
            time.sleep(timeout)  # as a port waits that is silent
            return b""
        if self._header:
            header, self._header = self._header, b""
            return header
        micros = np.rint(self._index * (1e6 / RATE)).astype(np.int64)
        for place in range(13):
            if place != 6:
                power = 12 - place - (place < 6)
                self._lines[:, place] = micros // 10**power % 10 + ord("0")
        self._index += LINES_AT_ONCE
        with self._lock:
            if self.left <= 0:
                return b""
            self.left -= LINES_AT_ONCE
        return self._lines.tobytes()

    def stop(self) -> int:
        """End soon; the number of lines handed over until then."""
        with self._lock:
            self._count -= self.left
            self.left = 0
            return self._count

    def rest(self) -> bytes:
        """It never stands still."""
        return b""

    def follow(self, instruction: Instruction, samples: int) -> None:
        """It does not listen."""

    def reopen(self) -> bool:
        """It is never lost."""
        return True

    def close(self) -> None:
        """Nothing has to be closed."""


def stream(seconds: float, outcome: Outcome) -> None:
    """Read that long a stream; each sample is an attempt."""
    count = int(seconds * RATE) // LINES_AT_ONCE * LINES_AT_ONCE
    source, engine = Lines(count), Engine(StreamSetup())
    reader = Reader(source, engine)
    reader.start()
    reader.command("start")
    while source.left > 0.9 * count and time.monotonic() < CLOCK.end:
        time.sleep(0.1)  # the reader works meanwhile
    tenth = count - source.left
    memory, files, begin = _memory(), _descriptors(), time.monotonic()
    while not source.ended.wait(1.0):
        reader.snapshot()
        if time.monotonic() > CLOCK.end:
            count = source.stop()
    passed = time.monotonic() - begin
    reader.stop()
    grown, more = _memory() - memory, _descriptors() - files
    outcome.tries += count
    outcome.lost += ["a sample"] * max(0, count - engine.samples)
    outcome.count(f"the process grew by {grown:.0f} MiB" if grown > MAX_GROWTH_MIB else "")
    outcome.count(f"{more} descriptors more" if more > 0 else "")
    outcome.notes.append(
        f"{count / RATE / 3600:.1f} h of samples at {(count - tenth) / passed:,.0f} samples/s:"
        f" grown by {grown:.0f} MiB and {more} descriptors after the first tenth"
    )


def _fit(hours: float, outcome: Outcome) -> None:
    """Fit and resume a session of a procedure and many rests, each line a piece of its own."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "long.imucal"
        live = _session(path, hours)
        environment = program_environment(HERE, str(Path(name) / "bytecode"))
        run_once([PYTHON, "-m", "compileall", "-q", str(HERE / "imucal_wizard")], environment)
        cost = run_once([PYTHON, "-m", "imucal_wizard", "fit", str(path)], environment)
        resumed = resume(path, replay=False)
    slow = cost.cpu > MAX_FIT_CPU_SECONDS
    outcome.count(f"the fit took {cost.cpu:.1f} s of CPU" if slow else "")
    slow = resumed.cpu > MAX_RESUME_CPU_SECONDS
    outcome.count(f"the resume took {resumed.cpu:.1f} s of CPU" if slow else "")
    equal = same(resumed.engine.collected(), live.collected())
    equal &= resumed.engine.status() == live.status()
    outcome.count("" if equal else "the resumed session differs from the one that received it all")
    outcome.notes.append(
        f"fit of {hours:.1f} h, {live.samples:,} samples: {cost.cpu:.1f} s of CPU (at most"
        f" {MAX_FIT_CPU_SECONDS:.0f}), {cost.memory:.0f} MiB; resumed from its checkpoint in"
        f" {resumed.cpu:.1f} s of CPU (at most {MAX_RESUME_CPU_SECONDS:.0f}), "
        f"{'the same to the last bit' if equal else 'not the same'}"
    )


def _session(path: Path, hours: float) -> Engine:
    """Write the session; the engine that has received every byte of it."""
    engine, number = begin_session(path), 0
    engine.command("start")
    for lines in _lines(hours):
        for first in range(0, len(lines), LINES_TOGETHER):
            some = lines[first : first + LINES_TOGETHER]
            engine.receive_all([(line, 0.01 * (number + k)) for k, line in enumerate(some)])
            number += len(some)
        while engine.journal.written < engine.journal.passed:  # these lines come faster than any
            time.sleep(0.01)  # device, so that the disk has to catch up
    engine.close()
    return engine


def _lines(hours: float) -> Iterator[list[bytes]]:
    """The lines of a procedure and of rests on each face in turn; the rests come again and again.

    Repeated lines have a running time of their own; to simulate 12 hours takes longer than to read
    them.
    """
    faces = ("+x", "-x", "+y", "-y", "+z", "-z")

    def script() -> Iterator[Action]:
        poses = generator(3, RandomStream.POSES)
        yield from recording_script("18", poses, hold=PROCEDURE_HOLD_SECONDS, rotations=3)
        for face in (faces[-1], *faces):
            yield PlacePose(face)
            yield LieStill(REST_SECONDS)

    imu = VirtualImu(100.0, 3, line_end="\n")
    imu.hand.perform(script())
    lines = [imu.printer.header]
    while count := imu.hand.remaining(1000):
        lines += imu.printer.lines(imu.stream.take(count)).splitlines(keepends=True)
    yield lines
    cycle = [line.partition(b",")[2] for line in lines[-round(6 * 100 * (REST_SECONDS + 2.0)) :]]
    number = len(lines) - 1
    while number < 3600.0 * hours * 100.0:
        yield [b"%.6f,%b" % (0.01 * (number + k), rest) for k, rest in enumerate(cycle)]
        number += len(cycle)


def _memory() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def _descriptors() -> int:
    return len(os.listdir("/proc/self/fd"))  # noqa: PTH208 - a count of names
