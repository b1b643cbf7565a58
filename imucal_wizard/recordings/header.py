"""Names of columns, as programs and people write them, to channels and units."""

import re

from imucal_wizard.devices.formats.base import Column
from imucal_wizard.units import COUNT, FACTORS, canonical

SENSOR_CHANNELS: dict[str, tuple[str, ...]] = {
    "accelerometer": ("ax", "ay", "az"),
    "gyroscope": ("gx", "gy", "gz"),
    "magnetometer": ("mx", "my", "mz"),
    "temperature": ("temp",),
}
"""The channels of each sensor, in axis order."""

_STEMS: dict[str, str] = {
    **dict.fromkeys(
        ["a", "acc", "accel", "accl", "accelerometer", "acceleration", "linearacceleration"], "a"
    ),
    **dict.fromkeys(
        ["g", "gyr", "gyro", "gyroscope", "angularvelocity", "angularrate", "w", "omega"], "g"
    ),
    **dict.fromkeys(["m", "mag", "magn", "magnetometer", "magnetic", "magneticfield"], "m"),
}
_WHOLE: dict[str, str] = {
    **dict.fromkeys(["t", "time", "timestamp", "ts", "stamp", "millis", "micros"], "t"),
    **dict.fromkeys(["temp", "temperature", "tmp"], "temp"),
    **dict.fromkeys(
        ["n", "nsamples", "samples", "sample", "samplenumber", "index", "idx", "counter",
         "packetcounter", "seq"],
        "counter",
    ),
}  # fmt: skip
_IGNORED_WORDS = {"imu", "raw", "sensor", "data", "calibrated", "uncalibrated"}
_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]\s*$")


def sensor_of(channel: str) -> str:
    """``accelerometer``, ``gyroscope``, ``magnetometer``, ``temperature``, ``time`` or ``""``."""
    if channel == "t":
        return "time"
    for sensor, channels in SENSOR_CHANNELS.items():
        if channel in channels:
            return sensor
    return ""


def _channel(words: list[str]) -> str:
    """The channel that lower-case words such as ``["acc", "x"]`` mean, or ``""``."""
    joined = "".join(word for word in words if word not in _IGNORED_WORDS)
    if joined in _WHOLE:
        return _WHOLE[joined]
    for axis in "xyz":
        if joined.endswith(axis) and joined[:-1] in _STEMS:
            return _STEMS[joined[:-1]] + axis
        if joined.startswith(axis) and joined[1:] in _STEMS:
            return _STEMS[joined[1:]] + axis
    return ""


def _unit_for(channel: str, word: str) -> str:
    """The word as a unit of this channel, or ``""`` when it is none."""
    sensor = sensor_of(channel)
    unit = canonical(word)
    has_counts = sensor in ("accelerometer", "gyroscope", "magnetometer")
    known = unit in FACTORS.get(sensor, {}) or (unit == COUNT and has_counts)
    return unit if known else ""


def _by_suffix(words: list[str]) -> tuple[str, str]:
    """Channel and unit of names that end in their unit, such as ``timestamp_ms``, ``gyr_x_dps``."""
    if len(words) > 1 and (channel := _channel(words[:-1])):
        return channel, _unit_for(channel, words[-1])
    if len(words) > 2 and (channel := _channel(words[:-2])):
        return channel, _unit_for(channel, "/".join(words[-2:]))
    return "", ""


def column(text: str) -> Column:
    """What one name in a header (or in ``--columns``) stands for.

    Returns:
        The column; its channel is ``""`` for a name that means nothing here, its unit ``""``
        where the name does not say it, and an unknown word in brackets stays as it is.
    """
    name = text.strip().strip("\"'").strip()
    bare, bracketed = name, ""
    if match := _BRACKETS.match(name):
        bare, bracketed = match["name"], match["unit"].strip()
    original = [word for word in re.split(r"[\s_.\-]+", bare) if word]
    words = [word.lower() for word in original]
    channel, unit = _channel(words), {"millis": "ms", "micros": "us"}.get("".join(words), "")
    if not channel:
        channel, unit = _by_suffix(words[:-1] + original[-1:])
        if not channel and words[-1:] == ["degc"]:
            channel, unit = "temp", "degC"
    if bracketed:
        unit = canonical(bracketed)
    if channel == "temp":
        unit = unit or "degC"
    return Column(channel, unit, name)
