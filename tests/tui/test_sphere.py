"""The sphere of directions as it is drawn."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imucal_wizard.estimate.ellipsoid.coverage import BINS, bin_of, centres
from imucal_wizard.tui.panels.sphere import (
    FULL,
    GAP,
    HERE,
    MIN_SPHERE_ROWS,
    THIN,
    half,
    signs,
    sphere_rows,
)
from imucal_wizard.tui.text import width_of
from tests.tui.terminals import page

ROWS = 20
EMPTY = np.zeros(BINS, np.intp)


def drawn(counts: np.ndarray, here: int | None = None, size: tuple[int, int] = (50, 12)) -> str:
    rows = sphere_rows(counts, here, *size)
    return page(rows)


def test_every_area_is_seen_once_and_as_large_as_every_other() -> None:
    """A character shows the area that lies under its middle: 10 % for twenty rows."""
    front, back = half(1, ROWS).bins, half(-1, ROWS).bins
    seen = [np.bincount(side[side >= 0], minlength=BINS) for side in (front, back)]
    upper = centres()[:, 2] > 0
    assert not seen[0][~upper].any()
    assert not seen[1][upper].any()
    cells = seen[0] + seen[1]
    expected = np.pi * ROWS**2 / BINS
    assert np.abs(cells - expected).max() < 0.5 * expected
    assert cells.std() < 0.2 * expected


@given(st.integers(0, BINS - 1), st.integers(MIN_SPHERE_ROWS - 2, 60))
def test_the_middle_of_an_area_is_where_the_area_is_drawn(area: int, rows: int) -> None:
    """In its own half and in no other, however large it is drawn."""
    side = 1 if centres()[area, 2] > 0 else -1
    shape = half(side, rows)
    row, column = shape.middles[area]
    assert shape.bins[row, column] == area
    assert not (half(-side, rows).bins == area).any()


def test_the_axes_lie_where_their_names_stand() -> None:
    """+x to the right of the front and to the left of the back; +y on top of both."""
    x, y = (int(bin_of(np.array([axis]).T)[0]) for axis in ([0.99, 0.02, 0.1], [0.02, 0.99, 0.1]))
    counts = EMPTY.copy()
    counts[[x, y]] = 99
    grid = signs(counts, half(1, ROWS), None)
    assert any(FULL in row[-4:] for row in grid[8:12])
    assert FULL in "".join(grid[0] + grid[1])
    below = int(bin_of(np.array([[0.99, 0.02, -0.1]]).T)[0])
    counts = EMPTY.copy()
    counts[below] = 99
    assert any(FULL in row[:4] for row in signs(counts, half(-1, ROWS), None)[8:12])
    assert "−x" in drawn(EMPTY)


def test_gap_thin_covered_and_here_are_different_signs() -> None:
    """Shapes and not only colours."""
    counts = EMPTY.copy()
    counts[60], counts[70] = 1, 50
    text = drawn(counts, here=80).rsplit("\n", 1)[0]
    assert {GAP, THIN, FULL, HERE} <= set(text)
    assert text.count(HERE) == 1
    full = drawn(np.full(BINS, 50)).rsplit("\n", 1)[0]
    assert GAP not in full
    assert THIN not in full


@pytest.mark.parametrize("size", [(50, 12), (50, 13), (60, 12), (114, 34), (200, 60)])
def test_it_stays_in_the_room_there_is(size: tuple[int, int]) -> None:
    rows = sphere_rows(EMPTY, 5, *size)
    assert len(rows) <= size[1]
    assert max(map(width_of, rows)) <= size[0]
    assert len(rows) >= min(size[1], size[0] // 4)


def test_without_room_it_says_so() -> None:
    assert "no room" in drawn(EMPTY, size=(30, 6))
