"""A compass card in braille: north on top, a needle where the device heads."""

import math
from collections.abc import Callable

from imucal_wizard.tui.braille import Canvas

Place = Callable[[float, float], tuple[float, float]]
"""The dot at an angle from north, degrees, and a share of the radius."""
_LETTERS = (("N", 0.0), ("E", 90.0), ("S", 180.0), ("W", 270.0))
_TICKS = range(0, 360, 30)
_HEAD_DEG = 12.0
"""Half the angle that the needle's tail spans at its end."""


def rose(heading: float | None, columns: int, rows: int) -> list[str]:
    """The card as rows of text.

    Args:
        heading: degrees clockwise from north, or None where there is none.
        columns: width in cells.
        rows: height in cells.
    """
    canvas = Canvas(columns, rows)
    centre = (canvas.columns - 0.5, 2 * canvas.rows - 0.5)
    radius = min(2 * columns, 4 * rows) / 2.0 - 0.5

    def at(degrees: float, share: float) -> tuple[float, float]:
        angle = math.radians(degrees)
        return (
            centre[0] + share * radius * math.sin(angle),
            centre[1] - share * radius * math.cos(angle),
        )

    for angle in range(0, 360, 3):
        x, y = at(angle, 1.0)
        canvas.dot(round(x), round(y))
    for angle in _TICKS:
        canvas.line(*at(angle, 0.9), *at(angle, 1.0))
    for letter, degrees in _LETTERS:
        canvas.letters(*at(degrees, 0.8), letter)
    if heading is not None:
        _needle(canvas, heading, at)
    return canvas.text()


def _needle(canvas: Canvas, heading: float, at: Place) -> None:
    """A tip towards the heading, a cross-bar at the tail: the ends differ in shape."""
    tip, tail = at(heading, 0.7), at(heading + 180.0, 0.45)
    canvas.line(*tail, *tip)
    for side in (-1.0, 1.0):
        canvas.line(*tip, *at(heading + side * 4.0 * _HEAD_DEG, 0.4))
        canvas.line(*tip, *at(heading + side * 2.0 * _HEAD_DEG, 0.4))
    canvas.line(*at(heading + 180.0 - _HEAD_DEG, 0.45), *at(heading + 180.0 + _HEAD_DEG, 0.45))
