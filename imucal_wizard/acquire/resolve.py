"""Resolves the columns of a stream, or determines the questions for the user."""

from collections.abc import Mapping, Sequence
from dataclasses import field, replace

import numpy as np

from imucal_wizard.acquire import column_guess
from imucal_wizard.acquire.decode.base import Column
from imucal_wizard.acquire.decode.vocabulary import (
    LETTER_OF_SENSOR,
    SENSOR_CHANNELS,
    channel_of,
    column_of_name,
    is_derived,
    quantity_of,
    squeeze_name,
    unit_belongs,
)
from imucal_wizard.acquire.host_clock import (
    burst_pause,
    has_enough_ticks,
    long_tick,
    pauses,
    sampling_period,
)
from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core import units
from imucal_wizard.core.gravity import are_whole_numbers
from imucal_wizard.core.limits.data_quality import MIN_PAUSES
from imucal_wizard.core.output import sanitise
from imucal_wizard.core.quantities import as_sentence
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass

FIRST_ROWS = 25
"""Rows from which columns and units are guessed."""
_FIRST_SECONDS = 0.5
"""Device time that the first rows must span for its period, s."""
_LONGEST_FIRST_SECONDS = 5.0
"""The same if there are pauses in them, which may be gaps or the pauses between bursts, s."""
_PLAUSIBLE_SAMPLING = (0.2, 50_000.0)
"""Slowest and fastest plausible sampling, Hz."""
_MAX_BACKWARD_SHARE = 0.2
"""Share of backward steps in a time column; above it, the column is not a time."""
_RATE_TOLERANCE = 0.01
"""Relative deviation allowed between a stated rate and that of the time column."""
_BESIDE = ("temperature", "current", "throttle")
"""Auxiliary quantities, left out if their unit is unknown."""


@dataclass(frozen=True)
class ResolvedColumns:
    """The columns as far as they are known.

    Attributes:
        columns: one per column of the rows, with units if they are known.
        needs: the questions: ``columns``, ``accelerometer unit``, ``gyroscope unit``, and ``rate``
            for a recording; or ``NEEDS_ACCELEROMETER``.
        notes: messages to the user about guesses and their reasons, or about missing data.
        guesses: the units guessed from the first readings, by sensor; all readings tell more.
    """

    columns: tuple[Column, ...]
    needs: tuple[str, ...]
    notes: tuple[str, ...]
    guesses: Mapping[str, column_guess.UnitGuess] = field(default_factory=dict)


def resolve_columns(
    setup: StreamSetup,
    columns: tuple[Column, ...],
    values: FloatArray,
    arrivals: FloatArray | None,
) -> ResolvedColumns:
    """Combine the user's statements, the stream's own names, and the evidence of the numbers.

    Args:
        setup: the user's statements.
        columns: the columns that the stream declares.
        values: first rows, shape (n, len(columns)).
        arrivals: arrival of each row, s, shape (n,); None for a recording, in which any sensor may
            be missing and which needs a time or a rate.
    """
    notes: list[str] = []
    if setup.columns and len(setup.columns) == len(columns):
        both = zip(columns, setup.columns, strict=True)
        if any(own.channel and own.channel != given.channel for own, given in both):
            notes.append("The columns that were given are used instead of those in the header.")
        columns = setup.columns
    elif not any(c.channel for c in columns):
        columns, sure = _propose_columns(columns, values)
        if not sure:
            return ResolvedColumns(_proposed_unit(columns, values), ("columns",), (_ASK,))
        names = ", ".join(c.channel or "-" for c in columns)
        notes.append(f"The lines have no names; read as {names}. Correct it if this is wrong.")
    if message := _twice(columns):
        return ResolvedColumns(columns, ("columns",), (message,))
    channels = {c.channel for c in columns}
    accelerometer = {"ax", "ay", "az"} & channels
    others = any(sensor_places(columns, sensor) for sensor in LETTER_OF_SENSOR)
    if len(accelerometer) < 3 and (accelerometer or arrivals is not None or not others):
        unknown = accelerometer or not others or not all(c.channel for c in columns)
        message = _lacking("accelerometer", channels)
        if not unknown:
            message = as_sentence(NO_ACCELEROMETER)
            message += _MAGNETOMETER_ALONE if sensor_places(columns, "magnetometer") else ""
        needs = ("columns",) if unknown else NEEDS_ACCELEROMETER
        return ResolvedColumns(columns, needs, (*notes, message))
    for sensor in ("gyroscope", "magnetometer"):
        if set(SENSOR_CHANNELS[sensor]) & channels and not sensor_places(columns, sensor):
            notes.append(_lacking(sensor, channels) + " It is left out.")
            columns = _without(columns, sensor)
    if arrivals is None:
        columns, silent = _without_silent(columns, values)
        notes += silent
        if not any(sensor_places(columns, sensor) for sensor in LETTER_OF_SENSOR):
            return ResolvedColumns(columns, ("sensor",), tuple(notes))
    if arrivals is None and not sensor_places(columns, "accelerometer"):
        notes += _unknown_names(columns)
    columns = tuple(replace(c, unit=setup.unit_of(c)) for c in columns)
    return _with_units(setup, columns, values, arrivals, notes)


NEEDS_ACCELEROMETER = ("accelerometer",)
"""What a live stream needs that has other sensors only: nothing that could be entered."""
NO_ACCELEROMETER = (
    "the stream has no accelerations, and gravity is the reference of all steps: print ax, ay and "
    "az, too"
)
"""What to do about it, as the problem of the stream."""
_MAGNETOMETER_ALONE = " A magnetometer alone is calibrated from a recording, without the steps."
_ASK = (
    "The lines contain numbers without known names. State which column is which, for example "
    "ax,ay,az,gx,gy,gz."
)


def _propose_columns(
    columns: tuple[Column, ...], values: FloatArray
) -> tuple[tuple[Column, ...], bool]:
    """A channel for each column, and whether this is certain enough to continue without asking.

    Columns named as derived quantities are excluded. If the device uses names of its own, nothing
    is certain: they may mean anything.

    Args:
        columns: the columns, none of which has a channel.
        values: first rows, shape (n, len(columns)).
    """
    places = [i for i, c in enumerate(columns) if not is_derived(squeeze_name(c.name))]
    found, sure = column_guess.guess_channels(values[:, places])
    channels = dict(zip(places, found, strict=True))
    named = tuple(replace(c, channel=channels.get(i, "")) for i, c in enumerate(columns))
    return named, sure and not _own_names(columns)


def _own_names(columns: tuple[Column, ...]) -> bool:
    """Whether the device has given its columns names that are unknown here."""
    names = [c.name.lower() for c in columns]
    if len(set(names)) < len(names) or all(name.startswith("column ") for name in names):
        return False
    others = [name for name in names if channel_of(name) not in ("t", "temp", "counter")]
    return others != ["x", "y", "z"]


def _twice(columns: tuple[Column, ...]) -> str:
    """Message about a second sensor of the same kind, or ""."""
    first = {c.channel: c.name for c in columns if c.channel}
    for c in columns:
        again = "" if c.channel else column_of_name(c.name).channel
        if again in first and len(again) == 2 and quantity_of(again):
            return (
                f"Two columns are {again}: '{sanitise(first[again])}' and '{sanitise(c.name)}'. "
                f"State which column is which, and leave one of them out."
            )
    return ""


def _unknown_names(columns: tuple[Column, ...]) -> list[str]:
    """Message about columns of a recording without accelerometer that have names of their own."""
    names = [sanitise(c.name, 24) for c in columns if c.name and not c.channel]
    names = [name for name in names if not name.lower().startswith("column ")]
    if len(names) < len(SENSOR_CHANNELS["accelerometer"]):
        return []
    message = (
        f"No column is named like an accelerometer, and {', '.join(names)} are not used: if they "
        f"hold one, state which column is which."
    )
    return [message]


def _lacking(sensor: str, channels: set[str]) -> str:
    """Message about a sensor with missing axes."""
    gone = [channel for channel in SENSOR_CHANNELS[sensor] if channel not in channels]
    are, them = ("is", "it") if len(gone) == 1 else ("are", "them")
    return (
        f"The {sensor} needs three columns and {', '.join(gone)} {are} missing: print {them}, or "
        f"state which column is which."
    )


def _without_silent(
    columns: tuple[Column, ...], values: FloatArray
) -> tuple[tuple[Column, ...], list[str]]:
    """Remove the sensors of a recording without a complete sample, with messages about them."""
    notes = []
    for sensor in LETTER_OF_SENSOR:
        places = sensor_places(columns, sensor)
        there = np.asarray(np.isfinite(values[:, places]))
        if not places or there.all(axis=1).any():
            continue
        if sensor == "magnetometer" and there.any():
            continue
        names = [columns[p].name or columns[p].channel for p in places]
        empty = [names[axis] for axis in range(len(places)) if not there[:, axis].any()]
        what = f"{' and '.join(empty)} hold no number" if empty else "no row has all of its axes"
        notes.append(f"{what}: the {sensor} was left out; check its wiring and the sketch")
        columns = _without(columns, sensor)
    return columns, notes


def _with_units(
    setup: StreamSetup,
    columns: tuple[Column, ...],
    values: FloatArray,
    arrivals: FloatArray | None,
    notes: list[str],
) -> ResolvedColumns:
    needs: list[str] = []
    guesses: dict[str, column_guess.UnitGuess] = {}
    for sensor in LETTER_OF_SENSOR:
        places = sensor_places(columns, sensor)
        if sensor == "magnetometer" and _foreign(columns, places):  # arbitrary units
            columns = _set_unit(columns, places, units.COUNT)
        if not places or (all(columns[p].unit for p in places) and not _wrong(columns, places)):
            continue
        if wrong := _wrong(columns, places):
            notes.append(wrong)
            needs.append(f"{sensor} unit")
            continue
        found = _unit_guess(sensor, values[:, places], columns, values)
        if found.by_size:
            guesses[sensor] = found
        if found.why:
            notes.append(column_guess.unit_note(sensor, found))
        if found.unit:
            columns = _set_unit(columns, places, found.unit)
        else:
            needs.append(f"{sensor} unit")
    columns, beside = _without_foreign(columns)
    columns, needed, time = _timed(setup, columns, values, arrivals)
    return ResolvedColumns(columns, (*needs, *needed), (*notes, *beside, *time), guesses)


def _foreign(columns: tuple[Column, ...], places: Sequence[int]) -> list[Column]:
    """The columns with a unit that is not one of theirs."""
    own = [columns[p] for p in places]
    return [c for c in own if c.unit and not unit_belongs(c.channel, c.unit)]


def _wrong(columns: tuple[Column, ...], places: Sequence[int]) -> str:
    """Message about wrong units of a sensor, or ""."""
    if foreign := _foreign(columns, places):
        sensor = str(quantity_of(foreign[0].channel))
        return _no_unit(foreign[0], (*units.UNIT_FACTORS[sensor], units.COUNT))
    if len({columns[p].unit == units.COUNT for p in places}) > 1:
        sensor = str(quantity_of(columns[places[0]].channel))
        return f"only some axes of the {sensor} are in counts; give all of them in one unit"
    return ""


def _no_unit(column: Column, known: Sequence[str]) -> str:
    sensor = quantity_of(column.channel)
    what = f"'{sanitise(column.unit, 48)}' of column '{sanitise(column.name, 48)}'"
    return f"{what} is not a unit of {'' if sensor == 'time' else 'the '}{sensor}; use one of " + (
        ", ".join(known)
    )


def _without_foreign(columns: tuple[Column, ...]) -> tuple[tuple[Column, ...], list[str]]:
    """Remove auxiliary quantities with an unknown unit; returns messages about them."""
    notes = []
    for sensor in _BESIDE:
        place = next((i for i, c in enumerate(columns) if quantity_of(c.channel) == sensor), None)
        if place is None or columns[place].unit in units.UNIT_FACTORS[sensor]:
            continue
        c = columns[place]
        if sensor == "temperature" and not c.unit:
            columns = _set_unit(columns, [place], "degC")
            continue
        what = f"'{sanitise(c.unit, 48)}' of column" if c.unit else "column"
        known = " or ".join(units.UNIT_FACTORS[sensor])
        notes.append(
            f"the {sensor} was left out: {what} '{sanitise(c.name, 48)}' has no known unit of it; "
            f"write {known}"
        )
        columns = _without(columns, sensor)
    return columns, notes


def _proposed_unit(columns: tuple[Column, ...], values: FloatArray) -> tuple[Column, ...]:
    """The columns with the unit of the proposed accelerometer, guessed from gravity."""
    places = sensor_places(columns, "accelerometer")
    if not places:
        return columns
    return _set_unit(
        columns, places, _unit_guess("accelerometer", values[:, places], columns, values).unit
    )


def _unit_guess(
    sensor: str, own: FloatArray, columns: tuple[Column, ...], values: FloatArray
) -> column_guess.UnitGuess:
    good = own[np.isfinite(own).all(axis=1)]
    if not len(good) and sensor == "magnetometer":  # slower than the others, or switched off
        return column_guess.UnitGuess(units.COUNT, "")
    if not len(good):
        return column_guess.UnitGuess("", f"The {sensor} has sent no numbers yet (empty or NaN).")
    if sensor == "accelerometer":
        return column_guess.guess_accelerometer_unit(good)
    accelerometer = sensor_places(columns, "accelerometer")
    counts = bool(accelerometer) and all(columns[p].unit == units.COUNT for p in accelerometer)
    if counts and are_whole_numbers(np.column_stack([own, values[:, accelerometer]])):
        why = f"Whole numbers: the {sensor} is read as raw counts."
        return column_guess.UnitGuess(units.COUNT, why, by_size=False)
    if sensor == "magnetometer":
        return column_guess.guess_magnetometer_unit(good)
    return column_guess.UnitGuess("", "")


def _timed(
    setup: StreamSetup,
    columns: tuple[Column, ...],
    values: FloatArray,
    arrivals: FloatArray | None,
) -> tuple[tuple[Column, ...], tuple[str, ...], tuple[str, ...]]:
    """The unit of the time column, the questions, and messages.

    A time column that does not advance is ignored.
    """
    rate = () if arrivals is not None or setup.rate else ("rate",)
    place = next((i for i, c in enumerate(columns) if c.channel == "t"), None)
    if place is None:
        message = "It has no time column: give the samples per second." if rate else ""
        return columns, rate, (message,) if message else ()
    time = columns[place]
    instead = "it is not used" if arrivals is None else "the rate is measured from arrival instead"
    dropped = (*columns[:place], replace(time, channel="", unit=""), *columns[place + 1 :])
    good = np.isfinite(values[:, place])
    ticks = values[good, place]
    steps = np.diff(ticks)
    if not np.any(steps != 0):
        at = f" and stands still at {ticks[0]:.6g}" if len(ticks) else ""
        return dropped, rate, (f"The time column does not run{at}: {instead}.",)
    back = float(np.mean(steps < 0))
    if back > _MAX_BACKWARD_SHARE:
        check = "Check which column is the time" + ", or give the samples per second" * bool(rate)
        message = f"The time column goes back in {back:.0%} of its steps: {instead}. {check}."
        return (columns, ("columns", *rate), (message,)) if rate else (dropped, (), (message,))
    if time.unit and time.unit not in units.UNIT_FACTORS["time"]:
        return columns, ("columns",), (_no_unit(time, tuple(units.TIME_UNITS)),)
    doubt = _doubtful(ticks, time.unit)
    if arrivals is not None and burst_pause(ticks):
        return dropped, rate, (f"The times jitter as if they were taken on arrival: {instead}.",)
    if time.unit and not doubt:
        return columns, (), _contradicted(setup.rate, ticks, time.unit)
    if doubt and arrivals is None:
        return columns, ("columns",), (f"{doubt}Give the unit of the time column.",)
    if arrivals is None:
        found = column_guess.guess_time_unit_by_rate(ticks, setup.rate)
    else:
        found = column_guess.guess_time_unit(ticks, arrivals[good])
    if not found.unit and arrivals is None:
        return columns, ("columns",), (found.why,)
    if not found.unit:
        return dropped, rate, (f"{doubt}{found.why} It is not used; {instead}.",)
    notes = (doubt + found.why, *_contradicted(setup.rate, ticks, found.unit))
    return _set_unit(columns, [place], found.unit), (), notes


def _contradicted(rate: float | None, ticks: FloatArray, unit: str) -> tuple[str, ...]:
    """Message about a stated rate that contradicts the times."""
    seconds = ticks * units.unit_factor("time", unit)
    period = sampling_period(seconds)
    if rate is None or not period or abs(1.0 / period - rate) <= _RATE_TOLERANCE * rate:
        return ()
    if burst_pause(seconds) or long_tick(seconds):
        return ()  # they contradict nothing: the stated rate is used
    message = (
        f"The stated rate of {rate:g} Hz was not used: the time column says {1.0 / period:.6g} Hz. "
        f"If the times are wrong, leave their column out."
    )
    return (message,)


def _doubtful(ticks: FloatArray, unit: str) -> str:
    """Message about a unit of time that implies an implausible sampling rate, or ""."""
    if not unit:
        return ""
    period = sampling_period(ticks)
    if not period:
        return ""
    rate = 1.0 / (period * units.unit_factor("time", unit))
    if _PLAUSIBLE_SAMPLING[0] <= rate <= _PLAUSIBLE_SAMPLING[1]:
        return ""
    return f"The time column in {unit} would mean {rate:.3g} samples/s. "


def first_rows(
    columns: tuple[Column, ...], values: FloatArray, full: bool = False
) -> FloatArray | None:
    """The first rows of a stream that are sufficient to determine the device's period.

    Args:
        columns: resolved columns.
        values: the first rows there are, shape (n, columns).
        full: whether no more rows will be kept, so that these must be sufficient.

    Returns:
        At least ``FIRST_ROWS`` rows that span half a second of device time, and several ticks of a
        coarse clock or several bursts; None while there are too few. The same stream always gives
        the same rows.
    """
    place = next((i for i, c in enumerate(columns) if c.channel == "t"), None)
    if place is None:
        return values[:FIRST_ROWS]
    if not columns[place].unit:
        return None
    seconds = values[:, place] * units.unit_factor("time", columns[place].unit)
    steps = np.maximum(np.nan_to_num(np.diff(seconds, prepend=seconds[:1])), 0.0)
    past, seen = np.cumsum(steps), np.cumsum(pauses(steps))
    known = (seen == 0) | (seen >= MIN_PAUSES) | (past >= _LONGEST_FIRST_SECONDS)
    enough = np.flatnonzero((past >= _FIRST_SECONDS) & known & has_enough_ticks(steps))
    if not len(enough):
        return values if full else None
    return values[: max(int(enough[0]) + 1, FIRST_ROWS)]


def sensor_places(columns: tuple[Column, ...], sensor: str) -> list[int]:
    """Indices of a sensor's x, y and z columns; empty unless all three are present."""
    where = {c.channel: i for i, c in enumerate(columns) if c.channel}
    places = [where[channel] for channel in SENSOR_CHANNELS[sensor] if channel in where]
    return places if len(places) == 3 else []


def _set_unit(columns: tuple[Column, ...], places: list[int], unit: str) -> tuple[Column, ...]:
    return tuple(replace(c, unit=unit) if i in places else c for i, c in enumerate(columns))


def _without(columns: tuple[Column, ...], sensor: str) -> tuple[Column, ...]:
    return tuple(
        replace(c, channel="", unit="") if quantity_of(c.channel) == sensor else c for c in columns
    )
