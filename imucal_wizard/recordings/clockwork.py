"""Clocks that wrap, restart, stumble or are too coarse, put right on whole columns."""

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.devices.clock import WRAP_WITHIN
from imucal_wizard.digits import how_often
from imucal_wizard.readings import BoolArray, FloatArray

_SIZES = (2.0**8, 2.0**16, 2.0**24, 2.0**32)
_NEARLY_FULL = 0.95
_FULL = (2.0**32 / 1e6, 2.0**32 / 1e3, 2.0**16 / 1e3, 86_400.0)
"""Seconds at which 32 bits of micro- and milliseconds, 16 of milliseconds, and a day are full."""
_COARSE = 0.05
"""More equal times than this share mean that the clock ticks more slowly than the samples come."""


def unwrapped(ticks: FloatArray, what: str) -> tuple[FloatArray, tuple[str, ...]]:
    """Whole ticks of 8, 16, 24 or 32 bits that began again at zero, put together.

    A step back by more than half of the counter's size is a wrap when the counter was nearly full.
    """
    back = np.diff(ticks) < 0
    if not back.any() or ticks.min() < 0 or np.any(ticks != np.floor(ticks)):
        return ticks, ()
    top = ticks.max()
    size = next((size for size in _SIZES if _NEARLY_FULL * size <= top < size), None)
    if size is None:
        return ticks, ()
    wraps = np.concatenate([[0], np.cumsum(np.diff(ticks) < -0.5 * size)])
    if not wraps[-1]:
        return ticks, ()
    says = f"the {what} began again at zero {how_often(int(wraps[-1]))}; put together"
    return ticks + wraps * size, (says,)


def rolled_over(time: FloatArray) -> tuple[FloatArray, tuple[str, ...]]:
    """Seconds whose counter was full (of micro- or milliseconds, of a day), put together."""
    steps = np.diff(time)
    rounds = np.zeros(len(steps))
    for size in _FULL:
        rounds[(steps < 0) & (steps + size > 0) & (steps + size <= WRAP_WITHIN)] = size
    times = int((rounds > 0).sum())
    if not times:
        return time, ()
    mended = time + np.concatenate([[0.0], np.cumsum(rounds)])
    return mended, (f"the time began again at zero {how_often(times)}; put together",)


def in_order(
    time: FloatArray, near: float, gap: float, what: str
) -> tuple[FloatArray, NDArray[np.intp], tuple[str, ...]]:
    """Times that never decrease, the places of the samples kept, and what was done.

    Args:
        time: times, shape (n,).
        near: how close the two neighbours of a single wrong time are.
        gap: set before what follows a restart, so that nothing is measured across it.
        what: name of the column.
    """
    kept = np.arange(len(time))
    if np.all(np.diff(time) >= 0):
        return time, kept, ()
    warnings: tuple[str, ...] = ()
    outliers = _outliers(time, near)
    if outliers.any():
        time, kept = time[~outliers], kept[~outliers]
        warnings = (f"{outliers.sum()} samples whose {what} jumps to and fro were left out",)
    back = np.flatnonzero(np.diff(time) < 0) + 1
    if len(back):
        says = (
            f"the {what} goes back {how_often(len(back))}, first after {time[back[0] - 1]:.6g};"
            " what follows was set after a gap (did the device restart?)"
        )
        warnings += (says,)
        shift = np.zeros(len(time))
        shift[back] = time[back - 1] - time[back] + gap
        time = time + np.cumsum(shift)
    return time, kept, warnings


def _outliers(time: FloatArray, near: float) -> BoolArray:
    """Single times that lie outside their two neighbours, which follow one another closely."""
    bad = np.zeros(len(time), bool)
    before, here, after = time[:-2], time[1:-1], time[2:]
    outside = (here < before) | (here > after)
    bad[1:-1] = outside & (after >= before) & (after - before <= near)
    return bad


def spread(time: FloatArray) -> tuple[FloatArray, tuple[str, ...]]:
    """Times of which many are equal, spread evenly up to the next tick; others unchanged."""
    first = np.concatenate([[True], np.diff(time) > 0])
    starts = np.flatnonzero(first)
    if len(starts) < 3 or first.mean() > 1.0 - _COARSE:
        return time, ()
    places = np.arange(len(time))
    even = np.interp(places, starts, time[starts])
    after_last = np.maximum(places - starts[-1], 0)
    even += after_last * (time[-1] - time[0]) / starts[-1]
    return even, ("several samples share one time (a coarse clock); they were spread evenly",)
