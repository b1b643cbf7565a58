"""Printed numbers, dates and times of day; reading one or many at once gives the same values."""

import io
import math
import re
from datetime import date

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.readings import MAX_READING, FloatArray, IntArray

_NUMERIC = b"0123456789+-.eE \t"
_PLAIN = b"0123456789+-.eE, "
_NOT_A_NUMBER = frozenset(
    b" nan -nan +nan inf +inf -inf ovf -ovf null none n/a na".split(b" ")
)  # the first one is the empty field
_MATLAB_LEAST, _MATLAB_MOST = b"   0.0000000e+00", b"  -9.9999999e-99"
"""The least and the largest byte in each place of a number of ``save -ascii``, of those in
``_NUMERIC``."""
_MATLAB_WEIGHTS = np.zeros((16, 3), np.float32)
"""Weight of each place in the first four digits, in the last four, and in the exponent."""
_MATLAB_WEIGHTS[[3, 5, 6, 7], 0] = _MATLAB_WEIGHTS[8:12, 1] = 1000.0, 100.0, 10.0, 1.0
_MATLAB_WEIGHTS[14:, 2] = 10.0, 1.0
_EXACT_POWERS = 10.0 ** np.arange(23)
_EXACT_DIGITS = 15
"""Digits of an integer that a float holds exactly."""
_MIN_DECIMAL_BYTES = 4096
"""Bytes from which that is faster."""
_INTEGER_POWERS = 10 ** np.arange(_EXACT_DIGITS + 1, dtype=np.uint64)
_LINE_FEED, _POINT = ord("\n"), ord(".")

_Words = NDArray[np.uint64]
_WORD = 8
"""Bytes of a word, each a digit."""
_EIGHT_ZEROS = np.uint64(0x3030_3030_3030_3030)
_MORE_THAN_NINE, _HIGH_BITS = np.uint64(0x7676_7676_7676_7676), np.uint64(0x8080_8080_8080_8080)
"""What sets the high bit of a byte above 9, and these bits."""
_LAST_BYTES = np.array([(1 << 64) - (1 << 8 * (8 - count)) for count in range(9)], np.uint64)
"""Masks of the last 0 to 8 bytes of a word."""
_JOINED = (
    (np.uint64(0x0F0F_0F0F_0F0F_0F0F), np.uint64(1 + (10 << 8)), np.uint64(8)),
    (np.uint64(0x00FF_00FF_00FF_00FF), np.uint64(1 + (100 << 16)), np.uint64(16)),
    (np.uint64(0x0000_FFFF_0000_FFFF), np.uint64(1 + (10_000 << 32)), np.uint64(32)),
)
"""Mask, factor and shift that join two digits, two pairs, two fours."""
_COMMA_NUMBER = re.compile(rb"[-+]?\d+,\d+(?:[eE][-+]?\d+)?")

NUMBER = re.compile(
    r"(?<![\w.^])[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?(?![\w^])"
    r"|(?<!\w)[-+]?(?:nan|inf|ovf)(?!\w)",
    re.IGNORECASE,
)
"""A number between words, but not the 2 of ``m/s^2`` or the 1 of ``Cal1``."""

_DATE = r"(?P<year>\d{4})[-/.](?P<month>\d{1,2})[-/.](?P<day>\d{1,2})"
_CLOCK = r"(?P<hour>\d{1,2}):(?P<minute>\d{1,2}):(?P<second>\d{1,2}(?:[.,]\d+)?)"
_ZONE = r"\s*(?P<zone>Z|UTC|[-+]\d{2}:?\d{2})?"
_MOMENT = re.compile(rf"(?:{_DATE}[T\s]\s*)?{_CLOCK}{_ZONE}")
_EPOCH = date(1970, 1, 1).toordinal()
_DAY = 86_400.0


def printed_number(field: bytes) -> float | None:
    """The value of one printed field.

    Returns:
        NaN for an empty field and for the words that firmware prints instead of a number (``nan``,
        ``inf``, ``ovf``); seconds for a time of day; None for text. A number may have a decimal
        comma.
    """
    field = field.strip()
    if not field.translate(None, _NUMERIC):
        try:
            value = float(field)
        except ValueError:
            return math.nan if not field else None
        return value if abs(value) < MAX_READING else math.nan
    if field.lower() in _NOT_A_NUMBER:
        return math.nan
    if _COMMA_NUMBER.fullmatch(field):
        return printed_number(field.replace(b",", b"."))
    if field.count(b":") < len("::"):
        return None
    try:
        return _seconds_of_time(field.decode("ascii"))
    except ValueError:
        return None


def plain_numbers(line: bytes) -> list[float]:
    """The values of a line whose separator is a comma, if all its fields are plain numbers.

    Returns:
        The values of ``printed_number``, a third as long; empty if they must be read one by one.
    """
    if b"." not in line or line.translate(None, _PLAIN):  # without a point, commas may be decimal
        return []
    try:
        values = list(map(float, line.split(b",")))
    except ValueError:
        return []
    return values if max(values) < MAX_READING and min(values) > -MAX_READING else []


def without_letters(field: bytes) -> bool:
    """Whether a field has no letters; a date may occur in a line of numbers, a label may not."""
    if not field.isascii():
        return False
    return field.upper() == field.lower() or _is_time(field.decode())


def printed_decimals(field: bytes) -> int:
    """Number of decimals printed in a field; 17 for a number with an exponent."""
    if b"e" in field.lower():
        return 17
    return len(field.strip().replace(b",", b".").partition(b".")[2])


def number_table(block: bytes, separator: bytes, columns: int) -> FloatArray | None:
    """Read plain numeric lines at once.

    Args:
        block: whole lines, each with LF at its end.
        separator: one byte between the fields; ``b" "`` means any number of blanks.
        columns: fields per line.

    Returns:
        Shape (non-empty lines, columns), or None if any line is not plain and the lines must be
        read one by one. The values are bit-identical to those of ``printed_number``.
    """
    foreign = block.translate(None, _NUMERIC + separator + b"\nnaNA")
    if foreign or block.isspace() or (separator != b"\t" and b"\t" in block):
        return None  # a tab may separate, too
    if separator == b" ":
        values = _matlab_table(block, columns)
    else:
        values = _decimal_table(block, separator, columns)
        block = block if values is not None else _with_nan(block, separator)
    try:
        if values is None:
            values = np.loadtxt(
                io.StringIO(block.decode("ascii")),
                delimiter=None if separator == b" " else separator.decode("ascii"),
                comments=None,
                ndmin=2,
            )
    except ValueError:
        return None
    inside = ~(np.abs(values) >= MAX_READING)
    if values.shape[1] != columns or not inside.all():
        return None
    return np.asarray(values, np.float64)


def _decimal_table(block: bytes, separator: bytes, columns: int) -> FloatArray | None:
    """Read numbers of up to fifteen digits without an exponent, a sixth as long.

    All digits together are an exact integer, and so is the power of ten by which it is divided, so
    that the quotient is rounded as correctly as any conversion. The digits are taken from all
    numbers at once.

    Args:
        block: whole lines, each with LF at its end.
        separator: one byte between the fields.
        columns: fields per line; NaN for an empty one.

    Returns:
        Shape (lines, columns), or None if the lines are not such.
    """
    if len(block) < _MIN_DECIMAL_BYTES:
        return None
    chars = np.frombuffer(block, np.uint8)
    line_ends = chars == _LINE_FEED
    places = np.flatnonzero(line_ends | (chars == separator[0]) | (chars == _POINT))
    is_point = chars[places] == _POINT
    last = np.flatnonzero(~is_point)
    ends = places[last]
    if (
        (is_point[1:] & is_point[:-1]).any()
        or len(ends) % columns
        or np.count_nonzero(line_ends) * columns != len(ends)
        or not line_ends[ends[columns - 1 :: columns]].all()
    ):
        return None
    starts = np.concatenate(([0], ends[:-1] + 1))
    minus = chars[starts] == ord("-")
    signed = minus | (chars[starts] == ord("+"))
    pointed = is_point[last - 1] & (last > 0)
    decimals = np.where(pointed, ends - places[last - 1] - 1, 0)
    count = ends - starts - signed - pointed
    if count.max() > _EXACT_DIGITS:
        return None
    # without the points, the digits of a number stand together
    padded = bytes(2 * _WORD) + block.translate(None, b".")
    words = np.ndarray((len(padded) - _WORD + 1,), "<u8", padded, 0, (1,))
    digits = _digits(words, ends - np.cumsum(pointed) + _WORD, count)
    empty = count == 0
    if digits is None or (empty & (signed | pointed)).any():
        return None
    values: FloatArray = digits / _EXACT_POWERS[decimals]
    np.negative(values, out=values, where=minus)
    values[empty] = np.nan
    return values.reshape(-1, columns)


def _digits(words: _Words, places: IntArray, counts: IntArray) -> _Words | None:
    """The integers of up to 16 digits that end with these words.

    Args:
        words: the eight bytes from each byte on, shape (m,).
        places: the word of the last eight digits of each integer, shape (n,).
        counts: number of digits of each, shape (n,); 0 is the value of none.

    Returns:
        Shape (n,), or None if a byte is no digit.
    """
    low = _eight_digits(words[places], np.minimum(counts, _WORD))
    longer = np.flatnonzero(counts > _WORD)
    if low is None or not len(longer):
        return low
    high = _eight_digits(words[places[longer] - _WORD], counts[longer] - _WORD)
    if high is None:
        return None
    low[longer] += high * _INTEGER_POWERS[_WORD]
    return low


def _eight_digits(words: _Words, counts: IntArray) -> _Words | None:
    """The integers that the last bytes of these words print; None if one of them is no digit.

    The first of eight digits is the least significant byte. Neighbouring digits, then pairs, then
    fours are joined in all places of a word by one multiplication.
    """
    words = (words ^ _EIGHT_ZEROS) & _LAST_BYTES[counts]
    if np.bitwise_or.reduce((words + _MORE_THAN_NINE) | words) & _HIGH_BITS:
        return None
    for mask, factor, shift in _JOINED:
        words &= mask
        words *= factor
        words >>= shift
    return words


def _with_nan(block: bytes, separator: bytes) -> bytes:
    """The lines with ``nan`` in empty fields: a slow sensor has no number in most lines."""
    empty, named = 2 * separator, separator + b"nan" + separator
    block = block.replace(empty, named).replace(empty, named)  # a second time for odd ones in a row
    block = block.replace(separator + b"\n", separator + b"nan\n")
    block = block.replace(b"\n" + separator, b"\nnan" + separator)
    return b"nan" + block if block.startswith(separator) else block


def _matlab_table(block: bytes, columns: int) -> FloatArray | None:
    """Read what MATLAB's ``save -ascii`` writes, sixteen characters a number, a third as long.

    Eight digits are an exact integer, and so are the powers of ten up to 10²²: one multiplication
    or division rounds as correctly as any conversion.

    Args:
        block: whole lines, each with LF at its end.
        columns: numbers per line.

    Returns:
        Shape (lines, columns), or None if the lines are not such.
    """
    least, most = (one * columns + b"\n" for one in (_MATLAB_LEAST, _MATLAB_MOST))
    if len(block) % len(least):
        return None
    lines, low, high = (np.frombuffer(one, np.uint8) for one in (block, least, most))
    lines = lines.reshape(-1, len(least))
    # below the least, the difference of bytes wraps around to a large one
    if (lines - low > high - low).any():
        return None
    chars = lines[:, :-1].reshape(-1, len(_MATLAB_LEAST))
    digits = (chars - np.uint8(ord("0"))).astype(np.float32)
    first, last, exponent = (digits @ _MATLAB_WEIGHTS).T.astype(np.int64)
    minus, down = (chars[:, place] == ord("-") for place in (2, 13))
    power = np.where(down, -exponent, exponent) - 7
    if (np.abs(power) >= len(_EXACT_POWERS)).any():
        return None
    mantissa, factor = 10_000 * first + last, _EXACT_POWERS[np.abs(power)]
    values = np.where(power < 0, mantissa / factor, mantissa * factor)
    return np.asarray(np.where(minus, -values, values).reshape(-1, columns))


def _seconds_of_time(text: str) -> float:
    """Seconds since 1970 of ``2024-05-03T10:00:00.25+02:00``, since midnight of ``10:00:00.25``.

    Args:
        text: a date with a time, or a time of day.

    Raises:
        ValueError: it is neither.
    """
    match = _MOMENT.fullmatch(text.strip("\"' "))
    if match is None:
        raise ValueError(text)
    clock = 3600.0 * int(match["hour"]) + 60.0 * int(match["minute"])
    clock += float(match["second"].replace(",", "."))
    if match["year"] is None:
        return clock
    day = date(int(match["year"]), int(match["month"]), int(match["day"]))
    return (day.toordinal() - _EPOCH) * _DAY + clock - _offset(match["zone"])


def _is_time(text: str) -> bool:
    """Whether a field is a date with a time, or a time of day."""
    return _MOMENT.fullmatch(text.strip("\"' ")) is not None


def _offset(zone: str | None) -> float:
    """Seconds by which a time zone is ahead of UTC."""
    if zone is None or not zone[1:3].isdigit():
        return 0.0
    size = 3600.0 * int(zone[1:3]) + 60.0 * int(zone[-2:])
    return -size if zone[0] == "-" else size
