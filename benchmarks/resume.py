"""Resume of a long session from its checkpoint: ``python -m benchmarks.resume [HOURS]``.

A virtual IMU is measured and then rests, moved every five minutes, for HOURS (12) at 100 samples/s.
The session is written as in real use. Then it is resumed from its newest checkpoint, resumed by a
replay from the first byte, and both states are compared to the last bit.
"""

import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from benchmarks.measure import machine, own_cpu
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.session_replay import begin_session, resume_session
from imucal_wizard.simulate.actions import Action, LieStill, PlacePose
from imucal_wizard.simulate.imu import VirtualImu
from imucal_wizard.simulate.noise import RandomStream, generator
from imucal_wizard.simulate.recording import recording_script
from imucal_wizard.simulate.scripts import FACE_NAMES
from tests.run.performance import same

RATE = 100.0
REST_SECONDS = 298.0
PIECE = 25
"""Samples that arrive together: a quarter of a second."""
SEED = 3


def script(hours: float) -> Iterator[Action]:
    """A measurement with rotations, then rests with a new face on top every five minutes."""
    yield from recording_script("18", generator(SEED, RandomStream.POSES), hold=12.0, rotations=3)
    for number in range(round(hours * 3600.0 / (REST_SECONDS + 2.0))):
        yield PlacePose(FACE_NAMES[number % len(FACE_NAMES)])
        yield LieStill(REST_SECONDS)


def write(path: Path, hours: float) -> int:
    """Write the session; the number of its samples."""
    imu = VirtualImu(RATE, SEED)
    imu.hand.perform(script(hours))
    engine = begin_session(path)
    engine.command("start")
    engine.receive(imu.printer.header, 0.0)
    while count := imu.hand.remaining(PIECE):
        engine.receive(imu.printer.lines(imu.stream.take(count)), engine.samples / RATE)
    engine.close()
    return engine.samples


@dataclass(frozen=True)
class Resumed:
    """A session after its resume.

    Attributes:
        engine: its state.
        seconds: duration of the resume, s.
        cpu: CPU time of it, s.
    """

    engine: Engine
    seconds: float
    cpu: float


def resume(path: Path, *, replay: bool) -> Resumed:
    """Resume a session, from its first byte if ``replay``."""
    wall, cpu = time.perf_counter(), own_cpu()
    resumed = resume_session(path)
    engine = resumed.engine
    if replay:
        for step in resumed.replay.steps():
            resumed.replay.replay_step(engine, step)
        resumed.session.close()
    else:
        resumed.prepare(engine)
    made = Resumed(engine, time.perf_counter() - wall, own_cpu() - cpu)
    if not replay:
        engine.close()
    return made


def main() -> int:
    """Print how long both ways take; 1 if the states differ."""
    hours = float(sys.argv[1]) if len(sys.argv) > 1 else 12.0
    print(machine())
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "long.imucal"
        samples = write(path, hours)
        size = path.stat().st_size
        quick, whole = resume(path, replay=False), resume(path, replay=True)
    print(f"{samples:,} samples, {hours:g} hours; {size / 1e6:.0f} MB")
    for name, one in (("from the checkpoint", quick), ("from the first byte", whole)):
        print(f"resumed {name}: {one.seconds:7.2f} s, {one.cpu:7.2f} s of CPU")
    equal = same(quick.engine.collected(), whole.engine.collected())
    equal &= quick.engine.status() == whole.engine.status()
    print("both states are the same to the last bit" if equal else "THE STATES DIFFER")
    print("wanted: 12 hours from the checkpoint in at most 5 s")
    return 0 if equal else 1


if __name__ == "__main__":
    sys.exit(main())
