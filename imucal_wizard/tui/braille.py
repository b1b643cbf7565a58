"""A canvas of braille dots: two dots across and four down in every character cell."""

import math

_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
_EMPTY = 0x2800


class Canvas:
    """Dots, lines and a few letters, turned into rows of text.

    Attributes:
        columns: width in cells; ``2 * columns`` dots.
        rows: height in cells; ``4 * rows`` dots.
    """

    def __init__(self, columns: int, rows: int) -> None:
        self.columns = columns
        self.rows = rows
        self._bits = [[0] * columns for _ in range(rows)]
        self._letters: dict[tuple[int, int], str] = {}

    def dot(self, x: int, y: int) -> None:
        """Set one dot; what lies outside is left out."""
        column, row = x >> 1, y >> 2
        if 0 <= column < self.columns and 0 <= row < self.rows:
            self._bits[row][column] |= _DOTS[y & 3][x & 1]

    def line(self, x0: float, y0: float, x1: float, y1: float, every: int = 1) -> None:
        """A straight line; with ``every`` above one a dotted one."""
        steps = max(1, math.ceil(max(abs(x1 - x0), abs(y1 - y0))))
        for i in range(0, steps + 1, every):
            part = i / steps
            self.dot(round(x0 + (x1 - x0) * part), round(y0 + (y1 - y0) * part))

    def letters(self, x: float, y: float, text: str) -> None:
        """Write text with its middle at a dot; it hides the dots of its cells."""
        row = int(y) >> 2
        first = round(x / 2 - len(text) / 2)
        for i, character in enumerate(text):
            if 0 <= first + i < self.columns and 0 <= row < self.rows:
                self._letters[row, first + i] = character

    def text(self) -> list[str]:
        """The rows; an empty cell is a space."""
        return ["".join(self._cell(y, x) for x in range(self.columns)) for y in range(self.rows)]

    def _cell(self, row: int, column: int) -> str:
        letter = self._letters.get((row, column))
        if letter is not None:
            return letter
        bits = self._bits[row][column]
        return chr(_EMPTY + bits) if bits else " "
