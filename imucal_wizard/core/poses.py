"""The named directions of a cube: 6 faces, 12 edges, 8 corners.

A pose is named by the faces that point up: ``+x`` has the +x face on top, ``+x-y`` the edge between
the +x and −y faces, ``+x-y+z`` a corner, ``+x~-y`` the +x face tilted towards −y. At rest the
specific force is ``g·u``, with ``u`` the up direction in the body frame, so the accelerometer shows
the pose.
"""

import itertools
import math
from collections.abc import Iterable

import numpy as np

from imucal_wizard.core.quantities import true_minus
from imucal_wizard.core.readings import FloatArray

AXES = "xyz"


def _name(signs: tuple[int, ...]) -> str:
    pairs = zip(signs, AXES, strict=True)
    return "".join(f"{'+' if sign > 0 else '-'}{axis}" for sign, axis in pairs if sign)


def _directions(faces: int) -> dict[str, FloatArray]:
    named = {}
    for signs in itertools.product((1, -1, 0), repeat=3):
        if sum(map(abs, signs)) == faces:
            vector = np.array(signs, float)
            named[_name(signs)] = vector / np.linalg.norm(vector)
    return named


FACES: dict[str, FloatArray] = {
    name: _directions(1)[name] for name in ("+x", "-x", "+y", "-y", "+z", "-z")
}
EDGES: dict[str, FloatArray] = _directions(2)
CORNERS: dict[str, FloatArray] = _directions(3)
DIRECTIONS: dict[str, FloatArray] = {**FACES, **EDGES, **CORNERS}
"""Unit up vector of each of the 26 named poses."""

TILT_SIGN = "~"
"""Separator in a name: the face before it is on top, tilted towards the face after it."""
TILT_DEG = 30.0
"""At this tilt, half of gravity acts on the second axis, where asymmetry and second order differ
most."""

MIN_ALONG_AXIS = 0.8
"""Cosine from which on an axis lies along another one (37°)."""


def axes_in_words(mounted: FloatArray, frame: str) -> str:
    """How axes lie in a frame, in words; "" if they are those of the frame or lie askew.

    Args:
        mounted: each column is an axis in the frame, shape (3, 3).
        frame: whose, in the genitive: ``the accelerometer's``.
    """
    nearest = np.abs(mounted).argmax(axis=0)
    along = mounted[nearest, np.arange(3)]
    if sorted(nearest.tolist()) != [0, 1, 2] or np.abs(along).min() < MIN_ALONG_AXIS:
        return ""
    parts = []
    for i, j in enumerate(nearest.tolist()):
        if i == j and along[i] < 0.0:
            parts.append(f"{AXES[i]} points the other way")
        elif i < j and nearest[j] == i and along[i] > 0.0 and along[j] > 0.0:
            parts.append(f"{AXES[i]} and {AXES[j]} are swapped")
        elif i != j and (nearest[j] != i or along[i] < 0.0 or along[j] < 0.0):
            sign = "+" if along[i] > 0.0 else "−"
            parts.append(f"{AXES[i]} lies along {frame} {sign}{AXES[j]}")
    return ", ".join(parts)


def _tilts() -> dict[str, FloatArray]:
    """From each face towards each of its four neighbours."""
    angle = np.radians(TILT_DEG)
    named = {}
    for face, other in itertools.permutations(FACES, 2):
        if face[1] != other[1]:
            up = np.cos(angle) * FACES[face] + np.sin(angle) * FACES[other]
            named[f"{face}{TILT_SIGN}{other}"] = up
    return named


TILTS: dict[str, FloatArray] = _tilts()
"""24 directions between the faces and the edges."""
NAMED: dict[str, FloatArray] = {**DIRECTIONS, **TILTS}
"""Every named direction."""
EIGHT_TILTS = ("+z~+x", "-x~+z", "+z~+y", "-y~+z", "-z~-x", "+x~-z", "-z~-y", "+y~-z")
"""Four tilts upright and four upside down, by 30° or 60° (N, VII-A). Tilts of one angle alone could
not separate the three scales: their squared components take only two sets of values."""
POSE_SETS: dict[str, tuple[str, ...]] = {
    "8": EIGHT_TILTS,
    "18": (*FACES, *EDGES),
    "26": (*FACES, *EDGES, *CORNERS),
}
"""The poses of N, of Q, and all directions of a cube."""

START_POSES: dict[str, str] = {"x": "+z", "y": "+z", "z": "+x"}
"""The pose in which rotations about each axis begin: the axis must lie level (Q's figure 2)."""

TIE_DEG = 15.0
"""Poses whose distances differ by less than this are equally near; the order of the list
decides."""
FACE_TOLERANCE_DEG = 40.0
"""With the six faces alone the nearest other face is 90° away."""
POSE_TOLERANCE_DEG = 20.0
"""Faces and edges are 45° apart; a tolerance of 20° keeps every pose unambiguous."""


def angle_between(a: FloatArray, b: FloatArray) -> float:
    """Angle between two vectors, rad, accurate near 0 and π (Kahan's two-argument form)."""
    # the bits of np.linalg.norm, five times faster: the wizard asks for many angles in each block
    a = a / math.sqrt(a @ a)
    b = b / math.sqrt(b @ b)
    apart, together = a - b, a + b
    return float(2.0 * np.arctan2(math.sqrt(apart @ apart), math.sqrt(together @ together)))


def nearest_pose(up: FloatArray, among: Iterable[str], tolerance_deg: float) -> str | None:
    """The named pose nearest to ``up`` within the tolerance, or None."""
    names = list(among)
    if not names:
        return None
    best = names[int(np.argmax(np.array([NAMED[name] for name in names]) @ up))]
    return best if np.degrees(angle_between(up, NAMED[best])) <= tolerance_deg else None


def pose_in_words(name: str) -> str:
    """The pose in words, like "the edge between the +x and −y faces on top"."""
    if name in TILTS:
        return direction_in_words(TILTS[name])
    faces = [true_minus(name[i : i + 2]) for i in range(0, len(name), 2)]
    if len(faces) == 1:
        return f"the {faces[0]} face on top"
    if len(faces) == 2:
        return f"the edge between the {faces[0]} and {faces[1]} faces on top"
    return f"the corner of the {faces[0]}, {faces[1]} and {faces[2]} faces on top"


def direction_in_words(up: FloatArray) -> str:
    """A direction in words, like "the +x face on top, tilted 30° towards −y"."""
    size = np.abs(up)
    first, second, third = np.argsort(-size, kind="stable")

    def face(axis: int) -> str:
        return f"{'+' if up[axis] > 0.0 else '−'}{AXES[axis]}"

    angle = float(np.degrees(np.arccos(np.clip(size[first] / np.linalg.norm(up), 0.0, 1.0))))
    towards = face(int(second))
    if size[third] > 0.5 * size[second]:
        towards += f" and {face(int(third))}"
    return f"the {face(int(first))} face on top, tilted {angle:.0f}° towards {towards}"
