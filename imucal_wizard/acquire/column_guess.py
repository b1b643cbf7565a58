"""Guesses of channels and units for numbers without names: gravity identifies the accelerometer."""

import math

import numpy as np

from imucal_wizard.acquire.host_clock import burst_pause, sampling_period
from imucal_wizard.core import units
from imucal_wizard.core.gravity import (
    MIN_GRAVITY_COUNTS,
    acceleration_unit,
    are_whole_numbers,
    median_magnitude,
    unit_of_gravity,
)
from imucal_wizard.core.limits.data_quality import USUAL_SAMPLING_RATES
from imucal_wizard.core.notices import Notice, NoticeKind
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import lengths, median, sphere_centre

_MAX_GRAVITY_DEVIATION = 0.15
"""Relative deviation of gravity up to which a column is an accelerometer without asking."""
_COUNTS_PER_G = (256.0, 2048.0, 4096.0, 8192.0, 16384.0)
"""Common sensitivities of accelerometers with 16 or fewer bits, counts per g."""
_CHIP_TEMPERATURES = (12.0, 70.0)
"""Plausible temperatures of a chip, °C."""
_MAX_WARMING = 2.0
"""°C; a device warms by less within the first second."""
_MAX_SIZE_VARIATION = 0.1
"""Relative variation of the magnitude of gravity at rest; a gyroscope's bias varies more."""
_MIN_WHOLE_GRAVITY = 100.0
"""Gravity of a smaller magnitude is not printed in whole numbers."""
_UNITS_TRIED = ("s", "ms", "us", "ns")
"""For times without a unit: the first one that gives a usual sampling rate is used."""
_FIELD_RANGES = ((20.0, 80.0, "uT"), (0.2, 0.8, "G"), (200.0, 800.0, "mG"), (2e4, 8e4, "nT"))
"""Smallest and largest reading of the Earth's field in each unit."""
_MIN_ARRIVAL_SECONDS = 0.3
"""Seconds of arrivals needed to compare a time column with the host's clock."""
_MAX_SPEED_RATIO = 4.0
"""Ratio of device time to arrival time that bursts of the link can cause."""
_OFFSET_BINARY = 32768.0
"""Mid-scale of unsigned 16-bit counts."""
_MAX_OFFSET_DEVIATION = 12_000.0
"""Counts by which gravity can deviate from it."""


@dataclass(frozen=True)
class UnitGuess:
    """A guess and its reason.

    Attributes:
        unit: the unit, or ``""`` if none can be guessed.
        why: the reason, one sentence for the user.
        by_size: whether the size of the readings is the reason.
    """

    unit: str
    why: str
    by_size: bool = True


def unit_note(sensor: str, guess: UnitGuess) -> str:
    """What the user is told of a guess."""
    return Notice(guess.why, NoticeKind.UNIT_OF_SIZE, sensor) if guess.by_size else guess.why


def guess_accelerometer_unit(values: FloatArray) -> UnitGuess:
    """The unit of accelerations in which gravity has the observed magnitude.

    Args:
        values: readings, shape (n, 3), most of them at rest.
    """
    size = median_magnitude(values)
    if _offset_binary(values):
        why = "The accelerometer is centred at 32768: raw counts with an offset (offset binary)."
        return UnitGuess(units.COUNT, why)
    unit = acceleration_unit(size, are_whole_numbers(values))
    if unit is not None and unit != units.COUNT:
        return UnitGuess(unit, f"Gravity reads {size:.4g}, so accelerations are in {unit}.")
    for counts in _COUNTS_PER_G:
        if abs(size / counts - 1) < _MAX_GRAVITY_DEVIATION:
            why = f"Gravity reads {size:.0f}: raw counts, nominally {counts:.0f} per g."
            return UnitGuess(units.COUNT, why)
    if unit == units.COUNT:
        return UnitGuess(unit, f"Gravity reads {size:.0f}, in whole numbers: taken as raw counts.")
    if size < 0.5:
        return UnitGuess(
            "",
            f"Gravity reads only {size:.3g}: this is not an accelerometer at rest, or the device "
            f"has removed gravity (linear acceleration). Choose other columns or its raw output.",
        )
    if size < MIN_GRAVITY_COUNTS:
        why = f"Gravity reads {size:.4g}, which fits no unit: choose the unit."
        return UnitGuess("", why)
    why = f"Gravity reads {size:.4g}, which fits no known unit: taken as raw counts."
    return UnitGuess(units.COUNT, why)


def guess_magnetometer_unit(values: FloatArray) -> UnitGuess:
    """The unit in which the Earth's field has the observed magnitude.

    The magnet or iron beside a sensor may read more than the field. If the device was turned, the
    readings surround their centre, and their distance from it is the field alone.

    Args:
        values: readings, shape (n, 3).
    """
    centre = sphere_centre(values)
    size = median(lengths(values if centre is None else values - centre))
    for low, high, unit in _FIELD_RANGES:
        if low <= size <= high:
            return UnitGuess(unit, f"The field reads {size:.3g}, so it is taken as {unit}.")
    return UnitGuess(units.COUNT, f"The field reads {size:.3g}: taken as raw counts.")


def guess_time_unit(ticks: FloatArray, arrivals: FloatArray) -> UnitGuess:
    """The unit of a time column, from its speed relative to the host's clock.

    Args:
        ticks: device times, shape (n,).
        arrivals: arrival time of each, s, shape (n,).
    """
    steps = np.diff(ticks)
    device = float(np.sum(steps[steps > 0]))
    host = float(arrivals[-1] - arrivals[0])
    if device <= 0:
        return UnitGuess("", "The time column does not advance.")
    if host > _MIN_ARRIVAL_SECONDS:
        unit = min(
            units.TIME_UNITS, key=lambda u: abs(math.log(device * units.TIME_UNITS[u] / host))
        )
        speed = device * units.TIME_UNITS[unit] / host
        if 1.0 / _MAX_SPEED_RATIO < speed < _MAX_SPEED_RATIO:
            why = f"The time column advances by {device / host:.4g} per second, so it is in {unit}."
            return UnitGuess(unit, why)
        why = f"The time column advances by {device / host:.4g} per second: no unit fits."
        return UnitGuess("", why)
    step = median(steps[steps > 0])
    whole = bool(np.all(ticks == np.round(ticks)))
    unit = "s" if step < 1 and not whole else "ms" if step < 200 else "us"
    return UnitGuess(unit, f"The time column steps by {step:.4g}: taken as {unit}.")


def guess_time_unit_by_rate(ticks: FloatArray, rate: float | None) -> UnitGuess:
    """The unit of a time column that gives a plausible sampling rate.

    Args:
        ticks: device times, shape (n,).
        rate: samples per second, if stated.
    """
    step = sampling_period(ticks)
    bursts = burst_pause(ticks) > 0.0
    low, high = (0.3 * rate, 3.0 * rate) if rate else USUAL_SAMPLING_RATES
    for unit in _UNITS_TRIED if step else ():
        found = 1.0 / (step * units.TIME_UNITS[unit])
        if low <= found <= high:
            gives = "" if bursts else f", which gives {found:.6g} Hz"
            return UnitGuess(unit, f"The time column was taken as {unit}{gives}.")
    return UnitGuess(
        "",
        f"The unit of the time column cannot be inferred from steps of {step:.6g}: name it, for "
        f"example t[ms].",
    )


def _runs_like_time(values: FloatArray) -> bool:
    """Whether a column mostly increases and decreases at most once (a restart, a wrap)."""
    steps = np.diff(values)
    return len(steps) > 3 and int(np.sum(steps < 0)) <= 1 and float(np.mean(steps > 0)) > 0.5


def _counts_samples(values: FloatArray) -> bool:
    """Whether a column increases by one from sample to sample, except for wraps."""
    steps = np.diff(values)
    return len(steps) > 3 and float(np.mean(steps == 1)) > 0.9


def guess_channels(values: FloatArray) -> tuple[tuple[str, ...], bool]:
    """The probable channel of each column of a stream without names.

    Args:
        values: shape (n, columns).

    Returns:
        One channel per column (``""`` if unknown), and whether the guess is certain enough to
        continue without asking.
    """
    width = values.shape[1]
    found = [""] * width
    if not width:
        return (), False
    rest = _without_clocks(values, found)
    if len(rest) not in (3, 4, 6, 7, 9, 10) or rest != list(range(rest[0], rest[-1] + 1)):
        return tuple(found), False
    warm = True
    if len(rest) % 3 == 1:
        last = rest.pop()
        found[last], warm = "temp", _is_temperature(values[:, last])
    triples = [rest[i : i + 3] for i in range(0, len(rest), 3)]
    order, sure = _order([values[:, triple] for triple in triples])
    for sensor, triple in zip(order, triples, strict=False):
        for axis, place in zip("xyz", triple, strict=True):
            found[place] = sensor + axis
    return tuple(found), sure and warm


def _without_clocks(values: FloatArray, found: list[str]) -> list[int]:
    """The columns that are neither a time nor a counter; those are entered in ``found``.

    An index and a time may be adjacent at the beginning.
    """
    width = values.shape[1]
    rest = list(range(width))
    for place in (0, 1, width - 1):
        column = values[:, place] if place < width else values[:, 0]
        if place not in rest or width <= 3 or (place == 1 and rest[0] == 0):
            continue
        # milliseconds at 1 kHz also step by one; a clock that counts samples is still a clock
        kind = "counter" if _counts_samples(column) else "t" if _runs_like_time(column) else ""
        if kind:
            found[place] = kind if kind not in found else ""
            rest.remove(place)
    return rest


def _is_temperature(column: FloatArray) -> bool:
    """Whether a column can be °C; if not, an unknown column may have shifted all others."""
    low, high = _CHIP_TEMPERATURES
    return low < median(column) < high and float(np.ptp(column)) < _MAX_WARMING


def _order(triples: list[FloatArray]) -> tuple[str, bool]:
    """The sensor of each triple of columns, and whether gravity identifies it clearly."""
    sizes = [median(lengths(three)) for three in triples]
    plain = [i for i, three in enumerate(triples[:2]) if _is_gravity(three, sizes[i])]
    order = "gam" if plain == [1] else "agm"
    if len(plain) != 1:
        return order, False
    others = [i for i in range(min(2, len(triples))) if i != plain[0]]
    counted = any(_is_counted_gravity(triples[i], sizes[i]) for i in others)
    # at rest the Earth's field is larger than any rate, in whichever units both are printed
    field_last = len(triples) < len("agm") or sizes[others[0]] < sizes[2]
    return order, field_last and not counted


def _is_gravity(three: FloatArray, size: float) -> bool:
    """Whether a triple shows 1 g in m/s², g or mg: steadily, and in more than whole steps of it."""
    steady = float(np.std(lengths(three))) < _MAX_SIZE_VARIATION * size
    fine = size > _MIN_WHOLE_GRAVITY or not are_whole_numbers(three)
    return steady and fine and unit_of_gravity(size, _MAX_GRAVITY_DEVIATION) is not None


def _is_counted_gravity(three: FloatArray, size: float) -> bool:
    """Whether a triple may be counts of an accelerometer."""
    return are_whole_numbers(three) and any(
        abs(size / counts - 1) < _MAX_GRAVITY_DEVIATION for counts in _COUNTS_PER_G
    )


def _offset_binary(values: FloatArray) -> bool:
    """Whether the readings are unsigned counts: whole numbers, every axis near 32768."""
    middle = np.array([median(column) for column in values.T])
    centred = bool(np.all(np.abs(middle - _OFFSET_BINARY) < _MAX_OFFSET_DEVIATION))
    return are_whole_numbers(values) and centred and float(np.min(values)) >= 0
