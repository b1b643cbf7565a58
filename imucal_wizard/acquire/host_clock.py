"""The sampling rate, and times of samples for streams without device time."""

from collections import deque

import numpy as np

from imucal_wizard.acquire.clock import LONG_GAP_SECONDS, DeviceClock
from imucal_wizard.core.limits.data_quality import (
    MAX_BURST_RATIO,
    MAX_PAUSE_SHARE,
    MIN_PAUSES,
)
from imucal_wizard.core.readings import BoolArray, FloatArray
from imucal_wizard.core.statistics import median, robust_deviation

MIN_ARRIVAL_JITTER = 0.01
"""Share of the time between two bursts by which most of them come earlier or later, if their times
are those of arrival and not of a clock that advances in coarse steps."""
_MIN_EQUAL_SHARE = 0.1
"""Share of the steps of time that are zero, above which equal times are no single faults."""
_DECIDING_TICKS = 10
"""Times that differ, from which on those of a coarse clock are told from those of bursts."""
_MIN_TICK_JITTER = 1e-4
"""Share of a tick of a coarse clock by which no tick differs from the usual one."""
_PRINTED_UNITS = 1.5
"""Units of the last digit, within which printed ticks of a coarse clock agree with the usual one:
those of 15.6 ms are 15 and 16."""
_MIN_UNEVEN_SHARE = 0.1
"""Share of the ticks that differ by more than both if the times are those of arrival."""
_LONGEST_TICK_SECONDS = 0.02
"""Longer than the steps of computers' clocks, of 16 ms at most. A hand turns a device by degrees in
that time, so its samples are spread by the whole course of the times, not by their neighbours."""
_MIN_SHARED = 1.5
"""Samples per time on average, from which on they share it and are no single repeats."""
WARM_UP_SECONDS = 2.0
"""Seconds of arrivals before the rate is accurate enough to start."""
_WARM_UP_POINTS = 10
"""Arrivals before the rate is accurate enough to start."""
_STALL_SECONDS = 0.25
"""s; a longer silence may hide lost samples."""
_REMEMBERED_BURSTS = 50
"""Bursts that show how much earlier or later than usual one arrives."""
_LATE_SIGMAS, _MIN_LATE_SAMPLES = 6.0, 1.5
"""Standard deviations and samples by which a burst is later than it ever is by its jitter, or by
the phase of a clock with long ticks."""
_BURSTS_TO_CATCH_UP = 3
"""Bursts after a late one in which a host that was delayed catches up."""
_MAX_STEP_BACK_SECONDS = 0.5
"""By how much the times of a host may go back that is set right by another clock."""
_LONGEST_INTERVAL_SECONDS = 2400.0
"""So that a step of less than an hour is a gap between bursts, and a longer one a clock that was
set."""
_SETTLE_SECONDS = 0.05
"""Seconds after a silence until the bytes buffered by the system have been read."""


def sampling_period(times: FloatArray) -> float:
    """The sampling period from a few device times, s; 0 if time does not advance.

    Gaps and backward jumps are ignored. If the printed time is coarser than the period, equal times
    are part of the mean; if the samples arrived in bursts, the pauses are.

    Args:
        times: shape (n,), s, as the device gave them.
    """
    steps = np.diff(times)
    forward = steps[steps > 0]
    if not len(forward):
        return 0.0
    if burst_pause(times):
        return float(np.mean(steps[steps >= 0]))
    middle = median(forward)
    low, high = (0.0, 2.5 * middle) if time_quantum(times) else (0.5 * middle, 1.5 * middle)
    near = steps[(steps >= low) & (steps <= high)]
    return float(np.mean(near)) if len(near) else middle  # none: the middle lies between two


def time_quantum(times: FloatArray) -> float:
    """The resolution of a printed time that is coarser than the sampling period, s; otherwise 0.

    Args:
        times: shape (n,), s, as the device gave them.
    """
    steps = np.diff(times)
    return float(np.min(steps[steps > 0])) if _often_equal(steps) else 0.0


def _often_equal(steps: FloatArray) -> bool:
    """Whether times advance, but many samples have that of the one before."""
    often = len(steps) > 0 and float(np.mean(steps == 0)) > _MIN_EQUAL_SHARE
    return often and bool(np.any(steps > 0))


def burst_pause(times: FloatArray) -> float:
    """The shortest pause between bursts, s, if times were taken when bursts arrived; otherwise 0.

    The steps within a burst then show the speed of the link and not that of the sensor. If all
    samples of a burst have one time, the times are equal as often as those of a coarse clock, but
    that advances by the same step each time, and arrivals do not.

    Args:
        times: shape (n,), s, as they were given.
    """
    steps = np.diff(times)
    if _often_equal(steps) and _uneven_ticks(times):
        return 0.5 * float(np.min(steps[steps > 0]))
    long = pauses(steps)
    if np.sum(long) < MIN_PAUSES or steps[long].sum() <= MAX_PAUSE_SHARE * steps[steps > 0].sum():
        return 0.0
    return MAX_BURST_RATIO * median(steps[steps > 0])


def has_enough_ticks(steps: FloatArray) -> BoolArray:
    """Whether the rows up to each one show bursts, if several have the same time, shape (n,).

    Args:
        steps: of time from each row to the next, shape (n,), not negative.
    """
    same, forward = np.cumsum(steps == 0), np.cumsum(steps > 0)
    rows = np.arange(len(steps))
    return np.asarray((same <= _MIN_EQUAL_SHARE * rows + 1.0) | (forward >= _DECIDING_TICKS))


def _uneven_ticks(times: FloatArray) -> bool:
    """Whether times that several samples share follow one another as no coarse clock advances.

    Such a clock advances by one tick, or by several where samples are missing, and its printed
    ticks differ by a unit of the last digit. A burst is read when the host comes to it.
    """
    steps = np.diff(times)
    forward = steps[steps > 0]
    if len(forward) < MIN_PAUSES:
        return False
    usual = median(forward)
    if np.mean(np.abs(forward - usual) > MIN_ARRIVAL_JITTER * usual) > 0.5:
        return True
    apart = np.diff(np.sort(forward))
    real = apart[apart > 4.0 * np.spacing(np.abs(times).max())]
    unit = float(real.min()) if len(real) else 0.0
    off = np.abs(forward - usual * np.maximum(np.round(forward / usual), 1.0))
    limit = max(_PRINTED_UNITS * unit, _MIN_TICK_JITTER * usual)
    return bool(np.mean(off > limit) > _MIN_UNEVEN_SHARE)


def long_tick(seconds: FloatArray) -> float:
    """Half a tick, s, if several samples share each time and the ticks are longer than a clock's.

    The ticks may be even: of a host that reads a buffer of the sensor on time, or whole seconds.

    Args:
        seconds: times, s, shape (n,), as they were given.
    """
    steps = np.diff(seconds)
    forward = steps[steps > 0]
    if len(forward) < MIN_PAUSES or len(steps[steps >= 0]) < _MIN_SHARED * len(forward):
        return 0.0
    usual = median(forward)
    return 0.5 * usual if usual >= _LONGEST_TICK_SECONDS else 0.0


def pauses(steps: FloatArray) -> BoolArray:
    """Which steps of time are much longer than the usual one, shape (n,)."""
    forward = steps[steps > 0]
    usual = median(forward) if len(forward) else 0.0
    return np.asarray(steps > MAX_BURST_RATIO * usual)


class RateFit:
    """Least-squares fit of arrival time over sample index, updated point by point.

    Bursts of a serial link shift single arrivals by tens of milliseconds; the slope over seconds is
    accurate to 0.05 % after 5 s and to 0.002 % after 30 s.
    """

    def __init__(self) -> None:
        self._n = 0
        self._mean_index = 0.0
        self._mean_arrival = 0.0
        self._sii = 0.0
        self._sia = 0.0
        self._first = 0.0
        self._last = 0.0

    def add(self, index: float, arrival: float) -> None:
        """Add one chunk: the index of its last sample and its arrival, s."""
        if self._n == 0:
            self._first = arrival
        self._last = arrival
        self._n += 1
        d_index = index - self._mean_index
        self._mean_index += d_index / self._n
        self._mean_arrival += (arrival - self._mean_arrival) / self._n
        self._sii += d_index * (index - self._mean_index)
        self._sia += d_index * (arrival - self._mean_arrival)

    @property
    def span(self) -> float:
        """Seconds between the first and the last arrival."""
        return self._last - self._first

    @property
    def points(self) -> int:
        """Number of arrivals."""
        return self._n

    @property
    def period(self) -> float:
        """Seconds per sample; 0 while there are too few points."""
        return self._sia / self._sii if self._n > 2 and self._sii > 0 and self._sia > 0 else 0.0

    @property
    def rate(self) -> float:
        """Samples per second; 0 while there are too few points."""
        return 1.0 / self.period if self.period > 0 else 0.0

    def expected(self, index: float) -> float:
        """Expected arrival of a sample, s."""
        return self._mean_arrival + (index - self._mean_index) * self.period


class HostClock:
    """Times of samples from their index and arrival; the same arrivals give the same times.

    A single arrival is inaccurate (links deliver in bursts); the least-squares slope over all of
    them gives the rate. After a long silence the samples wait until it is clear whether they were
    delayed or some are missing.

    Args:
        rate: samples per second, if known; None to measure it.
        complete: whether the indices leave out the samples that are missing, so that a silence
            hides none.
    """

    def __init__(self, rate: float | None = None, *, complete: bool = False) -> None:
        self._complete = complete
        self._given = 1.0 / rate if rate else 0.0
        self._fit = RateFit()
        self._waiting: list[FloatArray] = []
        self._warm = bool(rate)
        self._stalled: float | None = None
        self._last_arrival: float | None = None
        self._last_index: float | None = None
        self._last_time = 0.0
        self._shift = 0.0
        self.lost = 0
        self.away = 0

    @property
    def period(self) -> float:
        """Current estimate of the sampling period, s; 0 while unknown."""
        return self._given or self._fit.period

    def feed(self, indices: FloatArray, arrival: float) -> FloatArray:
        """Times of the samples that can be determined now, oldest first; the others wait.

        Args:
            indices: running index of each new sample, increasing, shape (n,), n > 0.
            arrival: arrival, s, on any monotonic clock.
        """
        self._notice_silence(arrival)
        self._waiting.append(indices + self._shift)
        if not self._settle(arrival):
            return np.zeros(0)
        self._fit.add(float(self._waiting[-1][-1]), arrival)
        if not self._warm:
            self._warm = self._fit.span >= WARM_UP_SECONDS and self._fit.points >= _WARM_UP_POINTS
            if not self._warm or not self.period:
                self._warm = False
                return np.zeros(0)
        return self._release()

    def flush(self) -> FloatArray:
        """Times of the waiting samples, at the end of the stream."""
        return self._release() if self.period else np.zeros(0)

    def _notice_silence(self, arrival: float) -> None:
        last, self._last_arrival = self._last_arrival, arrival
        usual = 4.0 * self.period
        if self._complete or not self._warm or last is None:
            return
        if arrival - last > max(_STALL_SECONDS, usual):
            self._stalled = self._stalled if self._stalled is not None else arrival

    def _settle(self, arrival: float) -> bool:
        """After a silence, wait, then decide whether samples are missing; True when decided."""
        if self._stalled is None:
            return True
        if arrival - self._stalled < _SETTLE_SECONDS:
            return False
        missing = self._missing(arrival)
        if missing > 0:
            self.lost += missing
            self.away += missing if missing * self.period > LONG_GAP_SECONDS else 0
            self._shift += missing
            self._waiting = [piece + missing for piece in self._waiting]
        self._stalled = None
        return True

    def _missing(self, arrival: float) -> int:
        """Number of samples by which the newest one is late; 0 while within the jitter."""
        if self._fit.points < _WARM_UP_POINTS or not self._fit.period:
            return 0
        late = arrival - self._fit.expected(float(self._waiting[-1][-1]))
        return round(late / self.period) if late > 0.5 * _STALL_SECONDS else 0

    def _release(self) -> FloatArray:
        indices = np.concatenate(self._waiting) if self._waiting else np.zeros(0)
        self._waiting = []
        if not len(indices):
            return indices
        if self._last_index is None:
            self._last_index = float(indices[0])
        times: FloatArray = self._last_time + (indices - self._last_index) * self.period
        if not self._given:  # a given rate counts from the first sample, whatever the chunks
            self._last_index, self._last_time = float(indices[-1]), float(times[-1])
        return times


class BurstClock:
    """Times of recorded samples whose own times were taken when bursts of them arrived.

    The end of each burst is the arrival of its samples for a ``HostClock``, and the last sample of
    the first burst keeps its time. Where samples are missing, a burst and all that follow are late
    for the number of their samples; after a delay the host catches up.

    Args:
        factor: seconds per tick.
        pause: the shortest pause between bursts, s.
        rate: samples per second, if known.

    Attributes:
        device: the clock whose times were given.
        lost: number of lost samples.
        away: number of samples lost in long gaps.
    """

    def __init__(self, factor: float, pause: float, rate: float | None) -> None:
        self._factor = factor
        self._pause = pause
        self.device = DeviceClock(factor, _LONGEST_INTERVAL_SECONDS, from_zero=False)
        self._newest = np.zeros(0)
        self._host = HostClock(rate, complete=True)
        self._waiting = np.zeros(0)
        self._first: float | None = None
        self._before = 0
        self._origin: float | None = None
        self._count = 0
        self._bursts: list[FloatArray] = []
        self._end: float | None = None
        self._late: deque[float] = deque(maxlen=_REMEMBERED_BURSTS)
        self.lost = 0
        self.away = 0

    @property
    def period(self) -> float:
        """Current estimate of the sampling period, s; 0 while unknown."""
        return self._host.period

    def feed(self, ticks: FloatArray) -> FloatArray:
        """Times of the oldest samples that can be determined now, s; the others wait.

        Args:
            ticks: given times, shape (n,), finite.
        """
        self._waiting = np.concatenate((self._waiting, self._seconds(ticks)))
        ends = np.flatnonzero(np.abs(np.diff(self._waiting)) > self._pause) + 1
        *bursts, self._waiting = np.split(self._waiting, ends)
        self._bursts += bursts
        return self._since_first(self._arrived())

    def _seconds(self, ticks: FloatArray) -> FloatArray:
        """Given times without wraps and restarts; one that goes back a little is the one before."""
        given = np.concatenate((self._newest, ticks))
        back = np.diff(given) * self._factor < -_MAX_STEP_BACK_SECONDS
        parts = np.split(given, np.flatnonzero(back) + 1)
        level = np.concatenate([np.maximum.accumulate(part) for part in parts])
        new, self._newest = level[len(self._newest) :], level[-1:]
        return self.device.feed(new)

    def flush(self) -> FloatArray:
        """Times of the waiting samples, at the end of the recording."""
        last, self._waiting = self._waiting, np.zeros(0)
        self._bursts += [last] if len(last) else []
        return self._since_first([*self._arrived(ended=True), self._host.flush()])

    def _arrived(self, *, ended: bool = False) -> list[FloatArray]:
        """Times of the bursts for which it is known whether samples are missing before them."""
        parts, known = [], 0
        for number in range(len(self._bursts)):
            missing = self._missing(number, ended=ended)
            if missing is None:
                break
            parts.append(self._counted(self._bursts[number], missing))
            known += 1
        del self._bursts[:known]
        return parts

    def _missing(self, number: int, *, ended: bool) -> int | None:
        """Number of samples missing before one of the waiting bursts; None if not yet known."""
        period, first = self._host.period, self._bursts[number]
        if self._end is None or not period or len(self._late) < _WARM_UP_POINTS:
            return 0
        limit = _MIN_LATE_SAMPLES * period
        if float(first[-1]) - self._end - len(first) * period <= limit:
            return 0  # most bursts, for which the jitter need not be known
        limit = max(limit, _LATE_SIGMAS * robust_deviation(self._late))
        least, count = np.inf, 0
        for place in range(number, len(self._bursts)):
            burst = self._bursts[place]
            count += len(burst)
            least = min(least, float(burst[-1]) - self._end - count * period)
            if least <= limit:
                return 0
            caught_up = place - number >= _BURSTS_TO_CATCH_UP
            if caught_up and burst[-1] - first[-1] > _STALL_SECONDS:
                return round(least / period)
        # the recording may end within the last burst, which is then short
        last = number + 1 == len(self._bursts)
        return (0 if last else round(least / period)) if ended else None

    def _counted(self, burst: FloatArray, missing: int) -> FloatArray:
        """Times of a burst before which so many samples are missing."""
        period = self._host.period
        self.lost += missing
        self.away += missing if missing * period > LONG_GAP_SECONDS else 0
        self._count += missing
        if self._end is not None and period:
            self._late.append(float(burst[-1]) - self._end - (len(burst) + missing) * period)
        self._end = float(burst[-1])
        if self._first is None:
            self._first, self._before = float(burst[-1]), len(burst) - 1
        indices = np.arange(self._count, self._count + len(burst), dtype=float)
        self._count += len(burst)
        return self._host.feed(indices, float(burst[-1]))

    def _since_first(self, parts: list[FloatArray]) -> FloatArray:
        times = np.concatenate(parts) if parts else np.zeros(0)
        if len(times) and self._origin is None:
            self._origin = (self._first or 0.0) - self._before * self.period
        return times + (self._origin or 0.0)
