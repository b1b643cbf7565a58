"""Holds and rotations, summarised so that their samples are not needed again."""

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
    """One period of rest.

    Attributes:
        start: time of the first sample, s.
        end: time just after the last sample, s.
        accelerometer: mean reading, shape (3,), m/s² or counts.
        accelerometer_covariance: covariance of that mean, shape (3, 3), from block means.
        gyroscope: mean reading, shape (3,), rad/s or counts; None without a gyroscope.
        gyroscope_covariance: covariance of that mean.
        samples: number of accelerometer samples averaged.
        temperature: mean temperature, °C, or None.
        pose: the named pose for which it was measured, or None.
        hand_held: recorded on the operator's command although the device was not still.
        accelerometer_scatter: variance of each axis of the accelerometer's mean if its samples were
            independent, shape (3,), or None; it has one degree of freedom per sample.
        batch_freedom: degrees of freedom per axis of the covariances.
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
    accelerometer_scatter: FloatArray | None = None
    batch_freedom: int = COVARIANCE_BATCHES - 1

    def readings(self, series: Series) -> Series:
        """The samples of any sensor during this hold.

        ``end`` is the last sample's time plus one interval, a sum that may round past the next
        sample: a sample belongs to the hold up to half an interval before the end.
        """
        half = 0.5 * (self.end - self.start) / self.samples
        return series.between(self.start, self.end - half)


@dataclass(frozen=True, eq=False)
class Rotation:
    """The motion between two holds.

    Attributes:
        before: the hold before the motion.
        after: the hold after the motion.
        time: gyroscope sample times from inside ``before`` to inside ``after``, s, shape (n,).
        rate: gyroscope readings at these times, shape (n, 3), rad/s or counts.
        axis: the body axis of the rotation (``x``, ``y``, ``z``), or None for any other axis.
        accelerometer: accelerometer readings at these times, shape (n, 3), or None if not kept;
            with them the fit can start without the gyroscope's unit.
        problem: the reason why it cannot be used (a gap, clipping), or None.
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
    """All measurements of the procedure: the input of the fit.

    The fit uses all holds and rotations; ``up_down``, ``poses`` and ``turns`` record which of them
    belong to which step of the procedure.

    Attributes:
        holds: all holds in time order.
        rotations: all motions between neighbouring holds, accepted and rejected.
        up_down: indices of the holds that belong to the up/down step.
        poses: indices of the holds that belong to the 18 poses.
        turns: indices into ``rotations`` of the rotations of the rotation step.
        validation: holds withheld from the fit.
        magnetometer: all samples of the magnetometer in time order, or None without one.
        field_spans: time spans (from, to) of the field step, s, without withdrawn or disturbed
            parts.
        field_left_out: disturbed spans: from, to, s, and the reason.
        steps: resolution of each accelerometer and gyroscope axis over all samples, shape (3,)
            each, 0 if none was seen; None if it was not determined.
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
    """A hold from consecutive blocks at rest, guards already removed."""
    mean, covariance, freedom = _average(blocks.mean)
    known = blocks.temperature[~np.isnan(blocks.temperature)]
    samples = len(blocks) * blocks.size
    squares = (blocks.variance[:, :3] + (blocks.mean[:, :3] - mean[:3]) ** 2).mean(axis=0)
    return Hold(
        start=float(blocks.start[0]),
        end=float(blocks.end[-1]),
        accelerometer=mean[:3],
        accelerometer_covariance=covariance[:3, :3],
        gyroscope=mean[3:] if blocks.turning else None,
        gyroscope_covariance=covariance[3:, 3:] if blocks.turning else None,
        samples=samples,
        temperature=float(known.mean()) if len(known) else None,
        accelerometer_scatter=squares / (samples - 1),
        batch_freedom=freedom,
    )


def trim_ends(
    blocks: Blocks, step_a: FloatArray | float = 0.0, step_g: FloatArray | float | None = 0.0
) -> Blocks:
    """Trim the ends at which the device was still settling or already moving.

    A rotation that begins slowly stays within any limit of stillness for a while, but deviates
    clearly from the middle of the hold. The middle half gives centre and spread of each axis;
    blocks are removed from each end while they, or their inner neighbours, deviate too far. A
    reading that flickers between two neighbouring values is at rest.

    Args:
        blocks: consecutive blocks.
        step_a: resolution of the accelerometer, if known.
        step_g: resolution of the gyroscope, if known.
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
    """Number of blocks to remove at the beginning: while one or its successor deviates."""
    taken = 0
    while taken < most and (off[taken] or off[taken + 1]):
        taken += 1
    return taken


def _average(means: FloatArray) -> tuple[FloatArray, FloatArray, int]:
    """Mean of block means, its covariance from about five batch means, degrees of freedom of that.

    Unlike the scatter of single samples, batch means include correlated noise with its true weight.
    """
    origin = means[0]
    centred = means - origin
    average = np.add.reduce(centred, axis=0) / len(means)
    length = max(len(means) // COVARIANCE_BATCHES, 1)
    count = len(means) // length
    if count < 2:
        return origin + average, np.full((len(average), len(average)), np.nan), 0
    pieces = centred[: count * length].reshape(count, length, -1)
    batches = np.add.reduce(pieces, axis=1) / length
    scatter = batches - np.add.reduce(batches, axis=0) / count
    return origin + average, scatter.T @ scatter / (count * (count - 1)), count - 1


class HoldBuilder:
    """Collects the blocks of the current rest in a stream."""

    def __init__(self) -> None:
        self._recent: deque[Blocks] = deque(maxlen=WINDOW_BLOCKS)
        self._run: list[Blocks] = []

    @property
    def seconds(self) -> float:
        """Duration of the hold if it ended now, without guards, s."""
        kept = len(self._run) - 2 * GUARD_BLOCKS
        if kept <= 0:
            return 0.0
        return float(self._run[-1 - GUARD_BLOCKS].end[0] - self._run[GUARD_BLOCKS].start[0])

    def add(self, block: Blocks, still: bool) -> None:
        """Add one block, and whether the window ending with it is still.

        The first block after a run ended it, so the next run begins after that block.
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
        """The hold so far without guards and unsettled ends; None if nothing remains."""
        kept = self._run[GUARD_BLOCKS : len(self._run) - GUARD_BLOCKS]
        return hold_from(trim_ends(join_blocks(kept))) if kept else None

    def drop(self) -> None:
        """Drop the current run and the blocks before it."""
        self._run = []
        self._recent.clear()


def runs_of_still_blocks(still: BoolArray) -> list[tuple[int, int]]:
    """Runs of blocks in which every window is still, as (first, past the last), without guards."""
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
