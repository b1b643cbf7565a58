"""Even times where the given ones jitter: rounded ones, or those of arrival."""

from itertools import pairwise

import numpy as np

from imucal_wizard.acquire.clock import LONG_GAP_SECONDS, TimeSmoother
from imucal_wizard.acquire.host_clock import BurstClock
from imucal_wizard.core.limits.data_quality import MAX_STEP_RATIO, RESTART_GAP_SECONDS
from imucal_wizard.core.readings import ComplexArray, FloatArray, across_restarts
from imucal_wizard.core.statistics import median
from imucal_wizard.measurement.data_quality import ARRIVAL_TIMES, missing_samples

_JITTER_SAMPLES = 100
"""Samples over which a jitter averages to nothing, and times that wander have wandered off."""
_MIN_JITTER = 0.05
"""Jitter of the steps in sampling intervals below which it does not matter."""
_DECIDING_SAMPLES = 3 * _JITTER_SAMPLES
"""Samples at the beginning of a stream that show whether its times jitter or wander."""
_MAX_JITTER_WAIT = 7.5
"""Longest time that they may take. Until then nothing arrives for the user; below 40 samples/s the
times stay as they are given, and a rotation hardly depends on their jitter."""
_MAX_LOOP_NOISE = 0.1
"""Error of the even times of a stream, in sampling intervals: a tenth of the jitter."""
_MAX_WANDER = 0.3
"""Growth of the deviation from even times in that many samples, over that of independent steps."""
_MIN_RESULTANT = 0.3
"""Mean resultant length of the phases of so many samples, below which they lie about no even times:
a uniform jitter by ±0.375 intervals gives 0.3, and independent phases give 0.06."""
_MIN_DELAYS = 0.25
"""Jitter of the steps in sampling intervals, above which samples are so late that the phases of
their times may not tell to which interval they belong."""
_MAX_SHIFTED = 10
"""Samples in a row that are late by half an interval."""
_LEVEL_SIGMAS = 3.0
"""Standard deviations by which a course differs from a level one if it is not level."""
JITTER_NOTE = (
    "the times jitter about even ones, as if they were rounded or taken on arrival: the even ones "
    "are used. What is wrong with them shows in rotations: where more than noise is left of the "
    "gyroscope, it may be that"
)


class JitterFilter:
    """Even times for a stream whose times jitter about them, as its beginning shows.

    The times of the beginning wait until it is long enough; a stream whose first steps are even, or
    that is so slow that this takes too long, is not delayed.

    Args:
        first: the first times, s.

    Attributes:
        open: whether it is not yet known if the times jitter.
        smoother: makes the times even; None if they do not jitter, or not yet.
        period: sampling period of the even times, s; 0 without a smoother.
        note: what the user should know of the times, or "".
    """

    def __init__(self, first: FloatArray) -> None:
        steps = _usual_steps(first)
        jitters = len(steps) > 0 and bool(steps.std() >= _MIN_JITTER * steps.mean())
        self.open = jitters and bool(_DECIDING_SAMPLES * steps.mean() <= _MAX_JITTER_WAIT)
        self._waiting = np.zeros(0)
        self.smoother: TimeSmoother | None = None
        self.period = 0.0
        self.note = ""

    def feed(self, times: FloatArray) -> FloatArray:
        """Times of the oldest samples that are known now, s; the others wait.

        Args:
            times: of the new samples, s, shape (n,), never decreasing.
        """
        if not self.open:
            return times if self.smoother is None else self.smoother.feed(times)
        self._waiting = np.concatenate((self._waiting, times))
        if len(self._waiting) < _DECIDING_SAMPLES:
            return np.zeros(0)
        begun, rest = np.split(self.flush(), [_DECIDING_SAMPLES])
        self.open = False
        even = without_jitter(begun)
        if even is None:
            self.note = ARRIVAL_TIMES if missing_samples(begun) == ARRIVAL_TIMES else ""
            return np.concatenate((begun, rest))
        self.note = JITTER_NOTE
        self.period = float(_usual_steps(even).mean())
        late = begun - even
        # halfway between the latest sample and the earliest one after a lost one
        limit = 0.5 * float(late.max() + self.period + late.min())
        limit = max(limit, float(late.max()) + _MAX_LOOP_NOISE * self.period)
        self.smoother = TimeSmoother(self.period, limit, float(even[-1]))
        return np.concatenate((even, self.smoother.feed(rest)))

    def flush(self) -> FloatArray:
        """Times of the waiting samples as they are given, at the end of the stream."""
        waiting, self._waiting = self._waiting, np.zeros(0)
        return waiting


def _usual_steps(time: FloatArray) -> FloatArray:
    """The steps of times over which no sample is missing."""
    steps = np.diff(time)
    return steps[steps <= MAX_STEP_RATIO * median(steps)] if len(steps) else steps


def _period(time: FloatArray) -> float:
    """The sampling interval of times that jitter, s.

    The steps over which no sample seems to be missing are too short on average: without the longest
    ones, those that follow a late time are left. Over more and more samples the jitter is spread
    over more intervals, whose number the shorter stretches tell.
    """
    period = median(np.diff(time))
    for reach in (3, 10, 30, _JITTER_SAMPLES) if period > 0.0 else ():
        apart = time[reach:] - time[:-reach]
        intervals = np.maximum(np.round(apart / period), 1.0)
        period = float(apart.sum() / intervals.sum())
    return period


def without_jitter(time: FloatArray) -> FloatArray | None:
    """The even times about which given ones jitter; None if they do not jitter, or wander.

    A sensor measures by its own clock, and whoever reads it takes the time later, by a delay that
    varies but does not add up. Where the steps themselves vary, their sum wanders off any even
    course: then each sample was measured at its own time.

    Args:
        time: s, shape (n,), never decreasing.
    """
    steps, usual = np.diff(time), _usual_steps(time)
    period = _period(time) if len(usual) > 2 * _JITTER_SAMPLES else 0.0
    if not period > 0.0 or usual.std() < _MIN_JITTER * period:
        return None
    restarts = across_restarts(steps)
    cuts = np.flatnonzero((steps > LONG_GAP_SECONDS) | restarts) + 1
    parts = np.split(time, cuts)
    courses = [_course(part, period) for part in parts]
    if np.concatenate([share for _, _, share in courses]).mean() < _MIN_RESULTANT:
        return None
    off = [late + slow for late, slow, _ in courses]
    far = np.concatenate([one[_JITTER_SAMPLES:] - one[:-_JITTER_SAMPLES] for one in off])
    near = np.concatenate([np.diff(one) for one in off])
    jitter = float((near - period * np.round(near / period)).std())
    if not len(far) or float(far.std()) > _MAX_WANDER * np.sqrt(_JITTER_SAMPLES) * jitter:
        return None
    even = [part - late for part, (late, _, _) in zip(parts, courses, strict=True)]
    for (before, after), cut in zip(pairwise(even), cuts, strict=True):
        if restarts[cut - 1]:  # its length is a sign, and not measured
            after += before[-1] + RESTART_GAP_SECONDS - after[0]
    return np.maximum.accumulate(_apart(np.concatenate(even), period))


def evenly_arrived(time: FloatArray) -> FloatArray | None:
    """Even times of samples whose own were taken on arrival, with delays of any size.

    None where the times hardly jitter, or wander off the course of the even ones: samples are
    missing, which such times do not show one by one, or each was measured at its own time.

    Args:
        time: s, shape (n,), never decreasing.
    """
    usual = _usual_steps(time)
    period = float(usual.mean()) if len(usual) > 2 * _JITTER_SAMPLES else 0.0
    if not period > 0.0 or usual.std() < _MIN_DELAYS * period:
        return None
    clock = BurstClock(1.0, 0.0, None)
    even = np.concatenate((clock.feed(time), clock.flush()))
    late = time - even
    course = _running_mean(late - late.mean(), _JITTER_SAMPLES)
    wanders = float(course.std()) > _MAX_WANDER * float(late.std()) or clock.lost > 0
    return None if len(even) < len(time) or wanders else even


def _apart(even: FloatArray, period: float) -> FloatArray:
    """Even times of which no two samples have the same.

    Samples that are later or earlier than the others by more than half an interval seem to be the
    next or the previous ones. They belong where the nearest place is empty, and so do those
    between.
    """
    steps = np.diff(even, prepend=-np.inf, append=np.inf)
    for one in np.flatnonzero(steps < 0.5 * period).tolist():
        before = steps[max(one - _MAX_SHIFTED, 0) : one][::-1] > 1.5 * period
        after = steps[one + 1 : one + 1 + _MAX_SHIFTED] > 1.5 * period
        back = int(before.argmax()) + 1 if before.any() else len(steps)
        on = int(after.argmax()) + 1 if after.any() else len(steps)
        if min(back, on) == len(steps):
            continue
        rows, by = slice(one - back, one), -period
        if on < back:
            rows, by = slice(one, one + on), period
        even[rows] += by
        steps[rows.start] += by
        steps[rows.stop] -= by
    return even


def _course(time: FloatArray, period: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """By how much times are later than the even ones near them, all of shape (n,).

    The phase of a sample in the interval in which it lies does not depend on how many samples are
    missing before it, as its number would.

    Args:
        time: s, shape (n,), without long gaps.
        period: sampling interval, s, about.

    Returns:
        The jitter and the course of the even times about the best line, s; and the resultant length
        of the phases about each sample: 1 where there is no jitter, 0 where all are as likely.
    """
    angle = 2.0 * np.pi * (time - time[0]) / period
    slow = np.unwrap(np.angle(_running_mean(np.exp(1j * angle), _JITTER_SAMPLES)))
    if len(time) > 2 * _JITTER_SAMPLES:  # the interval is a little longer or shorter
        angle -= angle * (angle @ (slow - slow.mean()) / (angle @ (angle - angle.mean())))
    phases = np.exp(1j * angle)
    near = _running_mean(phases, _JITTER_SAMPLES)
    late, slow, reach = np.angle(phases * near.conj()), np.unwrap(np.angle(near)), _JITTER_SAMPLES
    # the mean of more samples is better known, as long as the even times are level over them
    while 4 * (reach := 10 * reach) < len(time):
        level = np.unwrap(np.angle(wider := _running_mean(phases, reach)))
        parts = 5.0 * len(time) / reach
        chance = float(late.var()) * 5.0 / reach * (1.0 + _LEVEL_SIGMAS * np.sqrt(2.0 / parts))
        if float(np.var(slow - level)) > chance:
            break
        late, slow = np.angle(phases * wider.conj()), level
    second = period / (2.0 * np.pi)
    return second * late, second * (slow - slow.mean()), np.abs(near)


def _running_mean(values: ComplexArray | FloatArray, reach: int) -> ComplexArray:
    """Mean of each value and so many on either side; at the ends that of the first and last."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    width = min(2 * reach + 1, len(values))
    first = np.clip(np.arange(len(values)) - reach, 0, len(values) - width)
    return np.asarray((sums[first + width] - sums[first]) / width)
