"""Live traces of all channels in braille."""

import numpy as np

from imucal_wizard.core.quantities import number, unit_sign
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.tui.text import Line, Span, known_as

_UP = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
"""Bit of each dot of a braille cell, top row first."""
_LABEL = 4
_SMALLEST_SPAN: dict[str, float] = {"m/s^2": 2.0, "deg/s": 10.0}
"""Smallest span of an axis, so that a device at rest shows a line and not its noise."""
_SMALLEST_SHARE = 0.02
"""The same for counts, as a share of the largest reading."""


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


def trace_rows(values: FloatArray, units: tuple[str, str], width: int, height: int) -> list[Line]:
    """The channels of both sensors, or of the accelerometer alone.

    Args:
        values: samples, shape (n, 6); the rates are NaN without a gyroscope.
        units: of the accelerations and of the rates.
        width: columns available.
        height: rows available for two sensors.
    """
    blocks = [_Block("a", values[:, :3], units[0])]
    rates = values[:, 3:6]
    if not len(rates) or not np.isnan(rates).all():
        blocks.append(_Block("ω", rates, units[1]))
    columns = (width - max(len(one.scale) for one in blocks) - 2 - 3 * _LABEL) // 3
    return [row for one in blocks for row in one.rows(columns, max(1, height // 2))]


class _Block:
    """The channels of one sensor, in the unit that people use."""

    def __init__(self, name: str, values: FloatArray, unit: str) -> None:
        known, factor = known_as(unit)
        self._name = name
        self._values = values * factor
        self._low, self._high = _span(self._values, known)
        self.scale = f" {number(self._low, 2)}…{number(self._high, 2)} {unit_sign(known)}"

    def rows(self, columns: int, rows: int) -> list[Line]:
        """The channels in braille, each with this size in cells."""
        drawn = [trace(one, self._low, self._high, columns, rows) for one in self._values.T]
        block: list[Line] = []
        for y in range(rows):
            spans: list[Span] = [(f" {self._name}" if y == 0 else "  ", "strong")]
            for axis, picture in zip("xyz", drawn, strict=True):
                spans += [(f"  {axis} " if y == 0 else "    ", "quiet"), (picture[y], "")]
            spans.append((self.scale if y == 0 else "", "quiet"))
            block.append(tuple(spans))
        return block


def _span(values: FloatArray, unit: str) -> tuple[float, float]:
    """Round limits around all values, with a margin."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return -1.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    least = _SMALLEST_SPAN.get(unit, _SMALLEST_SHARE * max(abs(low), abs(high), 1.0))
    air = max(0.05 * (high - low), (least - (high - low)) / 2.0)
    step = 10.0 ** np.floor(np.log10(high - low + 2 * air)) / 2.0
    return float(np.floor((low - air) / step) * step), float(np.ceil((high + air) / step) * step)
