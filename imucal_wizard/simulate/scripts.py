"""Scripts of a complete calibration: poses, rotations, circles."""

import itertools
from collections.abc import Iterator

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.poses import AXES, CORNERS, FACES, START_POSES
from imucal_wizard.simulate.actions import Action, LieStill, PlacePose, Rotate

FACE_NAMES: tuple[str, ...] = tuple(FACES)
EDGE_NAMES = tuple(  # the order of ``poses.EDGES`` would change every seeded recording
    f"{p}{a}{q}{b}" for a, b in itertools.combinations(AXES, 2) for p in "+-" for q in "+-"
)
CORNER_NAMES: tuple[str, ...] = tuple(CORNERS)

Target = str | tuple[float, float, float]
"""A pose by name, or an up direction in the body frame."""


def _tilted() -> tuple[Target, ...]:
    """Four tilts upright and four upside down (N, VII-A), by 25° or 65° each.

    Equal tilts could not separate the three scales: in every pose the squared components would be
    one of two triples, and three scales need three.
    """
    out: list[Target] = []
    for upright in (1.0, -1.0):
        for axis in (0, 1):
            for side in (1.0, -1.0):
                angle = np.radians(25.0 if side == upright else 65.0)
                up = [0.0, 0.0, upright * float(np.cos(angle))]
                up[axis] = side * float(np.sin(angle))
                out.append((up[0], up[1], up[2]))
    return tuple(out)


TILTED_POSES = _tilted()
RECORDING_POSE_SETS = ("6", "8", "18", "26", "26+repeats")
REPEATED_POSES = 12
"""Poses of ``26+repeats`` that are repeated."""
SHAKEN_EVERY = 3
"""Interval of poses with a vibrating support, which shows vibration rectification."""
SHAKE_RMS = 0.5
"""Vibration of that support, m/s² per axis: a machine that idles beside the device."""

VALIDATION: tuple[tuple[float, float, float], ...] = (
    (0.40, 0.25, 0.88),
    (-0.85, 0.45, 0.28),
    (0.30, -0.90, -0.32),
    (-0.28, 0.38, -0.88),
    (0.88, 0.22, -0.42),
)
"""Up directions that are not named poses."""

SPEEDS_DEG = (45.0, 110.0, 200.0)
"""Peak rates of slow, medium and fast rotations, °/s."""
ANGLES_DEG = (90.0, -75.0, 140.0, -165.0, 60.0, -130.0, 165.0, -100.0, 120.0, -140.0)
"""Signed angles of successive rotations, in both senses."""
CIRCLE_SPEED_DEG = 60.0
"""Peak rate of a circle on the table, °/s."""
LARGEST_TILT_DEG = 172.0
"""Largest rotation from the start pose, degrees; half a turn would be ambiguous."""


def next_angle(turn: int, tilt: float) -> float:
    """The angle of the next rotation, degrees; the tilt stays within ±172°.

    Args:
        turn: number of earlier rotations about this axis.
        tilt: current rotation from the start pose, degrees.
    """
    angle = ANGLES_DEG[turn % len(ANGLES_DEG)]
    return angle if abs(tilt + angle) <= LARGEST_TILT_DEG else -angle


def pose_names(poses: str, rng: np.random.Generator) -> tuple[Target, ...]:
    """The poses of a set in random order, with repeats of the first ones at the end.

    Raises:
        UsageError: there is no such set.
    """
    if poses not in RECORDING_POSE_SETS:
        raise UsageError(f"no poses {poses!r}; choose one of {', '.join(RECORDING_POSE_SETS)}")
    names: tuple[Target, ...] = FACE_NAMES
    if poses == "8":
        names = TILTED_POSES
    elif poses != "6":
        names = FACE_NAMES + EDGE_NAMES
    if poses.startswith("26"):
        names = FACE_NAMES + EDGE_NAMES + CORNER_NAMES
    order = tuple(names[i] for i in rng.permutation(len(names)))
    return order + order[:REPEATED_POSES] if poses.endswith("repeats") else order


def perform_rotations(number: int, hold: float) -> Iterator[Action]:
    """``number`` rotations about each body axis between holds: both senses, three speeds."""
    for axis in AXES:
        yield PlacePose(START_POSES[axis], error=0.7)
        yield LieStill(hold)
        tilt = 0.0
        for turn in range(number):
            angle = next_angle(turn, tilt)
            tilt += angle
            yield Rotate(axis, angle, SPEEDS_DEG[turn % len(SPEEDS_DEG)])
            yield LieStill(hold)


def perform_circles(hold: float) -> Iterator[Action]:
    """A full circle about the vertical on each face, as on a table (N, VI-A)."""
    for face in FACE_NAMES:
        yield PlacePose(face, error=0.7)
        yield LieStill(hold)
        yield Rotate(face[1], 360.0 if face[0] == "+" else -360.0, CIRCLE_SPEED_DEG, error=3.0)
        yield LieStill(hold)
