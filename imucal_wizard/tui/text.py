"""Rows of text for a screen: cleaned text, wrapping, short numbers, bars, styles."""

import math
import textwrap
from collections.abc import Iterable
from itertools import groupby

from rich.style import Style
from rich.text import Text

from imucal_wizard.core.quantities import fixed

Span = tuple[str, str]
"""A piece of text and the name of its style (``""``, ``strong``, ``quiet``, ``good`` …)."""
Line = tuple[Span, ...]
"""One row of a screen."""
_CELL = 4
"""Characters of a value beside a short bar."""


def clean(text: str) -> str:
    """The text without control and format characters, which a terminal would obey."""
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


def compact(value: float, places: int) -> str:
    """A number of at most four characters if possible, with k or M for thousands."""
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


def known_as(unit: str) -> tuple[str, float]:
    """The unit that people use for a reading, and the factor to it: rates in degrees."""
    return ("deg/s", math.degrees(1.0)) if unit == "rad/s" else (unit, 1.0)


STYLES = {
    "": Style(),
    "strong": Style(bold=True),
    "quiet": Style(dim=True),
    "good": Style(color="green", bold=True),
    "warn": Style(color="yellow", bold=True),
    "bad": Style(color="red", bold=True),
    "accent": Style(color="cyan", bold=True),
    "key": Style(color="cyan", bold=True),
}
"""The styles of a row, in the colours of the theme. Colour only repeats a word or a sign."""
_SIGNS = {
    "◆": "accent", "●": "warn", "∘": "strong", "·": "accent", "×": "accent", "⊗": "good",
    "━": "accent",
    "▸": "accent", "▼": "good", "▲": "warn", **dict.fromkeys("█▉▊▋▌▍▎▏»", "accent"),
}  # fmt: skip
"""Style of each sign of a plot or table."""


def rich_text(rows: Iterable[Line]) -> Text:
    """Rows as Rich shows them."""
    spans = [[(text, STYLES[style]) for text, style in row] for row in rows]
    return Text("\n").join(Text.assemble(*row) for row in spans)


def by_sign(row: str, rest: str = "quiet") -> Line:
    """A row of a plot or table, each sign in its style, the rest in another one."""
    return tuple(
        ("".join(same), style) for style, same in groupby(row, lambda sign: _SIGNS.get(sign, rest))
    )
