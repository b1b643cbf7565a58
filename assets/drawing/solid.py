"""The device as a solid cube on paper: the faces that are seen, and the names printed on them."""

import math
from dataclasses import dataclass

from assets.drawing.svg import INK, Point, Style, area, arrow, text
from assets.drawing.vectors import cross, scaled, total, unit
from imucal_wizard.guide.operator_view import Matrix, Vector, times

TOP, LIGHT, SHADE = "#ffd54a", "#f4f6f7", "#dde2e6"
"""A face that points up; one that does not; the same turned from the light."""
COLOURS = {"x": "#b3261e", "y": "#1b6e3c", "z": "#1a56a8"}
_CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))


@dataclass(frozen=True)
class View:
    """From where the cube is seen.

    Attributes:
        azimuth: the eye goes so far to the right, rad.
        elevation: and so far up, rad.
        size: half an edge of the cube on paper.
    """

    azimuth: float
    elevation: float
    size: float

    def paper(self, point: Vector) -> Point:
        """A point of the world (right, away, up, in half edges) on paper, y downwards."""
        right, away = self._turned(point)
        up = math.cos(self.elevation) * point[2] + math.sin(self.elevation) * away
        return self.size * right, -self.size * up

    def nearness(self, point: Vector) -> float:
        """How far a point of the world lies towards the eye."""
        away = self._turned(point)[1]
        return math.sin(self.elevation) * point[2] - math.cos(self.elevation) * away

    def _turned(self, point: Vector) -> Point:
        c, s = math.cos(self.azimuth), math.sin(self.azimuth)
        return c * point[0] + s * point[1], c * point[1] - s * point[0]


@dataclass(frozen=True)
class Face:
    """One face of the cube as it lies.

    Attributes:
        name: ``+x`` … ``-z``.
        normal: where it points in the world.
        within: two directions within the face, at right angles, in the world.
    """

    name: str
    normal: Vector
    within: tuple[Vector, Vector]


def faces(attitude: Matrix, view: View) -> list[Face]:
    """The faces that are seen."""
    found = []
    for index, axis in enumerate("xyz"):
        for sign, name in ((1.0, "+"), (-1.0, "-")):
            first, second = unit((index + 1) % 3), unit((index + 2) % 3)
            normal, *within = (times(attitude, v) for v in (unit(index, sign), first, second))
            if view.nearness(normal) > 1e-6:
                found.append(Face(name + axis, normal, (within[0], within[1])))
    return found


def cube(attitude: Matrix, view: View, up: str, bare: tuple[str, ...] = ()) -> list[str]:
    """The cube around the origin.

    Args:
        attitude: body to world.
        view: from where it is seen.
        up: the faces named in this are marked as the ones on top.
        bare: faces on which no name is printed.
    """
    drawn: list[str] = []
    for face in faces(attitude, view):
        drawn.append(_face(face, view, face.name in up))
        if face.name not in bare:
            drawn.append(_printed(face, view))
    return drawn


def _face(face: Face, view: View, on_top: bool) -> str:
    first, second = face.within
    corners = [
        view.paper(total(face.normal, scaled(first, a), scaled(second, b))) for a, b in _CORNERS
    ]
    turned_away = view.paper(face.normal)[0] > 0.45 * view.size
    fill = TOP if on_top else SHADE if turned_away else LIGHT
    outline: Style = {"fill": fill, "stroke": INK, "stroke_width": 0.055 * view.size}
    return area(corners, **outline)


def _printed(face: Face, view: View) -> str:
    """The name on the face, foreshortened as it is, the way up that reads best."""
    first, second = face.within
    choices = [second, first, scaled(second, -1.0), scaled(first, -1.0)]
    upwards = min(choices, key=lambda one: view.paper(one)[1])
    rightwards = cross(upwards, face.normal)
    (a, b), (c, d) = view.paper(rightwards), view.paper(scaled(upwards, -1.0))
    e, f = view.paper(face.normal)
    values = (a / view.size, b / view.size, c / view.size, d / view.size, e, f)
    matrix = f"matrix({' '.join(f'{value:.3f}' for value in values)})"
    style: Style = {"text_anchor": "middle", "font_weight": "bold", "fill": COLOURS[face.name[1]]}
    words = face.name.replace("-", "−")
    return text((0.0, 0.38 * view.size), words, 1.05 * view.size, transform=matrix, **style)


def axis_arrows(attitude: Matrix, view: View) -> list[str]:
    """The sensor's axes where they leave the cube towards the eye."""
    drawn: list[str] = []
    for face in (one for one in faces(attitude, view) if one.name[0] == "+"):
        colour = COLOURS[face.name[1]]
        start, tip, beyond = (view.paper(scaled(face.normal, r)) for r in (1.0, 2.2, 2.85))
        drawn += arrow(start, tip, 0.1 * view.size, colour, 0.4 * view.size)
        style: Style = {"text_anchor": "middle", "font_weight": "bold", "fill": colour}
        place = (beyond[0], beyond[1] + 0.2 * view.size)
        drawn.append(text(place, face.name, 0.7 * view.size, **style))
    return drawn
