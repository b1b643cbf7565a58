"""From what is known of a stream to what every column is, or to what must be asked."""

from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard import units
from imucal_wizard.devices import guess, nameless
from imucal_wizard.devices.formats.base import Column
from imucal_wizard.devices.formats.names import sensor_of
from imucal_wizard.devices.setup import StreamSetup
from imucal_wizard.readings import FloatArray

FIRST_ROWS = 25
"""Rows from which columns and units are guessed."""
_FIRST_SECONDS = 0.5
_RATES = (0.2, 50_000.0)
"""Slowest and fastest sampling that can be, Hz."""
_SENSORS = {"accelerometer": "a", "gyroscope": "g", "magnetometer": "m"}


@dataclass(frozen=True)
class Resolution:
    """What every column is, as far as that can be known.

    Attributes:
        columns: one per column of the rows, with units where they are known.
        needs: what must be asked: ``columns``, ``accelerometer unit``, ``gyroscope unit``.
        notes: what was guessed and why, or what is missing, for the user.
    """

    columns: tuple[Column, ...]
    needs: tuple[str, ...]
    notes: tuple[str, ...]


def resolve(
    setup: StreamSetup, columns: tuple[Column, ...], values: FloatArray, arrivals: FloatArray
) -> Resolution:
    """Join what the user said, what the stream says and what the numbers show.

    Args:
        setup: what the user said.
        columns: what the stream says.
        values: first rows, shape (n, len(columns)), n >= FIRST_ROWS.
        arrivals: when each row arrived, s, shape (n,).
    """
    notes: list[str] = []
    if setup.columns and len(setup.columns) == len(columns):
        columns = setup.columns
    elif not any(c.channel for c in columns):
        columns, sure = nameless.proposed(columns, values)
        if not sure:
            return Resolution(_proposed_unit(columns, values), ("columns",), (nameless.ASK,))
        notes.append(nameless.told(columns))
    channels = {c.channel for c in columns}
    if says := nameless.twice(columns):
        notes.append(says)
    if not {"ax", "ay", "az"} <= channels:
        says = nameless.missing("accelerometer", "a", channels)
        return Resolution(columns, ("columns",), (says,))
    for sensor in ("gyroscope", "magnetometer"):
        some = any(sensor_of(c) == sensor for c in channels)
        if some and not places_of(columns, sensor):
            notes.append(nameless.missing(sensor, _SENSORS[sensor], channels))
            columns = _without(columns, sensor)
    columns = tuple(replace(c, unit=setup.unit_of(c)) for c in columns)
    return _with_units(columns, values, arrivals, notes)


def _with_units(
    columns: tuple[Column, ...],
    values: FloatArray,
    arrivals: FloatArray,
    notes: list[str],
) -> Resolution:
    needs: list[str] = []
    for sensor in _SENSORS:
        places = places_of(columns, sensor)
        if not places or all(columns[p].unit for p in places):
            continue
        found = _unit_guess(sensor, values[:, places], columns, values)
        if found.why:
            notes.append(found.why)
        if found.unit:
            columns = _set_unit(columns, places, found.unit)
        else:
            needs.append(f"{sensor} unit")
    columns, note = _timed(columns, values, arrivals)
    return Resolution(columns, tuple(needs), (*notes, *note))


def _proposed_unit(columns: tuple[Column, ...], values: FloatArray) -> tuple[Column, ...]:
    """The columns with the unit that gravity has in those proposed for the accelerometer."""
    places = places_of(columns, "accelerometer")
    if not places:
        return columns
    return _set_unit(
        columns, places, _unit_guess("accelerometer", values[:, places], columns, values).unit
    )


def _unit_guess(
    sensor: str, own: FloatArray, columns: tuple[Column, ...], values: FloatArray
) -> guess.UnitGuess:
    good = own[np.isfinite(own).all(axis=1)]
    if not len(good) and sensor == "magnetometer":  # slower than the rest, or switched off
        return guess.UnitGuess(units.COUNT, "")
    if not len(good):
        return guess.UnitGuess("", f"The {sensor} has sent no numbers yet (empty or NaN).")
    if sensor == "accelerometer":
        return guess.accelerometer_unit(good)
    if sensor == "magnetometer":
        return guess.magnetometer_unit(good)
    accelerometer = places_of(columns, "accelerometer")
    counts = all(columns[p].unit == units.COUNT for p in accelerometer)
    both = values[:, accelerometer + places_of(columns, "gyroscope")]
    both = both[np.isfinite(both).all(axis=1)]
    if counts and bool(np.all(both == np.round(both))):
        return guess.UnitGuess(units.COUNT, "Whole numbers: the gyroscope is read as raw counts.")
    return guess.UnitGuess("", "")


def _timed(
    columns: tuple[Column, ...], values: FloatArray, arrivals: FloatArray
) -> tuple[tuple[Column, ...], tuple[str, ...]]:
    """The unit of the time column; a time column that does not run is no time column."""
    place = next((i for i, c in enumerate(columns) if c.channel == "t"), None)
    if place is None:
        return columns, ()
    good = np.isfinite(values[:, place])
    ticks, arrivals = values[good, place], arrivals[good]
    if len(ticks) < 2 or not np.any(np.diff(ticks) > 0):
        note = "The time column does not run: the rate is measured from arrival instead."
        dropped = (replace(columns[place], channel="", unit=""),)
        return columns[:place] + dropped + columns[place + 1 :], (note,)
    doubt = _doubtful(ticks, columns[place].unit)
    if columns[place].unit and not doubt:
        return columns, ()
    found = guess.time_unit(ticks, arrivals)
    if not found.unit:
        dropped = (replace(columns[place], channel="", unit=""),)
        return columns[:place] + dropped + columns[place + 1 :], (
            f"{doubt}{found.why} It is not used; the rate is measured from arrival instead.",
        )
    return _set_unit(columns, [place], found.unit), (doubt + found.why,)


def _doubtful(ticks: FloatArray, unit: str) -> str:
    """What to say of a unit of time that gives a rate at which no IMU samples, or ""."""
    if not unit:
        return ""
    steps = np.diff(ticks)
    rate = 1.0 / (float(np.median(steps[steps > 0])) * units.factor("time", unit))
    if _RATES[0] <= rate <= _RATES[1]:
        return ""
    return f"The time column in {unit} would mean {rate:.3g} samples/s. "


def first_stretch(
    columns: tuple[Column, ...], values: FloatArray, full: bool = False
) -> FloatArray | None:
    """The shortest beginning of a stream from which the device's period can be taken.

    Args:
        columns: resolved columns.
        values: the first rows there are, shape (n, columns).
        full: no more rows will be kept, so that these must do.

    Returns:
        At least ``FIRST_ROWS`` rows that span half a second of device time; None while there are
        fewer. The same stream always gives the same rows.
    """
    place = next((i for i, c in enumerate(columns) if c.channel == "t"), None)
    if place is None:
        return values[:FIRST_ROWS]
    if not columns[place].unit:
        return None
    seconds = values[:, place] * units.factor("time", columns[place].unit)
    steps = np.nan_to_num(np.diff(seconds, prepend=seconds[:1]))
    enough = np.flatnonzero(np.cumsum(np.maximum(steps, 0.0)) >= _FIRST_SECONDS)
    if not len(enough):
        return values if full else None
    return values[: max(int(enough[0]) + 1, FIRST_ROWS)]


def places_of(columns: tuple[Column, ...], sensor: str) -> list[int]:
    """The places of a sensor's x, y and z column; empty unless all three are there."""
    letter = _SENSORS[sensor]
    where = {c.channel: i for i, c in enumerate(columns) if c.channel}
    places = [where[letter + axis] for axis in "xyz" if letter + axis in where]
    return places if len(places) == 3 else []


def _set_unit(columns: tuple[Column, ...], places: list[int], unit: str) -> tuple[Column, ...]:
    return tuple(replace(c, unit=unit) if i in places else c for i, c in enumerate(columns))


def _without(columns: tuple[Column, ...], sensor: str) -> tuple[Column, ...]:
    return tuple(
        replace(c, channel="", unit="") if sensor_of(c.channel) == sensor else c for c in columns
    )
