"""Slow noise within rests: what changes there is noise of the sensor, apart from any model.

One rest of a minute shows it by itself (``long_rest``). Many holds of a third of a minute show it
together (``flicker_in_holds``): the Allan variance within them, at averages of τ seconds, is

    σ²(τ) = w/τ + B² + K² τ/3 + R² τ²/2

for white noise, flicker noise, a random walk and a drift (IEEE 952, annex C). The differences of
halves, quarters, eighths … of each hold are independent under white noise and nearly so under
flicker noise, so that each Allan variance is a χ² over its degrees of freedom. What is measured
over some seconds is extrapolated to a session: by flicker noise with the logarithm of the time, by
a random walk with the time itself. A walk, which hardly differs from a drift, is therefore never
extrapolated: where the holds show one, only the flicker noise beside it counts.
"""

import math
from collections.abc import Sequence
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np

from imucal_wizard.core.limits.stillness import WINDOW_BLOCKS
from imucal_wizard.core.poses import angle_between
from imucal_wizard.core.readings import (
    MAX_SAMPLE_INTERVALS,
    FloatArray,
    IntArray,
    Series,
    across_restarts,
    distinct,
)
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import complement
from imucal_wizard.estimate.distributions import EXACT_FREEDOM, WITHIN_NINETY, exceeded
from imucal_wizard.estimate.noise import SURE
from imucal_wizard.estimate.slow_kernels import Kernel
from imucal_wizard.measurement.blocks import block_size
from imucal_wizard.measurement.holds import Hold

MIN_LONG_REST = 60.0
"""Seconds from which on one rest shows slow noise: twenty averages as long as a hold."""
MIN_PART_SHARE = 1.0 / 3.0
"""Of that time: the shortest part between two gaps that counts."""
MIN_HELD_SHARE = 0.9
"""Of that time: what the parts have to last together."""
MAX_MOVED = math.radians(1.0)
"""By which the direction of gravity differs across a gap in a rest: poses differ by more."""
PIECE = 3.0
"""Seconds of each of these averages, at the usual rates."""
MOMENTS = 6
"""Parts of each of them, whose scatter is white noise."""
SAMPLES_OF_MOMENT = 2
"""Intervals of such a part: at fewer than four samples per second the averages are longer, and the
rest that shows slow noise is so as well."""
MOST_AVERAGES = 300
"""Most averages of a rest; in a longer one neighbours are joined. The time that they take grows
with the cube of their number."""
FLICKER_P = 0.05
"""Probability by white noise alone of Allan variances as large at long averages, above which there
is no flicker noise; and by the noise found of those that differ as much from it, below which the
shortest averages are left out."""
DROPPED = 1.5
"""Length of averages up to which they are then left out, in units of the shortest: an octave."""
LEAST_SHARE = 0.2
"""Of the shortest averages in the longest, above which nothing more is left out: three octaves."""
RISING_P = 0.01
"""Probability by flicker noise of Allan variances that rise as far, below which a random walk, or a
drift, is seen beside it."""
RISING_OCTAVES = 3
"""Octaves of averages, above which a rise beside white noise and flicker noise can be seen."""
LEAST_EXPECTED = 1e-3
"""Of an Allan variance, as a share of what the usual white noise makes."""
SCORING_ROUNDS = 60
SCORED = 1e-6
"""Change of the variances, relative, that no longer matters."""


@dataclass(frozen=True, eq=False)
class RestPieces:
    """Rests in one direction each, cut into pieces.

    Attributes:
        spans: beginning and end of each piece, s, shape (m, 2).
        means: of the pieces on each axis, or of their magnitudes, shape (m, a).
        white: variance of each by white noise, shape (m, a).
        levels: factors by which all of that variance may be wrong, equally likely, shape (l,).
        lever: by how much each moves with the bias, shape (m,).
        rest: number of the rest of each, in order, shape (m,).
    """

    spans: FloatArray
    means: FloatArray
    white: FloatArray
    levels: FloatArray
    lever: FloatArray
    rest: IntArray

    def evidence(self, kernel: Kernel | None, squares: FloatArray, of_strength: bool) -> FloatArray:
        """Logarithm of the likelihood of slow errors of each of these sizes, shape (k,).

        Args:
            kernel: covariance of averages by slow errors of size one; None for errors that are the
                same throughout a rest.
            squares: squares of the sizes of each axis, shape (a, k); (1, k) if they are the same
                for all.
            of_strength: whether they are errors of the field's strength and not of the bias.
        """
        square, values = self._turned(kernel)
        own, lever = self._own
        slow = values if of_strength else lever * values
        beyond = squares.T[:, None] * slow[:, None]
        of_each = []
        for level in self.levels:
            variance = level * own + beyond
            log = -0.5 * (np.log(variance) + square / variance).sum(axis=1)
            of_each.append(log if len(squares) > 1 else log.sum(axis=1, keepdims=True))
        likely = np.logaddexp.reduce(of_each, axis=0) - math.log(len(self.levels))
        return np.asarray(likely.sum(axis=1))

    @cached_property
    def _edges(self) -> list[tuple[int, int]]:
        """First and past the last piece of each rest."""
        first = np.flatnonzero(np.diff(self.rest, prepend=self.rest[0] - 1)).tolist()
        return list(pairwise([*first, len(self)]))

    @cached_property
    def _own(self) -> tuple[FloatArray, FloatArray]:
        """Of each combination in a rest: variance by white noise, (c, a), mean square lever, (c,).

        Within a rest they are those of its pieces on average.
        """
        white = [self.white[first:last].mean(axis=0) for first, last in self._edges]
        lever = [np.mean(self.lever[first:last] ** 2) for first, last in self._edges]
        counts = [last - first - 1 for first, last in self._edges]
        return np.repeat(white, counts, axis=0), np.repeat(lever, counts)

    @cached_property
    def _known(self) -> dict[Kernel | None, tuple[FloatArray, FloatArray]]:
        return {}

    def _turned(self, kernel: Kernel | None) -> tuple[FloatArray, FloatArray]:
        """Independent combinations of the pieces in each rest that its mean does not move.

        Returns:
            Their squares, shape (c, a), and their variances by slow errors of size one, shape (c,).
        """
        if kernel not in self._known:
            squares, variances = [], []
            for first, last in self._edges:
                across, values = _across(last - first), np.zeros(last - first - 1)
                if kernel is not None:
                    inside = kernel(self.spans[first:last] - self.spans[first, 0])
                    values, vectors = np.linalg.eigh(across.T @ inside @ across)
                    across = across @ vectors
                squares.append((across.T @ self.means[first:last]) ** 2)
                variances.append(np.maximum(values, 0.0))
            self._known[kernel] = np.concatenate(squares), np.concatenate(variances)
        return self._known[kernel]

    def __len__(self) -> int:
        return len(self.rest)


@lru_cache
def _across(count: int) -> FloatArray:
    """Combinations of so many pieces that their mean does not move, shape (count, count − 1)."""
    return complement(np.ones((count, 1)))


def long_rest(series: Series, holds: Sequence[Hold], matrix: FloatArray) -> RestPieces | None:
    """The longest rest of a recording, if it is long enough to show slow noise.

    Where samples are missing in it, its parts count, each about its own mean.

    Args:
        series: readings of the sensor.
        holds: still periods, in order.
        matrix: SI per reading, shape (3, 3).
    """
    rate = series.rate
    piece = max(PIECE, MOMENTS * SAMPLES_OF_MOMENT / rate) if rate else math.inf
    shortest = MIN_LONG_REST / PIECE * piece
    each = [
        [
            part
            for one in rest
            for part in _without_gaps(series, one, piece / MOMENTS)
            if part[1] - part[0] >= MIN_PART_SHARE * shortest
        ]
        for rest in _rests_with_gaps(series, holds)
        if rest[-1].end - rest[0].start >= shortest
    ]
    if not each:
        return None
    parts = max(each, key=lambda own: sum(end - start for start, end in own))
    averages = sum(int((end - start) / piece) for start, end in parts)
    joined = max(math.ceil(averages / MOST_AVERAGES), 1)
    counts = [int((end - start) / piece) // joined for start, end in parts]
    cut = [
        _averages(series, *part, count, joined, matrix)
        for part, count in zip(parts, counts, strict=True)
    ]
    return _joined([one for one in cut if one is not None], joined, MIN_HELD_SHARE * shortest)


def _rests_with_gaps(series: Series, holds: Sequence[Hold]) -> list[list[Hold]]:
    """The holds, those in one list between which only samples are missing."""
    found = [[holds[0]]]
    edge = WINDOW_BLOCKS * block_size(series.rate) / series.rate if series.rate else 0.0
    for before, after in pairwise(holds):
        between = series.between(before.end - edge, after.start + edge).time
        gap = float(np.diff(between).max(initial=0.0))
        missing = gap * series.rate > MAX_SAMPLE_INTERVALS and gap <= PIECE
        at_rest = after.start - before.end <= gap + 2.0 * edge
        if (
            missing
            and at_rest
            and angle_between(before.accelerometer, after.accelerometer) <= MAX_MOVED
            and not across_restarts(np.array([gap])).any()
        ):
            found[-1].append(after)
        else:
            found.append([after])
    return found


def _without_gaps(series: Series, hold: Hold, longest: float) -> list[tuple[float, float]]:
    """Beginning and end of the parts of a hold in which no longer gap is."""
    time = series.between(hold.start, hold.end).time
    gaps = np.flatnonzero(np.diff(time) > longest)
    begun, ended = [hold.start, *time[gaps + 1].tolist()], [*time[gaps].tolist(), hold.end]
    return list(zip(begun, ended, strict=True))


@dataclass(frozen=True, eq=False)
class _Averages:
    """Averages over a part of a rest.

    Attributes:
        edges: beginning of each and the end, s, shape (k + 1,).
        means: about the mean of the part, SI, shape (k, 3).
        scatter: sum of the squares of its moments about their averages, shape (3,).
        freedom: degrees of freedom of that sum.
    """

    edges: FloatArray
    means: FloatArray
    scatter: FloatArray
    freedom: int


def _averages(
    series: Series, start: float, end: float, count: int, joined: int, matrix: FloatArray
) -> _Averages | None:
    """So many averages over a part of a rest; None if samples are missing in it.

    Args:
        series: readings of the sensor.
        start: beginning of the part, s.
        end: its end, s.
        count: of the averages.
        joined: shorter averages in each.
        matrix: SI per reading, shape (3, 3).
    """
    parts = count * joined * MOMENTS
    if parts < 2 * MOMENTS:
        return None
    inside = series.between(start, end)
    moments = np.floor((inside.time - start) / ((end - start) / parts)).astype(int)
    moments = np.clip(moments, 0, parts - 1)
    number = np.bincount(moments, minlength=parts)
    if number.min() < 1:
        return None
    centred = (inside.values - inside.values.mean(axis=0)) @ matrix.T
    means = np.array([np.bincount(moments, axis) / number for axis in centred.T])
    means = means.reshape(3, count * joined, MOMENTS)
    averages = means.mean(axis=2)
    return _Averages(
        edges=np.asarray(start + (end - start) / count * np.arange(count + 1)),
        means=averages.reshape(3, count, joined).mean(axis=2).T,
        scatter=((means - averages[:, :, None]) ** 2).sum(axis=(1, 2)),
        freedom=parts * (MOMENTS - 1),
    )


def _joined(parts: Sequence[_Averages], joined: int, least: float) -> RestPieces | None:
    """The parts of a rest; None if they are shorter than ``least`` seconds, or without noise."""
    if sum(float(one.edges[-1] - one.edges[0]) for one in parts) < least:
        return None
    scatter, freedom = sum(one.scatter for one in parts), sum(one.freedom for one in parts)
    white = np.asarray(scatter / (freedom * joined))
    if not (white > 0.0).all():
        return None
    counts = [len(one.means) for one in parts]
    return RestPieces(
        spans=np.concatenate([np.column_stack([one.edges[:-1], one.edges[1:]]) for one in parts]),
        means=np.concatenate([one.means for one in parts]),
        white=np.tile(white, (sum(counts), 1)),
        levels=np.ones(1),
        lever=np.ones(sum(counts)),
        rest=np.repeat(np.arange(len(parts)), counts),
    )


@dataclass(frozen=True)
class Flicker:
    """Flicker noise of an axis as holds show it.

    Attributes:
        variance: B², square of the bias instability, reading units²; 0 where the holds do not tell
            it from white noise.
        freedom: degrees of freedom of it.
        most: the largest that they do not exclude, reading units².
    """

    variance: float
    freedom: float
    most: float


@dataclass(frozen=True, eq=False)
class _AllanVariances:
    """Allan variances within holds, m of them.

    Attributes:
        white: what the noise of each hold makes of it if it is white, shape (m,).
        tau: length of its averages, s, shape (m,).
        count: degrees of freedom, shape (m,).
        variance: shape (m,).
    """

    white: FloatArray
    tau: FloatArray
    count: FloatArray
    variance: FloatArray

    def fitted(self, *shapes: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        """The likeliest sizes of white noise and of what has these shapes, by Fisher's scoring.

        Args:
            shapes: what each makes of the variances at size one, shape (m,).

        Returns:
            The sizes, their covariance, and −2 times the logarithm of the likelihood.
        """
        columns = np.column_stack([self.white, *shapes])
        usual = float(self.count @ (self.variance / self.white)) / float(self.count.sum())
        size = np.eye(columns.shape[1])[0] * usual
        for _ in range(SCORING_ROUNDS):
            # what is expected of each stays positive
            expected = np.maximum(columns @ size, LEAST_EXPECTED * usual * self.white)
            weighted = columns * (0.5 * self.count / expected**2)[:, None]
            covariance = np.linalg.inv(weighted.T @ columns)
            moved = covariance @ (weighted.T @ self.variance)
            change, size = np.abs(columns @ (moved - size) / expected).max(), moved
            if change < SCORED:
                break
        expected = np.maximum(columns @ size, LEAST_EXPECTED * usual * self.white)
        return size, covariance, float(self.count @ (np.log(expected) + self.variance / expected))

    def flicker(self) -> Flicker:
        """Flicker noise, where these variances cannot be without it.

        The shortest averages are left out until white noise, flicker noise and what rises beside
        them explain the others: a tremor, a filter in the sensor and a sway differ from white noise
        in averages that are not much longer than they last.
        """
        even, share = np.ones(len(self.tau)), self.tau / self.tau.max()
        (size, covariance, unlikely), without = self.fitted(even), self.fitted()[2]
        expected, flat = size[0] * self.white + size[1], unlikely
        for rising in (share, share**2) if self.octaves > RISING_OCTAVES else ():
            found = self.fitted(even, rising)
            better = found[0][2] > 0.0 and found[2] < unlikely
            if better and exceeded(flat - found[2], 1.0, EXACT_FREEDOM) < RISING_P:
                (size, covariance, unlikely), without = found, self.fitted(rising)[2]
                expected = size[0] * self.white + size[1] + size[2] * rising
        level, doubt = float(size[1]), float(covariance[1, 1])
        most = max(level, 0.0) + WITHIN_NINETY * math.sqrt(doubt)
        if self._as_unlike(expected, len(size)) < FLICKER_P:
            if share.min() > LEAST_SHARE or self.octaves <= RISING_OCTAVES:
                return Flicker(0.0, math.inf, most)
            longer = self.tau > DROPPED * self.tau.min()
            parts = (one[longer] for one in (self.white, self.tau, self.count, self.variance))
            return _AllanVariances(*parts).flicker()
        # no flicker noise lies at the border of all that there may be: one of two sides
        if level <= 0.0 or exceeded(without - unlikely, 1.0, EXACT_FREEDOM) > 2.0 * FLICKER_P:
            return Flicker(0.0, math.inf, most)
        return Flicker(level, 2.0 * level**2 / doubt, most)

    @property
    def _octave(self) -> IntArray:
        """Of each, from the shortest average on, shape (m,)."""
        return np.asarray(np.rint(np.log2(self.tau / self.tau.min())), np.int64)

    @property
    def octaves(self) -> int:
        """How many different ones there are."""
        return len(distinct(self._octave))

    def _as_unlike(self, expected: FloatArray, parameters: int) -> float:
        """Probability of variances that differ as much from those expected, octave by octave."""
        if not (expected > 0.0).all():
            return 0.0
        count = np.bincount(self._octave, self.count)
        squares = np.bincount(self._octave, self.count * self.variance / expected)
        ratio, count = squares[count > 0.0] / count[count > 0.0], count[count > 0.0]
        freedom = len(count) - parameters
        if freedom < 1:
            return 1.0
        deviance = float(count @ (ratio - 1.0 - np.log(ratio)))
        return exceeded(deviance / freedom, freedom, EXACT_FREEDOM)


def flicker_in_holds(holds: Sequence[Hold], up: FloatArray, white: FloatArray) -> Flicker | None:
    """Flicker noise of the accelerometer as the holds show it; None where they cannot show any.

    What turns the device slowly (a table that gives way) changes the readings across gravity more
    than those along it, and is no noise of the sensor: then only those along it count.

    Args:
        holds: still periods.
        up: direction of gravity in each, unit vectors, shape (n, 3).
        white: variance of the mean of each by the noise within it, reading units², shape (n,).
    """
    long = [hold.end - hold.start for hold in holds if hold.allan_covariances is not None]
    if sum(long) < MIN_LONG_REST:
        return None
    rows: list[tuple[float, ...]] = []
    for hold, own, noise in zip(holds, up, white.tolist(), strict=True):
        for halving, one in enumerate(
            () if hold.allan_covariances is None else hold.allan_covariances
        ):
            along = float(own @ one @ own)
            across = 0.5 * (float(np.trace(one)) - along)
            tau = 0.5 * (hold.end - hold.start) / 2**halving
            rows.append((noise * (hold.end - hold.start) / tau, tau, 2.0**halving, along, across))
    if not rows:
        return None
    expected, tau, count, along, across = np.array(rows).T
    if not (expected > 0.0).all() or not (along > 0.0).all() or not (across > 0.0).all():
        return None
    alone, beside, both = (
        _AllanVariances(expected, tau, axes * count, variance)
        for axes, variance in ((1, along), (2, across), (3, (along + 2.0 * across) / 3.0))
    )
    if both.octaves < RISING_OCTAVES:
        return None
    (_, own), of_own, _ = alone.fitted(np.ones(len(tau)))
    (_, other), of_other, _ = beside.fitted(np.ones(len(tau)))
    turned = other - own > SURE * math.sqrt(of_own[1, 1] + of_other[1, 1])
    return alone.flicker() if turned else both.flicker()
