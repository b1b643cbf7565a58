"""Dates and times of day as files write them, in seconds."""

import re
from collections.abc import Iterable
from datetime import date

_DATE = r"(?P<year>\d{4})[-/.](?P<month>\d{1,2})[-/.](?P<day>\d{1,2})"
_CLOCK = r"(?P<hour>\d{1,2}):(?P<minute>\d{1,2}):(?P<second>\d{1,2}(?:[.,]\d+)?)"
_ZONE = r"\s*(?P<zone>Z|UTC|[-+]\d{2}:?\d{2})?"
_MOMENT = re.compile(rf"(?:{_DATE}[T\s]\s*)?{_CLOCK}{_ZONE}")
_EPOCH = date(1970, 1, 1).toordinal()
_DAY = 86_400.0


def seconds(text: str, milliseconds: bool = False) -> float:
    """Seconds since 1970 of ``2024-05-03T10:00:00.25+02:00``, since midnight of ``10:00:00.25``.

    Args:
        text: a date with a time, or a time of day.
        milliseconds: what stands behind the point counts milliseconds: ``.6`` is 6 ms.

    Raises:
        ValueError: it is neither.
    """
    match = _MOMENT.fullmatch(text)
    if match is None:
        raise ValueError(text)
    clock = 3600.0 * int(match["hour"]) + 60.0 * int(match["minute"])
    whole, _, rest = match["second"].replace(",", ".").partition(".")
    clock += float(f"{whole}.{rest.zfill(3) if milliseconds else rest}")
    if match["year"] is None:
        return clock
    day = date(int(match["year"]), int(match["month"]), int(match["day"]))
    return (day.toordinal() - _EPOCH) * _DAY + clock - _offset(match["zone"])


def is_moment(text: str) -> bool:
    """Whether a field is a date with a time, or a time of day."""
    return _MOMENT.fullmatch(text.strip("\"' ")) is not None


def counts_milliseconds(texts: Iterable[str]) -> bool:
    """Whether the digits behind the point are milliseconds without leading zeros, as WitMotion's.

    Decimals begin with a zero now and then, and end with none where they are shortened.
    """
    found = [match["second"].partition(".")[2] for text in texts if (match := _MOMENT.match(text))]
    sizes = {len(rest) for rest in found}
    begun = any(len(rest) > 1 and rest.startswith("0") for rest in found)
    ended = any(len(rest) > 1 and rest.endswith("0") for rest in found)
    return len(sizes) > 1 and max(sizes) <= len("999") and ended and not begun


def _offset(zone: str | None) -> float:
    """Seconds by which the clock of a zone is ahead."""
    if zone is None or not zone[1:3].isdigit():
        return 0.0
    size = 3600.0 * int(zone[1:3]) + 60.0 * int(zone[-2:])
    return -size if zone[0] == "-" else size
