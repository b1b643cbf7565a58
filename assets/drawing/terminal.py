"""A terminal's screen as an SVG that looks alike everywhere: no font is loaded from anywhere."""

from collections.abc import Iterator
from dataclasses import dataclass
from html import escape

import pyte
from pyte.screens import Char

from assets.drawing.glyphs import CELL, LINE, drawn
from assets.drawing.svg import number

INK, GROUND, FRAME = "#e0e0e0", "#121212", "#2b2f33"
_EDGE, _BAR = 10.0, 26.0
_FONT = "DejaVu Sans Mono, Menlo, Consolas, Liberation Mono, monospace"
_SIZE = 14.0
_NAMED = {
    "black": "#000000",
    "red": "#cd3131",
    "green": "#0dbc79",
    "brown": "#e5e510",
    "blue": "#2472c8",
    "magenta": "#bc3fbc",
    "cyan": "#11a8cd",
    "white": "#e5e5e5",
}


@dataclass(frozen=True)
class Look:
    """How a character looks: its colour, what is behind it, whether it is bold or underlined."""

    ink: str
    ground: str
    bold: bool = False
    underlined: bool = False


@dataclass(frozen=True)
class Run:
    """Characters beside one another that look alike, from a column on."""

    column: int
    text: str
    look: Look


def picture(screen: pyte.Screen, title: str) -> str:
    """The screen in a window with a title."""
    width = screen.columns * CELL + 2.0 * _EDGE
    height = screen.lines * LINE + _BAR + _EDGE
    title_at = f'x="{number(width / 2.0)}" y="18" fill="#b9c0c5" text-anchor="middle"'
    ground = _sized(screen.columns * CELL, screen.lines * LINE)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {number(width)} {number(height)}"',
        f'font-family="{_FONT}" font-size="{number(_SIZE)}">',
        f'<rect {_sized(width, height)} rx="8" fill="{FRAME}"/>',
        *(f'<circle cx="{18 + 16 * i}" cy="13" r="4.5" fill="#5b6268"/>' for i in range(3)),
        f"<text {title_at}>{escape(title)}</text>",
        f'<g transform="translate({number(_EDGE)} {number(_BAR)})">',
        f'<rect {ground} fill="{GROUND}"/>',
        *(part for row in range(screen.lines) for part in _row(screen, row)),
        "</g>",
        "</svg>",
        "",
    ]
    return "\n".join(parts)


def _sized(width: float, height: float) -> str:
    return f'width="{number(width)}" height="{number(height)}"'


def _row(screen: pyte.Screen, row: int) -> Iterator[str]:
    top = row * LINE
    for run in _runs([screen.buffer[row][column] for column in range(screen.columns)]):
        x = run.column * CELL
        if run.look.ground != GROUND:
            where = f'x="{number(x)}" y="{number(top)}" {_sized(len(run.text) * CELL, LINE)}'
            yield f'<rect {where} fill="{run.look.ground}" shape-rendering="crispEdges"/>'
        yield from _written(run, top)


def _runs(cells: list[Char]) -> Iterator[Run]:
    start, text, look = 0, "", None
    for column, cell in enumerate(cells):
        own = _look(cell)
        if look is not None and own != look:
            yield Run(start, text, look)
            start, text = column, ""
        text, look = text + (cell.data or " "), own
    if look is not None:
        yield Run(start, text, look)


def _look(cell: Char) -> Look:
    ink, ground = _colour(cell.fg, INK), _colour(cell.bg, GROUND)
    if cell.reverse:
        ink, ground = ground, ink
    return Look(ink, ground, cell.bold, cell.underscore)


def _colour(name: str, usual: str) -> str:
    if name == "default":
        return usual
    return _NAMED.get(name.removeprefix("bright"), f"#{name}")


def _written(run: Run, top: float) -> Iterator[str]:
    """Words as text; signs that are no letters one by one, in the middle of their cells."""
    word, begin = "", 0
    for offset, character in enumerate(f"{run.text} "):
        if character.isascii() and character != " ":
            begin = begin if word else offset
            word += character
            continue
        if word:
            yield _text(run, begin, word, top)
            word = ""
        x = (run.column + offset) * CELL
        if character != " ":
            shape = drawn(character, x, top, run.look.ink)
            yield shape or _text(run, offset, character, top)


def _text(run: Run, offset: int, word: str, top: float) -> str:
    x = (run.column + offset + 0.5 * len(word)) * CELL
    style = ' font-weight="bold"' if run.look.bold else ""
    style += ' text-decoration="underline"' if run.look.underlined else ""
    if len(word) > 1:
        style += f' textLength="{number(len(word) * CELL)}"'
    where = f'x="{number(x)}" y="{number(top + 0.74 * LINE)}" text-anchor="middle"'
    return f'<text {where} fill="{run.look.ink}"{style}>{escape(word)}</text>'
