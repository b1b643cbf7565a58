"""One figure each: a pose with what the accelerometer reads in it, a rotation with its senses."""

import math

from assets.drawing.solid import COLOURS, View, axis_arrows, cube
from assets.drawing.svg import INK, QUIET, Point, Style, arrow, path, rectangle, text
from assets.drawing.vectors import across, cross, scaled, standing, total, unit
from imucal_wizard.core.poses import AXES, NAMED, START_POSES
from imucal_wizard.guide.operator_view import Matrix, Vector, about, times
from imucal_wizard.guide.wording import label

_MIDDLE: Style = {"text_anchor": "middle"}
_BOLD: Style = {"text_anchor": "middle", "font_weight": "bold"}
_ARC = range(-112, 113, 8)
"""Degrees of the arrow round an axis, from the top of it."""
_EYE = {1: (27.0, 34.0), 2: (11.0, 38.0), 3: (0.0, 61.0)}
"""Azimuth and elevation of the eye, degrees, by the number of faces on top."""


def up_of(pose: str) -> Vector:
    """Which way is up in a pose, seen from the body."""
    x, y, z = (float(value) for value in NAMED[pose])
    return x, y, z


def pose_attitude(pose: str) -> Matrix:
    """The device in a pose, turned about the vertical so that the faces on top can be seen."""
    up = up_of(pose)
    named = [index for index in range(3) if up[index]]
    free = [index for index in range(3) if not up[index]]
    if len(named) == 3:  # the corner's x face looks at the eye
        return standing(up, cross(scaled(across(unit(0, up[0]), up), -1.0), up))
    front = unit(free[-1]) if len(free) == 1 else unit(free[0] if named != [1] else 2, 1.0)
    return standing(up, cross(up, front))


def view_of(pose: str, size: float) -> View:
    """From where all faces on top are seen: the more they are, the higher up."""
    azimuth, elevation = _EYE[len(pose) // 2]
    return View(math.radians(azimuth), math.radians(elevation), size)


def readings(pose: str) -> str:
    """What the three axes read at rest, in g."""
    return " ".join(_signed(float(value)) for value in NAMED[pose])


def _signed(value: float) -> str:
    words = f"{abs(value):.2f}".rstrip("0").rstrip(".")
    return "0" if words == "0" else ("+" if value > 0 else "−") + words


def pose_figure(pose: str, size: float) -> list[str]:
    """A pose around the origin: a box to tick, the cube, gravity, the name and the readings.

    Args:
        pose: its name.
        size: half an edge of the cube.
    """
    box: Style = {"fill": "none", "stroke": INK, "stroke_width": 0.3}
    below, small = 2.75 * size, 0.5 if len(pose) < 6 else 0.42
    return [
        rectangle((-2.25 * size, -1.75 * size), 0.6 * size, 0.6 * size, **box),
        *cube(pose_attitude(pose), view_of(pose, size), pose),
        *gravity((1.95 * size, -0.1 * size), size),
        text((0.0, below), label(pose), 0.78 * size, **_BOLD),
        text((0.0, below + 0.68 * size), readings(pose), small * size, fill=QUIET, **_MIDDLE),
    ]


def gravity(top: Point, size: float) -> list[str]:
    """The arrow of gravity: down, always."""
    tip = (top[0], top[1] + 1.3 * size)
    words = text((top[0], top[1] - 0.2 * size), "g", 0.5 * size, font_style="italic", **_MIDDLE)
    return [*arrow(top, tip, 0.09 * size, INK, 0.4 * size), words]


def device_figure(size: float) -> list[str]:
    """The device lying flat, with the axes that are printed on its board."""
    view = view_of("+z", size)
    attitude = pose_attitude("+z")
    return [*cube(attitude, view, "", ("+x", "+y", "+z")), *axis_arrows(attitude, view)]


def rotation_figure(axis: str, size: float) -> list[str]:
    """Turning about an axis around the origin, from the pose in which it begins."""
    start, index = START_POSES[axis], AXES.index(axis)
    attitude = standing(up_of(start), unit(index))
    view = View(math.radians(47.0), math.radians(28.0), size)
    rod, colour = times(attitude, unit(index)), COLOURS[axis]
    stick: Style = {"stroke": colour, "stroke_width": 0.14 * size, "stroke_linecap": "round"}
    near, far = ([view.paper(scaled(rod, sign * r)) for r in (1.0, 3.1)] for sign in (1, -1))
    tip = view.paper(scaled(rod, 3.7))
    return [
        path(far, **stick),
        *cube(attitude, view, start, (f"+{axis}",)),
        path(near, **stick),
        *_senses(rod, view, colour),
        text((tip[0], tip[1] + 0.2 * size), f"+{axis}", 0.7 * size, fill=colour, **_BOLD),
        *gravity((-2.2 * size, 0.4 * size), size),
    ]


def _senses(rod: Vector, view: View, colour: str) -> list[str]:
    """A bow round the axis with a head at either end."""
    size, centre = view.size, scaled(rod, 2.3)
    up: Vector = (0.0, 0.0, 1.0)
    bow = [view.paper(total(centre, times(about(rod, math.radians(a)), up))) for a in _ARC]
    drawn = [path(bow[1:-1], stroke=colour, stroke_width=0.1 * size)]
    for before, end in ((bow[-3], bow[-1]), (bow[2], bow[0])):
        drawn += arrow(before, end, 0.1 * size, colour, 0.45 * size)
    return drawn
