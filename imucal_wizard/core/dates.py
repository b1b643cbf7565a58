"""Dates: seconds since 1970 inside, ISO 8601 with offset in files, local time for people.

A clock that was never set, or that has jumped, gives dates that no calendar has; they are unknown.
"""

import datetime as dt

UNKNOWN_DATE = "–"
SECONDS_PER_DAY = 86400.0
SECONDS_PER_YEAR = 365.25 * SECONDS_PER_DAY
SECONDS_PER_MONTH = SECONDS_PER_YEAR / 12.0


def seconds_of(text: str) -> float | None:
    """Seconds since 1970 of an ISO 8601 date; None if it is none."""
    try:
        return dt.datetime.fromisoformat(text).astimezone().timestamp()
    except (ValueError, OverflowError, OSError):
        return None


def iso_date(seconds: float) -> str | None:
    """ISO 8601 with the local offset, to the second; None if there is no such date."""
    local = _local(seconds)
    return None if local is None else local.isoformat(timespec="seconds")


def iso_now() -> str:
    """The present date and time, ISO 8601 with the local offset, to the second."""
    return dt.datetime.now().astimezone().isoformat(timespec="seconds")


def date_text(seconds: float) -> str:
    """Date and time of day here: ``2031-02-20 14:05``; a dash if there is no such date."""
    local = _local(seconds)
    return UNKNOWN_DATE if local is None else f"{local:%Y-%m-%d %H:%M}"


def day_text(seconds: float) -> str:
    """The date here: ``2031-02-20``; a dash if there is no such date."""
    return date_text(seconds)[: len("2031-02-20")]


def _local(seconds: float) -> dt.datetime | None:
    try:
        return dt.datetime.fromtimestamp(seconds).astimezone() if seconds else None
    except (ValueError, OverflowError, OSError):
        return None
