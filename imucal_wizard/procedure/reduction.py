"""A recording reduced to blocks and windows, and what it shows at its quietest."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from imucal_wizard.procedure.alignment import aligned
from imucal_wizard.procedure.blocks import BlockCutter, Blocks, join_blocks
from imucal_wizard.procedure.rounding import step_noise, steps_of
from imucal_wizard.procedure.stillness import Noise, WindowMaker, Windows
from imucal_wizard.readings import BoolArray, FloatArray, Readings, Series

QUIET_BLOCKS = 20
SLAB = 200_000
"""Samples cut at a time, so that memory stays flat however long the recording."""


@dataclass(frozen=True, eq=False)
class Stream:
    """A recording reduced to blocks and windows.

    Attributes:
        blocks: its blocks.
        windows: one per block.
        noise: of its quietest two seconds, and not less than the steps of its readings make.
        step_a: smallest step of each accelerometer axis, shape (3,); 0 where it always reads the
            same.
        step_g: the same of the gyroscope, or None.
    """

    blocks: Blocks
    windows: Windows
    noise: Noise
    step_a: FloatArray
    step_g: FloatArray | None


def reduce(readings: Readings) -> Stream | None:
    """Blocks, windows and the quietest noise of a recording; None when it is shorter than that."""
    together = aligned(readings)
    rate = together.accelerometer.rate
    if rate <= 0.0:
        return None
    cutter, maker = BlockCutter(rate), WindowMaker()
    parts = [cutter.feed(part) for part in _slabs(together)]
    blocks = join_blocks(parts)
    windows = maker.feed(blocks)
    gyroscope = readings.gyroscope
    step_a = steps_of(readings.accelerometer.values)
    step_g = None if gyroscope is None else steps_of(gyroscope.values)
    noise = _quietest(windows, step_a, step_g)
    return None if noise is None else Stream(blocks, windows, noise, step_a, step_g)


def _slabs(readings: Readings) -> Iterator[Readings]:
    gyroscope = readings.gyroscope
    for first in range(0, len(readings), SLAB):
        part = slice(first, first + SLAB)
        a = readings.accelerometer
        yield Readings(
            Series(a.time[part], a.values[part], a.unit),
            None
            if gyroscope is None
            else Series(gyroscope.time[part], gyroscope.values[part], gyroscope.unit),
            temperature=readings.temperature if first == 0 else None,
        )


def _quietest(windows: Windows, step_a: FloatArray, step_g: FloatArray | None) -> Noise | None:
    """Noise of the two seconds in which all axes together are quietest.

    Where the noise is smaller than the step of the readings, most windows show none at all and the
    others flicker between two values; the floor is then what rounding makes.
    """
    full = windows.full
    if full.sum() < QUIET_BLOCKS:
        return None
    floor_a = step_noise(step_a)
    floor_g = None if step_g is None else step_noise(step_g)
    score = _relative(windows.std_a, full, floor_a)
    if windows.std_g is not None and floor_g is not None:
        score = score + _relative(windows.std_g, full, floor_g)
    score[~(full & np.isfinite(score))] = np.inf
    spans = np.lib.stride_tricks.sliding_window_view(score, QUIET_BLOCKS).sum(axis=1)
    start = int(np.argmin(spans))
    if not np.isfinite(spans[start]):
        return None
    part = slice(start, start + QUIET_BLOCKS)
    std_g = mean_g = None
    if windows.std_g is not None and windows.mean_g is not None and floor_g is not None:
        std_g = np.maximum(_rms(windows.std_g[part]), floor_g)
        mean_g = windows.mean_g[part].mean(axis=0)
    return Noise(np.maximum(_rms(windows.std_a[part]), floor_a), std_g, mean_g)


def _rms(std: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt((std**2).mean(axis=0)))


def _relative(std: FloatArray, full: BoolArray, floor: FloatArray) -> FloatArray:
    """Variance over all axes against its own low values, so that two sensors can be added."""
    variance = (std**2).sum(axis=1)
    quiet = np.sort(variance[full])[:50]
    least = max(float(np.median(quiet)), float(floor @ floor), 1e-300)
    return np.asarray(variance / least)
