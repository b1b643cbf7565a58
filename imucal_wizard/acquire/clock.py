"""Converts device ticks and counters to seconds: wraps, lost samples, restarts."""

import numpy as np

from imucal_wizard.core.limits.data_quality import RESTART_GAP_SECONDS
from imucal_wizard.core.readings import FloatArray, across_restarts

LONG_GAP_SECONDS = 1.0
"""s; after a longer gap the device was away, and no samples count as dropped."""
_LONGEST_GAP = 3600.0
"""s; a longer step means that the clock was set."""
MAX_WRAP_STEP_SECONDS = 2.0
"""s; a step back that lands this close behind a full counter is a wrap and not a restart."""


class DeviceClock:
    """Converts the device's own time to seconds.

    The result depends only on the ticks, not on arrival times or on how the bytes were divided. The
    attributes ``wraps``, ``restarts`` and ``jumps`` count events.

    Args:
        factor: seconds per tick.
        period: sampling period, s, for counting lost samples.
        quantum: resolution of the printed time, s, if it is coarser than the period, so that equal
            times are normal; otherwise 0.
        from_zero: whether the first sample is at 0 s; otherwise the device's own origin is kept, so
            that files of one session fit together.
    """

    def __init__(
        self, factor: float, period: float, quantum: float = 0.0, *, from_zero: bool = True
    ) -> None:
        self._from_zero = from_zero
        self._factor = factor
        self._period = period
        self._limit = 1.5 * period + quantum
        self._smoother = TimeSmoother(period, quantum + 2.0 * period) if quantum else None
        self._moduli = (2.0**32, 2.0**32 / 1e3, 2.0**32 / 1e6, 2.0**16, 86400.0 / factor)
        self._base = 0.0
        self._offset = 0.0
        self._last: float | None = None
        self._last_time = 0.0
        self._lost = 0
        self._away = 0
        self.wraps = 0
        self.restarts = 0
        self.jumps = 0

    @property
    def lost(self) -> int:
        """Number of lost samples by the device's time."""
        return self._smoother.lost if self._smoother else self._lost

    @property
    def away(self) -> int:
        """Number of samples lost in long gaps."""
        return self._smoother.away if self._smoother else self._away

    def feed(self, ticks: FloatArray) -> FloatArray:
        """Times of these samples, s, never decreasing.

        Args:
            ticks: device times, shape (n,), finite.
        """
        if not len(ticks):
            return np.zeros(0)
        if self._last is None:
            self._last = float(ticks[0])
            self._base = self._last if self._from_zero else 0.0
        steps = np.diff(ticks, prepend=self._last) * self._factor
        times = (ticks - self._base) * self._factor + self._offset
        for i in np.flatnonzero((steps < 0) | (steps > self._limit)):
            before = float(times[i - 1]) if i else self._last_time
            step = self._odd_step(float(steps[i]))
            if step != steps[i]:
                self._base, self._offset = float(ticks[i]), before + step
                times[i:] = (ticks[i:] - self._base) * self._factor + self._offset
        self._last, self._last_time = float(ticks[-1]), float(times[-1])
        return self._smoother.feed(times) if self._smoother else times

    def _odd_step(self, step: float) -> float:
        """The true duration of an unusual step, s: a gap, a wrap, or a new segment."""
        if step < 0:
            for modulus in self._moduli:
                unwrapped = step + modulus * self._factor
                if 0 < unwrapped <= MAX_WRAP_STEP_SECONDS:
                    self.wraps += 1
                    self._count_lost(unwrapped)
                    return unwrapped
            self.restarts += 1
            return RESTART_GAP_SECONDS
        if step > _LONGEST_GAP:
            self.jumps += 1
            return RESTART_GAP_SECONDS
        self._count_lost(step)
        return step

    def _count_lost(self, step: float) -> None:
        if step > self._limit:
            missing = round(step / self._period) - 1
            self._lost += missing
            self._away += missing if step > LONG_GAP_SECONDS else 0


class TimeSmoother:
    """Derives even times from coarse or jittering ones by a phase-locked loop over the samples.

    At 8,000 samples/s, times in milliseconds are eight equal values and then a step. The loop
    follows their mean with a time constant of a hundred samples.

    Args:
        period: sampling period, s.
        limit: delay from which samples are missing, s.
        last: even time of the sample before the first one, s, if known.
    """

    _PHASE, _FREQUENCY = 0.02, 1e-4

    def __init__(self, period: float, limit: float, last: float | None = None) -> None:
        self._nominal = self._period = period
        self._limit = limit
        self._time = last
        self._given = np.nan
        self.lost = 0
        self.away = 0

    def feed(self, times: FloatArray) -> FloatArray:
        """Even times of these samples, s, never decreasing.

        Args:
            times: given times, s, shape (n,), never decreasing.
        """
        return np.array([self._next(t) for t in times.tolist()])

    def _next(self, coarse: float) -> float:
        step, self._given = coarse - self._given, coarse
        if self._time is None:
            self._time = coarse
            return coarse
        error = coarse - (self._time + self._period)
        if error > self._limit and across_restarts(np.array([step])).any():
            self._time += RESTART_GAP_SECONDS  # its length is a sign, and not measured
            return self._time
        if error > self._limit:  # samples are missing: keep the phase, skip whole periods
            missing = max(1, round(error / self._period))
            self.lost += missing
            self.away += missing if error > 0.9 * LONG_GAP_SECONDS else 0
            self._time += (missing + 1) * self._period
            return self._time
        self._time += max(0.0, self._period + self._PHASE * error)
        wanted = self._period + self._FREQUENCY * error
        self._period = min(max(wanted, 0.8 * self._nominal), 1.25 * self._nominal)
        return self._time


class SampleCounter:
    """Converts the device's sample counter, of any width, to a running index.

    Each row passes at once, so a row that comes late is not told from a restart: it is kept, after
    a gap.
    """

    _MODULI = (2.0**8, 2.0**16, 2.0**32)

    def __init__(self) -> None:
        self._last: float | None = None
        self._index = -1.0
        self.lost = 0
        self.restarts = 0

    def feed(self, counts: FloatArray, gap: float = 1.0) -> FloatArray:
        """The index of each sample, strictly increasing; lost samples leave gaps.

        Args:
            counts: values of the counter, shape (n,), finite.
            gap: number of samples in ``RESTART_GAP_SECONDS``, inserted when the counter restarts.
        """
        out = np.empty(len(counts))
        for i, count in enumerate(counts.tolist()):
            self._index += self._step(count, max(gap, 1.0))
            self._last = count
            out[i] = self._index
        return out

    def _step(self, count: float, gap: float) -> float:
        if self._last is None:
            return 1.0
        step = count - self._last
        if step <= 0:
            near = [step + m for m in self._MODULI if 0 < step + m <= m / 4]
            step = near[0] if near else 0.0
        if step <= 0 or step > 1e6:  # it restarted; the loss is unknown
            self.restarts += 1
            return gap
        self.lost += int(step) - 1
        return step
