"""Rests: where each begins and ends, by its own noise.

A limit of stillness finds a rest, but another limit meets its ends a block sooner or later. So the
limit only shows that the device rests. The rest is all windows around its calmest one that exceed
neither the noise usual among them nor the resolution by more than a factor. It follows from the
samples alone: every limit that does not break the rest, in a file or in a stream, finds the same
blocks.
"""

import numpy as np

from imucal_wizard.core.limits.stillness import (
    GUARD_BLOCKS,
    HISTORY_BLOCKS,
    REST_FACTOR,
    WINDOW_BLOCKS,
)
from imucal_wizard.core.readings import BoolArray, FloatArray
from imucal_wizard.core.statistics import median_of_rows, true_on_all_axes
from imucal_wizard.measurement.blocks import Blocks, join_blocks
from imucal_wizard.measurement.holds import Hold, hold_at_rest
from imucal_wizard.measurement.rounding import rounding_noise
from imucal_wizard.measurement.stillness import Windows, join_windows

_REACH = 64
"""Windows to either side that are looked at first; a longer rest is looked at again."""
_WITHOUT_GYROSCOPE = 1e6
"""Makes windows without samples of the gyroscope the least calm of all."""


class Rests:
    """The rests in a stream of windows.

    Args:
        windows: the windows.
        step_a: resolution of the accelerometer, 0 if not known.
        step_g: resolution of the gyroscope; None without one.
    """

    def __init__(
        self,
        windows: Windows,
        step_a: FloatArray | float = 0.0,
        step_g: FloatArray | float | None = 0.0,
    ) -> None:
        self._std = windows.std_a
        self._full = windows.full & true_on_all_axes(np.isfinite(windows.std_a))
        self._step = step_a + np.zeros(3)
        if windows.std_g is not None:
            self._std = np.hstack([windows.std_a, windows.std_g])
            self._step = np.append(self._step, (0.0 if step_g is None else step_g) + np.zeros(3))
        # a product of all axes needs no common unit of the sensors
        noise = np.log(np.maximum(self._std, np.maximum(rounding_noise(self._step), 1e-300)))
        calm, turning = noise[:, :3].sum(axis=1), noise[:, 3:].sum(axis=1)
        self._unrest = calm + np.where(np.isnan(turning), _WITHOUT_GYROSCOPE, turning)
        self._unrest[~self._full] = np.inf
        self._known: dict[int, tuple[int, int]] = {}

    def within(self, first: int, past: int, shortest: int) -> list[tuple[int, int]]:
        """The rests in a run of still windows, each as its first window and past its last.

        What a rest leaves of the run may be another rest, with more noise.

        Args:
            first: first window of the run.
            past: past its last window.
            shortest: fewer windows are no rest.
        """
        found, left = [], [(first, past)]
        while left:
            first, past = left.pop()
            if past - first < shortest:
                continue
            begin, end = self.around(first, past)
            found.append((begin, end))
            if begin < past and first < end:
                left += [(first, begin), (end, past)]
        return found

    def around(self, first: int, past: int) -> tuple[int, int]:
        """The rest around the calmest of some windows: its first window and past its last."""
        calmest, seen = first + int(self._unrest[first:past].argmin()), set[int]()
        while True:
            begin, end = self._rest(calmest)
            seen.add(calmest)
            calmest = begin + int(self._unrest[begin:end].argmin())
            if calmest in seen:
                return begin, end

    def _rest(self, calmest: int) -> tuple[int, int]:
        """All windows around this one within the limit that they make themselves."""
        if calmest not in self._known:
            limit = np.maximum(REST_FACTOR * self._std[calmest], self._step)
            while True:
                begin, end = self._under(limit, calmest)
                usual = REST_FACTOR * median_of_rows(self._std[begin:end])
                wider = np.fmax(limit, usual)  # NaN where the gyroscope is missing
                if np.array_equal(wider, limit, equal_nan=True):
                    break
                limit = wider
            self._known[calmest] = begin, end
        return self._known[calmest]

    def _under(self, limit: FloatArray, window: int) -> tuple[int, int]:
        """The run of windows under a limit around one of them."""
        reach, count = _REACH, len(self._full)
        while True:
            begin, end = max(window - reach, 0), min(window + reach, count)
            std = self._std[begin:end]
            still = self._full[begin:end] & true_on_all_axes(~(std > limit))
            moving = np.flatnonzero(~still)
            place = int(moving.searchsorted(window - begin))
            opened, closed = place > 0 or begin == 0, place < len(moving) or end == count
            if opened and closed:
                first = begin + int(moving[place - 1]) + 1 if place else begin
                past = begin + int(moving[place]) if place < len(moving) else end
                return first, past
            reach *= 4


def still_runs(still: BoolArray) -> list[tuple[int, int]]:
    """Runs of still windows, each as its first and past its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    return [(int(first), int(past)) for first, past in edges.reshape(-1, 2)]


def blocks_of_rests(rests: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """The blocks of rests in order, guards removed; none is in two rests.

    The block after a rest ended it, so the next one begins after that block.

    Args:
        rests: first and past the last window of each.
    """
    runs = []
    earliest = 0
    for first, past in rests:
        start = max(first - WINDOW_BLOCKS + 1, earliest) + GUARD_BLOCKS
        stop = past - GUARD_BLOCKS
        earliest = max(past + 1, earliest)
        if stop > start:
            runs.append((start, stop))
    return runs


class HoldBuilder:
    """Collects the blocks of the current rest in a stream, and those since the rest before it."""

    def __init__(self) -> None:
        self._blocks: list[Blocks] = []
        self._windows: list[Windows] = []
        self._run: tuple[int, int] | None = None

    @property
    def seconds(self) -> float:
        """Duration of the run of still windows if it ended now, without guards, s."""
        if self._run is None or len(self._blocks) - self._run[0] <= 2 * GUARD_BLOCKS:
            return 0.0
        start = self._blocks[self._run[0] + GUARD_BLOCKS].start[0]
        return float(self._blocks[-1 - GUARD_BLOCKS].end[0] - start)

    def add(self, block: Blocks, window: Windows, still: bool) -> None:
        """Add one block, the window that ends with it, and whether that is still.

        The first block after a run ended it, so the next run begins after that block.
        """
        self._blocks.append(block)
        self._windows.append(window)
        if still and self._run is None:
            last = len(self._blocks) - 1
            self._run = max(last - WINDOW_BLOCKS + 1, 0), last
        elif not still and self._run is not None:
            self.drop()
        elif not still:
            del self._blocks[:-HISTORY_BLOCKS], self._windows[:-HISTORY_BLOCKS]

    def hold(
        self,
        gravity: float,
        step_a: FloatArray | float = 0.0,
        step_g: FloatArray | float | None = 0.0,
    ) -> Hold | None:
        """The hold in the rest so far; None if it drifts or nothing remains.

        Args:
            gravity: reading of one gravity.
            step_a: resolution of the accelerometer, 0 if not known.
            step_g: resolution of the gyroscope.
        """
        if self._run is None:
            return None
        rests = Rests(join_windows(self._windows), step_a, step_g)
        runs = blocks_of_rests([rests.around(self._run[1], len(self._blocks))])
        if not runs:
            return None
        blocks = join_blocks(self._blocks[slice(*runs[0])])
        return hold_at_rest(blocks, gravity, step_a, step_g)

    def drop(self) -> None:
        """Drop the current run and the blocks before it."""
        self._blocks, self._windows, self._run = [], [], None
