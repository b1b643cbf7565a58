"""Holds and rotations: what was measured, summed up so that the samples are not needed again."""

from collections import deque

import numpy as np

from imucal_wizard.core.limits.stillness import (
    COVARIANCE_BATCHES,
    GUARD_BLOCKS,
    MAX_SETTLING_SIGMA,
    MAX_TRIMMED_BLOCKS,
    MIN_BLOCKS_TO_TRIM,
    WINDOW_BLOCKS,
)
from imucal_wizard.core.readings import BoolArray, FloatArray, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import SIGMA_PER_MEDIAN, median_of_rows
from imucal_wizard.measurement.blocks import Blocks, join_blocks
from imucal_wizard.measurement.rounding import rounding_variance


@dataclass(frozen=True, eq=False)
class Hold:
    """One still period.

    Attributes:
        start: time of the first sample kept, s.
        end: time just after the last sample kept, s.
        accelerometer: mean reading, shape (3,), m/s² or counts.
        accelerometer_covariance: covariance of that mean, shape (3, 3), from block means.
        gyroscope: mean reading, shape (3,), rad/s or counts; None without a gyroscope.
        gyroscope_covariance: covariance of that mean.
        samples: how many accelerometer samples were averaged.
        temperature: mean temperature, °C, or None.
        pose: the named pose it was taken as, or None.
        hand_held: taken at the operator's word although the device was not still.
    """

    start: float
    end: float
    accelerometer: FloatArray
    accelerometer_covariance: FloatArray
    gyroscope: FloatArray | None
    gyroscope_covariance: FloatArray | None
    samples: int
    temperature: float | None = None
    pose: str | None = None
    hand_held: bool = False


@dataclass(frozen=True, eq=False)
class Rotation:
    """The motion between two holds.

    Attributes:
        before: the hold it starts from.
        after: the hold it ends in.
        time: gyroscope sample times from inside ``before`` to inside ``after``, s, shape (n,).
        rate: gyroscope readings at these times, shape (n, 3), rad/s or counts.
        axis: the body axis it was about (``x``, ``y``, ``z``), or None when about none of them.
        accelerometer: accelerometer readings at these times, shape (n, 3), or None when not kept;
            they let the fit begin without knowing the gyroscope's unit.
        problem: why it cannot be used (a gap, clipping), or None.
    """

    before: Hold
    after: Hold
    time: FloatArray
    rate: FloatArray
    axis: str | None = None
    problem: str | None = None
    accelerometer: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Collected:
    """What the procedure has measured: the input of the fit.

    The fit takes all holds and rotations alike; ``up_down``, ``poses`` and ``turns`` record which
    of them counted for which step of the procedure.

    Attributes:
        holds: all holds kept, in time order.
        rotations: all motions between neighbouring holds, good and rejected.
        up_down: indices of the holds that belong to the up/down step.
        poses: indices of the holds that belong to the 18 poses.
        turns: indices into ``rotations`` of the rotations of the rotation step.
        validation: holds that the fit must not see.
        magnetometer: every sample of it in time order, or None without one.
        field_spans: sample times (from, to) of the field step, s, without what was taken back or
            disturbed.
        field_left_out: what was disturbed in it: from, to, s, and the reason.
        steps: smallest step of each accelerometer and of each gyroscope axis in all samples, shape
            (3,) each, 0 where none was seen; None when nobody has looked.
    """

    holds: tuple[Hold, ...]
    rotations: tuple[Rotation, ...]
    up_down: tuple[int, ...] = ()
    poses: tuple[int, ...] = ()
    turns: tuple[int, ...] = ()
    validation: tuple[Hold, ...] = ()
    magnetometer: Series | None = None
    field_spans: tuple[tuple[float, float], ...] = ()
    field_left_out: tuple[tuple[float, float, str], ...] = ()
    steps: tuple[FloatArray, FloatArray] | None = None


def hold_from(blocks: Blocks) -> Hold:
    """A hold from consecutive blocks that are all at rest (guards already taken off)."""
    mean, covariance = _average(blocks.mean)
    known = blocks.temperature[~np.isnan(blocks.temperature)]
    return Hold(
        start=float(blocks.start[0]),
        end=float(blocks.end[-1]),
        accelerometer=mean[:3],
        accelerometer_covariance=covariance[:3, :3],
        gyroscope=mean[3:] if blocks.turning else None,
        gyroscope_covariance=covariance[3:, 3:] if blocks.turning else None,
        samples=len(blocks) * blocks.size,
        temperature=float(known.mean()) if len(known) else None,
    )


def trim_ends(
    blocks: Blocks, step_a: FloatArray | float = 0.0, step_g: FloatArray | float | None = 0.0
) -> Blocks:
    """The same blocks without the ends at which the device came to rest or already left it.

    A rotation that begins slowly stays within any limit of stillness for a while, but it shows at
    once against the middle of the hold. The middle half gives centre and spread of each axis; from
    either end blocks are taken off as long as they, or their neighbours inwards, lie too far out.
    A reading that flickers between two neighbouring values is at rest.

    Args:
        blocks: consecutive blocks.
        step_a: smallest step of the accelerometer's readings, where it is known.
        step_g: the same of the gyroscope.
    """
    count = len(blocks)
    if count < MIN_BLOCKS_TO_TRIM:
        return blocks
    step = np.zeros(blocks.mean.shape[1])
    step[:3] = step_a
    if blocks.turning:
        step[3:] = 0.0 if step_g is None else step_g
    middle = slice(count // 4, count - count // 4)
    centre = median_of_rows(blocks.mean[middle])
    away = np.abs(blocks.mean - centre)
    scatter = SIGMA_PER_MEDIAN * median_of_rows(away[middle])
    variance = median_of_rows(blocks.variance[middle])
    rounded = rounding_variance(variance, step)
    spread = np.maximum(np.maximum(scatter, np.sqrt(variance / blocks.size)), np.sqrt(rounded))
    off = np.asarray((away > MAX_SETTLING_SIGMA * spread).any(axis=1))
    most = min(MAX_TRIMMED_BLOCKS, count // 4)
    first, past = _quiet_from(off, most), count - _quiet_from(off[::-1], most)
    return blocks.select(slice(first, past))


def _quiet_from(off: BoolArray, most: int) -> int:
    """How many blocks to take off the beginning: while one or the next one is off."""
    taken = 0
    while taken < most and (off[taken] or off[taken + 1]):
        taken += 1
    return taken


def _average(means: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean of block means, and its covariance from the scatter of about five longer batches.

    Batch means, unlike the scatter of single samples, count noise that is correlated from sample to
    sample at its true weight.
    """
    origin = means[0]
    centred = means - origin
    average = np.add.reduce(centred, axis=0) / len(means)
    length = max(len(means) // COVARIANCE_BATCHES, 1)
    count = len(means) // length
    if count < 2:
        return origin + average, np.full((len(average), len(average)), np.nan)
    pieces = centred[: count * length].reshape(count, length, -1)
    batches = np.add.reduce(pieces, axis=1) / length
    scatter = batches - np.add.reduce(batches, axis=0) / count
    return origin + average, scatter.T @ scatter / (count * (count - 1))


class HoldBuilder:
    """Gathers the blocks of the present still run of a stream."""

    def __init__(self) -> None:
        self._recent: deque[Blocks] = deque(maxlen=WINDOW_BLOCKS)
        self._run: list[Blocks] = []

    @property
    def seconds(self) -> float:
        """How long the hold would be if it ended now, guards off."""
        kept = len(self._run) - 2 * GUARD_BLOCKS
        if kept <= 0:
            return 0.0
        return float(self._run[-1 - GUARD_BLOCKS].end[0] - self._run[GUARD_BLOCKS].start[0])

    def add(self, block: Blocks, still: bool) -> None:
        """Take one block (``len(block) == 1``) and whether the window ending with it is still.

        The first block after a run broke it, so the next run begins after that block.
        """
        self._recent.append(block)
        if not still:
            if self._run:
                self.drop()
        elif self._run:
            self._run.append(block)
        else:
            self._run = list(self._recent)

    def hold(self) -> Hold | None:
        """The hold so far without its guards and unsettled ends; None when nothing is left."""
        kept = self._run[GUARD_BLOCKS : len(self._run) - GUARD_BLOCKS]
        return hold_from(trim_ends(join_blocks(kept))) if kept else None

    def drop(self) -> None:
        """Forget the present run and the blocks before it."""
        self._run = []
        self._recent.clear()


def runs_of_still_blocks(still: BoolArray) -> list[tuple[int, int]]:
    """Runs of blocks (first, past the last), guards off, in which every window is still."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    runs = []
    earliest = 0
    for first, past in edges.reshape(-1, 2):
        start = max(int(first) - WINDOW_BLOCKS + 1, earliest) + GUARD_BLOCKS
        stop = int(past) - GUARD_BLOCKS
        earliest = int(past) + 1
        if stop > start:
            runs.append((start, stop))
    return runs
