"""Pictures in braille dots: the device as a cube with named faces, and a compass card."""

import itertools
import math
from collections.abc import Callable

from imucal_wizard.guide.operator_view import Matrix, Turn, Vector, about, seen, times

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
        """Set one dot; dots outside the canvas are ignored."""
        column, row = x >> 1, y >> 2
        if 0 <= column < self.columns and 0 <= row < self.rows:
            self._bits[row][column] |= _DOTS[y & 3][x & 1]

    def line(self, x0: float, y0: float, x1: float, y1: float, every: int = 1) -> None:
        """Draw a straight line, dotted if ``every`` is above one."""
        steps = max(1, math.ceil(max(abs(x1 - x0), abs(y1 - y0))))
        for i in range(0, steps + 1, every):
            part = i / steps
            self.dot(round(x0 + (x1 - x0) * part), round(y0 + (y1 - y0) * part))

    def letters(self, x: float, y: float, text: str) -> None:
        """Write text centred at a dot; it hides the dots of its cells."""
        row = int(y) >> 2
        first = round(x / 2 - len(text) / 2)
        for i, character in enumerate(text):
            if 0 <= first + i < self.columns and 0 <= row < self.rows:
                self._letters[row, first + i] = character

    def written(self, x: float, y: float) -> bool:
        """Whether one letter at this dot would hide another one."""
        return (int(y) >> 2, round(x / 2 - 0.5)) in self._letters

    def text(self) -> list[str]:
        """The rows; an empty cell is a space."""
        return ["".join(self._cell(y, x) for x in range(self.columns)) for y in range(self.rows)]

    def _cell(self, row: int, column: int) -> str:
        letter = self._letters.get((row, column))
        if letter is not None:
            return letter
        bits = self._bits[row][column]
        return chr(_EMPTY + bits) if bits else " "


_DISTANCE = 7.0
"""Distance of the eye in half-edges; the perspective shows which faces are near."""
_ORDER = ((-1, -1), (1, -1), (1, 1), (-1, 1))
_ARROW_RADIUS = 1.5
"""Distance of the arrow from the centre, half-edges: just above the top face."""
_ARROW_DEG = range(-50, 51, 4)
"""The arrow's angles from the vertical; its middle is on top."""
ARROW_HEADS = "→↗↑↖←↙↓↘"
"""Heads for the eight directions in words, counter-clockwise from the right; up is away."""


def cube_rows(
    attitude: Matrix, columns: int, rows: int, axis: str = "", turn: Turn | None = None
) -> list[str]:
    """The cube as rows of text.

    Args:
        attitude: body to world.
        columns: width in cells.
        rows: height in cells.
        axis: a body axis to draw through the cube (``x``, ``y``, ``z``), or "".
        turn: a turn to be made; an arrow over the cube shows where its top moves.

    Returns:
        ``rows`` strings of ``columns`` characters.
    """
    canvas = Canvas(columns, rows)
    size = min(2 * columns, 4 * rows) / 2.0 * (0.5 if axis else 0.56)
    view = _Projection(canvas, attitude, size)
    faces = sorted(_faces(view), key=lambda face: face[0])
    for depth, name, corners, centre in faces:
        _face(canvas, corners, hidden=depth <= 0.0, fine=rows >= 12)
        if depth > 0.12:
            canvas.letters(*centre, name)
    if axis:
        _axis(canvas, view, "xyz".index(axis))
    if turn is not None:
        _arrow(canvas, view, turn)
    return canvas.text()


class _Projection:
    """Body points to dots."""

    def __init__(self, canvas: Canvas, attitude: Matrix, size: float) -> None:
        self._centre = (canvas.columns - 0.5, 2 * canvas.rows - 0.5)
        self._attitude = attitude
        self._size = size

    def eye(self, point: Vector) -> Vector:
        return seen(times(self._attitude, point))

    def dots(self, point: Vector) -> tuple[float, float]:
        return self.world_dots(times(self._attitude, point))

    def world_dots(self, point: Vector) -> tuple[float, float]:
        right, up, near = seen(point)
        scale = self._size * _DISTANCE / (_DISTANCE - near)
        return self._centre[0] + right * scale, self._centre[1] - up * scale


_Dots = tuple[float, float]


def _faces(view: _Projection) -> list[tuple[float, str, list[_Dots], _Dots]]:
    found = []
    for i, letter in enumerate("xyz"):
        for sign in (1, -1):
            normal = _placed(i, sign, 0, 0)
            right, up, near = view.eye(normal)
            # a face is visible if its outside faces the eye, which is at a finite distance
            facing = near * _DISTANCE - (right * right + up * up + near * near)
            corners = [view.dots(_placed(i, sign, a, b)) for a, b in _ORDER]
            name = ("+" if sign > 0 else "−") + letter
            found.append((facing / _DISTANCE, name, corners, view.dots(normal)))
    return found


def _placed(axis: int, along: float, a: float, b: float) -> Vector:
    point = [0.0, 0.0, 0.0]
    point[axis], point[(axis + 1) % 3], point[(axis + 2) % 3] = along, a, b
    return point[0], point[1], point[2]


def _face(canvas: Canvas, corners: list[_Dots], *, hidden: bool, fine: bool) -> None:
    if hidden and not fine:
        return
    for (x0, y0), (x1, y1) in zip(corners, corners[1:] + corners[:1], strict=True):
        canvas.line(x0, y0, x1, y1, every=4 if hidden else 1)


def _axis(canvas: Canvas, view: _Projection, index: int) -> None:
    for sign in (1, -1):
        inner, outer = (
            view.dots(_placed(index, sign, 0, 0)),
            view.dots(_placed(index, sign * 1.9, 0, 0)),
        )
        hidden = view.eye(_placed(index, sign, 0, 0))[2] < 0
        canvas.line(*inner, *outer, every=3 if hidden else 1)


def _arrow(canvas: Canvas, view: _Projection, turn: Turn) -> None:
    """The way of a point above the device, two dots wide; the head says what the words say."""
    points = [
        view.world_dots(times(about(turn.axis, math.radians(angle)), (0.0, 0.0, _ARROW_RADIUS)))
        for angle in _ARROW_DEG
    ]
    for (x0, y0), (x1, y1) in itertools.pairwise(points):
        canvas.line(x0, y0, x1, y1)
        canvas.line(x0 + 1.0, y0, x1 + 1.0, y1)
    # the head hides no name of a face
    free = (point for point in reversed(points) if not canvas.written(*point))
    canvas.letters(*next(free, points[-1]), ARROW_HEADS[turn.sector])


Place = Callable[[float, float], tuple[float, float]]
"""The dot at an angle from north, degrees, and at a share of the radius."""
_LETTERS = (("N", 0.0), ("E", 90.0), ("S", 180.0), ("W", 270.0))
_TICKS = range(0, 360, 30)
_HEAD_DEG = 12.0
"""Half the angle of the needle's tail at its end."""


def rose(heading: float | None, columns: int, rows: int) -> list[str]:
    """The compass card as rows of text.

    Args:
        heading: degrees clockwise from north, or None if unknown.
        columns: width in cells.
        rows: height in cells.
    """
    canvas = Canvas(columns, rows)
    centre = (canvas.columns - 0.5, 2 * canvas.rows - 0.5)
    radius = min(2 * columns, 4 * rows) / 2.0 - 0.5

    def at(degrees: float, share: float) -> tuple[float, float]:
        angle = math.radians(degrees)
        return (
            centre[0] + share * radius * math.sin(angle),
            centre[1] - share * radius * math.cos(angle),
        )

    for angle in range(0, 360, 3):
        x, y = at(angle, 1.0)
        canvas.dot(round(x), round(y))
    for angle in _TICKS:
        canvas.line(*at(angle, 0.9), *at(angle, 1.0))
    for letter, degrees in _LETTERS:
        canvas.letters(*at(degrees, 0.8), letter)
    if heading is not None:
        _needle(canvas, heading, at)
    return canvas.text()


def _needle(canvas: Canvas, heading: float, at: Place) -> None:
    """Draw the needle: a tip towards the heading, a cross-bar at the tail."""
    tip, tail = at(heading, 0.7), at(heading + 180.0, 0.45)
    canvas.line(*tail, *tip)
    for side in (-1.0, 1.0):
        canvas.line(*tip, *at(heading + side * 4.0 * _HEAD_DEG, 0.4))
        canvas.line(*tip, *at(heading + side * 2.0 * _HEAD_DEG, 0.4))
    canvas.line(*at(heading + 180.0 - _HEAD_DEG, 0.45), *at(heading + 180.0 + _HEAD_DEG, 0.45))
