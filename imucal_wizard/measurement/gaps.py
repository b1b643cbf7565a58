"""Samples that are missing in a rotation: whether the angle across them is known all the same.

A rate changes little in some hundredths of a second, and the cubic between the samples on either
side of a gap stands for those that are missing. How wrong its integral is, the rates around the gap
tell: there the same number of samples is left out as well, and the integral compared with the whole
one. The noise of the samples is in the difference, as it is in the gap.
"""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.limits.data_quality import (
    GAP_REACH_SECONDS,
    MAX_GAP_VARIANCE,
    MIN_PLACES_AROUND_GAP,
)
from imucal_wizard.core.notices import Notice, NoticeKind
from imucal_wizard.core.readings import (
    MAX_SAMPLE_INTERVALS,
    FloatArray,
    Series,
    across_restarts,
)
from imucal_wizard.measurement.holds import Hold

NODES = 3
"""Samples to either side of a gap that take part: the slope at each end of the gap is that of the
parabola through its neighbours, and the step beside the gap has that slope too."""


def gap_problem(part: Series, interval: float, before: Hold, after: Hold) -> str | None:
    """Why the angle of a rotation is not known for missing samples; None if it is.

    Args:
        part: the gyroscope from inside the hold before to inside the hold after, not empty.
        interval: of the samples, s.
        before: the hold before the rotation.
        after: the hold after it.
    """
    whole = np.concatenate(
        [[min(before.end, part.time[0])], part.time, [max(after.start, part.time[-1])]]
    )
    gap, unknown = float(np.diff(whole).max()), "the angle in it is not known"
    if gap <= MAX_SAMPLE_INTERVALS * interval:
        return None
    if across_restarts(np.array([gap])).any():
        return f"the recording was interrupted in it: {unknown}"
    at_an_end = max(whole[1] - whole[0], whole[-1] - whole[-2]) > MAX_SAMPLE_INTERVALS * interval
    most = MAX_GAP_VARIANCE * _noise((before, after), float(part.time[-1] - part.time[0]))
    if not at_an_end and (error_across_gaps(part.time, part.values, interval) <= most).all():
        return None
    text = f"a gap of {gap:.2f} s in its time stamps: {unknown}"
    return Notice(text, NoticeKind.GAP, "gyroscope")


def _noise(holds: Sequence[Hold], seconds: float) -> FloatArray:
    """Variance of the integral of each axis by the noise of the rates, as holds show it, (3,)."""
    each = [
        (one.end - one.start) * np.diag(one.gyroscope_covariance)
        for one in holds
        if one.gyroscope_covariance is not None
    ]
    return np.asarray(seconds * np.mean(each, axis=0)) if each else np.zeros(3)


def error_across_gaps(time: FloatArray, reading: FloatArray, interval: float) -> FloatArray:
    """Variance of the integral of each axis by the samples that are missing, shape (3,).

    Infinite where the rates around a gap do not show it.

    Args:
        time: of the samples of a rotation, s, shape (n,).
        reading: shape (n, 3).
        interval: of the samples, s.
    """
    total, steps = np.zeros(3), np.diff(time)
    for gap in np.flatnonzero(steps > MAX_SAMPLE_INTERVALS * interval).tolist():
        if not NODES <= gap + 1 <= len(time) - NODES:
            return np.full(3, np.inf)
        missing = round(float(steps[gap]) / interval) - 1
        count, reach = missing + 2 * NODES, round(GAP_REACH_SECONDS / interval)
        begin, end = max(gap - reach - count, 0), min(gap + reach + 2, len(time) - count + 1)
        if end - begin < MIN_PLACES_AROUND_GAP:
            return np.full(3, np.inf)
        first = np.arange(begin, end)
        windows = first[:, None] + np.arange(count)
        each = np.diff(time[windows], axis=1)
        even = ((each > 0.0) & (each <= MAX_SAMPLE_INTERVALS * interval)).all(axis=1)
        middle = time[windows].mean(axis=1) - time[gap : gap + 2].mean()
        near = even & (np.abs(middle) <= GAP_REACH_SECONDS + 0.5 * float(steps[gap]))
        if near.sum() < MIN_PLACES_AROUND_GAP:
            return np.full(3, np.inf)
        when, rate = time[windows[near]], reading[windows[near]]
        left = [*range(NODES), *range(count - NODES, count)]
        off = _integral(when, rate) - _integral(when[:, left], rate[:, left])
        total += (off**2).mean(axis=0)
    return total


def _integral(time: FloatArray, rate: FloatArray) -> FloatArray:
    """Integrals from the second to the last but one of n samples, by cubics, shape (k, 3).

    As ``core.attitude`` takes them, with slopes of the parabolas through neighbours.

    Args:
        time: shape (k, n).
        rate: shape (k, n, 3).
    """
    step = np.diff(time, axis=1)[:, :, None]
    rise = np.diff(rate, axis=1) / step
    earlier, later = step[:, :-1], step[:, 1:]
    slope = (later * rise[:, :-1] + earlier * rise[:, 1:]) / (earlier + later)
    inner, own = step[:, 1:-1], rate[:, 1:-1]
    pieces = 0.5 * inner * (own[:, 1:] + own[:, :-1])
    pieces += inner**2 / 12.0 * (slope[:, :-1] - slope[:, 1:])
    return np.asarray(pieces.sum(axis=1))
