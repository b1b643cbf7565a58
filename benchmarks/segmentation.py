"""Segmentation of ten million samples: ``python -m benchmarks.segmentation``."""

import resource
import statistics
import time
from collections.abc import Iterator

import numpy as np

from benchmarks.measure import machine
from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.measurement.blocks import BlockCutter
from imucal_wizard.measurement.holds import still_runs
from imucal_wizard.measurement.stillness import Limits, WindowMaker

RATES = (100.0, 1000.0, 8000.0)
"""A block is a tenth of a second: 10, 100 and 800 samples."""
SLAB = 200_000
SIZES = (2_000_000, 10_000_000, 40_000_000)
RUNS = 3


def slabs(total: int, rate: float, gyroscope: bool) -> Iterator[Readings]:
    """A recording in pieces: four seconds at rest, one in motion, around 32768 counts."""
    rng = np.random.default_rng(0)
    noise = rng.normal(32768.0, 4.0, (SLAB, 3))
    moving = (np.arange(SLAB) / rate % 5.0) > 4.0
    noise[moving] += rng.normal(0.0, 400.0, (int(moving.sum()), 3))
    for first in range(0, total, SLAB):
        series = Series((first + np.arange(SLAB)) / rate, noise, "count")
        yield Readings(series, series if gyroscope else None)


def segment(total: int, rate: float, gyroscope: bool) -> tuple[float, int]:
    """CPU seconds spent in the detector, and holds found."""
    cutter, maker = BlockCutter(rate), WindowMaker()
    limits = Limits(np.full(3, 20.0), np.full(3, 20.0) if gyroscope else None)
    spent, decisions = 0.0, []
    for piece in slabs(total, rate, gyroscope):
        start = time.process_time()
        decisions.append(maker.feed(cutter.feed(piece)).still(limits))
        spent += time.process_time() - start
    return spent, len(still_runs(np.concatenate(decisions)))


def peak() -> float:
    """Peak memory of this process so far, MiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def main() -> None:
    """Print samples per second for accelerometer alone and for both sensors, at three rates."""
    print(machine())
    print(
        f"{'samples':>12}{'Hz':>8}{'channels':>10}{'CPU s':>8}{'Msamples/s':>12}{'holds':>9}"
        f"{'peak MiB':>10}"
    )
    for gyroscope in (False, True):
        for rate in RATES:
            for total in SIZES:
                runs = [segment(total, rate, gyroscope) for _ in range(RUNS)]
                spent = statistics.median(seconds for seconds, _ in runs)
                channels = 6 if gyroscope else 3
                print(
                    f"{total:12,}{rate:8,.0f}{channels:10}{spent:8.2f}{total / spent / 1e6:12.1f}"
                    f"{runs[0][1]:9,}{peak():10.0f}",
                    flush=True,
                )
    print("wanted: at least 10 Msamples/s, memory flat in the number of samples")


if __name__ == "__main__":
    main()
