"""Even times of a recording whose given times jitter: rounded ones, or those of arrival."""

from itertools import pairwise

import numpy as np

from imucal_wizard.acquire.clock import LONG_GAP_SECONDS
from imucal_wizard.core.limits.data_quality import MAX_STEP_RATIO, RESTART_GAP_SECONDS
from imucal_wizard.core.readings import ComplexArray, FloatArray, across_restarts
from imucal_wizard.core.statistics import median

_JITTER_SAMPLES = 100
"""Samples over which a jitter averages to nothing, and times that wander have wandered off."""
_MIN_JITTER = 0.05
"""Jitter of the steps in sampling intervals below which it does not matter."""
_MAX_WANDER = 0.3
"""Growth of the deviation from even times in that many samples, over that of independent steps."""
_MIN_RESULTANT = 0.3
"""Mean resultant length of the phases of so many samples, below which they lie about no even times:
a uniform jitter by ±0.375 intervals gives 0.3, and independent phases give 0.06."""


def without_jitter(time: FloatArray) -> FloatArray | None:
    """The even times about which given ones jitter; None if they do not jitter, or wander.

    A sensor measures by its own clock, and whoever reads it takes the time later, by a delay that
    varies but does not add up. Where the steps themselves vary, their sum wanders off any even
    course: then each sample was measured at its own time.

    Args:
        time: s, shape (n,), never decreasing.
    """
    steps = np.diff(time)
    usual = steps[steps <= MAX_STEP_RATIO * median(steps)] if len(steps) else steps
    period = float(usual.mean()) if len(usual) > 2 * _JITTER_SAMPLES else 0.0
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
    return np.maximum.accumulate(np.concatenate(even))


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
    slow = np.unwrap(np.angle(_running_mean(np.exp(1j * angle))))
    if len(time) > 2 * _JITTER_SAMPLES:  # the interval is a little longer or shorter
        angle -= angle * (angle @ (slow - slow.mean()) / (angle @ (angle - angle.mean())))
    phases = np.exp(1j * angle)
    near = _running_mean(phases)
    late = np.angle(phases * near.conj())
    slow = np.unwrap(np.angle(near))
    second = period / (2.0 * np.pi)
    return second * late, second * (slow - slow.mean()), np.abs(near)


def _running_mean(values: ComplexArray) -> ComplexArray:
    """Mean of each value and its neighbours; at the ends that of the first and last ones."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    width = min(2 * _JITTER_SAMPLES + 1, len(values))
    first = np.clip(np.arange(len(values)) - _JITTER_SAMPLES, 0, len(values) - width)
    return np.asarray((sums[first + width] - sums[first]) / width)
