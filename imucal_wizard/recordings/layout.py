"""How the lines of a text file are written: what separates the fields, which of them are wanted."""

import re
from dataclasses import dataclass

_COMMA_NUMBERS = re.compile(r"\s*[-+]?\d+,\d+([;\t ]+[-+]?\d+,\d+)+[;\s]*$")
_SHOWN = 48


@dataclass(frozen=True)
class Layout:
    """How the lines are written.

    Attributes:
        separator: ``,`` ``;`` a tab, or None for any white space.
        width: numbers per line.
        used: places of the columns that are wanted; others may hold text.
        decimal_comma: whether ``9,81`` is one number.
        skip: a line that may come again and is no data (the header).
    """

    separator: str | None
    width: int
    used: tuple[int, ...]
    decimal_comma: bool = False
    skip: str = ""


def separator_of(line: str) -> tuple[str | None, bool]:
    """The separator of a line, and whether its numbers are written with a decimal comma."""
    if _COMMA_NUMBERS.match(line):
        return (";" if ";" in line else None), True
    for separator in (";", ",", "\t"):
        if separator in line:
            return separator, False
    return None, False


def split(line: str, separator: str | None) -> list[str]:
    """The fields of one line without the white space around them."""
    return [field.strip() for field in line.split(separator)]


def shown(line: str) -> str:
    """A line of a file as a message may show it: short, and nothing but visible characters."""
    visible = "".join(char if char.isprintable() else "·" for char in line.strip())
    return repr(visible if len(visible) <= _SHOWN else visible[:_SHOWN] + "…")


def is_number(field: str) -> bool:
    """Whether a field of a first line is a number (an empty one or ``nan`` is data as well)."""
    field = field.strip("\"' ").replace(",", ".")
    try:
        float(field or "nan")
    except ValueError:
        return False
    return True
