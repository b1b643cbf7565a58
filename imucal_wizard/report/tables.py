"""Tables of text: rows of cells, and the comparison of methods."""

import textwrap
from collections.abc import Sequence

from imucal_wizard.core.quantities import quantity
from imucal_wizard.estimate.comparison import (
    MethodRow,
    difference,
    least_held_out,
    offset_difference,
)

BEST = "▸"
"""Marks the methods with the least held-out error."""
_COLUMNS = ("fitted", "held out", "relative", "M off by", "b off by")
_WIDTHS = (-20, 11, 11, 8, 8, 11)
_NOTE = (
    f"{BEST} least held-out error (within 2 %). Q: Qureshi and Golnaraghi, N: Niespodziany. "
    "Errors: rms of |corrected| − g over holds, of the gyroscope's closure over rotations "
    "(offset: of the rate at rest), of |corrected| − field over directions. Relative: rms of the "
    "relative error of the magnitude (N's figure of merit), of held-out data where there are "
    "any. M and b off by: largest difference from matrix (relative) and bias of the first method."
)


def table_row(cells: Sequence[str], widths: Sequence[int]) -> str:
    """Cells side by side.

    Args:
        cells: as many as the widths, or more; those beyond them stand at the end as they are.
        widths: columns of each cell. One of a positive width is a number and ends there; one of a
            negative width is a text, which begins there and ends in an ellipsis if it is too long.
    """
    fitted = []
    for cell, width in zip(cells, widths, strict=False):
        text = cell if width >= 0 or len(cell) <= -width else cell[: -width - 1] + "…"
        fitted.append(f"{text:{'>' if width >= 0 else '<'}{abs(width)}}")
    return " ".join([*fitted, *cells[len(widths) :]]).rstrip()


def fitting_widths(rows: Sequence[Sequence[str]], texts: int = 1) -> list[int]:
    """Widths for ``table_row`` in which every cell has room.

    Args:
        rows: of the table; a shorter one has no cells in the last columns.
        texts: how many columns from the left are texts.
    """
    columns = [
        [row[place] for row in rows if place < len(row)] for place in range(max(map(len, rows)))
    ]
    widths = [max(map(len, cells)) for cells in columns]
    return [-width if place < texts else width for place, width in enumerate(widths)]


def method_table(rows: Sequence[MethodRow], width: int = 80) -> str:
    """A block of rows per sensor; the methods with the least held-out error are marked.

    There is no row between the blocks, so that three sensors fit a terminal of 24 rows.

    Args:
        rows: all methods of all sensors.
        width: columns of the terminal; the numbers take 74, so that a page with a margin and a
            scroll bar shows them in 80.
    """
    lines: list[str] = []
    for sensor in dict.fromkeys(row.sensor for row in rows):
        mine = [row for row in rows if row.sensor == sensor]
        first = next((row for row in mine if row.fit is not None), mine[0])
        lines.append(table_row((sensor.upper(), *_COLUMNS), _WIDTHS))
        if first.fit is not None and first.fit.rms_before is not None:
            named = "scale and bias" if first.fit.before_note else "not calibrated"
            before = quantity(first.fit.rms_before, first.fit.unit)
            lines.append(table_row((f"  {named}", before), _WIDTHS))
        best = least_held_out(mine)
        for row in mine:
            mark = BEST if row in best else " "
            text, *others = _row(row, first, width)
            lines += [mark + text[1:], *others]
    return "\n".join([*lines, "", *textwrap.wrap(_NOTE, width)])


def _row(row: MethodRow, first: MethodRow, width: int) -> list[str]:
    name = f"{row.method} {f'({row.paper})' if row.paper else ''}".rstrip()
    if row.fit is None:
        text = f"  {name:18}no result: {row.why}"
        return textwrap.wrap(text, width, subsequent_indent=" " * 20)
    held_out, relative = row.fit.rms_held_out, row.relative_error_held_out or row.relative_error
    cells = [
        quantity(row.fit.rms_fitted, row.fit.unit),
        "–" if held_out is None else quantity(held_out, row.fit.unit),
        "–" if relative is None else f"{100.0 * relative:.3f} %",
        *_off(row, first),
    ]
    return [table_row((f"  {name}", *cells), _WIDTHS)]


def _off(row: MethodRow, first: MethodRow) -> tuple[str, str]:
    """Difference of matrix and bias from the first method; empty for that method itself."""
    matrix, bias = difference(row, first), offset_difference(row, first)
    if row is first or row.fit is None or matrix is None or bias is None:
        return "", ""
    unit = {"rad": "rad/s"}.get(row.fit.unit, row.fit.unit)  # of a closure's error, and its bias
    return f"{100.0 * matrix:.3f} %", quantity(bias, unit, 2)
