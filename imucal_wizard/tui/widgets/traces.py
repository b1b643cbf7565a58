"""Live traces of all channels in braille: fast, because only rows that changed are sent."""

import numpy as np
from textual import events

from imucal_wizard.readings import FloatArray
from imucal_wizard.tui.text import Line, Span, number, unit_sign
from imucal_wizard.tui.widgets.lines import Lines

_UP = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
"""Bit of each dot of a braille cell, top row first."""
_LABEL = 4
_SMALLEST_SPAN: dict[str, float] = {"m/s^2": 2.0, "rad/s": 0.2}
"""A still device draws a line and not its noise."""
_SMALLEST_SHARE = 0.02
"""The same for counts, as a share of the largest."""


def trace(values: FloatArray, low: float, high: float, columns: int, rows: int) -> list[str]:
    """One channel as braille: each column of dots is filled from its smallest to largest value.

    Args:
        values: samples, oldest first, shape (n,); NaN leaves a gap.
        low: value at the lower edge.
        high: value at the upper edge.
        columns: width in cells.
        rows: height in cells.

    Returns:
        ``rows`` strings of ``columns`` characters.
    """
    dots = 4 * rows
    lowest, highest = _per_column(values, 2 * columns)
    scale = (dots - 1) / (high - low)
    with np.errstate(invalid="ignore"):
        top = np.clip(np.rint((high - highest) * scale), 0, dots - 1)
        bottom = np.clip(np.rint((high - lowest) * scale), 0, dots - 1)
        y = np.arange(dots)[:, None]
        lit = (y >= top) & (y <= bottom)
    cells = lit.reshape(rows, 4, columns, 2)
    codes = np.einsum("rdcw,dw->rc", cells, _UP, dtype=np.int64)
    return ["".join(chr(0x2800 + code) if code else " " for code in row) for row in codes.tolist()]


def _per_column(values: FloatArray, width: int) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest value of each of ``width`` equal parts."""
    n = len(values)
    if n < 2:
        nothing = np.full(width, np.nan)
        return nothing, nothing
    if n <= width:
        picked = values[(np.arange(width) * n) // width]
        return picked, picked
    starts = (np.arange(width) * n) // width
    return np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)


class Traces(Lines):
    """Six channels side by side: accelerometer above, gyroscope below."""

    DEFAULT_CSS = "Traces { height: 2; }"

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002 (Textual's own name for it)
        super().__init__(id=id)
        self._values: FloatArray = np.zeros((0, 6))
        self._units = ("m/s^2", "rad/s")

    def feed(self, values: FloatArray, units: tuple[str, str]) -> None:
        """Show these samples, shape (n, 6), with the unit of either sensor."""
        if values is self._values and units == self._units:
            return
        self._values, self._units = values, units
        self._draw()

    def on_resize(self, event: events.Resize) -> None:
        """Draw again for the new size."""
        event.stop()
        self._draw()

    def _draw(self) -> None:
        width, height = self.size
        if width < 30 or not height:
            return
        each = max(1, height // 2)
        rows = self._block("a", self._values[:, :3], self._units[0], width, each)
        self.show(rows + self._block("ω", self._values[:, 3:6], self._units[1], width, each))

    def _block(self, name: str, values: FloatArray, unit: str, width: int, rows: int) -> list[Line]:
        low, high = _span(values, unit)
        scale = f" {number(low, 2)}…{number(high, 2)} {unit_sign(unit)}"
        columns = (width - len(scale) - 2 - 3 * _LABEL) // 3
        drawn = [trace(values[:, i], low, high, columns, rows) for i in range(values.shape[1])]
        block: list[Line] = []
        for y in range(rows):
            spans: list[Span] = [(f" {name}" if y == 0 else "  ", "strong")]
            for axis, picture in zip("xyz", drawn, strict=True):
                spans += [(f"  {axis} " if y == 0 else "    ", "quiet"), (picture[y], "")]
            spans.append((scale if y == 0 else "", "quiet"))
            block.append(tuple(spans))
        return block


def _span(values: FloatArray, unit: str) -> tuple[float, float]:
    """Round limits that hold all values, with a little air."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return -1.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    least = _SMALLEST_SPAN.get(unit, _SMALLEST_SHARE * max(abs(low), abs(high), 1.0))
    air = max(0.05 * (high - low), (least - (high - low)) / 2.0)
    step = 10.0 ** np.floor(np.log10(high - low + 2 * air)) / 2.0
    return float(np.floor((low - air) / step) * step), float(np.ceil((high + air) / step) * step)
