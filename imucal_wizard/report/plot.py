"""A scatter plot in characters: points, noise band, line, model and cursor.

``∘`` is a point, ``●`` one beyond three times the noise, ``◆`` the cursor, ``┈`` the noise band,
``·`` the line; ``×`` is the model, ``⊗`` a point that meets it.
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
_RANK = {" ": 0, "┈": 1, "─": 2, "·": 3, "×": 4, "∘": 5, "⊗": 6, "●": 7, "◆": 8}
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
    values = y if model is None else np.concatenate([y, model])
    high = max(float(np.abs(values).max()), noise or 0.0) * 1.0001 or 1.0
    low = -high if (values < 0.0).any() or slope is not None else 0.0
    cells = [[" "] * columns for _ in range(rows)]

    def put(value: float, column: int, sign: str) -> None:
        row = round((high - value) / (high - low) * (rows - 1))
        if 0 <= row < rows:
            there = cells[row][column]
            sign = "⊗" if sign == "∘" and there == "×" else sign
            if _RANK[sign] > _RANK[there]:
                cells[row][column] = sign

    # lines, then the model, then the points
    left, right = float(x.min()), float(x.max())
    for column in range(columns):
        put(0.0, column, "─")
        if noise is not None:
            put(noise, column, "┈")
            put(-noise, column, "┈")
        if slope is not None:
            put(slope * (left + (right - left) * column / (columns - 1)), column, "·")
    share = (x - left) / (right - left) if right > left else np.full(len(x), 0.5)
    places = [round(float(part) * (columns - 1)) for part in share]
    for value, column in zip(() if model is None else model, places, strict=False):
        put(float(value), column, "×")
    for i, column in enumerate(places):
        far = error is not None and abs(y[i]) > FAR_SIGMA * error[i]
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
