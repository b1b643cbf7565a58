"""The sphere of directions as characters: covered areas, gaps, present direction of the field.

Each half is seen from outside along z, in Lambert's equal-area projection (``ρ² = 1 − |z|`` on a
disc of radius 1), so that every gap has its true size. The back half is seen after half a turn
about y: its left is +x.
"""

from collections.abc import Iterator
from functools import lru_cache
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.ellipsoid.coverage import GAP_SHARES, bin_of, centres
from imucal_wizard.tui.text import Line, Span, line, width_of

FEW = len(GAP_SHARES)
"""Number of samples from which an area is covered."""
GAP, THIN, FULL = "·", "▒", "█"
HERE = "◆"
_STYLES = {GAP: "quiet", THIN: "warn", FULL: "good", HERE: "strong"}
_NAMES = {1: ("front +z", "+y", "−y", "−x", "+x"), -1: ("back −z", "+y", "−y", "+x", "−x")}
"""Title of each half, and its axes at the top, the bottom, the left and the right."""
_GAP = "  "
MIN_SPHERE_ROWS = 10
"""Rows of a half with its labels."""
_Cells = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Half:
    """One half of the sphere in a grid of characters.

    Attributes:
        bins: area at the centre of each character, −1 outside, shape (rows, columns).
        middles: row and column of the centre of each area of both halves, shape (100, 2).
    """

    bins: _Cells
    middles: _Cells


@lru_cache(maxsize=8)
def half(side: int, rows: int) -> Half:
    """The grid of a half, ``rows`` high and twice as many columns wide.

    Args:
        side: 1 for the front (+z), −1 for the back.
        rows: characters from top to bottom.
    """
    v = 1.0 - (2.0 * np.arange(rows) + 1.0) / rows
    u = (np.arange(2 * rows) + 0.5) / rows - 1.0
    x, y = np.meshgrid(u, v)
    square = x**2 + y**2
    z = 1.0 - np.minimum(square, 1.0)
    stretch = np.sqrt(np.maximum(1.0 - z**2, 0.0) / np.maximum(square, 1e-12))
    direction = np.stack([side * x * stretch, y * stretch, side * z])
    bins = bin_of(direction.reshape(3, -1)).reshape(x.shape)
    return Half(np.where(square < 1.0, bins, -1), _middles(side, rows))


def _middles(side: int, rows: int) -> _Cells:
    x, y, z = centres().T
    shrink = np.sqrt((1.0 - np.abs(z)) / np.maximum(1.0 - z**2, 1e-12))
    row = np.floor((1.0 - y * shrink) * rows / 2.0)
    column = np.floor((1.0 + side * x * shrink) * rows)
    return np.column_stack([row, column]).astype(np.intp)


def signs(counts: NDArray[np.intp], shape: Half, here: int | None) -> list[list[str]]:
    """The characters of a half, row by row; blanks outside.

    Args:
        counts: samples in each area, shape (100,).
        shape: the grid.
        here: the area of the newest sample, or None.
    """
    each = np.where(counts >= FEW, FULL, np.where(counts > 0, THIN, GAP))
    grid: list[list[str]] = np.where(shape.bins >= 0, each[shape.bins], " ").tolist()
    if here is not None and (shape.bins == here).any():
        row, column = (int(place) for place in shape.middles[here])
        for beside in (column - 1, column + 1):
            if 0 <= beside < len(grid[row]):
                grid[row][beside] = " "
        grid[row][column] = HERE
    return grid


def half_rows(counts: NDArray[np.intp], side: int, rows: int, here: int | None) -> list[Line]:
    """A half with its title and the axes at its rim: ``rows`` rows of equal width."""
    name, top, bottom, left, right = _NAMES[side]
    grid = signs(counts, half(side, rows - 2), here)
    wide = len(grid[0]) + len(left) + len(right)
    head = top.center(wide)
    lines: list[Line] = [((name, "strong"), (head[len(name) :], "quiet"))]
    for y, row in enumerate(grid):
        before, after = (left, right) if y == len(grid) // 2 else ("  ", "  ")
        lines.append(((before, "quiet"), *_spans(row), (after, "quiet")))
    return [*lines, ((bottom.center(wide), "quiet"),)]


def _spans(row: list[str]) -> Iterator[Span]:
    for sign, same in groupby(row):
        yield "".join(same), _STYLES.get(sign, "")


def sphere_rows(counts: NDArray[np.intp], here: int | None, width: int, height: int) -> list[Line]:
    """Both halves with their axes, and a legend.

    Args:
        counts: samples in each of the hundred areas, shape (100,).
        here: the area of the newest sample, or None.
        width: columns available.
        height: rows available.
    """
    rows = min(height - 1, (width - len(_GAP)) // 4)
    if rows < MIN_SPHERE_ROWS:
        return [line("no room for the sphere", "quiet")]
    front, back = (half_rows(counts, side, rows, here) for side in (1, -1))
    used = 2 * width_of(front[0]) + len(_GAP)
    margin = " " * ((width - used) // 2)
    body: list[Line] = [
        ((margin, ""), *left, (_GAP, ""), *right) for left, right in zip(front, back, strict=True)
    ]
    return [*body, _key(width)]


def _key(width: int) -> Line:
    spans = (
        (FULL, "good"), (" covered  ", "quiet"), (THIN, "warn"), (" thin  ", "quiet"),
        (GAP, "quiet"), (" gap  ", "quiet"), (HERE, "strong"), (" now", "quiet"),
    )  # fmt: skip
    used = width_of(spans)
    return ((" " * max(0, (width - used) // 2), ""), *spans)
