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
    coarse = [
        replace(one, field_time=one.field_time[::COARSE_EVERY], field=one.field[::COARSE_EVERY])
        for one in passages
    ]
    costs = [sum(_terms(one, offset)[0] for one in coarse) for offset in OFFSETS_TRIED]
    best = int(np.argmin(costs))
    if best in (0, len(OFFSETS_TRIED) - 1):
        return None
    offset = float(OFFSETS_TRIED[best])
    for _ in range(CLOCK_ITERATIONS):
        parts = np.array([_terms(one, offset) for one in passages])
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


def _terms(one: Passage, offset: float) -> tuple[float, float, float]:
    """Sum of squares of n about its mean, half its slope by τ, and half its curvature."""
    at = one.field_time - offset
    inside = (at >= one.time[0]) & (at < one.time[-1])
    if inside.sum() < 3:
        return 0.0, 0.0, 0.0
    at, field = at[inside], one.field[inside]
    index = np.searchsorted(one.time, at, side="right") - 1
    first, passed = one.rate[index], (at - one.time[index])[:, None]
    whole = (one.time[index + 1] - one.time[index])[:, None]
    rate = first + (one.rate[index + 1] - first) * (passed / whole)
    # within a step the attitude goes on turning: to second order in the angle
    turned = 0.5 * (first + rate) * passed
    near = field + np.cross(turned, field) + 0.5 * np.cross(turned, np.cross(turned, field))
    seen = np.einsum("kij,kj->ki", one.attitude[index], near)
    moving = -np.einsum("kij,kj->ki", one.attitude[index], np.cross(rate, near))
    left, slope = seen - seen.mean(axis=0), moving - moving.mean(axis=0)
    return (
        float((left**2).sum()),
        float((left * slope).sum()),
        float((slope**2).sum()),
    )
