"""A scatter plot in characters: points, noise band, line, model and cursor.

``∘`` is a point, ``●`` one beyond three times the noise, ``◆`` the cursor, ``│`` the error bar of a
point, ``▒`` the noise band, ``·`` the line, ``━`` what a suspect predicts; ``×`` is the model,
``⊗`` a point that meets it.
"""

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
    slope: float | None = None,
    model: FloatArray | None = None,
    predicted: FloatArray | None = None,
    cursor: int | None = None,
) -> list[str]:
    """Draw points.

    Args:
        x: shape (n,).
        y: shape (n,).
        width: columns there are.
        height: rows there are, with one or two for the x axis.
        x_label: what x is, with its unit.
        error: standard deviation of each y by the noise alone, shape (n,), or None.
        slope: y per x of a line through the origin, or None.
        model: what the model says of each point, shape (n,), or None.
        predicted: what a suspect predicts of each point, shape (n,), or None.
        cursor: place of the point to mark, or None.

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
    high = max(float(np.abs(values).max()), noise or 0.0) * 1.0001 or 1.0
    low = -high if (values < 0.0).any() or slope is not None else 0.0
    cells = [[" "] * columns for _ in range(rows)]

    def row_of(value: float) -> int:
        return round((high - value) / (high - low) * (rows - 1))

    def put(value: float, column: int, sign: str) -> None:
        row = row_of(value)
        if 0 <= row < rows:
            there = cells[row][column]
            sign = "⊗" if sign == "∘" and there == "×" else sign
            if _RANK[sign] > _RANK[there]:
                cells[row][column] = sign

    def between(low: float, high: float, column: int, sign: str) -> None:
        for row in range(max(0, row_of(high)), min(rows - 1, row_of(low)) + 1):
            if _RANK[sign] > _RANK[cells[row][column]]:
                cells[row][column] = sign

    # band and lines, then the model, then the points with their error bars
    left, right = float(x.min()), float(x.max())
    for column in range(columns):
        put(0.0, column, "─")
        if noise is not None:
            between(max(-noise, low), noise, column, "▒")
        if slope is not None:
            put(slope * (left + (right - left) * column / (columns - 1)), column, "·")
    share = (x - left) / (right - left) if right > left else np.full(len(x), 0.5)
    places = [round(float(part) * (columns - 1)) for part in share]
    for value, column in zip(() if model is None else model, places, strict=False):
        put(float(value), column, "×")
    for value, column in zip(() if predicted is None else predicted, places, strict=False):
        for beside in range(max(0, column - 1), min(columns, column + 2)):
            put(float(value), beside, "━")  # beside the point, which may hide its own
    for i, column in enumerate(places):
        far = error is not None and abs(y[i]) > FAR_SIGMA * error[i]
        if error is not None:
            between(float(y[i] - error[i]), float(y[i] + error[i]), column, "│")
        put(float(y[i]), column, "◆" if i == cursor else "●" if far else "∘")
    labels = {0: number(high, 2), rows - 1: number(low, 2)}
    labels[round(high / (high - low) * (rows - 1))] = "0"
    drawn = [_row(labels.get(k, ""), row) for k, row in enumerate(cells)]
    frame = [" " * LABEL_COLUMNS + "└" + "─" * columns] if framed else []
    return [*drawn, *frame, _foot(x_label, left, right, columns)]


def _row(label: str, cells: list[str]) -> str:
    axis = "┼" if label == "0" else "┤" if label else "│"
    return f"{label:>{LABEL_COLUMNS - 1}} {axis}{''.join(cells)}"


def _foot(x_label: str, left: float, right: float, columns: int) -> str:
    """Ends of the x axis, counts as counts, with what it is between them."""
    first, last = (
        fixed(end, 0) if end.is_integer() and abs(end) < 1e6 else number(end)
        for end in (left, right)
    )
    room = columns - len(first) - len(last)
    label = x_label if len(x_label) + 2 <= room else x_label[: max(0, room - 3)] + "…"
    return f"{' ' * (LABEL_COLUMNS + 1)}{first}{label:^{max(room, 0)}}{last}"
