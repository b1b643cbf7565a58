"""The constant offset between two sensors' clocks, from the field seen while the device turns.

Carried into the frame in which a turn began, ``n_k = A(t_k − τ) R m_k``, the field stands still; it
does so only for the right offset τ. A is the attitude integrated from the gyroscope, and
``∂n/∂τ = −A (w × R m)``, so that τ follows by Gauss–Newton from the best point of a coarse grid.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass

OFFSETS_TRIED = np.linspace(-0.5, 0.5, 51)
"""Offsets tried, s: more is not one device's."""
COARSE_EVERY = 4
"""On the grid only every fourth sample of the field is looked at."""
CLOCK_ITERATIONS = 20
MIN_CLOCK_TURNS = 3
"""Turns."""
LARGEST_CLOCK_ERROR = 0.02
"""Standard error, s, beyond which nothing is known of the clocks."""


@dataclass(frozen=True, eq=False)
class Passage:
    """One turn as both sensors saw it.

    Attributes:
        time: gyroscope's sample times, s, shape (n,).
        attitude: from the body at each of them to the body at the first, shape (n, 3, 3).
        rate: calibrated rate, rad/s, shape (n, 3).
        field_time: magnetometer's sample times by its own clock, s, shape (k,).
        field: calibrated unit field in the accelerometer's frame, shape (k, 3).
    """

    time: FloatArray
    attitude: FloatArray
    rate: FloatArray
    field_time: FloatArray
    field: FloatArray


@dataclass(frozen=True)
class ClockOffset:
    """The magnetometer's clock minus the other's.

    Attributes:
        seconds: the offset.
        standard_error: s.
    """

    seconds: float
    standard_error: float


def clock_offset(passages: Sequence[Passage]) -> ClockOffset | None:
    """The offset τ, or None when the turns do not show it."""
    if len(passages) < MIN_CLOCK_TURNS:
        return None
    turns = Turns(passages)
    coarse = Turns(
        [
            replace(one, field_time=one.field_time[::COARSE_EVERY], field=one.field[::COARSE_EVERY])
            for one in passages
        ]
    )
    costs = [coarse.terms(offset)[:, 0].sum() for offset in OFFSETS_TRIED]
    best = int(np.argmin(costs))
    if best in (0, len(OFFSETS_TRIED) - 1):
        return None
    offset = float(OFFSETS_TRIED[best])
    for _ in range(CLOCK_ITERATIONS):
        parts = turns.terms(offset)
        _, slope, square = parts.sum(axis=0)
        if square <= 0.0:
            return None
        step = -slope / square
        offset += step
        if abs(step) < 1e-7:
            break
    error = _jackknife(parts)
    return ClockOffset(float(offset), error) if error < LARGEST_CLOCK_ERROR else None


def _jackknife(parts: FloatArray) -> float:
    """Standard error from the offsets that all turns but one would give.

    Within a turn the errors follow one another (calibration, drift of the attitude), so that turns
    and not samples are what is independent.
    """
    rest = parts.sum(axis=0) - parts
    if rest[:, 2].min() <= 0.0:  # one turn alone carries it
        return np.inf
    steps = -rest[:, 1] / rest[:, 2]
    count = len(parts)
    return float(np.sqrt((count - 1.0) / count * ((steps - steps.mean()) ** 2).sum()))


class Turns:
    """All turns, whose samples follow one another, so that an offset is tried on all at once."""

    def __init__(self, passages: Sequence[Passage]) -> None:
        self._times = [one.time for one in passages]
        self._first = np.cumsum([0, *map(len, self._times)])
        self._field_times = [one.field_time for one in passages]
        self._turn = np.repeat(np.arange(len(passages)), [*map(len, self._field_times)])
        self._time = np.concatenate(self._times)
        self._field_time = np.concatenate(self._field_times)
        self._attitude = np.concatenate([one.attitude for one in passages])
        self._rate = np.concatenate([one.rate for one in passages])
        self._field = np.concatenate([one.field for one in passages])

    def terms(self, offset: float) -> FloatArray:
        """Sum of squares of n about its mean, half its slope by τ, half its curvature, (turns, 3).

        All are zero for a turn with fewer than three samples of the field.
        """
        found = np.zeros((len(self._times), 3))
        each = zip(self._times, self._field_times, strict=True)
        place = np.concatenate(
            [time.searchsorted(at - offset, side="right") - 1 for time, at in each]
        )
        inside = (place >= 0) & (place < np.diff(self._first)[self._turn] - 1)
        enough = np.bincount(self._turn[inside], minlength=len(self._times)) >= 3
        used = inside & enough[self._turn]
        if not used.any():
            return found
        turn, field = self._turn[used], self._field[used]
        index = place[used] + self._first[turn]
        passed = (self._field_time[used] - offset - self._time[index])[:, None]
        whole = (self._time[index + 1] - self._time[index])[:, None]
        first = self._rate[index]
        rate = first + (self._rate[index + 1] - first) * (passed / whole)
        # within a step the attitude goes on turning: to second order in the angle
        turned = 0.5 * (first + rate) * passed
        across = np.cross(turned, field)
        near = field + across + 0.5 * np.cross(turned, across)
        # n and its derivative, in the frame in which the turn began
        both = np.stack([near, -np.cross(rate, near)], axis=2)
        seen = self._attitude[index] @ both
        begins = np.flatnonzero(np.diff(turn, prepend=-1))
        count = np.diff(np.append(begins, len(turn)))
        mean = np.add.reduceat(seen, begins) / count[:, None, None]
        left, slope = np.moveaxis(seen - np.repeat(mean, count, axis=0), 2, 0)
        products = np.stack([left**2, left * slope, slope**2]).sum(axis=2)
        found[turn[begins]] = np.add.reduceat(products, begins, axis=1).T
        return found
