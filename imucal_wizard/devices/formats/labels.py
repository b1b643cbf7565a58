"""What the words between the numbers of a line say: which channel, which unit."""

import re

from imucal_wizard import units
from imucal_wizard.devices.formats.base import Column
from imucal_wizard.devices.formats.names import belongs, sensor_of
from imucal_wizard.devices.formats.numbers import NUMBER
from imucal_wizard.devices.formats.words import channel_of, sensor_word

_WORD = re.compile(r"[A-Za-z]+")
_BRACKETED_UNIT = re.compile(r"[\[(]\s*([A-Za-zµμ°/^0-9²*]+)\s*[\])]")


def described(line: str) -> tuple[str, tuple[Column, ...]]:
    """The words at the start of a line and a column for each of its numbers.

    ``AccelX:0.1,AccelY:…``, ``Accl: x= 0.1 | y= …``, ``Acceleration X: 0.1, Y: … m/s^2`` and
    ``Acc (mg) [ 1, 2, 3 ], Gyr (DPS) [ …`` are understood; a number whose words mean nothing here
    gets a column without channel.
    """
    found: list[Column] = []
    position, sensor, place, unit = 0, "", 0, ""
    prefix = ""
    for match in NUMBER.finditer(line):
        label = line[position : match.start()]
        if not found:
            prefix = label.strip()
        else:
            found, label = _unit_behind(found, label)
        position = match.end()
        channel, told = _channel(label, sensor, place)
        if channel:
            sensor = told
            place = "xyz".find(channel[-1]) + 1 if len(channel) == 2 else 0
        elif _WORD.search(label):
            sensor, place = told, 0
        bracket = _BRACKETED_UNIT.search(label)
        if bracket or _WORD.search(label):
            unit = units.canonical(bracket[1]) if bracket else unit
        name = " ".join(_WORD.findall(label)) or channel or (found[-1].name if found else "")
        found.append(Column(channel, unit if belongs(channel, unit) else "", name))
    found, _ = _unit_behind(found, line[position:], last=True)
    return prefix, _once(found)


def _channel(label: str, sensor: str, place: int) -> tuple[str, str]:
    """The channel of the number after a label, and the sensor its words (or those before) name."""
    words = _WORD.findall(_BRACKETED_UNIT.sub(" ", label))
    if not words:
        axis = "xyz"[place : place + 1]
        return (sensor + axis if sensor in ("a", "g", "m") and axis else ""), sensor
    for taken in (words[-2:], words[-1:]):
        channel = channel_of("".join(taken))
        if channel:
            return channel, channel[0] if len(channel) == 2 else channel
    last = words[-1].lower()
    named = [sensor_word(word) for word in words if word.lower() not in ("x", "y", "z")]
    own = named[-1] if named else sensor
    if own == "temp":
        return "temp", own
    if own not in ("a", "g", "m"):
        return "", ""
    return own + (last if last in ("x", "y", "z") else "x"), own


def _unit_behind(columns: list[Column], text: str, last: bool = False) -> tuple[list[Column], str]:
    """Take a unit that stands behind the numbers it belongs to, and the text without it.

    A single letter between numbers is rather the next label (``g 0.1 0.2``) than a unit.
    """
    match = re.match(r"[\s\])|]*([A-Za-zµμ°/^0-9²]+)(?=[\s,;|\])]|$)", text)
    word = units.canonical(match[1]) if match else ""
    if match is None or not columns or (len(match[1]) == 1 and not last):
        return columns, text
    sensor = sensor_of(columns[-1].channel)
    if not belongs(columns[-1].channel, word):
        return columns, text
    changed = [
        Column(c.channel, word, c.name) if sensor_of(c.channel) == sensor and not c.unit else c
        for c in columns
    ]
    return changed, text[match.end() :]


def _once(columns: list[Column]) -> tuple[Column, ...]:
    """Every channel at its first place only."""
    seen: set[str] = set()
    kept = []
    for c in columns:
        kept.append(Column("", "", c.name) if c.channel in seen else c)
        seen.add(c.channel or "-")
    return tuple(kept)
