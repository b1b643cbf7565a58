"""Words and numbers for a screen: what devices say is made harmless, numbers are kept short."""

import math
import textwrap

from imucal_wizard.digits import decimals, fixed

Span = tuple[str, str]
"""A piece of text and the name of its style (``""``, ``strong``, ``quiet``, ``good`` …)."""
Line = tuple[Span, ...]
"""One row of a screen."""
_CELL = 4
"""Characters there are for a value beside a short bar."""


def clean(text: str) -> str:
    """The text without what a terminal could obey: control and format characters."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if c.isprintable() else " " if c.isspace() else "" for c in text)


def line(text: str, style: str = "") -> Line:
    """A row in one style."""
    return ((text, style),)


def width_of(row: Line) -> int:
    """How many characters a row has."""
    return sum(len(text) for text, _ in row)


def wrapped(text: str, width: int, style: str = "", indent: str = "") -> list[Line]:
    """The text as rows of at most ``width`` characters; rows after the first are indented."""
    rows = textwrap.wrap(
        clean(text), max(8, width), subsequent_indent=indent, break_on_hyphens=False
    )
    return [line(row, style) for row in rows]


def signed(name: str) -> str:
    """A pose's name as people write it: ``+x-y`` becomes ``+x−y``."""
    return name.replace("-", "−")


def number(value: float, digits: int = 3) -> str:
    """A number with about ``digits`` significant digits and a true minus sign."""
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    if not 1e-4 <= abs(value) < 1e6:
        return f"{value:.{digits - 1}e}".replace("-", "−")
    return fixed(value, decimals(value, digits))


def compact(value: float, places: int) -> str:
    """A number of at most four characters where that can be, with a k or M for thousands."""
    for size, letter, shown in ((1.0, "", places), (1.0, "", 0), (1e3, "k", 0), (1e6, "M", 0)):
        text = fixed(value / size, shown) + letter
        if len(text) <= _CELL:
            return text
    return text


def clock(seconds: float) -> str:
    """Seconds as ``04:12``."""
    whole = max(0, int(seconds))
    return f"{whole // 60:02d}:{whole % 60:02d}"


def bar(fraction: float, width: int) -> str:
    """A bar that is ``fraction`` full, between two edges, ``width`` characters in all."""
    inner = max(1, width - 2)
    filled = 0 if math.isnan(fraction) else round(min(1.0, max(0.0, fraction)) * inner)
    return "▕" + "█" * filled + "░" * (inner - filled) + "▏"


_UNITS = {
    "m/s^2": "m/s²",
    "deg/s": "°/s",
    "mdeg/s": "m°/s",
    "degC": "°C",
    "uT": "µT",
    "deg": "°",
    "1": "",
}


def known_as(unit: str) -> tuple[str, float]:
    """The unit in which people know a reading, and the factor to it: rates in degrees."""
    return ("deg/s", math.degrees(1.0)) if unit == "rad/s" else (unit, 1.0)


def unit_sign(unit: str) -> str:
    """A unit word as people write it: ``m/s^2`` becomes ``m/s²``; a mere ratio has none."""
    return _UNITS.get(unit, clean(unit).replace("^2", "²"))
