"""The drift of a device: the slope of each parameter over the dates of its calibrations.

The line through the values is weighted by the variance of each calibration plus a variance between
dates (the turn-on spread and all other changes from one measurement to the next). The latter makes
the weighted sum of squares equal to its degrees of freedom (R. C. Paule and J. Mandel, J. Res.
Natl. Bur. Stand. 87, 1982). Two dates cannot show it: their slope has the error of the calibrations
alone.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.dates import SECONDS_PER_DAY, SECONDS_PER_MONTH
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.distributions import two_sided
from imucal_wizard.sessions.history import DeviceHistory, PastParameter

MIN_DRIFT_DAYS = 0.5
"""Calibrations of one day show a scatter and no drift, days."""
MIN_TEMPERATURE_DIFFERENCE = 5.0
"""Difference of temperatures from which they may explain a drift, °C: a bias of consumer grade
moves by 0.1 to 1 mg/°C."""


@dataclass(frozen=True)
class Drift:
    """The course of one parameter over the dates of its calibrations.

    Attributes:
        unit: of the parameter.
        dates: number of calibrations that determine it.
        newest: its newest value, ``unit``.
        newest_error: standard error of that, or None.
        per_month: slope, ``unit`` per month; None where there are no two dates.
        standard_error: of the slope, or None.
        spread: standard deviation between dates beyond the errors of the calibrations, ``unit``;
            None where fewer than three dates cannot show it.
        p: probability of as steep a slope by chance, by Student's t, or None.
    """

    unit: str
    dates: int
    newest: float
    newest_error: float | None
    per_month: float | None = None
    standard_error: float | None = None
    spread: float | None = None
    p: float | None = None


def parameter_course(
    history: DeviceHistory, sensor: str, parameter: str
) -> list[tuple[float, PastParameter, float | None]]:
    """Date (seconds since 1970), value and mean temperature (°C) of a parameter, oldest first.

    Only calibrations in the newest one's unit that determine it: readings in counts of another
    range cannot be compared.
    """
    found = []
    for one in history.calibrations:
        known = one.sensors.get(sensor)
        value = None if known is None else known.parameters.get(parameter)
        if value is not None and value.determined:
            warm = None if one.temperature is None else sum(one.temperature) / 2.0
            found.append((one.measured, value, warm))
    return [row for row in found if row[1].unit == found[-1][1].unit]


def parameter_drifts(history: DeviceHistory) -> dict[str, dict[str, Drift]]:
    """The drift of every parameter of the newest calibration, by sensor and name."""
    found: dict[str, dict[str, Drift]] = {}
    for calibration in history.calibrations[-1:]:
        for sensor, record in calibration.sensors.items():
            courses = {name: parameter_course(history, sensor, name) for name in record.parameters}
            found[sensor] = {name: drift(course) for name, course in courses.items() if course}
    return found


def drift(course: Sequence[tuple[float, PastParameter, float | None]]) -> Drift:
    """The line through the values of one parameter.

    Args:
        course: date, value and temperature, oldest first, at least one.
    """
    newest = course[-1][1]
    about = Drift(newest.unit, len(course), newest.value, newest.standard_error)
    dates = np.array([time for time, _, _ in course]) / SECONDS_PER_MONTH
    values = np.array([one.value for _, one, _ in course])
    errors = [one.standard_error for _, one, _ in course]
    if np.ptp(dates) * SECONDS_PER_MONTH < MIN_DRIFT_DAYS * SECONDS_PER_DAY:
        return about
    known = np.array([error for error in errors if error is not None and error > 0.0])
    if len(known) < len(errors):
        return replace(about, per_month=_line(dates, values, np.ones(len(dates)))[0])
    if len(dates) == 2:
        slope, error, _ = _line(dates, values, known**2)
        return replace(about, per_month=slope, standard_error=error)
    between = _between_dates(dates, values, known**2)
    slope, error, _ = _line(dates, values, known**2 + between)
    return replace(
        about,
        per_month=slope,
        standard_error=error,
        spread=math.sqrt(between),
        p=two_sided(slope / error, len(dates) - 2),
    )


def _line(
    dates: FloatArray, values: FloatArray, variance: FloatArray
) -> tuple[float, float, float]:
    """Slope, its standard error, and weighted sum of squares of a line."""
    weight = 1.0 / variance
    middle = float(weight @ dates / weight.sum())
    away = dates - middle
    information = float(weight @ away**2)
    slope = float(weight @ (away * values)) / information
    rest = values - float(weight @ values / weight.sum()) - slope * away
    return slope, 1.0 / math.sqrt(information), float(weight @ rest**2)


def _between_dates(dates: FloatArray, values: FloatArray, variance: FloatArray) -> float:
    """Variance between dates, by bisection; the weighted sum of squares falls with it."""
    freedom = len(dates) - 2
    if _line(dates, values, variance)[2] <= freedom:
        return 0.0
    low, high = 0.0, float(np.ptp(values)) ** 2
    for _ in range(60):
        middle = 0.5 * (low + high)
        if _line(dates, values, variance + middle)[2] > freedom:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def temperature_note(history: DeviceHistory) -> str:
    """That drift and temperature cannot be separated, where the temperatures differ; else ""."""
    warm = [sum(one.temperature) / 2.0 for one in history.calibrations if one.temperature]
    if not warm or max(warm) - min(warm) < MIN_TEMPERATURE_DIFFERENCE:
        return ""
    return (
        f"the temperatures of the calibrations differ by {max(warm) - min(warm):.0f} °C: what the"
        " temperature changes is part of the drift"
    )
