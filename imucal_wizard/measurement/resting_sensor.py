"""One sensor at rest for hours: gaps, motion, and the Allan variance of what is left.

The rule of ``stillness`` distinguishes a hand from a table. Averages over minutes also resolve a
table that is bumped or tilts by a tenth of a degree. A block of a second is therefore disturbed if
its variance on any axis is far above that of quiet blocks, if its mean differs from that of the
block before by far more than usual, or if it sways as in a hand. Disturbed blocks and their
neighbours are left out, and no difference is taken across them.
"""

from itertools import pairwise

import numpy as np

from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import MAX_SAMPLE_INTERVALS, BoolArray, FloatArray, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import SIGMA_PER_MEDIAN, median_of_rows
from imucal_wizard.measurement.allan_variance import AllanSums
from imucal_wizard.measurement.rounding import resolution_of, rounding_noise

JUDGED_SECONDS = 1.0
MIN_JUDGED_SAMPLES = 10
"""Fewest samples of a block that show its variance."""
JUDGED_BLOCKS = 30
"""Blocks that are judged together, so that the pieces of the stream do not matter."""
REMEMBERED_BLOCKS = 300
"""Blocks that define the usual scatter: that of a fan becomes usual after minutes."""
QUIET_SHARE = 0.2
"""Share of the blocks that are quiet even if most of a recording is not."""
QUIETEST_SHARE = 0.05
"""Share of the quietest blocks: from here to ``QUIET_SHARE`` the variance rises by its scatter
alone."""
SIGMA_BETWEEN_SHARES = 0.803
"""Standard deviations of a normal distribution between these two quantiles ..."""
SIGMA_TO_MEDIAN = 0.842
"""... and from the upper one to the median."""
MIN_DISTURBED_VARIANCE = 3.0
"""Variance of a disturbed block over the median; warming changes noise by far less."""
DISTURBED_SIGMA_OF_VARIANCE = 5.0
"""Standard deviations of the logarithm of a variance that chance does not reach: its distribution
has a longer tail below, where they are measured, than above."""
DISTURBED_SIGMA_OF_STEP = 8.0
"""Standard deviations that the difference of two means never reaches by chance within hours."""
SWAY_PARTS = 10
"""Parts of a block; their means show the sway of a hand and little of a sensor's noise."""
MAX_FILLED_SECONDS = 1.0
"""Longest gap that is filled by a straight line; a longer one, unless it is usual between samples,
interrupts the recording."""
MERGED_SECONDS = 10.0
"""Disturbances that follow one another within this time count as one."""


@dataclass(frozen=True)
class MovedPart:
    """A part of the recording in which the device did not rest.

    Attributes:
        start: s.
        end: s.
        axis: on which it was largest.
        ratio: of the scatter, or of the change of the mean, to the usual one.
    """

    start: float
    end: float
    axis: str
    ratio: float


class RestingSensor:
    """Collects one sensor's Allan variance from the parts in which it rests.

    Args:
        rate: samples per second, about.
        largest_sway: of slow means at rest, reading units.

    Attributes:
        sums: the Allan variance.
        disturbances: what was left out, in order of time.
        filled: samples that were missing and are filled in.
        gaps: longer gaps.
        judged: samples in all blocks so far.
        disturbed: samples in those blocks that are disturbed themselves.
        longest_filled: s; a longer gap interrupts the recording.
    """

    def __init__(self, rate: float, largest_sway: float = np.inf) -> None:
        self.sums = AllanSums(len(AXES))
        self.disturbances: list[MovedPart] = []
        self.filled = self.gaps = self.judged = self.disturbed = 0
        self._nominal = 1.0 / rate
        self.longest_filled = max(MAX_FILLED_SECONDS, MAX_SAMPLE_INTERVALS * self._nominal)
        self._size = max(round(JUDGED_SECONDS * rate), MIN_JUDGED_SAMPLES)
        self._largest_sway = largest_sway
        self._resolution: FloatArray | None = None
        self._last = np.zeros(0), np.zeros((0, len(AXES)))
        self._waiting = self._last
        self._variances = np.zeros((0, len(AXES)))
        self._steps = np.zeros((0, len(AXES)))
        self._span, self._intervals = 0.0, 0
        self._begin()

    def _begin(self) -> None:
        """Nothing before belongs to what follows."""
        self._mean = np.full(len(AXES), np.nan)
        self._held: tuple[FloatArray, FloatArray, BoolArray] | None = None
        self._disturbed = False

    @property
    def period(self) -> float:
        """Seconds between samples."""
        return self._span / self._intervals if self._intervals else self._nominal

    def feed(self, series: Series) -> None:
        """Add the samples that follow."""
        old, last = self._last  # the gap to the first new sample counts as any other
        time = np.concatenate([old, series.time])
        time, values = self._filled_in(time, np.concatenate([last, series.values]))
        begin = len(old)
        self._last = time[-1:], values[-1:]
        for place in (np.flatnonzero(np.diff(time) > self.longest_filled) + 1).tolist():
            self._judge_all(time[begin:place], values[begin:place])
            self._interrupt()
            self.gaps += 1
            begin = place
        self._judge_all(time[begin:], values[begin:])

    def finish(self) -> None:
        """The recording has ended."""
        self._interrupt()

    def _filled_in(self, time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The samples with a straight line across short gaps."""
        steps = np.diff(time)
        short = (steps > MAX_SAMPLE_INTERVALS * self._nominal) & (steps <= self.longest_filled)
        if not short.any():
            return time, values
        missing = np.where(short, np.round(steps / self._nominal) - 1, 0).astype(np.int64)
        self.filled += int(missing.sum())
        place = np.arange(len(time)) + np.concatenate([[0], np.cumsum(missing)])
        every = np.arange(place[-1] + 1)
        columns = [np.interp(every, place, column) for column in (time, *values.T)]
        return columns[0], np.column_stack(columns[1:])

    def _interrupt(self) -> None:
        """The samples that follow are not joined to those before."""
        time, values = self._waiting
        blocks = len(time) // self._size
        if blocks:
            self._judge(*self._blocks(time, values, blocks))
        if self._held is not None:
            held_time, held, disturbed = self._held
            self._count_run(held_time, held, bad=bool(disturbed[0]) or self._disturbed)
        self._waiting = time[:0], values[:0]
        self.sums.interrupt()
        self._begin()

    def _judge_all(self, time: FloatArray, values: FloatArray) -> None:
        """Add samples, and judge as many blocks as are judged together."""
        size = JUDGED_BLOCKS * self._size
        time = np.concatenate([self._waiting[0], time])
        values = np.concatenate([self._waiting[1], values])
        while len(time) >= size:
            self._judge(*self._blocks(time, values, JUDGED_BLOCKS))
            time, values = time[size:], values[size:]
        self._waiting = time, values

    def _blocks(
        self, time: FloatArray, values: FloatArray, count: int
    ) -> tuple[FloatArray, FloatArray]:
        samples = count * self._size
        return (
            time[:samples].reshape(count, self._size),
            values[:samples].reshape(count, self._size, len(AXES)),
        )

    def _judge(self, time: FloatArray, values: FloatArray) -> None:
        """Find the disturbed blocks, and pass on the others but for the last one."""
        means, variances = values.mean(axis=1), values.var(axis=1, ddof=1)
        steps = np.abs(np.diff(means, axis=0, prepend=self._mean[None]))
        self._mean = means[-1]
        self.judged += values.shape[0] * values.shape[1]
        if self._resolution is None:
            self._resolution = resolution_of(values.reshape(-1, len(AXES)))
        # what is usual; below its resolution a sensor shows a part of its noise, at random
        rounding = rounding_noise(self._resolution) ** 2
        self._variances = np.concatenate([self._variances, variances])[-REMEMBERED_BLOCKS:]
        known = steps[np.isfinite(steps[:, 0])]
        self._steps = np.concatenate([self._steps, known])[-REMEMBERED_BLOCKS:]
        limit, middle = self._largest_variance(rounding)
        usual = np.sqrt(2.0 * middle / self._size)
        if len(self._steps):
            usual = np.maximum(usual, SIGMA_PER_MEDIAN * median_of_rows(self._steps))
        # an axis that never changes shows nothing
        varies = middle > 0.0
        scatter = np.where(varies, variances / np.where(varies, middle, 1.0), 0.0)
        step = np.where(varies, np.nan_to_num(steps) / np.where(varies, usual, 1.0), 0.0)
        shaken = varies & (variances > limit)
        swayed = np.maximum(np.nan_to_num(steps), self._sway(values)) > self._largest_sway
        moved = (step > DISTURBED_SIGMA_OF_STEP) | swayed
        disturbed = (shaken | moved).any(axis=1)
        self.disturbed += int(disturbed.sum()) * self._size
        ratios = np.where(shaken, np.sqrt(scatter), step)
        for row in np.flatnonzero(disturbed):
            self._note(float(time[row, 0]), float(time[row, -1]), ratios[row])
        self._count(time, values, np.asarray(disturbed))

    def _sway(self, values: FloatArray) -> FloatArray:
        """Standard deviation of the means of tenths of each block, shape (k, 3)."""
        parts = min(SWAY_PARTS, self._size // 2)
        length = self._size // parts
        tenths = values[:, : parts * length].reshape(len(values), parts, length, len(AXES))
        return np.asarray(tenths.mean(axis=2).std(axis=1))

    def _largest_variance(self, rounding: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Largest variance of a block that rests, and the median by its quiet blocks, shape (3,).

        Samples that a filter has made alike say less about the variance than as many independent
        ones, so that the scatter from block to block is measured.
        """
        ordered = np.sort(np.maximum(self._variances, rounding), axis=0)
        quietest, quiet = (ordered[int(q * len(ordered))] for q in (QUIETEST_SHARE, QUIET_SHARE))
        there = quietest > 0.0
        ratio = np.where(there, quiet / np.where(there, quietest, 1.0), 1.0)
        chance = np.sqrt(2.0 / (self._size - 1))
        sigma = np.maximum(np.log(ratio) / SIGMA_BETWEEN_SHARES, chance)
        middle = quiet * np.exp(SIGMA_TO_MEDIAN * sigma)
        factor = np.exp(DISTURBED_SIGMA_OF_VARIANCE * sigma)
        return middle * np.maximum(factor, MIN_DISTURBED_VARIANCE), middle

    def _note(self, start: float, end: float, ratios: FloatArray) -> None:
        axis, ratio = AXES[int(ratios.argmax())], float(ratios.max())
        last = self.disturbances[-1] if self.disturbances else None
        if last is not None and start - last.end < MERGED_SECONDS:
            start = last.start
            if last.ratio > ratio:
                axis, ratio = last.axis, last.ratio
            self.disturbances.pop()
        self.disturbances.append(MovedPart(start, end, axis, ratio))

    def _count(self, time: FloatArray, values: FloatArray, disturbed: BoolArray) -> None:
        """Count the blocks with calm neighbours; the last one waits for its neighbour."""
        if self._held is not None:
            time = np.concatenate([self._held[0], time])
            values = np.concatenate([self._held[1], values])
            disturbed = np.concatenate([self._held[2], disturbed])
        padded = np.concatenate([[self._disturbed], disturbed, [False]])
        bad = (padded[:-2] | padded[1:-1] | padded[2:])[:-1]
        edges = [0, *(np.flatnonzero(np.diff(bad)) + 1).tolist(), len(bad)]
        for first, last in pairwise(edges):
            if last > first:
                self._count_run(time[first:last], values[first:last], bad=bool(bad[first]))
        self._held = time[-1:], values[-1:], disturbed[-1:]
        self._disturbed = bool(padded[-3])

    def _count_run(self, time: FloatArray, values: FloatArray, *, bad: bool) -> None:
        if bad:
            self.sums.interrupt()
            return
        self.sums.feed(values.reshape(-1, len(AXES)))
        self._span += float(time[-1, -1] - time[0, 0])
        self._intervals += time.size - 1
