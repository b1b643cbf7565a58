"""Segmentation of ten million samples: ``python -m benchmarks.segmentation``."""

import resource
import time
from collections.abc import Iterator

import numpy as np

from benchmarks.measure import machine
from imucal_wizard.procedure.blocks import BlockCutter
from imucal_wizard.procedure.holds import still_runs
from imucal_wizard.procedure.stillness import Limits, WindowMaker
from imucal_wizard.readings import Readings, Series

RATE = 1000.0
SLAB = 200_000
SIZES = (2_000_000, 10_000_000, 40_000_000)


def slabs(total: int, gyroscope: bool) -> Iterator[Readings]:
    """A recording in pieces: four seconds at rest, one in motion, around 32768 counts."""
    rng = np.random.default_rng(0)
    noise = rng.normal(32768.0, 4.0, (SLAB, 3))
    moving = (np.arange(SLAB) / RATE % 5.0) > 4.0
    noise[moving] += rng.normal(0.0, 400.0, (int(moving.sum()), 3))
    for first in range(0, total, SLAB):
        series = Series((first + np.arange(SLAB)) / RATE, noise, "count")
        yield Readings(series, series if gyroscope else None)


def segment(total: int, gyroscope: bool) -> tuple[float, int, float]:
    """Seconds spent in the detector, holds found, peak memory in MiB."""
    cutter, maker = BlockCutter(RATE), WindowMaker()
    limits = Limits(np.full(3, 20.0), np.full(3, 20.0) if gyroscope else None)
    spent, decisions = 0.0, []
    for piece in slabs(total, gyroscope):
        start = time.perf_counter()
        decisions.append(maker.feed(cutter.feed(piece)).still(limits))
        spent += time.perf_counter() - start
    holds = len(still_runs(np.concatenate(decisions)))
    return spent, holds, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def main() -> None:
    """Print samples per second for accelerometer alone and for both sensors."""
    print(machine())
    print(f"{'samples':>12}{'channels':>10}{'s':>8}{'Msamples/s':>12}{'holds':>8}{'peak MiB':>10}")
    for gyroscope in (False, True):
        for total in SIZES:
            spent, holds, memory = segment(total, gyroscope)
            rate = total / spent / 1e6
            channels = 6 if gyroscope else 3
            print(f"{total:12,}{channels:10}{spent:8.2f}{rate:12.1f}{holds:8}{memory:10.0f}")
    print("wanted: at least 10 Msamples/s, memory flat in the number of samples")


if __name__ == "__main__":
    main()
