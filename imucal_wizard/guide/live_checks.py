"""Checks during measurement: a problem is reported at once, while repeating is cheap."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.limits.procedure import (
    END_SAMPLES,
    MAX_ANGLE_DISAGREEMENT,
    MAX_PATH_TILT_DEG,
    MIN_GRAVITY_SHARE,
    SPEED_RATIO,
    SPEEDS_WANTED,
)
from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.statistics import sample_quantile
from imucal_wizard.guide.measurements import KeptRotation
from imucal_wizard.guide.up_direction import UpEstimate
from imucal_wizard.guide.wording import signed
from imucal_wizard.measurement.clipping import (
    RateSegment,
    clipped_motions,
    clipped_rotation,
    is_clipped,
)
from imucal_wizard.measurement.rotation_angle import integrated_rate


def axis_shares(rate: FloatArray, rest: FloatArray) -> FloatArray:
    """Each axis' share of the squared rate of a motion, shape (3,)."""
    energy = ((rate - rest) ** 2).sum(axis=0)
    total = float(energy.sum())
    return energy / total if total > 0.0 else np.zeros(3)


def speeds(peaks: list[float]) -> int:
    """Number of clearly different speeds among peak rates, at most ``SPEEDS_WANTED``."""
    count, last = 0, 0.0
    for peak in sorted(peaks):
        if peak >= SPEED_RATIO * last and peak > 0.0:
            count, last = count + 1, peak
    return min(count, SPEEDS_WANTED)


def resting_rate(motion: KeptRotation) -> FloatArray:
    """The gyroscope's reading at rest, from the holds before and after, shape (3,)."""
    holds = (motion.before.hold, motion.after.hold)
    known = [hold.gyroscope for hold in holds if hold.gyroscope is not None]
    return np.asarray(np.mean(known, axis=0), float) if known else np.zeros(3)


def integrated(motion: KeptRotation) -> FloatArray:
    """The integrated rate of a motion, bias removed, shape (3,), rad or counts·s."""
    return integrated_rate(motion.time, motion.rate - resting_rate(motion))


def reject_clipped(
    rotations: Sequence[KeptRotation], full_scale: float | None, unit: str
) -> list[KeptRotation]:
    """Note the clipped axis of each rotation so far; returns the rotations that are newly found.

    The end of the range may show only when a second rotation reaches it.
    """
    whole = [one for one in rotations if one.problem is None or is_clipped(one.problem)]
    motions = [
        RateSegment(
            one.time,
            one.rate,
            resting_rate(one),
            one.before.hold.accelerometer,
            one.after.hold.accelerometer,
        )
        for one in whole
    ]
    found = []
    for one, axis in zip(whole, clipped_motions(motions, unit, full_scale), strict=True):
        if axis is not None and one.problem is None:
            one.problem = clipped_rotation(axis)
            found.append(one)
    return found


def gravity_angle(acceleration: FloatArray, up: UpEstimate, axis: str) -> float | None:
    """The angle about an axis by the accelerometer alone, rad, with whole turns.

    It checks a doubtful gyroscope.

    Args:
        acceleration: readings during the motion, from rest to rest, shape (n, 3).
        up: bias and size of gravity in the reading's unit.
        axis: ``x``, ``y`` or ``z``.

    Returns:
        The angle; None if the axis did not stay level, or other forces than gravity acted.
    """
    force = acceleration - up.bias
    size = np.sqrt((force * force).sum(axis=1))
    felt = np.isfinite(size) & (np.abs(size / up.radius - 1.0) < 0.5)
    if len(felt) < 2 * END_SAMPLES or felt.mean() < MIN_GRAVITY_SHARE:
        return None
    directions = force[felt] / size[felt, None]
    index = AXES.index(axis)
    tilt = sample_quantile(np.abs(directions[:, index]), MIN_GRAVITY_SHARE)
    if tilt > np.sin(np.radians(MAX_PATH_TILT_DEG)):
        return None
    across, along = directions[:, (index + 1) % 3], directions[:, (index + 2) % 3]
    angles = np.unwrap(np.arctan2(across, along))
    return float(angles[-END_SAMPLES:].mean() - angles[:END_SAMPLES].mean())


def contradicted(felt: FloatArray, seen: float, axis: str) -> bool:
    """Whether the gyroscope shows a rotation about another axis than gravity does, or none.

    Args:
        felt: the gyroscope's angle about each axis, shape (3,).
        seen: gravity's angle about ``axis``, in the same unit.
        axis: the axis.
    """
    sizes, size = np.abs(felt), abs(seen)
    nowhere = bool((sizes < MAX_ANGLE_DISAGREEMENT * size).all())
    return nowhere or _other_axis(sizes, size, axis) is not None


def _other_axis(sizes: FloatArray, size: float, axis: str) -> str | None:
    """The only other axis that turned by as much, if this one hardly turned."""
    if sizes[AXES.index(axis)] > 2.0 * MAX_ANGLE_DISAGREEMENT * size:
        return None
    margin = MAX_ANGLE_DISAGREEMENT * size
    same = [other for other in AXES if abs(sizes[AXES.index(other)] - size) <= margin]
    return same[0] if len(same) == 1 else None


def disagreement(motion: KeptRotation, *, scale_known: bool) -> str:
    """A warning when the gyroscope's angle is far from gravity's, or ""."""
    if not scale_known or motion.axis is None:
        return ""
    axis, seen = motion.axis, motion.angle
    angles = np.degrees(integrated(motion))
    felt, margin = float(angles[AXES.index(axis)]), MAX_ANGLE_DISAGREEMENT * abs(seen)
    if abs(felt - seen) <= margin:
        return ""
    turn = f"Gravity turned by {signed(seen)} about {axis}, the gyroscope"
    other = _other_axis(np.abs(angles), abs(seen), axis)
    if other is not None:
        there = float(angles[AXES.index(other)])
        return f"{turn} by {signed(there)} about {other}: are axes of one of the two swapped?"
    if abs(felt) < margin:
        return f"{turn} not at all: is its {axis} axis dead, or its column another one?"
    if abs(felt + seen) <= margin:
        others = " or ".join(one for one in AXES if one != axis)
        wrong = (
            f"the sign of its {axis} axis is wrong, or that of the accelerometer's {others} axis"
        )
        return f"{turn} by {signed(felt)}: {wrong}."
    return f"{turn} by {signed(felt)}: check its unit and the sample rate."
