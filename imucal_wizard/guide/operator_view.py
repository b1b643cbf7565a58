"""What the operator sees: one view of the device, which drawing, arrow and words share.

The operator holds the device as it is drawn, with the eye where the drawing has it. Every turn that
the procedure asks for is about a level axis of the room. It is named by the direction in which the
top of the device moves as the operator sees it: towards the eye, away from it, left or right.

World axes: z up; the eye is at ``AZIMUTH`` to the right of −y. Attitudes are body to world.
"""

import math
from collections.abc import Sequence

from imucal_wizard.core.records import dataclass

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]
"""Rows of a rotation matrix."""

IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
AZIMUTH = math.radians(20.0)
"""Enough to show the name of a side face of a device that lies square."""
ELEVATION = math.radians(24.0)
UPRIGHT = 0.1
"""Level part of a unit axis below which a rotation about it moves the top nowhere."""
_DIRECTIONS = (
    "to the right",
    "away from you and right",
    "away from you",
    "away from you and left",
    "to the left",
    "towards you and left",
    "towards you",
    "towards you and right",
)
"""Directions in which the top moves, counter-clockwise from the right, 45° apart."""
_RIGHT = -AZIMUTH / 2.0
"""The middle of "to the right": half-way between the right of the eye and that of a device that
lies square to the operator. The edges that such a device is tipped along are ``AZIMUTH`` beside the
directions of the eye, so counted from the eye 3° of yaw would make another word in one sense, and
25° in the other; from here it is 12° in both."""


def seen(point: Vector) -> Vector:
    """World to eye: right, up, towards the eye."""
    x, y, z = point
    right, away = _level_seen(x, y)
    ce, se = math.cos(ELEVATION), math.sin(ELEVATION)
    return right, ce * z + se * away, se * z - ce * away


def _level_seen(x: float, y: float) -> tuple[float, float]:
    """A level direction of the world as the operator sees it: right, away."""
    ca, sa = math.cos(AZIMUTH), math.sin(AZIMUTH)
    return ca * x + sa * y, ca * y - sa * x


def matrix_of(attitude: Sequence[Sequence[float]]) -> Matrix:
    """Any 3×3 table as plain rows."""
    a, b, c = ((float(r[0]), float(r[1]), float(r[2])) for r in attitude)
    return a, b, c


def times(matrix: Matrix, v: Vector) -> Vector:
    """Matrix times vector."""
    a, b, c = (row[0] * v[0] + row[1] * v[1] + row[2] * v[2] for row in matrix)
    return a, b, c


def product(left: Matrix, right: Matrix) -> Matrix:
    """Matrix times matrix."""
    a, b, c = (times(left, (right[0][i], right[1][i], right[2][i])) for i in range(3))
    return (a[0], b[0], c[0]), (a[1], b[1], c[1]), (a[2], b[2], c[2])


def about(axis: Vector, angle: float) -> Matrix:
    """Rotation about a unit axis by an angle in radians (Rodrigues)."""
    x, y, z = axis
    c, s = math.cos(angle), math.sin(angle)
    k = 1.0 - c
    return (
        (c + x * x * k, x * y * k - z * s, x * z * k + y * s),
        (y * x * k + z * s, c + y * y * k, y * z * k - x * s),
        (z * x * k - y * s, z * y * k + x * s, c + z * z * k),
    )


@dataclass(frozen=True)
class Turn:
    """A rotation about a level axis of the world.

    Attributes:
        axis: unit vector, world.
        angle: right-handed about the axis, rad, not negative.
    """

    axis: Vector
    angle: float

    def of(self, attitude: Matrix, share: float = 1.0) -> Matrix:
        """The attitude after a share of the turn."""
        return product(about(self.axis, share * self.angle), attitude)

    @property
    def sector(self) -> int:
        """Where the top of the device moves: 45° counter-clockwise from the right, so many times.

        Words and the head of the arrow are both taken from it.
        """
        right, away = _level_seen(self.axis[1], -self.axis[0])  # axis × up
        beyond = math.degrees(math.atan2(away, right) - _RIGHT)
        return round(beyond / 45.0) % len(_DIRECTIONS)

    @property
    def words(self) -> str:
        """The same in words: "towards you", "to the left"."""
        return _DIRECTIONS[self.sector]


def turn_to(attitude: Matrix, up: Vector) -> Turn:
    """The smallest turn that brings the body direction ``up`` on top."""
    x, y, z = times(attitude, up)
    across = math.hypot(x, y)
    if across < 1e-9:  # on top already, or upside down: over, towards the operator
        axis = (math.cos(AZIMUTH), math.sin(AZIMUTH), 0.0)
        return Turn(axis, 0.0 if z > 0.0 else math.pi)
    # about (world direction) × (world up), which is level
    return Turn((y / across, -x / across, 0.0), math.atan2(across, z))


def turn_about(attitude: Matrix, axis: Vector, angle: float) -> Turn | None:
    """A rotation about a body axis, which is taken as level; None if it stands upright.

    Args:
        attitude: body to world.
        axis: unit vector, body.
        angle: right-handed about it, rad.
    """
    x, y, _ = times(attitude, axis)
    level = math.hypot(x, y)
    if level < UPRIGHT:
        return None
    sense = math.copysign(1.0, angle)
    return Turn((sense * x / level, sense * y / level, 0.0), abs(angle))
