"""The live sphere of directions: where the field has been seen, the gaps, and where it is now."""

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.tui.hemispheres import FULL, GAP, HERE, THIN, half_rows
from imucal_wizard.tui.text import Line, line, width_of
from imucal_wizard.tui.widgets.drawn import Drawn

_GAP = "  "
SMALLEST = 10
"""Rows of a half with its names."""


class Sphere(Drawn):
    """Front and back side by side, as large as there is room; drawn again only when it changes."""

    DEFAULT_CSS = "Sphere { width: 1fr; height: 1fr; }"

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002 (Textual's own name for it)
        super().__init__(id=id)
        self._counts: NDArray[np.intp] = np.zeros(0, np.intp)
        self._here: int | None = None

    def tell(self, counts: NDArray[np.intp], here: int | None) -> None:
        """Show so many samples in each of the hundred areas, and the area of the newest."""
        if here == self._here and np.array_equal(counts, self._counts):
            return
        self._counts, self._here = counts, here
        self.draw()

    def draw(self) -> None:
        """Show it in the room there is."""
        width, height = self.size
        if width and height and len(self._counts):
            self.show(sphere_rows(self._counts, self._here, width, height))


def sphere_rows(counts: NDArray[np.intp], here: int | None, width: int, height: int) -> list[Line]:
    """Both halves with the names of their axes, and the signs explained below.

    Args:
        counts: samples in each of the hundred areas, shape (100,).
        here: the area of the newest sample, or None.
        width: columns there are.
        height: rows there are.
    """
    rows = min(height - 1, (width - len(_GAP)) // 4)
    if rows < SMALLEST:
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
