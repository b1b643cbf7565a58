"""What two seconds of samples show that a user should know. Each check gives one sentence or "".

Every sentence says what was seen and what to do.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard import units
from imucal_wizard.devices.gravity import GUESSED, unit_of_gravity
from imucal_wizard.readings import FloatArray

_AXES = "xyz"
_RUN = 4
"""So many equal extremes in a row are no chance."""
_JUMP = 5
"""Steps of the readings from which on a run of equal extremes is entered at once."""
_REPEATS = 0.2
"""Share of samples like the one before, from which the device prints faster than it measures."""
_ZEROS = 0.5
"""Share of samples that turn at exactly nothing, from which that is no chance."""
_NO_GRAVITY = 2.0
"""m/s²: less is gravity by no unit that is taken for another."""
_AT_REST = 0.03
"""Share of itself by which the size of gravity varies at most while the device lies still."""
_OTHER_UNIT = 0.2
"""Share of gravity by which no sensor is off whose unit is right."""
_LIKE_GRAVITY, _STEADILY = 0.15, 0.05
"""Shares by which what feels gravity is off one g, and varies, at most."""
_TAKEN_FOR = 0.1
"""The same as the first of them, where the mistake of units is named."""
_COARSE_FORCE, _COARSE_RATE = 0.004, 0.002
"""Printed steps, m/s² and rad/s, that hide the noise of a consumer sensor."""
_LEAST_FORCE = 1.7 * units.STANDARD_GRAVITY
"""Below this no accelerometer ends: the smallest usual range is ±2 g."""
_LEAST_RATE = 2.0
"""Below this no gyroscope ends, rad/s: the smallest usual range is ±125 °/s, 2.18 rad/s."""
_SMALLEST_SPAN = 1000.0
"""Counts over which an axis must have moved before its farthest value can be an end."""


@dataclass(frozen=True, eq=False)
class Window:
    """Some consecutive samples.

    Attributes:
        acceleration: shape (n, 3), in m/s² or counts.
        rate: shape (n, 3), in rad/s or counts; None without gyroscope.
        acceleration_unit: ``m/s^2`` or ``count``.
        rate_unit: ``rad/s`` or ``count``.
    """

    acceleration: FloatArray
    rate: FloatArray | None
    acceleration_unit: str
    rate_unit: str = ""


def repeated(window: Window) -> str:
    """Samples that are the same as the one before in every axis."""
    values = window.acceleration
    if window.rate is not None:
        values = np.hstack((values, window.rate))
    share = float(np.mean(np.all(np.diff(values, axis=0) == 0, axis=1)))
    if not _REPEATS < share < 1.0:
        return ""
    return (
        f"{share:.0%} of the samples repeat the one before: the device prints faster than its "
        f"sensor measures, or too few digits. Print once per new measurement, or the noise and "
        f"the stillness limits come out wrong."
    )


def frozen(window: Window) -> str:
    """Not one value changes."""
    values = window.acceleration
    if window.rate is not None:
        values = np.hstack((values, window.rate))
    if not bool(np.all(values == values[0])):
        return ""
    return (
        "No value changes at all: the sensor does not answer and its last values are printed, or "
        "so few digits that no noise is seen. Check its wiring, and print more digits."
    )


def gravity(window: Window) -> str:
    """The size of gravity does not fit the unit."""
    if window.acceleration_unit != "m/s^2":
        return ""
    sizes = np.linalg.norm(window.acceleration, axis=1)
    size = float(np.median(sizes))
    if size < _NO_GRAVITY and _feels_gravity(window.rate, window.rate_unit):
        return (
            "What is taken for the gyroscope reads as gravity does, and the accelerometer does "
            "not: their columns are exchanged. Correct the names that the device prints, or the "
            "columns (key c)."
        )
    if size < _NO_GRAVITY:
        return (
            f"The acceleration is only {size:.2g} m/s² for two seconds: the device has taken "
            f"gravity out (linear acceleration), or the unit is wrong. Let it print the raw "
            f"acceleration, or correct the unit."
        )
    off = abs(size / units.STANDARD_GRAVITY - 1)
    if float(np.std(sizes)) > _AT_REST * size or off < _OTHER_UNIT:
        return ""
    likely = _unit_for(size)
    advice = f"it looks like {likely}: set that unit" if likely else "correct the unit or the range"
    return f"Gravity reads {size:.4g} m/s² instead of 9.81; {advice}."


def _feels_gravity(rate: FloatArray | None, unit: str) -> bool:
    """Whether rates have steadily the size that one g has in a usual unit."""
    if rate is None or unit == units.COUNT:
        return False
    sizes = np.linalg.norm(rate, axis=1)
    size = float(np.median(sizes))
    printed = [size / factor for factor in units.RATE.values()]
    near = any(unit_of_gravity(one, _LIKE_GRAVITY) for one in printed)
    return near and float(np.std(sizes)) < _STEADILY * size


def _unit_for(size: float) -> str:
    """What was printed in another unit than it was taken for, by the size of gravity."""
    for taken in GUESSED:
        unit = unit_of_gravity(size / units.ACCELERATION[taken], _TAKEN_FOR)
        if unit not in (None, taken):
            return f"{unit} taken for {taken}"
    return ""


def zero_rate(window: Window) -> str:
    """The gyroscope is exactly zero while the accelerometer shows noise."""
    if window.rate is None or bool(np.all(np.ptp(window.acceleration, axis=0) == 0)):
        return ""
    zeros = float(np.mean(np.all(window.rate == 0, axis=1)))
    if zeros < _ZEROS:
        return ""
    return (
        "The gyroscope reads exactly zero: the device takes its own bias out (BNO055 in a fusion "
        "mode, WitMotion with automatic calibration) or prints too few digits. Switch to raw data "
        "(BNO055: AMG mode; WitMotion: register 0x63 = 1), or its bias cannot be found."
    )


def clipped(window: Window) -> str:
    """An axis stands at the end of its range."""
    limits = [
        ("accelerometer", window.acceleration, window.acceleration_unit, _LEAST_FORCE),
        ("gyroscope", window.rate, window.rate_unit, _LEAST_RATE),
    ]
    for sensor, values, unit, least in limits:
        if values is None:
            continue
        for axis in range(3):
            column = values[:, axis]
            if _at_end(column, unit, least):
                end = f"{column[_farthest(column)]:.5g} {unit}"
                return (
                    f"The {sensor}'s {_AXES[axis]} axis stands at its limit ({end}): the range is "
                    f"too small for this movement. Set a larger range in the device, or move "
                    f"more slowly."
                )
    return ""


def _farthest(column: FloatArray) -> int:
    return int(np.argmax(np.abs(column - np.median(column))))


def _at_end(column: FloatArray, unit: str, least: float) -> bool:
    """The farthest value comes several times in a row, far from rest, or is the end of int16."""
    extreme = float(column[_farthest(column)])
    if unit == units.COUNT:
        if extreme in (32767.0, -32768.0, 65535.0):
            return True
        if float(np.ptp(column)) < _SMALLEST_SPAN:
            return False
    elif abs(extreme) < least:
        return False
    return _cut_off(column, extreme)


def _cut_off(column: FloatArray, extreme: float) -> bool:
    """Whether a run of equal extremes is entered and left at once.

    A smooth peak in coarse steps stands on one value, too, but it comes there step by step.
    """
    flags = np.concatenate(([False], column == extreme, [False]))
    if flags[1:-1].all():
        return True
    first, after = np.flatnonzero(np.diff(flags.astype(np.int8))).reshape(-1, 2).T
    step = float(np.min(np.diff(np.unique(column)), initial=np.inf))
    around = np.concatenate(([extreme], column, [extreme]))
    jump = np.maximum(np.abs(around[first] - extreme), np.abs(around[after + 1] - extreme))
    return bool(np.any((after - first >= _RUN) & (jump >= _JUMP * step)))


def dead_axes(values: FloatArray) -> list[str]:
    """Axes that never change while another axis of the same sensor does.

    Args:
        values: shape (n, 3).
    """
    spans = np.ptp(values, axis=0)
    lively = max(len(np.unique(values[:, axis])) for axis in range(3))
    return [_AXES[axis] for axis in range(3) if spans[axis] == 0] if lively > 5 else []


def too_few_digits(sensor: str, unit: str, decimals: int) -> str:
    """Printed steps that are coarser than what a calibration needs.

    Args:
        sensor: ``accelerometer`` or ``gyroscope``.
        unit: the printed unit.
        decimals: printed decimals; -1 where that is not known.
    """
    if decimals < 0 or unit == units.COUNT:
        return ""
    step = 10.0**-decimals * units.factor(sensor, unit)
    if sensor == "accelerometer":
        coarse, words = step > _COARSE_FORCE, f"{step * 1000:.3g} mm/s²"
    else:
        coarse, words = step > _COARSE_RATE, f"{np.degrees(step):.2g} °/s"
    if not coarse:
        return ""
    return (
        f"The {sensor} is printed in {unit} with {decimals} digits behind the point, in steps of "
        f"{words}: print more, for instance Serial.print(x, 5)."
    )
