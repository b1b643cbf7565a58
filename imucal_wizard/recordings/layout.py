"""How the lines of a text file are written: what separates the fields, which of them are wanted."""

import contextlib
import csv
import re
from dataclasses import dataclass

_COMMA_NUMBER = re.compile(r"[-+]?\d+(?:,\d+)?(?:[eE][-+]?\d+)?")
_SHOWN = 48
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
_OPENING = ("(", "[", "{")
_NO_BRACKETS = str.maketrans("", "", "()[]{}")
LONGEST = 65_536
"""Characters; a longer line is no sample."""


@dataclass(frozen=True)
class Layout:
    """How the lines are written.

    Attributes:
        separator: ``,`` ``;`` ``|`` a tab, or None for any white space.
        width: numbers per line.
        used: places of the columns that are wanted; others may hold text.
        decimal_comma: whether ``9,81`` is one number.
        skip: a line that may come again and is no data (the header).
        milliseconds: whether the ``.6`` of a time of day is 6 ms.
    """

    separator: str | None
    width: int
    used: tuple[int, ...]
    decimal_comma: bool = False
    skip: str = ""
    milliseconds: bool = False


def separator_of(line: str) -> tuple[str | None, bool]:
    """The separator of a line, and whether its numbers are written with a decimal comma."""
    if '"' in line and (separator := _between_quotes(line)):
        return separator, _commas(split(line, separator))
    for separator in (";", "\t", "|"):
        if separator in line:
            return separator, _commas(split(line, separator))
    fields = line.split()
    if _commas(fields) and all(map(_COMMA_NUMBER.fullmatch, fields)):
        return None, True
    return ("," if "," in line else None), False


def _commas(fields: list[str]) -> bool:
    """Whether numbers among these are written with a decimal comma, and none with a point."""
    numbers = [field for field in fields if _COMMA_NUMBER.fullmatch(field)]
    points = any("." in field and is_number(field) for field in fields)
    return len(fields) > 1 and any("," in number for number in numbers) and not points


def _between_quotes(line: str) -> str:
    """What stands behind the first field in quotes."""
    match = re.match(r'\s*"[^"]*"\s*([,;\t|])', line)
    return match[1] if match else ""


def split(line: str, separator: str | None) -> list[str]:
    """The fields of one line without the white space, quotes and brackets around them."""
    if line.lstrip()[:1] in _OPENING:
        line = line.translate(_NO_BRACKETS)
    if '"' in line and separator is not None and line.count('"') % 2 == 0:
        with contextlib.suppress(csv.Error):
            fields = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
            return [field.strip() for field in fields]
    return [field.strip() for field in line.split(separator)]


def words_of(text: str) -> list[str]:
    """The words of a name such as ``AccelerometerUncalibrated`` or ``sensor_gyro_0``."""
    return [word.lower() for word in _WORD.findall(text)]


def shown(line: str) -> str:
    """A line of a file as a message may show it: short, and nothing but visible characters."""
    start = line.strip()[: _SHOWN + 1]
    visible = "".join(char if char.isprintable() else "·" for char in start)
    return repr(visible if len(visible) <= _SHOWN else visible[:_SHOWN] + "…")


def is_number(field: str) -> bool:
    """Whether a field of a first line is a number (an empty one or ``nan`` is data as well)."""
    field = field.strip("\"' ").replace(",", ".")
    try:
        float(field or "nan")
    except ValueError:
        return False
    return True
