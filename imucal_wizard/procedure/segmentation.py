"""Holds and rotations of a whole recording, and the stillness limits that suit it.

No fixed multiple of the quietest noise finds the holds of every recording: a table asks for one, a
hand for a hundred. Every candidate limit is therefore tried, and whoever can judge (the fit) picks.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from imucal_wizard.procedure.alignment import aligned
from imucal_wizard.procedure.blocks import BlockCutter, Blocks, join_blocks
from imucal_wizard.procedure.holds import Hold, hold_from, settled, still_runs
from imucal_wizard.procedure.rotation_check import clipped
from imucal_wizard.procedure.rotations import Rotation
from imucal_wizard.procedure.stillness import Noise, WindowMaker, Windows
from imucal_wizard.readings import FloatArray, Readings, Series

SHORTEST_HOLD = 1.0
"""Seconds; shorter rests are as often a slow moment of a turn as a hold."""
VARIANCE_FACTORS = (2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256)
"""Limits tried, as multiples of the quietest variance."""
QUIET_BLOCKS = 20
SLAB = 200_000
"""Samples cut at a time, so that memory stays flat however long the recording."""
SHORTEST_TURN = 2.5
"""Seconds within which no hand turns a device all the way round and back to the same place."""
SAME_PLACE = 0.01
"""Share of gravity by which two holds of one place differ at most."""
OVERLAP = 0.05
"""Seconds of each hold at the ends of a rotation, so that no motion is missed."""
MEANING_OF_GAP = 2.5


@dataclass(frozen=True, eq=False)
class Stream:
    """A recording reduced to blocks and windows.

    Attributes:
        blocks: its blocks.
        windows: one per block.
        noise: of its quietest two seconds.
    """

    blocks: Blocks
    windows: Windows
    noise: Noise


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
    noise = _quietest(windows)
    return None if noise is None else Stream(blocks, windows, noise)


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


def _quietest(windows: Windows) -> Noise | None:
    """Noise of the two seconds in which all axes together are quietest."""
    full = windows.full
    if full.sum() < QUIET_BLOCKS:
        return None
    score = _relative(windows.std_a, full)
    if windows.std_g is not None:
        score = score + _relative(windows.std_g, full)
    score[~(full & np.isfinite(score))] = np.inf
    spans = np.lib.stride_tricks.sliding_window_view(score, QUIET_BLOCKS).sum(axis=1)
    start = int(np.argmin(spans))
    if not np.isfinite(spans[start]):
        return None
    part = slice(start, start + QUIET_BLOCKS)
    std_g = mean_g = None
    if windows.std_g is not None and windows.mean_g is not None:
        std_g = np.sqrt((windows.std_g[part] ** 2).mean(axis=0))
        mean_g = windows.mean_g[part].mean(axis=0)
    return Noise(np.sqrt((windows.std_a[part] ** 2).mean(axis=0)), std_g, mean_g)


def _relative(std: FloatArray, full: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> FloatArray:
    """Variance over all axes against its own low values, so that two sensors can be added."""
    variance = (std**2).sum(axis=1)
    quiet = np.sort(variance[full])[:50]
    return np.asarray(variance / max(float(np.median(quiet)), 1e-300))


def holds_at(stream: Stream, variance_factor: float) -> list[Hold]:
    """The holds under limits at this multiple of the quietest variance."""
    still = stream.windows.still(stream.noise.limits(float(np.sqrt(variance_factor))))
    holds = []
    for first, past in still_runs(still):
        piece = settled(stream.blocks.select(slice(first, past)))
        if piece.end[-1] - piece.start[0] >= SHORTEST_HOLD - 1e-9:
            holds.append(hold_from(piece))
    return holds


def candidates(stream: Stream) -> Iterator[tuple[float, list[Hold]]]:
    """Every limit tried with the holds it finds, from the strictest on; equal results once."""
    seen: set[tuple[float, ...]] = set()
    for factor in VARIANCE_FACTORS:
        holds = holds_at(stream, factor)
        key = tuple(hold.start for hold in holds) + tuple(hold.end for hold in holds)
        if key not in seen:
            seen.add(key)
            yield factor, holds


def rotations_between(
    holds: Sequence[Hold], gyroscope: Series, accelerometer: Series
) -> list[Rotation]:
    """The motions between neighbouring holds, with the reason where one cannot be used."""
    interval = 1.0 / gyroscope.rate
    rotations = []
    means = np.array([hold.accelerometer for hold in holds]).reshape(-1, 3)
    gravity = float(np.ptp(means, axis=0).max()) / 2.0 if len(means) else 0.0
    for before, after in itertools.pairwise(holds):
        moved = float(np.linalg.norm(after.accelerometer - before.accelerometer))
        if after.start - before.end < SHORTEST_TURN and moved < SAME_PLACE * gravity:
            continue  # one rest with a disturbance in it
        part = gyroscope.between(before.end - OVERLAP, after.start + OVERLAP)
        problem = _problem(part, interval, _rest(before, after))
        force = _at(accelerometer, part.time)
        rotations.append(Rotation(before, after, part.time, part.values, None, problem, force))
    return rotations


def _at(series: Series, time: FloatArray) -> FloatArray:
    """Readings at other times than their own, by linear interpolation."""
    near = series.between(float(time[0]) - 1.0, float(time[-1]) + 1.0) if len(time) else series
    if not len(time) or not len(near):
        return np.zeros((len(time), 3))
    return np.column_stack([np.interp(time, near.time, column) for column in near.values.T])


def _rest(before: Hold, after: Hold) -> FloatArray:
    """The gyroscope's reading at rest around a rotation, shape (3,)."""
    known = [hold.gyroscope for hold in (before, after) if hold.gyroscope is not None]
    return np.asarray(np.mean(known, axis=0)) if known else np.zeros(3)


def _problem(part: Series, interval: float, rest: FloatArray) -> str | None:
    if len(part) < 3:
        return "no gyroscope samples in it"
    gaps = np.diff(part.time)
    if gaps.max() > MEANING_OF_GAP * interval:
        return f"a gap of {gaps.max():.2f} s: the angle in it is not known"
    if not np.isfinite(part.values).all():
        return "some of its samples are not numbers"
    axis = clipped(part.values, rest, None)
    return None if axis is None else f"axis {axis} is clipped at its range: turn more slowly"
