"""A plot of dots about zero, with the band that noise alone makes."""

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.tui.text import Line, Span, line, number

_HALF = 3
"""Rows above and below zero."""
_LABEL = 9


def dot_plot(values: FloatArray, floor: float | None, width: int) -> list[Line]:
    """One dot per value, in order.

    Args:
        values: what to plot, shape (n,); NaN leaves a gap.
        floor: half the height of the noise band in the same unit, or None.
        width: columns there are; more values than columns share a column.

    Returns:
        Seven rows: zero in the middle, the band dotted.
    """
    finite = values[np.isfinite(values)]
    if not finite.size:
        return [line("nothing to show", "quiet")]
    top = max(float(np.abs(finite).max()), floor or 0.0) or 1.0
    columns = max(10, width - _LABEL - 2)
    band = None if floor is None else round(floor / top * _HALF)
    grid = [[_ground(y, band)] * columns for y in range(_HALF, -_HALF - 1, -1)]
    for i in np.flatnonzero(np.isfinite(values)).tolist():
        x = _place(i, len(values), columns)
        grid[_HALF - round(float(values[i]) / top * _HALF)][x] = _dot(float(values[i]), floor)
    return [
        _row(y, cells, top) for y, cells in zip(range(_HALF, -_HALF - 1, -1), grid, strict=True)
    ]


def _place(i: int, n: int, columns: int) -> int:
    spread = min(4, columns // n) if n <= columns else 0
    return i * spread + spread // 2 if spread else i * columns // n


def _ground(y: int, band: int | None) -> str:
    if y == 0:
        return "─"
    return "┈" if band is not None and abs(y) == band else " "


def _dot(value: float, floor: float | None) -> str:
    return "●" if floor is not None and abs(value) > 3.0 * floor else "∘"


def _row(y: int, cells: list[str], top: float) -> Line:
    label = number(top * y / _HALF, 2) if y in (_HALF, 0, -_HALF) else ""
    spans: list[Span] = [
        (f"{label:>{_LABEL - 1}} {'┼' if y == 0 else '┤' if label else '│'}", "quiet")
    ]
    for sign in cells:
        style = {"●": "warn", "∘": "strong"}.get(sign, "quiet")
        if spans[-1][1] == style:
            spans[-1] = (spans[-1][0] + sign, style)
        else:
            spans.append((sign, style))
    return tuple(spans)
