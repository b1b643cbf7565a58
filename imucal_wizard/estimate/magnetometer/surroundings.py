"""The circumstances of a magnetometer's samples: temperature and current as recorded beside it."""

from dataclasses import replace

import numpy as np

from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.estimate.magnetometer.pieces import Pieces
from imucal_wizard.model.effect import Circumstances, FieldUnit

CURRENT_REACH_SECONDS = 5.0
"""Seconds from where a current was recorded within which it is taken to flow still."""


def beside_at(series: Series | None, time: FloatArray) -> FloatArray:
    """A slower series at other times, in between by straight lines; NaN without one."""
    if series is None or not len(series):
        return np.full(len(time), np.nan)
    return np.interp(time, series.time, series.values[:, 0])


def current_at(series: Series | None, time: FloatArray) -> FloatArray:
    """A current or throttle at other times, shape (n,); NaN far from where it was recorded."""
    values = beside_at(series, time)
    if series is None or not len(series):
        return values
    ends = np.concatenate([[-np.inf], series.time, [np.inf]])
    after = np.searchsorted(series.time, time) + 1
    away = np.minimum(time - ends[after - 1], ends[after] - time)
    return np.where(away <= CURRENT_REACH_SECONDS, values, np.nan)


def flows(series: Series | None) -> bool:
    """Whether a current was recorded that changes, and so may explain what looks disturbed."""
    return series is not None and len(series) > 1 and float(np.ptp(series.values)) > 0.0


def recorded(time: FloatArray, readings: Readings | None) -> FloatArray:
    """Temperature, °C, and current at these times, NaN where unknown, shape (n, 2)."""
    if readings is None:
        return np.full((len(time), 2), np.nan)
    temperature = beside_at(readings.temperature, time)
    return np.column_stack([temperature, current_at(readings.current, time)])


CLEAR_SLOPE = 5.0
"""Standard errors from which on the field is known to jump with the current."""


def by_current(values: FloatArray, current: FloatArray) -> FloatArray:
    """By how much the readings jump when the current does, per unit of it, shape (3,).

    Only to judge noise and disturbances, without a model: by second differences, in which a
    current that is switched stands out from the turning of the device. Zero where no current is
    known everywhere or the readings do not follow it.

    Args:
        values: readings in the order of time, shape (n, 3).
        current: beside them, NaN where unknown, shape (n,).
    """
    jumps, change = np.diff(current, 2), np.diff(values, 2, axis=0)
    square = float(jumps @ jumps)
    if not 0.0 < square < np.inf:
        return np.zeros(3)
    slope = jumps @ change / square
    error = np.sqrt(((change - np.outer(jumps, slope)) ** 2).mean(axis=0) / square)
    return np.where(np.abs(slope) > CLEAR_SLOPE * error, slope, 0.0)


def part_of_current(current: FloatArray, slope: FloatArray) -> FloatArray:
    """What a current adds to the readings, about its mean, shape (n, 3)."""
    if not slope.any():
        return np.zeros((len(current), 3))
    return np.outer(current - current.mean(), slope)


def around(
    time: FloatArray,
    magnetic: FloatArray,
    beside: FloatArray,
    readings: Readings | None,
    gravity: float,
    unit: FieldUnit,
) -> Circumstances:
    """Circumstances of means of samples.

    Args:
        time: mean times, s, shape (n,).
        magnetic: mean corrected field, shape (n, 3).
        beside: mean temperature and current, see ``recorded``.
        readings: the recording: where the session begins, the unit of the current.
        gravity: m/s².
        unit: of the field.
    """
    unknown = np.full((len(time), 3), np.nan)
    current = None if readings is None else readings.current
    return Circumstances(
        force=unknown,
        rate=np.zeros((len(time), 3)),
        temperature=beside[:, 0],
        time=time - _origin(time, readings),
        previous=unknown,
        vibration=np.full(len(time), np.nan),
        magnetic=magnetic,
        current=beside[:, 1],
        current_unit="A" if current is None else current.unit,
        gravity=gravity,
        field_unit=unit,
    )


def _origin(time: FloatArray, readings: Readings | None) -> float:
    """Time of the session's first sample, s."""
    if readings is None:
        return float(time.min(initial=np.inf)) if len(time) else 0.0
    first = readings.accelerometer.time[:1]
    if readings.magnetometer is not None:
        first = np.concatenate([first, readings.magnetometer.time[:1]])
    return float(first.min())


def within(data: Circumstances, pieces: Pieces) -> Circumstances:
    """Circumstances of the groups from those of their pieces."""
    field = pieces.mean(data.magnetic)
    count = len(field)
    return replace(
        data,
        force=np.full((count, 3), np.nan),
        rate=np.zeros((count, 3)),
        temperature=pieces.mean(data.temperature),
        time=pieces.mean(data.time),
        previous=np.full((count, 3), np.nan),
        vibration=np.full(count, np.nan),
        magnetic=field,
        current=pieces.mean(data.current),
    )
