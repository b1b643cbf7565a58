"""A scatter plot in characters: points, noise band, line, model and cursor.

``∘`` is a point, ``●`` one beyond three times the noise, ``◆`` the cursor, ``│`` the error bar of a
point, ``▒`` the noise band, ``·`` the line, ``━`` what a suspect predicts; ``×`` is the model,
``⊗`` a point that meets it.
"""

from collections.abc import Callable

import numpy as np

from imucal_wizard.core.quantities import fixed, number
from imucal_wizard.core.readings import FloatArray

LABEL_COLUMNS = 9
"""Columns left of the axis."""
FRAMED = 14
"""Rows from which the plot has a line below."""
FAR_SIGMA = 3.0
"""Noise standard deviations beyond which a point is filled."""
_RANK = {sign: rank for rank, sign in enumerate(" ▒─│·×━∘⊗●◆")}
"""Where two signs meet, the one that says more stays."""


def scatter(
    x: FloatArray,
    y: FloatArray,
    width: int,
    height: int,
    *,
    x_label: str = "",
    error: FloatArray | None = None,
    band: bool = True,
    slope: float | None = None,
    model: FloatArray | None = None,
    predicted: FloatArray | None = None,
    cursor: int | None = None,
    y_text: Callable[[float], str] = lambda value: number(value, 2),
    x_text: Callable[[float], str] | None = None,
) -> list[str]:
    """Draw points.

    Args:
        x: shape (n,).
        y: shape (n,).
        width: columns there are.
        height: rows there are, with one or two for the x axis.
        x_label: what x is, with its unit.
        error: standard deviation of each y by the noise alone, shape (n,), or None.
        band: draw the band of this noise about 0, too.
        slope: y per x of a line through the origin, or None.
        model: what the model says of each point, shape (n,), or None.
        predicted: what a suspect predicts of each point, shape (n,), or None.
        cursor: place of the point to mark, or None.
        y_text: how y is written at the axis, for a logarithm of something else.
        x_text: the same of the ends of the x axis.

    Returns:
        At most ``height`` rows of ``width`` characters.
    """
    if not len(x):
        return ["nothing to show"]
    # the area: 0 is in the middle unless all values are positive
    framed = height >= FRAMED
    columns, rows = max(10, width - LABEL_COLUMNS - 1), max(3, height - 1 - framed)
    rows -= rows % 2 == 0  # 0 is in the middle
    noise = None if error is None else float(np.sqrt(np.mean(error**2)))
    values = np.concatenate([y, *(one for one in (model, predicted) if one is not None)])
    if error is not None and not band:  # the error bars are what is looked at
        values = np.concatenate([values, y - error, y + error])
    high = max(float(np.abs(values).max()), noise or 0.0) * 1.0001 or 1.0
    low = -high if (values < 0.0).any() or slope is not None else 0.0
    area = _Area(low, high, rows, columns)

    # band and lines, then the model, then the points with their error bars
    left, right = float(x.min()), float(x.max())
    for column in range(columns):
        area.put(0.0, column, "─")
        if band and noise is not None:
            area.fill(max(-noise, low), noise, column, "▒")
        if slope is not None:
            area.put(slope * (left + (right - left) * column / (columns - 1)), column, "·")
    share = (x - left) / (right - left) if right > left else np.full(len(x), 0.5)
    places = [round(float(part) * (columns - 1)) for part in share]
    for value, column in zip(() if model is None else model, places, strict=False):
        area.put(float(value), column, "×")
    for value, column in zip(() if predicted is None else predicted, places, strict=False):
        for beside in range(max(0, column - 1), min(columns, column + 2)):
            area.put(float(value), beside, "━")  # beside the point, which may hide its own
    for i, column in enumerate(places):
        far = error is not None and abs(y[i]) > FAR_SIGMA * error[i]
        if error is not None:
            area.fill(float(y[i] - error[i]), float(y[i] + error[i]), column, "│")
        area.put(float(y[i]), column, "◆" if i == cursor else "●" if far else "∘")
    first, last = ((x_text or _end_text)(end) for end in (left, right))
    frame = [" " * LABEL_COLUMNS + "└" + "─" * columns] if framed else []
    return [*area.drawn(y_text), *frame, _foot(x_label, first, last, columns)]


class _Area:
    """The cells of a plot.

    Args:
        low: y of the last row.
        high: y of the first row.
        rows: number of them.
        columns: number of them.
    """

    def __init__(self, low: float, high: float, rows: int, columns: int) -> None:
        self.low, self.high, self.cells = low, high, [[" "] * columns for _ in range(rows)]

    def row_of(self, value: float) -> int:
        """The row of a value, which may lie outside."""
        return round((self.high - value) / (self.high - self.low) * (len(self.cells) - 1))

    def drawn(self, y_text: Callable[[float], str]) -> list[str]:
        """The rows, with the highest and lowest y and 0 written at the axis."""
        labels = {0: y_text(self.high), len(self.cells) - 1: y_text(self.low)}
        labels[self.row_of(0.0)] = y_text(0.0)
        return [_row(labels.get(k, ""), row) for k, row in enumerate(self.cells)]

    def put(self, value: float, column: int, sign: str) -> None:
        """Draw a sign, unless one that says more is there."""
        row = self.row_of(value)
        if 0 <= row < len(self.cells):
            there = self.cells[row][column]
            sign = "⊗" if sign == "∘" and there == "×" else sign
            if _RANK[sign] > _RANK[there]:
                self.cells[row][column] = sign

    def fill(self, low: float, high: float, column: int, sign: str) -> None:
        """Draw a sign in all rows between two values."""
        last = len(self.cells) - 1
        for row in range(max(0, self.row_of(high)), min(last, self.row_of(low)) + 1):
            if _RANK[sign] > _RANK[self.cells[row][column]]:
                self.cells[row][column] = sign


def _row(label: str, cells: list[str]) -> str:
    axis = "┼" if label == "0" else "┤" if label else "│"
    return f"{label:>{LABEL_COLUMNS - 1}} {axis}{''.join(cells)}"


def _end_text(end: float) -> str:
    """An end of the x axis; counts as counts."""
    return fixed(end, 0) if end.is_integer() and abs(end) < 1e6 else number(end)


def _foot(x_label: str, first: str, last: str, columns: int) -> str:
    """Ends of the x axis, with what it is between them."""
    room = columns - len(first) - len(last)
    label = x_label if len(x_label) + 2 <= room else x_label[: max(0, room - 3)] + "…"
    return f"{' ' * (LABEL_COLUMNS + 1)}{first}{label:^{max(room, 0)}}{last}"
