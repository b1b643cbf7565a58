"""Which motion fills the largest gap.

When the device turns once about the vertical, the field runs round a circle about the direction
that points down in the body frame. Its angle from there is 90° minus the dip. So every pose has its
own circle on the sphere; the best pose is the one whose circle crosses the most empty areas.
"""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.limits.procedure import FACE_GAIN_SHARE
from imucal_wizard.core.poses import DIRECTIONS, TIE_DEG, angle_between
from imucal_wizard.core.quantities import true_minus
from imucal_wizard.core.readings import FloatArray, distinct
from imucal_wizard.estimate.ellipsoid.coverage import GAP_SHARES, bin_of
from imucal_wizard.guide.field.survey import Survey

STEPS = np.linspace(0.0, 2.0 * np.pi, 90, endpoint=False)
"""Angles on a circle, rad; several for each area that the circle crosses."""


def down_component(survey: Survey) -> float | None:
    """Mean share of the field that points down (the sine of the dip); None if not known yet."""
    up = survey.log.up[: len(survey.disturbed)]
    rows = np.isfinite(up).all(axis=1) & ~survey.disturbed
    if survey.fit is None or not rows.any():
        return None
    seen = survey.fit.look(survey.log.reading[: len(up)][rows])[1]
    return float(-np.einsum("in,ni->n", seen, up[rows]).mean())


def gains(counts: NDArray[np.intp], down: float, poses: Iterable[str]) -> dict[str, float]:
    """How many empty areas a circle with each face, edge or corner down would fill.

    Args:
        counts: samples in each area, shape (100,).
        down: see ``down_component``.
        poses: names in ``poses.DIRECTIONS`` of what points down.
    """
    empty = np.zeros(len(counts))
    few = counts < len(GAP_SHARES)
    empty[few] = GAP_SHARES[counts[few]]
    return {pose: float(empty[crossed(DIRECTIONS[pose], down)].sum()) for pose in poses}


def crossed(direction: FloatArray, down: float) -> NDArray[np.intp]:
    """The areas through which the field runs when the device is turned once round.

    Args:
        direction: what points down, unit vector in the body frame, shape (3,).
        down: see ``down_component``.
    """
    across = np.cross(direction, np.eye(3)[int(np.argmin(np.abs(direction)))])
    across /= np.linalg.norm(across)
    level = np.outer(across, np.cos(STEPS)) + np.outer(np.cross(direction, across), np.sin(STEPS))
    path = np.sqrt(max(1.0 - down * down, 0.0)) * level + down * direction[:, None]
    return distinct(bin_of(path))


def next_face(survey: Survey, missing: Sequence[str], up: FloatArray | None) -> str | None:
    """The missing face whose circle fills the most areas; of similar ones the nearest.

    Args:
        survey: the samples.
        missing: faces to choose from.
        up: up direction in the body frame, or None.
    """
    if not missing or up is None:
        return None
    down = down_component(survey)
    fills = dict.fromkeys(missing, 1.0) if down is None else gains(survey.counts, down, missing)
    enough = FACE_GAIN_SHARE * max(fills.values())
    near = [face for face in missing if fills[face] >= enough]
    tie = np.radians(TIE_DEG)
    return min(near, key=lambda face: round(angle_between(up, -DIRECTIONS[face]) / tie))


def next_motion(survey: Survey) -> str | None:
    """The face, edge or corner whose circle fills the most areas; None if all are full."""
    down = down_component(survey)
    fills = {} if down is None else gains(survey.counts, down, DIRECTIONS)
    best = max(fills, key=fills.__getitem__, default=None)
    return best if best is not None and fills[best] > 0.0 else None


def opposite(pose: str) -> str:
    """The pose that is up when this one is down."""
    return pose.translate(str.maketrans("+-", "-+"))


def sentence(pose: str) -> str:
    """The instruction for a circle with this pose down."""
    faces = [true_minus(pose[i : i + 2].upper()) for i in range(0, len(pose), 2)]
    if len(faces) == 1:
        return f"put {faces[0]} on the table and turn it once round"
    if len(faces) == 2:
        where = f"the edge between {faces[0]} and {faces[1]}"
    else:
        where = f"the corner of {faces[0]}, {faces[1]} and {faces[2]}"
    return f"hold it with {where} down and turn it once round"
