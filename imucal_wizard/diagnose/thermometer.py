"""Whether a thermometer may read the temperature that a course of the bias follows.

A thermometer has steps, and one away from the chip is late. The recorded temperature then has
another course than that of the chip, and an effect of the temperature fits worse than a course that
was not recorded: a warm-up, or a warm-up with a drift. The data cannot tell such a course from an
effect of the temperature if the thermometer, with its steps and its delay, would have read what was
recorded while the temperature of the chip followed the course.
"""

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.statistics import median, root_mean_square
from imucal_wizard.model.effect import Circumstances
from imucal_wizard.model.requirements import MIN_TEMPERATURE_SWING

THERMOMETER_STEP = 1.0 / 16.0
"""Step of a usual thermometer of a chip, °C: the least that is taken for the error of one."""
DELAYS = tuple(range(0, 65, 5))
"""How late a thermometer may be, s: up to twice the typical lag of a bias (``thermal-lag``)."""
MAX_ROUNDING = 1.0 / 3.0
"""Error of a rounded temperature, rms in steps: 1/√12 over many steps, up to 1/2 within one."""
ONE_VALUE = 1e-6
"""Temperatures that differ by less are of the same step, °C."""


def delay_of_thermometer(c: Circumstances, courses: FloatArray, step: float) -> float | None:
    """The least delay with which a thermometer reads a temperature that follows courses.

    Args:
        c: one row per hold, with the recorded temperature.
        courses: of the temperature of the chip, of which any sum may be, shape (n, k).
        step: of the thermometer, °C.

    Returns:
        s; None where the recorded temperature is no reading of any such temperature.
    """
    count, k = courses.shape
    if not np.isfinite(c.temperature).all() or count <= k + 2:
        return None
    error = MAX_ROUNDING * step
    for delay in DELAYS:
        late = _late(c.time, courses, delay)
        # what differs when the session begins decays with the delay
        begun = np.exp((c.time[0] - c.time) / delay)[:, None] if delay else np.zeros((count, 0))
        columns = np.column_stack([np.ones(count), begun, late - late.mean(axis=0)])
        weights = np.linalg.lstsq(columns, c.temperature, rcond=None)[0]
        swing = float(np.ptp(late @ weights[-k:]))
        if swing < MIN_TEMPERATURE_SWING:
            continue
        if root_mean_square(c.temperature - columns @ weights) <= error:
            return float(delay)
    return None


def step_of(temperature: FloatArray) -> float:
    """Step of a thermometer, °C: between the values that come again.

    Where most differ, its noise makes them means of several steps, which are finer.

    Args:
        temperature: as recorded, or the means of holds, shape (n,).
    """
    ordered = np.sort(temperature[np.isfinite(temperature)])
    starts = np.flatnonzero(np.diff(ordered, prepend=-np.inf) > ONE_VALUE)
    counts = np.diff(starts, append=len(ordered))
    again = ordered[starts[counts > 1]]
    if len(again) < 2 or 2 * int(counts[counts > 1].sum()) < len(ordered):
        return THERMOMETER_STEP
    return max(median(np.diff(again)), THERMOMETER_STEP)


def _late(time: FloatArray, courses: FloatArray, delay: int) -> FloatArray:
    """Courses as something that follows them exponentially, constant before the first row."""
    if not delay:
        return courses
    seconds = np.arange(time[0], time[-1] + 1.0)
    follows = np.exp(-np.arange(min(len(seconds), 8 * delay)) / delay)
    found = []
    for course in courses.T:
        changes = np.diff(np.interp(seconds, time, course), prepend=course[0])
        behind = np.convolve(changes, follows)[: len(seconds)]
        found.append(course - np.interp(time, seconds, behind))
    return np.column_stack(found)
