"""The few elements of SVG that the drawings are made of, as text."""

from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

Point = tuple[float, float]

SANS = "DejaVu Sans, Verdana, Helvetica, Arial, sans-serif"
INK, QUIET, PAPER = "#1d2327", "#59636b", "#ffffff"


def number(value: float) -> str:
    """A hundredth of a unit is finer than any printer."""
    return f"{round(value, 2) + 0.0:g}"


def _attributes(values: "Style") -> str:
    pairs = (
        (name.rstrip("_").replace("_", "-"), v if isinstance(v, str) else number(v))
        for name, v in values.items()
    )
    return "".join(f' {name}="{escape(text)}"' for name, text in pairs)


Style = dict[str, str | float]
"""Attributes of an element; ``_`` stands for the hyphen in their names."""


def path(points: Sequence[Point], **style: str | float) -> str:
    """A line through points."""
    return f'<path d="{_way(points)}"{_attributes({"fill": "none", **style})}/>'


def area(points: Sequence[Point], **style: str | float) -> str:
    """The area that points enclose."""
    return f'<path d="{_way(points)}Z"{_attributes(style)}/>'


def _way(points: Sequence[Point]) -> str:
    return "M" + "L".join(f"{number(x)} {number(y)}" for x, y in points)


def text(place: Point, words: str, size: float, **style: str | float) -> str:
    """Words at a place; ``text_anchor`` says which end of them."""
    style.setdefault("fill", INK)
    where = f'x="{number(place[0])}" y="{number(place[1])}" font-size="{number(size)}"'
    return f"<text {where}{_attributes(style)}>{escape(words)}</text>"


def rectangle(corner: Point, width: float, height: float, **style: str | float) -> str:
    """A rectangle."""
    x, y = map(number, corner)
    size = f'width="{number(width)}" height="{number(height)}"'
    return f'<rect x="{x}" y="{y}" {size}{_attributes(style)}/>'


def arrow(start: Point, tip: Point, width: float, colour: str, head: float) -> list[str]:
    """A straight arrow."""
    (x0, y0), (x1, y1) = start, tip
    length = ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5 or 1.0
    along = (x1 - x0) / length, (y1 - y0) / length
    neck = x1 - head * along[0], y1 - head * along[1]
    wide = 0.42 * head
    left = neck[0] - wide * along[1], neck[1] + wide * along[0]
    right = neck[0] + wide * along[1], neck[1] - wide * along[0]
    return [
        path([start, neck], stroke=colour, stroke_width=width),
        area([left, tip, right], fill=colour),
    ]


def moved(elements: Iterable[str], by: Point) -> str:
    """Elements as one group at another place."""
    return f'<g transform="translate({number(by[0])} {number(by[1])})">{"".join(elements)}</g>'


def write(place: Path, width: float, height: float, elements: Iterable[str]) -> None:
    """A file with these elements on paper; sizes in millimetres."""
    place.write_text(document(width, height, elements), encoding="utf-8")


def document(width: float, height: float, elements: Iterable[str]) -> str:
    """The text of such a file."""
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{number(width)}mm" '
        f'height="{number(height)}mm" viewBox="0 0 {number(width)} {number(height)}" '
        f'font-family="{SANS}" stroke-linejoin="round">'
    )
    paper = rectangle((0.0, 0.0), width, height, fill=PAPER)
    return "\n".join([head, paper, *elements, "</svg>", ""])
