"""What a column's name says: which channel it is and in which unit."""

import re

from imucal_wizard import units
from imucal_wizard.devices.formats.base import Column

_SENSORS: dict[str, str] = {
    word: channel
    for channel, words in {
        "a": "a acc accl accel accelerometer acceleration acceler accelero xl",
        "g": "g gyr gyro gyroscope gyros w omega rate angularrate angularvelocity rotation",
        "m": "m mag magn magnet magneto magnetometer magnetic magneticfield field compass",
    }.items()
    for word in words.split()
}
_SINGLE: dict[str, str] = {
    word: channel
    for channel, words in {
        "t": "t time timestamp timestamps ts micros millis tick ticks clock uptime timeus timems "
        "rtctime datetime",
        "temp": "temp temperature tmp tempr imutemp imudegc",
        "counter": "counter count cnt seq sequence packet packetcounter index sample samplecount",
    }.items()
    for word in words.split()
}
_AXES = {"x": "x", "y": "y", "z": "z", "0": "x", "1": "y", "2": "z"}
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
    "rads": "rad/s",
    "rps": "rad/s",
    "ut": "uT",
    "degc": "degC",
    "c": "degC",
    "raw": "count",
    "lsb": "count",
}
_BRACKETED = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]()]*)[\])]?\s*$")
_SENSOR_AXIS = re.compile(r"(?P<sensor>[a-z]+)(?P<axis>[xyz012])")
# the device has already taken gravity out of these, or left only gravity in
_NOT_A_READING = re.compile(r"linear|gravity|quat|euler|orient|yaw|pitch|roll|heading")
_IMPLIED = {
    "micros": "us",
    "millis": "ms",
    "timeus": "us",
    "timems": "ms",
    "rtctime": "s",
    "imudegc": "degC",
}


def column(name: str) -> Column:
    """The column that a name in a header means; channel ``""`` when it means nothing here."""
    name = name.strip().strip('"').strip()
    match = _BRACKETED.match(name)
    bare, unit = (match["name"], units.canonical(match["unit"])) if match else (name, "")
    channel = channel_of(bare)
    if not channel and not unit:
        channel, unit = _with_suffix(bare)
    if channel and not unit:
        unit = _IMPLIED.get(_squeezed(bare), "")
    return Column(channel, unit if channel and belongs(channel, unit) else "", name)


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
    names = {"t": "time", "temp": "temperature"}
    if channel in names:
        return names[channel]
    if len(channel) == 2 and channel[1] in "xyz":
        return {"a": "accelerometer", "g": "gyroscope", "m": "magnetometer"}[channel[0]]
    return None


def channel_of(name: str) -> str:
    """``ax`` for "AccelX", "acc_x", "aX", "Acceleration X", "acc.0"; ``""`` for what it is not."""
    word = _squeezed(name)
    if _NOT_A_READING.search(word):
        return ""
    if word in _SINGLE:
        return _SINGLE[word]
    match = _SENSOR_AXIS.fullmatch(word)
    if match is None or match["sensor"] not in _SENSORS:
        return ""
    return _SENSORS[match["sensor"]] + _AXES[match["axis"]]


def sensor_word(word: str) -> str:
    """``a``, ``g`` or ``m`` for a word that names a sensor, ``temp`` for one that names heat."""
    word = word.lower()
    if _NOT_A_READING.search(word):
        return ""
    single = _SINGLE.get(word, "")
    return single if single == "temp" else _SENSORS.get(word, "")


def header(fields: list[str]) -> tuple[Column, ...] | None:
    """The columns that a line of names declares.

    Returns:
        None unless no field is a number and the three axes of an accelerometer, or of a
        gyroscope, are among them.
    """
    if any(re.fullmatch(r"\s*[-+.]?\d.*", field) for field in fields):
        return None
    columns = tuple(column(field) for field in fields)
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


def _squeezed(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _with_suffix(name: str) -> tuple[str, str]:
    """The channel and unit of a name that ends in its unit: ``acc_x_mg``, ``timestamp_ms``."""
    head, separator, tail = name.rpartition("_")
    if not separator:
        return "", ""
    unit = _SUFFIXES.get(_squeezed(tail), "")
    channel = channel_of(head) if unit else ""
    return channel, unit if channel else ""
