"""Holds and rotations of a recording, and the stillness limits that suit it.

No fixed multiple of the quietest noise finds the holds of every recording: a device on a table
needs 1, a hand-held device 1,000. Every candidate limit is tried, and the fit decides. The limits
find where the device rests; how long it rests follows from its own noise (``rests``).
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import field, replace

import numpy as np

from imucal_wizard.core.limits.stillness import (
    CALM_FACTOR,
    COURSE_STRETCHES,
    HOLDS_BESIDE,
    LIVELY_RATE,
    LIVELY_SHARE,
    MAX_FORCE_LIMIT,
    MAX_QUIET_STRETCHES,
    MAX_RATE_LIMIT,
    MAX_TILT_OF_TURN,
    MAX_VIBRATION,
    MIN_HOLD_SECONDS,
    MIN_LIVELY_BLOCKS,
    MIN_RATE_LIMIT_DEG,
    MIN_RESTING_POSITIONS,
    MIN_ROTATION_SECONDS,
    MIN_SELECTED_RATIO,
    MIN_SHAKEN,
    MIN_SHARE_OF_POSITIONS,
    MIN_SPEED_RATIO,
    MIN_TURN_DEG,
    ONE_POSITION,
    ONE_POSITION_NOISE,
    OTHER_POSITION,
    QUIET_BLOCKS,
    REST_FACTOR,
    ROTATION_OVERLAP_SECONDS,
    SAME_PLACE,
    TIME_TOLERANCE,
    TURNING_SIGMAS,
    VARIANCE_FACTORS,
    WINDOW_BLOCKS,
)
from imucal_wizard.core.readings import (
    BoolArray,
    FloatArray,
    IntArray,
    Readings,
    Series,
)
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import (
    median,
    median_of_rows,
    root_mean_square,
    sample_quantile,
    true_on_all_axes,
)
from imucal_wizard.core.units import COUNT
from imucal_wizard.measurement.blocks import (
    BlockCutter,
    Blocks,
    join_blocks,
    resample_gyroscope,
)
from imucal_wizard.measurement.clipping import RateSegment, clipped_motions, clipped_rotation
from imucal_wizard.measurement.gaps import gap_problem
from imucal_wizard.measurement.holds import (
    Hold,
    Rests,
    Rotation,
    blocks_of_rests,
    fewest_windows,
    hold_at_rest,
    steady,
    still_runs,
    vibration,
)
from imucal_wizard.measurement.rounding import resolution_of, rounding_noise
from imucal_wizard.measurement.stillness import Limits, Noise, WindowMaker, Windows

SAMPLES_PER_SLAB = 200_000
"""Samples cut at a time, so that memory stays bounded for any length of recording."""


@dataclass(frozen=True, eq=False)
class ReducedRecording:
    """A recording reduced to blocks and windows.

    Attributes:
        blocks: its blocks.
        windows: one per block.
        noise: noise of its quietest two seconds, at least the rounding noise.
        step_a: resolution of each accelerometer axis, shape (3,); 0 if it never changes.
        step_g: resolution of each gyroscope axis, or None.
        gravity: reading of one gravity: half the range of the liveliest axis, or the magnitude if
            the device stayed in one position.
        one_position: whether it stayed so.
        rests: the rests of the recording.
        resting_rate: the gyroscope's reading at rest in each window, shape (m, 3), or None.
        least_rate: the smallest limit of the mean rate at rest, in the reading's unit; 0 where its
            size is not known.
        holds: the hold in each run of blocks summarised so far; None if it is too short or drifts.
    """

    blocks: Blocks
    windows: Windows
    noise: Noise
    step_a: FloatArray
    step_g: FloatArray | None
    gravity: float
    one_position: bool
    rests: Rests
    resting_rate: FloatArray | None
    least_rate: float = 0.0
    holds: dict[tuple[int, int], Hold | None] = field(default_factory=dict)

    @property
    def seconds(self) -> float:
        """Duration of all blocks together, s."""
        return float((self.blocks.end - self.blocks.start).sum())


def reduce_recording(readings: Readings) -> ReducedRecording | None:
    """Reduce a recording to blocks, windows and its quietest noise; None if it is too short."""
    together = resample_gyroscope(readings)
    rate = together.accelerometer.rate
    if rate <= 0.0:
        return None
    cutter, maker = BlockCutter(rate), WindowMaker()
    parts = [cutter.feed(part) for part in _slabs(together)]
    blocks = join_blocks(parts)
    if not len(blocks):
        return None
    windows = maker.feed(blocks)
    gyroscope = readings.gyroscope
    step_a = resolution_of(readings.accelerometer.values)
    step_g = None if gyroscope is None else resolution_of(gyroscope.values)
    reach = float(np.ptp(blocks.mean_a, axis=0).max()) / 2.0
    counts = gyroscope is None or gyroscope.unit == COUNT
    least = 0.0 if counts else math.radians(MIN_RATE_LIMIT_DEG)
    stretches = _Stretches.of(blocks, windows, reach, least)
    quietest = _quietest(windows, step_a, step_g, stretches)
    if quietest is None:
        alone = replace(readings, gyroscope=None)
        return None if gyroscope is None else reduce_recording(alone)
    noise, first = quietest
    magnitude = median(np.linalg.norm(blocks.mean_a, axis=1))
    one_position = reach < ONE_POSITION * magnitude
    if readings.accelerometer.unit == COUNT:
        one_position &= reach < ONE_POSITION_NOISE * float(noise.std_a.max())
    gravity = magnitude if one_position else reach
    if counts:
        least = math.radians(MIN_RATE_LIMIT_DEG) * _counts_per_radian(blocks, gravity, noise.mean_g)
    resting = _resting_rate(windows, noise, first + QUIET_BLOCKS // 2)
    turning = windows.turning(resting, least * MIN_TURN_DEG / MIN_RATE_LIMIT_DEG)
    return ReducedRecording(
        blocks=blocks,
        windows=windows,
        noise=noise,
        step_a=step_a,
        step_g=step_g,
        gravity=gravity,
        one_position=one_position,
        rests=Rests(windows, step_a, step_g, turning),
        resting_rate=resting,
        least_rate=least,
    )


def _slabs(readings: Readings) -> Iterator[Readings]:
    for first in range(0, len(readings), SAMPLES_PER_SLAB):
        part = readings.inertial_part(first, first + SAMPLES_PER_SLAB)
        yield replace(part, temperature=readings.temperature if first == 0 else None)


@dataclass(frozen=True, eq=False)
class _Stretches:
    """The stretches of two seconds of a recording, one after the other.

    Attributes:
        position: mean reading of the accelerometer in units of gravity, shape (n, 3).
        rate: mean reading of the gyroscope, shape (n, 3); no stretches without one.
        least_rate: deviation of such means that is no rotation, in the reading's unit; 0 where its
            size is not known.
    """

    position: FloatArray
    rate: FloatArray
    least_rate: float

    @classmethod
    def of(
        cls, blocks: Blocks, windows: Windows, gravity: float, least_rate: float
    ) -> "_Stretches":
        """The whole stretches of a recording."""
        if windows.mean_g is None or not gravity > 0.0:
            return cls(np.zeros((0, 3)), np.zeros((0, 3)), least_rate)
        count = len(blocks) // QUIET_BLOCKS

        def means(values: FloatArray) -> FloatArray:
            whole = values[: count * QUIET_BLOCKS].reshape(count, QUIET_BLOCKS, 3)
            return np.asarray(whole.mean(axis=1))

        return cls(means(blocks.mean_a) / gravity, means(windows.mean_g), least_rate)

    def positions(self, rate: FloatArray, limit: FloatArray) -> int:
        """In how many positions the gyroscope reads this mean, up to a limit for each axis."""
        left = self.position[true_on_all_axes(np.abs(self.rate - rate) <= limit)]
        count = 0
        while len(left):
            left = left[np.linalg.norm(left - left[0], axis=1) > OTHER_POSITION]
            count += 1
        return count


def _quietest(
    windows: Windows, step_a: FloatArray, step_g: FloatArray | None, stretches: _Stretches
) -> tuple[Noise, int] | None:
    """Noise of the two seconds at rest in which all axes together are quietest; their first window.

    A device that turns evenly on a table may be quieter than one that is held in the hand. Its rate
    is found in that one position, and the bias of a gyroscope in all.

    If the noise is smaller than the resolution, most windows show none and the others flicker
    between two values; the rounding noise is then the lower limit.
    """
    full = windows.full
    if full.sum() < QUIET_BLOCKS:
        return None
    floor_a = rounding_noise(step_a)
    floor_g = None if step_g is None else rounding_noise(step_g)
    score = _relative(windows.std_a, full, floor_a)
    if windows.std_g is not None and floor_g is not None:
        score = score + _relative(windows.std_g, full, floor_g)
    score[~(full & np.isfinite(score))] = np.inf
    spans = np.lib.stride_tricks.sliding_window_view(score, QUIET_BLOCKS).sum(axis=1)
    start = int(np.argmin(spans))
    if not np.isfinite(spans[start]):
        return None

    def noise_from(start: int) -> Noise:
        part = slice(start, start + QUIET_BLOCKS)
        std_g = mean_g = None
        if windows.std_g is not None and windows.mean_g is not None and floor_g is not None:
            std_g = np.maximum(_rms(windows.std_g[part]), floor_g)
            mean_g = windows.mean_g[part].mean(axis=0)
        return Noise(np.maximum(_rms(windows.std_a[part]), floor_a), std_g, mean_g)

    limits = noise_from(start).limits(REST_FACTOR)
    if windows.mean_g is None or limits.rate is None or not len(stretches.rate):
        return noise_from(start), start
    # the noise here may be that of a turn that begins; a mean of two seconds has little of any
    limit = limits.rate if not stretches.least_rate > 0.0 else np.full(3, stretches.least_rate)
    apart = np.arange(0, len(spans), QUIET_BLOCKS)
    apart = apart[np.isfinite(spans[apart])]
    quiet = [start, *apart[np.argsort(spans[apart])][:MAX_QUIET_STRETCHES].tolist()]
    means = [windows.mean_g[one : one + QUIET_BLOCKS].mean(axis=0) for one in quiet]
    positions = np.array([stretches.positions(mean, limit) for mean in means])
    if positions.max() >= MIN_RESTING_POSITIONS:
        start = quiet[int(np.argmax(positions >= MIN_SHARE_OF_POSITIONS * positions.max()))]
    return noise_from(start), start


def _resting_rate(windows: Windows, noise: Noise, quietest: int) -> FloatArray | None:
    """The gyroscope's reading at rest in each window, shape (m, 3); None without a gyroscope.

    A bias that drifts with the temperature changes by many times the noise while a session lasts,
    but hardly from one rest to the next. From the quietest window to either end, a calm stretch
    continues the course of those before it within the noise; a motion at constant rate does not.

    Args:
        windows: of the recording.
        noise: of its quietest two seconds, with the mean rate there.
        quietest: number of a window in these.
    """
    means, limits = windows.mean_g, noise.limits(CALM_FACTOR)
    if means is None or noise.mean_g is None or limits.rate is None:
        return noise.mean_g
    calm = windows.still(replace(limits, gyroscope_mean=None)) & np.isfinite(means).all(axis=1)
    pieces = [
        (first, min(first + QUIET_BLOCKS, past))
        for begin, past in still_runs(calm)
        for first in range(begin, past - WINDOW_BLOCKS + 1, QUIET_BLOCKS)
    ]
    middle = np.array([0.5 * (first + past - 1) for first, past in pieces])
    rates = np.array([means[first:past].mean(axis=0) for first, past in pieces]).reshape(-1, 3)
    course = [(float(quietest), noise.mean_g)]
    for index in np.argsort(np.abs(middle - quietest)).tolist():
        later = bool(middle[index] > quietest)
        near = course[-COURSE_STRETCHES:][::-1] if later else course[:COURSE_STRETCHES]
        (at, last), (earlier, then) = near[0], near[-1]
        further = min(abs(middle[index] - at) / max(abs(at - earlier), 1.0), 1.0)
        if (np.abs(rates[index] - last - further * (last - then)) <= limits.rate).all():
            course.insert(later * len(course), (float(middle[index]), rates[index]))
    places, table = [one[0] for one in course], np.array([one[1] for one in course])
    every = np.arange(len(windows))
    return np.column_stack([np.interp(every, places, column) for column in table.T])


def _counts_per_radian(blocks: Blocks, gravity: float, resting: FloatArray | None) -> float:
    """Reading of the gyroscope for 1 rad/s, rather too small; 0 where the device never turns.

    The direction of gravity turns as fast as the device at most, so that the largest ratios are of
    rotations about the vertical, and the smallest of jerks.
    """
    if resting is None or blocks.mean.shape[1] < 6 or len(blocks) < MIN_LIVELY_BLOCKS:
        return 0.0
    seconds = median(blocks.end - blocks.start)
    turned = np.linalg.norm(blocks.mean_a[2:] - blocks.mean_a[:-2], axis=1)
    turned /= 2.0 * seconds * max(gravity, 1e-300)
    rate = np.linalg.norm(blocks.mean[1:-1, 3:] - resting, axis=1)
    lively = (turned > LIVELY_RATE) & np.isfinite(rate)
    if lively.sum() < MIN_LIVELY_BLOCKS:
        return 0.0
    return sample_quantile(rate[lively] / turned[lively], 0.25)


def _rms(std: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt((std**2).mean(axis=0)))


def _relative(std: FloatArray, full: BoolArray, floor: FloatArray) -> FloatArray:
    """Variance over all axes relative to its own low values, so that two sensors can be added."""
    variance = (std**2).sum(axis=1)
    quiet = np.sort(variance[full & np.isfinite(variance)])[:50]
    least = max(median(quiet), float(floor @ floor), 1e-300)
    return np.asarray(variance / least)


def holds_under(stream: ReducedRecording, limits: Limits) -> list[Hold]:
    """The holds in the rests that these limits find."""
    seconds = median(stream.blocks.end - stream.blocks.start)
    rate = None if limits.rate is None else np.maximum(limits.rate, stream.least_rate)
    limits = replace(limits, gyroscope_mean=stream.resting_rate, rate=rate)
    runs = still_runs(stream.windows.still(limits))
    rests = {
        rest
        for first, past in runs
        for rest in stream.rests.within(first, past, fewest_windows(seconds))
    }
    holds = [_hold_of_rest(stream, rest) for rest in blocks_of_rests(sorted(rests))]
    return _without_turns(stream, [hold for hold in holds if hold is not None])


def _without_turns(stream: ReducedRecording, holds: list[Hold]) -> list[Hold]:
    """The holds in which the gyroscope reads about the mean that it reads in those beside them.

    A turn about the vertical may be calmer than the rests of a hand that trembles. Of counts of
    unknown size the mean of each half second decides alone.
    """
    std, known = stream.noise.std_g, [one for one in holds if one.gyroscope is not None]
    if std is None or stream.resting_rate is None or not stream.least_rate > 0.0 or not known:
        return holds
    rates = np.array([one.gyroscope for one in known])
    beside = [
        median_of_rows(rates[max(place - HOLDS_BESIDE, 0) : place + HOLDS_BESIDE + 1])
        for place in range(len(rates))
    ]
    least = stream.least_rate * MIN_TURN_DEG / MIN_RATE_LIMIT_DEG
    noise = std / np.sqrt([[one.samples] for one in known])
    turns = (np.abs(rates - beside) > np.maximum(least, TURNING_SIGMAS * noise)).any(axis=1)
    turned = {id(known[place]) for place in np.flatnonzero(turns)}
    return [one for one in holds if id(one) not in turned]


def shaken_holds(stream: ReducedRecording, holds: Sequence[Hold]) -> list[Hold]:
    """The holds on a support that vibrates steadily, which are none under the limit of the others.

    Errors that vibration makes show in them alone, so that no calibration from quiet holds speaks
    for them. The gyroscope shows that the device does not turn; without one nothing tells them
    from a motion.

    Args:
        stream: the recording.
        holds: those that are used.
    """
    limits, usual = _loosest(stream), stream.noise.limits(REST_FACTOR)
    if limits.gyroscope is None or not holds:
        return []
    most = np.full(3, MAX_VIBRATION * stream.gravity)

    def vibration_in(hold: Hold) -> float:
        return vibration(_blocks_of(stream, hold), stream.step_a)

    quiet = median([vibration_in(one) for one in holds])
    return [
        one
        for one in holds_under(stream, replace(limits, accelerometer=most, rate=usual.rate))
        if all(one.end <= hold.start or hold.end <= one.start for hold in holds)
        and vibration_in(one) > MIN_SHAKEN * quiet
        and steady(_blocks_of(stream, one), stream.step_a, stream.gravity)
    ]


def _blocks_of(stream: ReducedRecording, hold: Hold) -> Blocks:
    first = int(np.searchsorted(stream.blocks.start, hold.start - TIME_TOLERANCE))
    past = int(np.searchsorted(stream.blocks.end, hold.end + TIME_TOLERANCE))
    return stream.blocks.select(slice(first, past))


def rests_apart(stream: ReducedRecording, holds: Sequence[Hold]) -> list[Hold]:
    """Calm rests that are no holds because the gyroscope reads another mean there.

    Its bias has jumped, or the device lies on something that turns. Turns about the vertical, after
    which the gyroscope reads its usual mean again, are none: the accelerometer does not see them.
    Rests without a hold between them are judged together. Those after the last hold are returned
    as well where all others are and the gyroscope still reads another mean at the end.

    Args:
        stream: the recording.
        holds: those that are used.
    """
    if stream.windows.mean_g is None:
        return []
    limits, usual = stream.noise.limits(REST_FACTOR), stream.resting_rate
    if limits.rate is None or usual is None:
        return []
    most = np.maximum(limits.rate, stream.least_rate)
    ends = np.array([one.end for one in holds])
    parts: dict[int, list[Hold]] = {}
    jumped: set[int] = set()
    for one in holds_under(replace(stream, resting_rate=None), limits):
        if one.gyroscope is None or any(
            hold.start < one.end and one.start < hold.end for hold in holds
        ):
            continue
        here = min(int(np.searchsorted(stream.blocks.end, one.end)), len(usual) - 1)
        off = one.gyroscope - usual[here]
        if (np.abs(off) > most).any():
            part = int((ends <= one.start).sum())
            parts.setdefault(part, []).append(one)
            if not _about_vertical(off, one.accelerometer, most):
                jumped.add(part)
    last = len(holds)
    at_end = np.abs(stream.blocks.mean[-1, 3:] - usual[-1]) <= most
    if last in parts and len(jumped) == len(parts) - 1 and not at_end.all():
        jumped.add(last)
    return [rest for part in sorted(jumped) for rest in parts[part]]


def _about_vertical(rate: FloatArray, force: FloatArray, limit: FloatArray) -> bool:
    """Whether a rate is about the vertical, as sensors before their calibration see it."""
    up = force / np.linalg.norm(force)
    across = rate - (rate @ up) * up
    return bool((np.abs(across) <= limit + MAX_TILT_OF_TURN * np.linalg.norm(rate)).all())


def _hold_of_rest(stream: ReducedRecording, rest: tuple[int, int]) -> Hold | None:
    """The hold in the blocks of a rest; None if it is too short or drifts.

    Many limits find the same rest, so each is summarised once.
    """
    if rest not in stream.holds:
        blocks = stream.blocks.select(slice(*rest))
        hold = hold_at_rest(blocks, stream.gravity, stream.step_a, stream.step_g)
        stream.holds[rest] = hold
    return stream.holds[rest]


def usual_candidates(stream: ReducedRecording) -> Iterator[tuple[float, list[Hold]]]:
    """The common limits with the holds that they find, from the strictest; equal results once."""
    limits = ((factor, stream.noise.limits(float(np.sqrt(factor)))) for factor in VARIANCE_FACTORS)
    return _different(stream, limits)


def loose_candidates(stream: ReducedRecording) -> Iterator[tuple[float, list[Hold]]]:
    """Looser limits, for a device whose quietest two seconds are not typical of its holds."""
    return _different(stream, _doubled(stream))


def _different(
    stream: ReducedRecording, limits: Iterator[tuple[float, Limits]]
) -> Iterator[tuple[float, list[Hold]]]:
    seen: set[tuple[float, ...]] = set()
    for factor, one in limits:
        holds = holds_under(stream, one)
        key = tuple(hold.start for hold in holds) + tuple(hold.end for hold in holds)
        if key not in seen:
            seen.add(key)
            yield factor, holds


def _doubled(stream: ReducedRecording) -> Iterator[tuple[float, Limits]]:
    """Multiples of the quietest variance, doubled up to the limits of a hand.

    Each sensor has its own end: a tremor is many times a good gyroscope's noise, but hardly exceeds
    a coarse accelerometer's step.
    """
    end, factor = _loosest(stream), float(VARIANCE_FACTORS[-1])
    while True:
        factor *= 2.0
        wider = stream.noise.limits(float(np.sqrt(factor)))
        capped = wider.capped(end)
        yield factor, capped
        if capped.equals(end):
            return


def _loosest(stream: ReducedRecording) -> Limits:
    """The loosest limits; not stricter than the largest common multiple."""
    least = stream.noise.limits(float(np.sqrt(VARIANCE_FACTORS[-1])))
    force = np.maximum(least.accelerometer, MAX_FORCE_LIMIT * stream.gravity)
    if least.gyroscope is None or stream.windows.std_g is None:
        return Limits(force)
    shown = stream.windows.std_g[stream.windows.full]
    shown = shown[np.isfinite(shown).all(axis=1)]
    if not len(shown):
        return Limits(force)
    lively = max(sample_quantile(column, LIVELY_SHARE) for column in shown.T)
    rate = np.maximum(least.gyroscope, MAX_RATE_LIMIT * lively)
    return Limits(force, rate, least.gyroscope_mean, rate)


def turning_rates(
    blocks: Blocks, gravity: float, holds: Sequence[Hold]
) -> tuple[float, float, bool]:
    """Rms rate at which gravity's direction turns within the holds and between them, rad/s.

    Rates are taken between the means of neighbouring stretches of half a second, which average a
    tremor; without such stretches they are NaN.

    Args:
        blocks: of a recording or of a part of it.
        gravity: reading of one gravity.
        holds: in this part.

    Returns:
        Both rates, and whether the holds are only slow moments of a device that is never put down:
        they turn nearly as fast as the device does between them, or as its slowest moments do.
    """
    seconds = median(blocks.end - blocks.start)
    length = max(int(0.5 * MIN_HOLD_SECONDS / seconds + TIME_TOLERANCE), 1)
    sums = np.cumsum(np.vstack([np.zeros(3), blocks.mean_a - blocks.mean_a[0]]), axis=0)
    means = (sums[length:] - sums[:-length]) / length
    turned = np.linalg.norm(means[length:] - means[:-length], axis=1) / max(gravity, 1e-300)
    count = len(turned)
    start, end = blocks.start[:count], blocks.end[2 * length - 1 : 2 * length - 1 + count]
    inside = np.zeros(count, bool)
    for hold in holds:
        inside |= (start >= hold.start - TIME_TOLERANCE) & (end <= hold.end + TIME_TOLERANCE)
    rates = [turned[rows] / (length * seconds) for rows in (inside, ~inside)]
    within, between = (root_mean_square(rate) if len(rate) else np.nan for rate in rates)
    share = sum(one.end - one.start for one in holds) / float((blocks.end - blocks.start).sum())
    selected = MIN_SELECTED_RATIO * np.sqrt(2.0 / share) if share > 0.0 else 0.0
    return within, between, bool(between < max(MIN_SPEED_RATIO, selected) * within)


def rotations_between(
    holds: Sequence[Hold], gyroscope: Series, accelerometer: Series
) -> list[Rotation]:
    """The motions between neighbouring holds, each with the reason if it cannot be used."""
    interval = 1.0 / gyroscope.rate
    rotations = []
    gravity = _gravity(holds)
    for before, after in itertools.pairwise(holds):
        if _same_rest(before, after, gravity):
            continue
        part = gyroscope.between(
            before.end - ROTATION_OVERLAP_SECONDS, after.start + ROTATION_OVERLAP_SECONDS
        )
        problem = _problem(part, interval, before, after)
        force = _at(accelerometer, part.time)
        rotations.append(Rotation(before, after, part.time, part.values, None, problem, force))
    whole = [one for one in rotations if one.problem is None]
    motions = [
        RateSegment(
            one.time,
            one.rate,
            _rest(one.before, one.after),
            one.before.accelerometer,
            one.after.accelerometer,
        )
        for one in whole
    ]
    axes = zip(map(id, whole), clipped_motions(motions, gyroscope.unit), strict=True)
    clipped = {key: clipped_rotation(axis) for key, axis in axes if axis is not None}
    return [replace(one, problem=clipped.get(id(one), one.problem)) for one in rotations]


def _same_rest(before: Hold, after: Hold, gravity: float) -> bool:
    """Whether two neighbouring holds belong to one rest that was disturbed.

    Args:
        before: a hold.
        after: the next one.
        gravity: in the unit of the readings.
    """
    if after.start - before.end >= MIN_ROTATION_SECONDS:
        return False
    moved = float(np.linalg.norm(after.accelerometer - before.accelerometer))
    return moved < SAME_PLACE * gravity


def rest_numbers(holds: Sequence[Hold]) -> IntArray:
    """Index of the rest to which each hold belongs, shape (n,)."""
    gravity = _gravity(holds)
    new = [not _same_rest(before, after, gravity) for before, after in itertools.pairwise(holds)]
    return np.cumsum(np.array([0, *new][: len(holds)], np.int64))


def _gravity(holds: Sequence[Hold]) -> float:
    """Gravity in the unit of the readings: half the range of the liveliest axis over the holds."""
    means = np.array([hold.accelerometer for hold in holds]).reshape(-1, 3)
    return float(np.ptp(means, axis=0).max()) / 2.0 if len(means) else 0.0


def _at(series: Series, time: FloatArray) -> FloatArray:
    """Readings interpolated linearly to other times."""
    near = series.between(float(time[0]) - 1.0, float(time[-1]) + 1.0) if len(time) else series
    if not len(time) or not len(near):
        return np.zeros((len(time), 3))
    return np.column_stack([np.interp(time, near.time, column) for column in near.values.T])


def _rest(before: Hold, after: Hold) -> FloatArray:
    """The gyroscope's reading at rest around a rotation, shape (3,)."""
    known = [hold.gyroscope for hold in (before, after) if hold.gyroscope is not None]
    return np.asarray(np.mean(known, axis=0)) if known else np.zeros(3)


def _problem(part: Series, interval: float, before: Hold, after: Hold) -> str | None:
    if len(part) < 3:
        return "no gyroscope samples in it"
    gap = gap_problem(part, interval, before, after)
    if gap is not None:
        return gap
    if not np.isfinite(part.values).all():
        return "some of its samples are not numbers"
    return None
