"""Whether a thermometer may read the temperature that a course of the bias follows.

A thermometer has steps, and one away from the chip is late. The recorded temperature then has
another course than that of the chip, and an effect of the temperature fits worse than a course that
was not recorded: a warm-up, or a warm-up with a drift. The data cannot tell such a course from an
effect of the temperature if the thermometer, with its steps and its delay, would have read what was
recorded while the temperature of the chip followed the course.
"""

import numpy as np

from imucal_wizard.core.readings import FloatArray, distinct
from imucal_wizard.core.statistics import root_mean_square
from imucal_wizard.model.effect import Circumstances
from imucal_wizard.model.requirements import MIN_TEMPERATURE_SWING

THERMOMETER_STEP = 1.0 / 16.0
"""Step of a usual thermometer of a chip, °C: the least that is taken for the error of one."""
DELAYS = (0.0, 15.0, 30.0, 60.0)
"""How late a thermometer may be, s: up to twice the typical lag of a bias (``thermal-lag``)."""
MAX_ROUNDING = 1.0 / 3.0
"""Error of a rounded temperature, rms in steps: 1/√12 over many steps, up to 1/2 within one."""
SAME_DIGITS = 6
"""Decimals in which means of one step agree, °C."""
MIN_ON_STEPS = 0.6
"""Share of the means that are whole steps apart; half of them are even steps apart."""


def delay_of_thermometer(c: Circumstances, courses: FloatArray) -> float | None:
    """The least delay with which a thermometer reads a temperature that follows courses.

    Args:
        c: one row per hold, with the recorded temperature.
        courses: of the temperature of the chip, of which any sum may be, shape (n, k).

    Returns:
        s; None where the recorded temperature is no reading of any such temperature.
    """
    count, k = courses.shape
    if not np.isfinite(c.temperature).all() or count <= k + 2:
        return None
    error = MAX_ROUNDING * step_of(c.temperature)
    for delay in DELAYS:
        late = _late(c.time, courses, delay)
        # the difference between both where the session begins passes with the delay
        begun = np.exp(-(c.time - c.time[0]) / delay)[:, None] if delay else np.zeros((count, 0))
        columns = np.column_stack([np.ones(count), begun, late - late.mean(axis=0)])
        weights = np.linalg.lstsq(columns, c.temperature, rcond=None)[0]
        swing = float(np.ptp(late @ weights[-k:]))
        if swing < MIN_TEMPERATURE_SWING:
            continue
        if root_mean_square(c.temperature - columns @ weights) <= error:
            return delay
    return None


def step_of(temperature: FloatArray) -> float:
    """Step of a thermometer by its means over holds, °C: most of them are whole steps apart.

    The mean of a hold in which it changes lies between two. Where most are such means, as noise
    makes them, the mean is finer than the steps.
    """
    known = distinct(np.round(temperature, SAME_DIGITS))
    apart = distinct(np.concatenate([np.diff(known), known[2:] - known[:-2]]))
    for step in apart[apart > THERMOMETER_STEP][::-1].tolist():
        places = np.sort((temperature - temperature.min()) / step % 1.0)
        near = 10.0**-SAME_DIGITS / step
        # the first again after the last: 0 and 1 are the same place
        ends = np.searchsorted(np.concatenate([places, places + 1.0]), places + 2.0 * near)
        if (ends - np.arange(len(places))).max() >= MIN_ON_STEPS * len(places):
            return float(step)
    return THERMOMETER_STEP


def _late(time: FloatArray, courses: FloatArray, delay: float) -> FloatArray:
    """Courses as something that follows them exponentially, constant before the first row."""
    if not delay:
        return courses
    seconds = np.arange(time[0], time[-1] + 1.0)
    follows = np.exp(-np.arange(min(len(seconds), int(8.0 * delay))) / delay)
    found = []
    for course in courses.T:
        changes = np.diff(np.interp(seconds, time, course), prepend=course[0])
        behind = np.convolve(changes, follows)[: len(seconds)]
        found.append(course - np.interp(time, seconds, behind))
    return np.column_stack(found)
