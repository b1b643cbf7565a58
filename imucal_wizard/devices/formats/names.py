"""What a column's name says: which channel it is and in which unit."""

import re
from dataclasses import replace

from imucal_wizard import units
from imucal_wizard.devices.formats.base import Column
from imucal_wizard.devices.formats.words import channel_of, squeezed

_SUFFIXES: dict[str, str] = {
    "us": "us",
    "ms": "ms",
    "s": "s",
    "sec": "s",
    "ns": "ns",
    "g": "g",
    "mg": "mg",
    "ms2": "m/s^2",
    "mps2": "m/s^2",
    "dps": "deg/s",
    "mdps": "mdeg/s",
    "degs": "deg/s",
    "mdegs": "mdeg/s",
    "rad": "rad/s",
    "rads": "rad/s",
    "mrads": "mrad/s",
    "rps": "rad/s",
    "ut": "uT",
    "degc": "degC",
    "c": "degC",
    "raw": "count",
    "lsb": "count",
}
_BRACKETED = re.compile(r"^(?P<name>[^\[(]*)[\[(](?P<unit>.*?)[\])]?\s*$")
_INDEXED = re.compile(r"^(?P<name>.+)\[(?P<index>[012])\]$")
_IN_UNIT = re.compile(r"^(?P<name>.+)\s+in\s+(?P<unit>\S+)$")
_TWO_WORDS = re.compile(r"^(?P<name>.+)_(?P<unit>m?(?:rad|deg)_s|m_s_?2|mps_2)$", re.IGNORECASE)
_IMPLIED = {
    "micros": "us",
    "millis": "ms",
    "timeus": "us",
    "timems": "ms",
    "rtctime": "s",
    "imudegc": "degC",
    "secondselapsed": "s",
}
_SENSOR_OF_UNIT = {"accelerometer": "a", "gyroscope": "g", "magnetometer": "m"}


_LINEAR = re.compile(r"linear[\W_]*(?=acc)", re.IGNORECASE)


def column(name: str) -> Column:
    """The column that a name in a header means; channel ``""`` when it means nothing here."""
    name = name.strip().strip("\"'").strip()
    bare, unit = parts(name)
    index = _INDEXED.match(bare)
    bare, axis = (index["name"], "." + index["index"]) if index else (bare, "")
    channel = ""
    if not unit:
        channel, unit = _with_suffix(bare, axis)
    channel = _of_unit(channel or channel_of(bare + axis), bare, unit)
    if channel and not unit:
        unit = _IMPLIED.get(squeezed(bare), "")
    unit = units.unit_of(sensor_of(channel) or "", unit)
    return Column(channel, unit if channel and belongs(channel, unit) else "", name)


def parts(name: str) -> tuple[str, str]:
    """The name without its unit, and the unit; an index in brackets stays with the name."""
    if _INDEXED.match(name):
        return name, ""
    match = _BRACKETED.match(name) or _IN_UNIT.match(name)
    if match is None:
        return name, ""
    unit = units.canonical(match["unit"])
    return match["name"].strip(), unit


def _of_unit(channel: str, bare: str, unit: str) -> str:
    """The channel where the unit decides: ``X (rad/s)`` turns, ``T (°C)`` is no time."""
    word = squeezed(bare)
    if word == "t" and unit in units.TEMPERATURE:
        return "temp"
    if channel or word not in ("x", "y", "z"):
        return channel
    sensors = [s for s, letter in _SENSOR_OF_UNIT.items() if unit in units.FACTORS[s]]
    return _SENSOR_OF_UNIT[sensors[0]] + word if len(sensors) == 1 else ""


def belongs(channel: str, unit: str) -> bool:
    """Whether a unit can be one of this channel's."""
    sensor = sensor_of(channel)
    if not unit or sensor is None:
        return False
    if unit == units.COUNT:
        return channel[0] in "agm"
    return unit in units.FACTORS[sensor]


def sensor_of(channel: str) -> str | None:
    """Which quantity of ``units.FACTORS`` a channel belongs to; None for counters and unknowns."""
    names = {"t": "time", "temp": "temperature", "current": "current", "throttle": "throttle"}
    if channel in names:
        return names[channel]
    if len(channel) == 2 and channel[1] in "xyz":
        return {"a": "accelerometer", "g": "gyroscope", "m": "magnetometer"}[channel[0]]
    return None


def with_gravity(columns: tuple[Column, ...]) -> tuple[Column, ...]:
    """The columns, with ``linear_acceleration.x`` as ``ax`` where there is no other accelerometer.

    ROS calls specific force so; Android what is left of it without gravity, which is of no use and
    is told by its size.
    """
    if any(sensor_of(c.channel) == "accelerometer" for c in columns):
        return columns
    again = (replace(column(_LINEAR.sub("", c.name)), name=c.name) for c in columns)
    return tuple(
        new if sensor_of(new.channel) == "accelerometer" else c
        for c, new in zip(columns, again, strict=True)
    )


def header(fields: list[str]) -> tuple[Column, ...] | None:
    """The columns that a line of names declares.

    Returns:
        None unless no field is a number and the three axes of an accelerometer, or of a
        gyroscope, are among them.
    """
    if any(re.fullmatch(r"\s*[-+.]?\d.*", field) for field in fields):
        return None
    columns = with_gravity(tuple(column(field) for field in fields))
    channels = [c.channel for c in columns if c.channel]
    if len(channels) != len(set(channels)):
        columns = _first_of_each(columns)
    if not any({f"{s}x", f"{s}y", f"{s}z"} <= set(channels) for s in "ag"):
        return None
    return columns


def _first_of_each(columns: tuple[Column, ...]) -> tuple[Column, ...]:
    seen: set[str] = set()
    kept = []
    for c in columns:
        kept.append(Column("", "", c.name) if c.channel in seen else c)
        if c.channel:
            seen.add(c.channel)
    return tuple(kept)


def _with_suffix(name: str, axis: str) -> tuple[str, str]:
    """The channel and unit of a name that ends in its unit: ``acc_x_mg``, ``timestamp_ms``."""
    two = _TWO_WORDS.match(name)
    head, _, tail = (two["name"], "_", two["unit"]) if two else name.rpartition("_")
    unit = _SUFFIXES.get(squeezed(tail), "") if head else ""
    channel = channel_of(head + axis) if unit else ""
    return channel, unit if channel else ""
