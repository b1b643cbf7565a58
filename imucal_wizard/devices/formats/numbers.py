"""Printed numbers: the same value whether read one by one or a batch at once."""

import math
import re

import numpy as np

from imucal_wizard.devices.formats.moment import is_moment, seconds
from imucal_wizard.readings import FloatArray

_NUMERIC = b"0123456789+-.eE \t"
_NOT_A_NUMBER = frozenset(
    (b"", b"nan", b"-nan", b"+nan", b"inf", b"+inf", b"-inf", b"ovf", b"-ovf", b"null", b"none")
)

LARGEST = 1e30
"""A larger number is no reading and no time (nanoseconds since 1970 have 19 digits)."""

NUMBER = re.compile(
    r"(?<![\w.^])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w^])"
    r"|(?<!\w)[-+]?(?:nan|inf|ovf)(?!\w)",
    re.IGNORECASE,
)
"""A number between words: not the 2 of ``m/s^2``, not the 1 of ``Cal1``."""


def number(field: bytes) -> float | None:
    """The value of one printed field.

    Returns:
        NaN for an empty field and for what firmware prints when it has no number (``nan``,
        ``inf``, ``ovf``); seconds for a time of day; None when it is text.
    """
    field = field.strip()
    if not field.translate(None, _NUMERIC):
        try:
            value = float(field)
        except ValueError:
            return math.nan if not field else None
        return value if abs(value) < LARGEST else math.nan
    if field.lower() in _NOT_A_NUMBER:
        return math.nan
    if field.count(b":") < len("::"):
        return None
    try:
        return seconds(field.decode("ascii"))
    except ValueError:
        return None


def wordless(field: bytes) -> bool:
    """Whether a field holds no letter: a date may stand in a line of numbers, a label may not."""
    if not field.isascii():
        return False
    return field.upper() == field.lower() or is_moment(field.decode())


def decimals(field: bytes) -> int:
    """How many decimals are printed in this field; 17 for a number with an exponent."""
    if b"e" in field.lower():
        return 17
    return len(field.strip().partition(b".")[2])


def batch(lines: list[bytes], separator: bytes, columns: int) -> FloatArray | None:
    """Plain numeric lines all at once.

    Args:
        lines: whole lines without their ends.
        separator: one byte between the fields; ``b" "`` stands for any run of blanks.
        columns: fields per line.

    Returns:
        Shape (len(lines), columns), or None when any line is not plain: then each is read with
        care. Where it answers, ``number`` gives the same values to the last bit.
    """
    block = separator.join(lines)
    if block.translate(None, _NUMERIC + separator) or (separator == b" " and b"\t" in block):
        return None
    if separator == b" ":
        if any(len(line.split()) != columns for line in lines):
            return None
        fields = block.split()
    else:
        wanted = columns - 1
        if any(line.count(separator) != wanted for line in lines):
            return None
        fields = block.split(separator)
    try:
        values = np.fromiter(map(float, fields), np.float64, len(lines) * columns)
    except ValueError:
        return None
    if not (np.abs(values) < LARGEST).all():
        return None
    return values.reshape(len(lines), columns)
