"""A scatter plot in characters, with the band of the noise, a line and a cursor."""

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.tui.bench.views import View
from imucal_wizard.tui.text import Line, Span, line, number

LABEL = 9
"""Columns left of the axis."""
FRAMED = 14
"""Rows from which the plot has a line below."""
FAR = 3.0
"""Noise standard deviations beyond which a point is filled."""
_STYLES = {"◆": "accent", "●": "warn", "∘": "strong", "·": "accent", "×": "accent", "⊗": "good"}
_RANK = {" ": 0, "┈": 1, "─": 2, "·": 3, "×": 4, "∘": 5, "⊗": 6, "●": 7, "◆": 8}


def scatter(view: View, width: int, height: int, cursor: int | None = None) -> list[Line]:
    """The points of a view.

    Args:
        view: what to draw.
        width: columns there are.
        height: rows there are, with one or two for the x axis.
        cursor: place of the point to mark, or None.

    Returns:
        At most ``height`` rows: ``∘`` a point, ``●`` one beyond three times the noise, ``◆`` the
        cursor, ``┈`` the noise, ``·`` the line; ``×`` the model, ``⊗`` a point that it meets.
    """
    if not len(view.x):
        return [line("nothing to show", "quiet")]
    framed = height >= FRAMED
    columns, rows = max(10, width - LABEL - 1), max(3, height - 1 - framed)
    rows -= rows % 2 == 0  # 0 is in the middle
    low, high = _limits(view)
    grid = _Grid(low, high, rows, columns)
    _draw(grid, view, columns)
    _mark(grid, view, columns, cursor)
    labels = _labels(low, high, rows)
    drawn = [_row(labels.get(k, ""), cells) for k, cells in enumerate(grid.cells)]
    frame = [line(" " * LABEL + "└" + "─" * columns, "quiet")] if framed else []
    return [*drawn, *frame, _foot(view, columns)]


class _Grid:
    """The characters of a plot; where two meet, the one that says more stays."""

    def __init__(self, low: float, high: float, rows: int, columns: int) -> None:
        self._low, self._high = low, high
        self.cells = [[" "] * columns for _ in range(rows)]

    def put(self, y: float, column: int, sign: str) -> None:
        """Set a sign at a height of the plot; nothing outside it."""
        last = len(self.cells) - 1
        row = round((self._high - y) / (self._high - self._low) * last)
        if 0 <= row <= last:
            there = self.cells[row][column]
            sign = "⊗" if sign == "∘" and there == "×" else sign
            if _RANK[sign] > _RANK[there]:
                self.cells[row][column] = sign


def _draw(grid: _Grid, view: View, columns: int) -> None:
    """The axis, the band of the noise, the line."""
    left, right = float(view.x.min()), float(view.x.max())
    for column in range(columns):
        grid.put(0.0, column, "─")
        if view.floor is not None:
            grid.put(view.floor, column, "┈")
            grid.put(-view.floor, column, "┈")
        if view.slope is not None:
            grid.put(view.slope * (left + (right - left) * column / (columns - 1)), column, "·")


def _mark(grid: _Grid, view: View, columns: int, cursor: int | None) -> None:
    """The points, with the model beside them."""
    places = _columns(view.x, columns)
    for value, column in zip(() if view.model is None else view.model, places, strict=False):
        grid.put(float(value), column, "×")
    for i, column in enumerate(places):
        far = view.floor is not None and abs(view.y[i]) > FAR * view.floor
        grid.put(float(view.y[i]), column, "◆" if i == cursor else "●" if far else "∘")


def _limits(view: View) -> tuple[float, float]:
    """Symmetric about 0, or from 0 where nothing is negative."""
    values = view.y if view.model is None else np.concatenate([view.y, view.model])
    top = max(float(np.abs(values).max()), view.floor or 0.0) * 1.0001 or 1.0
    return (-top if (values < 0.0).any() or view.slope is not None else 0.0), top


def _columns(x: FloatArray, columns: int) -> list[int]:
    left, right = float(x.min()), float(x.max())
    share = (x - left) / (right - left) if right > left else np.full(len(x), 0.5)
    return [round(float(part) * (columns - 1)) for part in share]


def _labels(low: float, high: float, rows: int) -> dict[int, str]:
    zero = round(high / (high - low) * (rows - 1))
    return {0: number(high, 2), rows - 1: number(low, 2), zero: "0"}


def _row(label: str, cells: list[str]) -> Line:
    axis = "┼" if label == "0" else "┤" if label else "│"
    spans: list[Span] = [(f"{label:>{LABEL - 1}} {axis}", "quiet")]
    for sign in cells:
        style = _STYLES.get(sign, "quiet")
        if spans[-1][1] == style:
            spans[-1] = (spans[-1][0] + sign, style)
        else:
            spans.append((sign, style))
    return tuple(spans)


def _foot(view: View, columns: int) -> Line:
    """Ends of the x axis, with what it is between them."""
    ends = number(float(view.x.min()), 3), number(float(view.x.max()), 3)
    room = columns - len(ends[0]) - len(ends[1])
    label = (
        view.x_label if len(view.x_label) + 2 <= room else view.x_label[: max(0, room - 3)] + "…"
    )
    return (
        (" " * (LABEL + 1) + ends[0], "quiet"),
        (f"{label:^{max(room, 0)}}", ""),
        (ends[1], "quiet"),
    )
