"""Promised and achieved error held out of a suspect: ``python -m benchmarks.promises``.

The bench lists each suspect with the error that adding it would leave on data held out. Recordings
of the virtual IMU (accelerometer, gyroscope, and a magnetometer in every second one) have nothing,
one or two effects hidden in them. Each of the first suspects is added, and the two errors are
compared. Required: they agree within 15 % in at least 95 % of the cases of every sensor.

    --recordings   how many
    --seed         of the first one
"""

import argparse
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.measure import Wanted, interval, machine
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.errors import DataError
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.model.effect import SENSORS
from imucal_wizard.simulate.recording import simulate_recording

HIDDEN = (
    "second-order:{:.1f}:x",
    "third-order:{:.1f}:y",
    "cross-product:{:.1f}:zxy",
    "bias-drift:{:.2f}:z",
    "gyroscope/g-sensitivity:0.{:.0f}:xy",
    "gyroscope/bias-step:0.{:.0f}:z",
)
"""What is hidden: a random one of these in half of the recordings, two in a quarter."""
SIZES = 1.0, 8.0
FIRST_SUSPECTS = 6
MARGIN = 0.15
"""By how much promise and achievement may differ."""


@dataclass(frozen=True)
class Promise:
    """One suspect.

    Attributes:
        sensor: whose.
        term: the effect.
        now: error held out before.
        promised: error held out with it, as listed.
        achieved: the same once it was added.
    """

    sensor: str
    term: str
    now: float
    promised: float
    achieved: float

    @property
    def kept(self) -> bool:
        """Whether the two agree."""
        return bool(abs(np.log(self.promised / self.achieved)) <= np.log1p(MARGIN))


def main() -> None:
    """Print the share of promises kept, and those that are not."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--recordings", type=int, default=24)
    parser.add_argument("--seed", type=int, default=700)
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    print(machine())
    with ProcessPoolExecutor(asked.jobs) as pool:
        parts = pool.map(partial(promises, asked.seed), range(asked.recordings))
        found = [one for part in parts for one in part]
    for row in table(found):
        print(row)


def table(found: Sequence[Promise]) -> Iterator[str]:
    """The lines of the table."""
    wanted = Wanted()
    yield f"{'sensor':<16}{'within 15 %':>14}  95 % interval"
    for sensor in SENSORS:
        own = [one for one in found if one.sensor == sensor]
        kept = sum(one.kept for one in own)
        low, high = interval(kept, len(own))
        yield f"{sensor:<16}{f'{kept} of {len(own)}':>14}  [{low:.1f}, {high:.1f}] %"
        wanted.share(sensor, kept, len(own), 95.0)
    for one in found:
        if not one.kept:
            errors = f"now {one.now:.4g}, promised {one.promised:.4g}, achieved {one.achieved:.4g}"
            yield f"  not kept: {one.sensor}, {one.term}: {errors}"
    yield str(wanted)


def promises(seed: int, number: int, sensors: Sequence[str] = SENSORS) -> list[Promise]:
    """The first suspects of each of these sensors of one recording."""
    rng = np.random.default_rng([seed, number])
    count = int(rng.choice((0, 1, 1, 2)))
    chosen = rng.choice(len(HIDDEN), count, replace=False)
    hidden = [HIDDEN[k].format(rng.uniform(*SIZES)) for k in chosen]
    poses = str(rng.choice(("18", "26+repeats")))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "recording.csv"
        own = int(rng.integers(10**6))
        magnetometer = number % 2 == 0
        simulate_recording(path, hidden=hidden, poses=poses, seed=own, magnetometer=magnetometer)
        readings = read_files([path])
    benches = Benches(fit_readings(readings), readings)
    wanted = [sensor for sensor in benches.sensors if sensor in sensors]
    return [one for sensor in wanted for one in _of_sensor(benches, sensor)]


def _of_sensor(benches: Benches, sensor: str) -> Iterator[Promise]:
    bench = benches.bench(sensor)
    if bench is None:
        return
    now = bench.fit.rms_held_out
    for suspect in bench.look().suspects[:FIRST_SUSPECTS]:
        promised = None if suspect.trial is None else suspect.trial.rms_held_out
        if promised is None or now is None:
            continue
        try:
            bench.add(suspect.term)
        except DataError:
            continue
        achieved = bench.fit.rms_held_out
        bench.undo()
        if achieved is not None:
            yield Promise(sensor, suspect.term, now, promised, achieved)


if __name__ == "__main__":
    main()
