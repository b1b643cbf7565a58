"""Thousands of samples of a turning magnetometer as some seventy means, one after the other.

Samples that follow one another are averaged to pieces of a fifth of a second. A mean of vectors
along an arc is shorter than the vectors; ``extra`` keeps the difference, so that the magnitude of
the mean is the mean magnitude. Neighbouring pieces whose direction, current and time differ least
form a group, which is a row of the fit. A still pose is one group: what the place or the rounding
does to its readings is the same in all of them. Where the noise changes within a group, it becomes
two, so that each weighs by its own noise.
"""

import heapq
import itertools
import math

import numpy as np

from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.poses import CORNERS, FACES
from imucal_wizard.core.readings import (
    MAX_SAMPLE_INTERVALS,
    BoolArray,
    FloatArray,
    IntArray,
    distinct,
)
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import MEDIAN_CHI_SQUARE, median, median_of_rows

MOST_GROUPS = 120
"""Groups: arcs of a tumbling device then stay short of a radian, and the bench ranks its suspects
as quickly as for a hundred holds. Changes of the noise make some more."""
FIELD_PIECE_SECONDS = 0.2
"""Seconds of a piece."""
MAX_FIELD_PIECES = 3000
"""Pieces at most; those of an hour are longer."""
SESSION_RADIANS = 3.0
"""What the whole session counts for, against a radian of direction: a rest of a tenth of it is cut
as readily as an arc of 17°."""
REVISIT_SECONDS = 3.0
"""Seconds after which a direction is visited anew."""
ONE_POSE_RADIANS = np.radians(2.0)
"""Scatter of the direction within a still pose that a hand holds, at most. A shorter arc than 7°
tells an ellipsoid nothing more than its mean does."""
MIN_PIECES_OF_POSE = 3
"""Pieces in which a direction stays: two do not tell a rate from their noise."""
POSE_RATE = ONE_POSE_RADIANS * np.sqrt(12.0) / REVISIT_SECONDS
"""Rate of the direction, rad/s, by which a turn of ``REVISIT_SECONDS`` scatters as much as a pose
that is held."""
SMALLEST_NOISE = 1e-7
"""Of the field; data without any noise keep a weight."""
CHANGED_NOISE = 20.0
"""Twice the logarithm of the likelihood ratio from which on the noise changes at one of the some
hundred places in a recording: by chance it is as large in less than one of a hundred of them."""
PARABOLA_SAMPLES = 32
"""Samples along which noise is told from a course: of fewer, a parabola takes much of the noise."""
MEAN_WITHIN_THREE_SIGMAS = 0.9733
"""Mean square of a normal variable, over its variance, where it is within three standard
deviations: P(χ²₃ < 9) / P(χ²₁ < 9)."""
TOGETHER = 35.0 / 18.0
"""Variance of a mean of squares of second differences over that of independent ones: white noise
correlates neighbours by −2/3, the next ones by 1/6, and 1 + 2 (4/9 + 1/36) = 35/18."""
DIRECTION_CELLS = np.array([*FACES.values(), *CORNERS.values()])
"""Directions that are told apart: what is nearest to one of them is left out together."""


@dataclass(frozen=True, eq=False)
class Pieces:
    """Means of samples that follow one another.

    Attributes:
        reading: shape (p, 3).
        count: samples in each, shape (p,).
        time: mean, s, shape (p,).
        beside: means of what was recorded beside, shape (p, b).
        extra: by how much the mean magnitude is more than the magnitude of the mean, in the unit of
            the corrected field, shape (p,).
        offsets: first piece of each group and the end, shape (k + 1,).
        cell: number of each group's direction, shape (k,).
        apart: whether samples are missing before each piece, shape (p,).
    """

    reading: FloatArray
    count: FloatArray
    time: FloatArray
    beside: FloatArray
    extra: FloatArray
    offsets: IntArray
    cell: IntArray
    apart: BoolArray

    def mean(self, values: FloatArray) -> FloatArray:
        """Means over the groups of values of the pieces, shape (p, …) to (k, …)."""
        weight = self.count.reshape(-1, *[1] * (values.ndim - 1))
        sums = np.add.reduceat(values * weight, self.offsets[:-1], axis=0)
        return np.asarray(sums / self.samples.reshape(-1, *[1] * (values.ndim - 1)))

    def medians(self, values: FloatArray) -> FloatArray:
        """Medians over the groups of values of the pieces, shape (p, q) to (k, q)."""
        parts = itertools.pairwise(self.offsets.tolist())
        return np.array([median_of_rows(values[first:past]) for first, past in parts])

    @property
    def samples(self) -> FloatArray:
        """Samples of each group, shape (k,)."""
        return np.asarray(np.add.reduceat(self.count, self.offsets[:-1]))

    def spread(self, values: FloatArray) -> FloatArray:
        """Values of the groups as values of their pieces, shape (k, …) to (p, …)."""
        return np.repeat(values, np.diff(self.offsets), axis=0)

    def scatter(self, *values: FloatArray) -> list[FloatArray]:
        """Variances of values of all samples, (n, …), about the mean of their group, (k, …)."""
        starts = np.append(0, np.cumsum(self.count).astype(np.intp))[self.offsets]
        return [_scatter(one, starts) for one in values]

    def noise(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Variances of values of all samples, (n,), about short parabolas, and ν of each group.

        What a calibration that is not yet right makes of a turn bends the magnitude along an arc.
        It is no noise.

        Returns:
            the variances and their degrees of freedom, shapes (k,); 0 where a group is too short.
        """
        first = np.append(0, np.cumsum(self.count).astype(np.intp))[self.offsets]
        parts = np.maximum(np.diff(first) // PARABOLA_SAMPLES, 1)
        own = np.concatenate([np.arange(one) for one in parts]) / np.repeat(parts, parts)
        starts = np.repeat(first[:-1], parts)
        starts = starts + (own * np.repeat(np.diff(first), parts)).astype(np.intp)
        number = np.diff(np.append(starts, len(values)))
        place = (np.arange(len(values)) - np.repeat(starts, number)) / np.repeat(number, number)
        removed: list[FloatArray] = []
        length = np.zeros(len(starts))
        for one in (np.ones(len(values)), place, place**2, values):
            left = one.astype(float)
            for other in removed:
                left = left - np.repeat(np.add.reduceat(left * other, starts), number) * other
            length = np.sqrt(np.add.reduceat(left**2, starts))
            scale = np.where((number > len(removed)) & (length > 0.0), length, np.inf)
            removed.append(left / np.repeat(scale, number))
        group = np.append(0, np.cumsum(parts))[:-1]
        free = np.maximum(number - 3.0, 0.0)
        freedom = np.add.reduceat(free, group)
        squares = np.add.reduceat(length**2 * (free > 0.0), group)
        return np.asarray(squares / np.maximum(freedom, 1.0)), np.asarray(freedom)

    def still(self, field: FloatArray) -> BoolArray:
        """Which groups are a pose that is held, shape (k,).

        Args:
            field: corrected field of the pieces, shape (p, 3).
        """
        held = _held(unit_vectors(field), self.time, self.offsets)
        return np.array([len(pieces) > 0 for pieces in held])

    @property
    def edges(self) -> FloatArray:
        """Beginning and end of each piece, s, shape (p, 2)."""
        pairs = self.count[1:] + self.count[:-1]
        step = 2.0 * median(np.diff(self.time) / pairs) if len(pairs) else 0.0
        half = 0.5 * step * self.count
        return np.column_stack([self.time - half, self.time + half])

    @property
    def span(self) -> FloatArray:
        """Beginning and end of the samples of each group, s, shape (k, 2)."""
        first, last = self.offsets[:-1], self.offsets[1:] - 1
        return np.column_stack([self.edges[first, 0], self.edges[last, 1]])


def cut(
    time: FloatArray,
    reading: FloatArray,
    field: FloatArray,
    beside: FloatArray,
    rounding: float = 0.0,
) -> Pieces:
    """The pieces and groups of a recording.

    Args:
        time: s, in order, shape (n,).
        reading: shape (n, 3).
        field: the same corrected about right, shape (n, 3).
        beside: temperature and current, NaN where unknown, shape (n, 2).
        rounding: variance of the corrected field by the steps of the readings.
    """
    steps = np.diff(time, prepend=time[0])
    step = max(median(steps[1:]), 1e-6) if len(time) > 1 else 1.0
    begins = steps > MAX_SAMPLE_INTERVALS * step
    begins[0] = True
    length = max(FIELD_PIECE_SECONDS, float(time[-1] - time[0]) / MAX_FIELD_PIECES)
    starts = _piece_starts(begins, max(round(length / step), 1))
    count = np.diff(np.append(starts, len(time))).astype(float)

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray((np.add.reduceat(values, starts, axis=0).T / count).T)

    means, when, extras = mean(field), mean(time), mean(beside)
    magnitude = np.linalg.norm(field, axis=1)
    size = np.linalg.norm(means, axis=1)
    unit = means / np.maximum(size, 1e-12)[:, None]
    flowing = _changes(extras[:, 1])
    share = SESSION_RADIANS * (when - when[0]) / max(float(when[-1] - when[0]), 1e-9)
    fresh = np.diff(when, prepend=when[0]) > REVISIT_SECONDS
    features = np.column_stack([unit, flowing, share])
    offsets = slices(features, count, MOST_GROUPS, alike=3 + flowing.shape[1], fresh=fresh)
    offsets = _without_ends_of_turns(offsets, _held(unit, when, offsets), fresh)
    least = max(rounding, (SMALLEST_NOISE * float(magnitude.mean())) ** 2)
    scatter = _scatter(magnitude, np.append(starts, len(time))) + least
    offsets = _of_one_noise(offsets, scatter, count - 1.0)
    total = np.add.reduceat(unit * count[:, None], offsets[:-1], axis=0)
    return Pieces(
        mean(reading),
        count,
        when,
        extras,
        mean(magnitude) - size,
        offsets,
        np.argmax(total @ DIRECTION_CELLS.T, axis=1).astype(np.int64),
        begins[starts],
    )


def _held(unit: FloatArray, time: FloatArray, offsets: IntArray) -> list[IntArray]:
    """Pieces of each group in which a pose is held; none where the group is no such pose.

    Most of its pieces lie near one direction and do not turn on. A short arc of a turn lies near
    one direction, too, but turns on.

    Args:
        unit: directions of the pieces, shape (p, 3).
        time: of each, s, shape (p,).
        offsets: first piece of each group and the end, shape (k + 1,).
    """
    out = []
    for first, past in itertools.pairwise(offsets.tolist()):
        own = unit[first:past]
        away = np.linalg.norm(own - median_of_rows(own), axis=1)
        near = np.flatnonzero(away <= ONE_POSE_RADIANS)
        held = len(near) >= max(MIN_PIECES_OF_POSE, 0.5 * len(own))
        if held:
            later = time[first:past][near] - time[first:past][near].mean()
            held = np.linalg.norm(later @ own[near]) <= POSE_RATE * float(later @ later)
        out.append(first + near if held else near[:0])
    return out


def _without_ends_of_turns(offsets: IntArray, held: list[IntArray], fresh: BoolArray) -> IntArray:
    """First piece of each group and the end, where poses end as their turns begin, shape (k + 1,).

    The ends of a turn differ too little from the pose for ``slices``, but on them the device moves
    to another place already. They become part of the turn.

    Args:
        offsets: first piece of each group and the end, shape (k + 1,).
        held: pieces in which each group is a pose that is held.
        fresh: which pieces begin another visit, shape (p,).
    """
    edges = offsets.copy()
    for group, (one, other) in enumerate(itertools.pairwise(held), 1):
        if bool(len(one)) != bool(len(other)) and not fresh[offsets[group]]:
            edges[group] = one[-1] + 1 if len(one) else other[0]
    return edges


def _of_one_noise(offsets: IntArray, variance: FloatArray, freedom: FloatArray) -> IntArray:
    """First piece of each group and the end, where a group has one noise, shape (k + 1,).

    A group whose pieces before some place scatter otherwise than those from it on is cut there.

    Args:
        offsets: first piece of each group and the end, shape (k + 1,).
        variance: of the samples within each piece, shape (p,).
        freedom: of each, shape (p,).
    """

    def cost(squares: FloatArray, number: FloatArray) -> FloatArray:
        return np.asarray(number * np.log(np.maximum(squares, 1e-300) / np.maximum(number, 1.0)))

    squares, number = (np.append(0.0, np.cumsum(one)) for one in (freedom * variance, freedom))
    while True:
        first, end = (np.repeat(edge, np.diff(offsets)) for edge in (offsets[:-1], offsets[1:]))
        place = np.arange(len(variance))
        before, after, both = (
            cost(squares[one] - squares[other], number[one] - number[other])
            for one, other in ((place, first), (end, place), (end, first))
        )
        gain = np.where(place > first, both - before - after, 0.0)
        most = np.repeat(np.maximum.reduceat(gain, offsets[:-1]), np.diff(offsets))
        found = np.flatnonzero((gain == most) & (gain > CHANGED_NOISE))
        if not len(found):
            return offsets
        offsets = distinct(np.append(offsets, found))


def _scatter(values: FloatArray, starts: IntArray) -> FloatArray:
    """Variances of values, (n, …), about the mean of those from each start to the next, (k, …)."""
    number = np.diff(starts).reshape(-1, *[1] * (values.ndim - 1))
    means = np.add.reduceat(values, starts[:-1], axis=0) / number
    squares = (values - np.repeat(means, np.diff(starts), axis=0)) ** 2
    return np.asarray(np.add.reduceat(squares, starts[:-1], axis=0) / np.maximum(number - 1, 1))


def _changes(current: FloatArray) -> FloatArray:
    """The current as a share of its span, shape (p, 1); (p, 0) where it is unknown or only noise.

    Noise differs from one piece to the next by as much as over the session.
    """
    span = float(np.ptp(current)) if np.isfinite(current).all() else 0.0
    if not span > 0.0 or np.mean(np.diff(current) ** 2) > np.var(current):
        return np.zeros((len(current), 0))
    return (current / span)[:, None]


def _piece_starts(begins: np.ndarray, length: int) -> IntArray:
    """First sample of each piece: stretches without a gap cut into about equal lengths."""
    first = np.flatnonzero(begins)
    sizes = np.diff(np.append(first, len(begins)))
    parts = np.maximum(np.round(sizes / length).astype(np.int64), 1)
    starts = [f + (np.arange(n) * s) // n for f, s, n in zip(first, sizes, parts, strict=True)]
    return np.concatenate(starts).astype(np.int64)


def slices(
    features: FloatArray,
    weight: FloatArray,
    most: int,
    alike: int = 0,
    fresh: BoolArray | None = None,
) -> IntArray:
    """First row of each slice and the end, shape (k + 1,), k at most ``most``.

    Neighbours are joined whose joining adds least to the scatter of the features within the slices
    (Ward's criterion), until few enough are left: a circle becomes arcs. What is one pose after
    that is joined, too.

    Args:
        features: of what follows one another, shape (n, f).
        weight: of each row, shape (n,).
        most: slices.
        alike: how many of the features, the first ones, scatter by no more than
            ``ONE_POSE_RADIANS`` in one pose; 0 to join no more than ``most`` asks for.
        fresh: which rows begin another visit and so another pose, shape (n,).
    """
    count = len(weight)
    means: list[list[float]] = features.tolist()  # of so few numbers lists are faster than arrays
    weights: list[float] = weight.tolist()
    after, before = list(range(1, count + 1)), list(range(-1, count - 1))
    version, alive = [0] * count, [True] * count
    scatter = [0.0] * count

    def costs(row: int, columns: int) -> float:
        other = after[row]
        square = math.dist(means[row][:columns], means[other][:columns]) ** 2
        return square * weights[row] * weights[other] / (weights[row] + weights[other])

    every = features.shape[1]
    both = weight[:-1] * weight[1:] / (weight[:-1] + weight[1:])
    first_costs = (np.diff(features, axis=0) ** 2).sum(axis=1) * both
    waiting = [(cost, row, 0, 0) for row, cost in enumerate(first_costs.tolist())]
    heapq.heapify(waiting)
    left = count
    while waiting and (left > most or alike):
        _, row, own, others = heapq.heappop(waiting)
        if not alive[row] or after[row] >= count:
            continue
        other = after[row]
        if version[row] != own or version[other] != others:
            continue
        total = weights[row] + weights[other]
        within = scatter[row] + scatter[other] + costs(row, alike)
        if left <= most and (
            within > ONE_POSE_RADIANS**2 * total or (fresh is not None and fresh[other])
        ):
            continue
        means[row] = [
            (weights[row] * mine + weights[other] * theirs) / total
            for mine, theirs in zip(means[row], means[other], strict=True)
        ]
        weights[row], alive[other], after[row] = total, False, after[other]
        scatter[row] = within
        version[row] += 1
        left -= 1
        if after[row] < count:
            before[after[row]] = row
            heapq.heappush(waiting, (costs(row, every), row, version[row], version[after[row]]))
        if before[row] >= 0:
            first = before[row]
            heapq.heappush(waiting, (costs(first, every), first, version[first], version[row]))
    return np.append(np.flatnonzero(alive), count).astype(np.int64)


def piece_noise(
    pieces: Pieces, magnitude: FloatArray, single: FloatArray | float = 1.0
) -> tuple[float, float]:
    """Variance times samples of a mean over that of single samples.

    From three pieces that follow one another, by how far the middle one is off the line through the
    others, whose course over a turn is not noise. What is beyond three standard deviations, as at a
    step, does not count.

    Args:
        pieces: of the recording.
        magnitude: of each piece's corrected field, shape (p,).
        single: variance of a sample in each piece, shape (p,), or of all.

    Returns:
        the ratio, and its standard error over itself.
    """
    each = np.broadcast_to(single, np.shape(magnitude)) / pieces.count
    total = each[:-2] + 4.0 * each[1:-1] + each[2:]
    counted = ~(pieces.apart[1:-1] | pieces.apart[2:]) & (total > 0.0)
    if not counted.any():
        return 0.0, np.inf
    squares = np.diff(magnitude + pieces.extra, 2)[counted] ** 2 / total[counted]
    inside = squares <= 9.0 * median(squares) / MEDIAN_CHI_SQUARE
    ratio = float(squares[inside].mean()) / MEAN_WITHIN_THREE_SIGMAS
    return ratio, float(np.sqrt(2.0 * TOGETHER / inside.sum()))


def visits_of(pieces: Pieces, poses: IntArray) -> IntArray:
    """Number of the visit to a direction that each group is, shape (k,).

    Groups of one direction between which there is hardly time to turn away are one visit.

    Args:
        pieces: and their groups.
        poses: number of each group's direction, shape (k,).
    """
    first, last = pieces.time[pieces.offsets[:-1]], pieces.time[pieces.offsets[1:] - 1]
    number = np.zeros(len(first), np.int64)
    known: dict[int, tuple[float, int]] = {}
    for group, cell in enumerate(poses.tolist()):
        end, visit = known.get(cell, (-np.inf, -1))
        if first[group] - end > REVISIT_SECONDS:
            visit = group
        number[group] = visit
        known[cell] = (float(last[group]), visit)
    return number
