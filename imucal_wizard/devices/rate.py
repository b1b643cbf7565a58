"""Samples per second: from the times a device gives, or from when its samples arrive."""

import numpy as np

from imucal_wizard.readings import FloatArray


def period_of(times: FloatArray) -> float:
    """The sampling period from a few device times, s; 0 where time does not run.

    Gaps and backward jumps are left out. Where the printed time is coarser than the period, equal
    times are part of the mean.

    Args:
        times: shape (n,), s, as the device gave them.
    """
    steps = np.diff(times)
    forward = steps[steps > 0]
    if not len(forward):
        return 0.0
    middle = float(np.median(forward))
    low, high = (0.0, 2.5 * middle) if quantum_of(times) else (0.5 * middle, 1.5 * middle)
    return float(np.mean(steps[(steps >= low) & (steps <= high)]))


def quantum_of(times: FloatArray) -> float:
    """The step of a printed time that is coarser than the sampling period, s; 0 where it is finer.

    Args:
        times: shape (n,), s, as the device gave them.
    """
    steps = np.diff(times)
    if not len(steps) or float(np.mean(steps == 0)) <= 0.1 or not np.any(steps > 0):
        return 0.0
    return float(np.min(steps[steps > 0]))


class RateFit:
    """Least squares of arrival over index, one point at a time.

    Bursts of a serial link move single arrivals by tens of milliseconds; the slope over seconds
    of them is good to 0.05 % after 5 s and to 0.002 % after 30 s.
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
        """One chunk: the index of its last sample and when it arrived, s."""
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
        """How many arrivals have been seen."""
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
        """When a sample of this index should arrive, s."""
        return self._mean_arrival + (index - self._mean_index) * self.period
