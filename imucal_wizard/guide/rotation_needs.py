"""The rotation that improves the fit most, given the rotations so far.

The rows are those of the fit: the closure of each rotation against gravity, differentiated by the
matrix, the bias, and the effects that depend on the rate. The rotations so far narrow the prior of
these parameters; the next rotation is the one whose closure narrows the posterior most (the largest
growth of the logarithm of the information's determinant). A second rotation that repeats the first
adds little information, so sense, speed and angle change by themselves.
"""

import itertools
import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from imucal_wizard.core.attitude import rotation_samples
from imucal_wizard.core.limits.procedure import (
    ROTATION_RATES,
    SPEED_RATIO,
)
from imucal_wizard.core.poses import AXES, DIRECTIONS, START_POSES
from imucal_wizard.core.quaternions import rotation_matrix
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.measurement.rotation_angle import soft_rotation
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.effect import GYROSCOPE, Circumstances
from imucal_wizard.model.rows.gravity_closure import GravityClosure
from imucal_wizard.model.rows.source import ENTRIES, Parameters, RowLabels
from imucal_wizard.model.terms import Term, Terms

ANGLES_DEG = (60.0, 90.0, 120.0, 150.0)
"""Angles asked for; a rotation by hand beyond 170° needs a second grip."""
MAX_RANGE_SHARE = 0.8
"""Largest peak rate asked for, as a share of the gyroscope's range: a hand overshoots by 10 %."""
MAX_TILT_DEG = 170.0
"""Largest rotation from the start pose that is asked for: a cable would wind up beyond."""
CLOSURE_NOISE = math.radians(0.1)
"""Noise of a closure of a consumer gyroscope by hand, rad."""
MATRIX_PRIOR, BIAS_PRIOR = 0.03, math.radians(0.02)
"""Prior standard deviations: scale and cross axis of a consumer part, and the bias (rad/s) once it
was measured at rest."""
SIMILAR_AXIS_SHARE = 0.9
"""Axes whose gains are at least this share of the largest keep their order, which saves changes of
the start pose."""
RATE_EFFECTS = ("asymmetry", "second-order", "third-order")
"""Effects that only rotations of other senses and rates separate from the scale."""
SAMPLE_SECONDS = 0.05
"""Between the samples of an imagined rotation: it is as smooth as a hand."""
SAME = 1e-6
"""Gains that differ by less are equal; the first of the list is asked for."""
NEW_RATE_SHARE = 0.8
"""A rate that was not used about this axis is preferred if its gain is at least this share of the
largest: a third rate shows a curve that none of these parameters describes."""


@dataclass(frozen=True)
class PlannedRotation:
    """A rotation from rest to rest about a body axis.

    Attributes:
        axis: ``x``, ``y`` or ``z``.
        angle: signed, degrees.
        fastest: peak rate, °/s.
        tilt: angle about the axis from the start pose at its beginning, degrees.
    """

    axis: str
    angle: float
    fastest: float
    tilt: float = 0.0


@lru_cache(maxsize=64)
def next_rotation(
    done: tuple[PlannedRotation, ...], axis: str, tilt: float, range_deg: float | None = None
) -> PlannedRotation:
    """The rotation about an axis that adds most information.

    Args:
        done: the rotations so far, about any axis.
        axis: the axis.
        tilt: present angle about it from its start pose, degrees.
        range_deg: full scale of the gyroscope, °/s, or None if not known.
    """
    fastest = math.inf if range_deg is None else MAX_RANGE_SHARE * range_deg
    rates = sorted({min(rate, fastest) for rate in ROTATION_RATES})
    choices = [
        PlannedRotation(axis, sense * angle, rate, tilt)
        for rate, angle, sense in itertools.product(rates, ANGLES_DEG, (1.0, -1.0))
        if abs(tilt + sense * angle) <= MAX_TILT_DEG
    ]
    gains = _gains(done, choices)
    used = [one.fastest for one in done if one.axis == axis]
    new = np.array([not any(_alike(one.fastest, rate) for rate in used) for one in choices])
    if (gains[new] >= NEW_RATE_SHARE * gains.max()).any():
        gains = np.where(new, gains, 0.0)
    return choices[int(np.flatnonzero(gains >= gains.max() - SAME)[0])]


def _alike(rate: float, other: float) -> bool:
    return max(rate, other) < SPEED_RATIO * min(rate, other)


@lru_cache(maxsize=64)
def neediest_axis(done: tuple[PlannedRotation, ...], axes: tuple[str, ...]) -> str:
    """The axis whose best rotation from the start pose adds most; of similar ones the first."""
    gains = _gains(done, [next_rotation(done, axis, 0.0) for axis in axes])
    return axes[int(np.flatnonzero(gains >= SIMILAR_AXIS_SHARE * gains.max())[0])]


def _gains(done: Sequence[PlannedRotation], choices: Sequence[PlannedRotation]) -> FloatArray:
    """By how much each choice lets the log-determinant of the information grow, shape (n,)."""
    columns = _columns([*done, *choices])
    before, after = columns[: len(done)].reshape(-1, columns.shape[2]), columns[len(done) :]
    covariance = np.linalg.inv(np.eye(columns.shape[2]) + before.T @ before)
    inside = np.einsum("map,pq,mbq->mab", after, covariance, after) + np.eye(2)
    return np.asarray(np.linalg.slogdet(inside)[1])


def _columns(rotations: Sequence[PlannedRotation]) -> FloatArray:
    """Derivative of each closure by the parameters, in standard deviations, shape (m, 2, p)."""
    moves = [soft_rotation(one.angle, one.fastest, SAMPLE_SECONDS) for one in rotations]
    along = [np.eye(3)[AXES.index(one.axis)] for one in rotations]
    samples = rotation_samples(
        [time for time, _ in moves],
        [np.radians(rate)[:, None] * axis for (_, rate), axis in zip(moves, along, strict=True)],
    )
    before = np.array([_up(one, one.tilt) for one in rotations])
    count, size = len(rotations), len(samples.time)
    force = STANDARD_GRAVITY * before[samples.rotation]
    unknown = np.full(2 * count, -1)
    closure = GravityClosure(
        samples=samples,
        before=before,
        after=np.array([_up(one, one.tilt + one.angle) for one in rotations]),
        before_doubt=np.zeros((count, 3, 0)),
        after_doubt=np.zeros((count, 3, 0)),
        noise=np.full(count, CLOSURE_NOISE**2),
        motion=Circumstances(
            force, samples.reading, np.full(size, np.nan), samples.time, force, np.zeros(size)
        ),
        gravity=STANDARD_GRAVITY,
        labels=RowLabels(
            unknown, unknown, unknown, unknown, unknown * 1.0, np.zeros((2 * count, 2)), unknown
        ),
    )
    rows = closure.at(Parameters(np.eye(3), np.zeros(3)), Terms(GYROSCOPE, ()))
    prior = np.repeat([MATRIX_PRIOR, BIAS_PRIOR], [ENTRIES - 3, 3])
    columns = [rows.base_columns() * prior]
    for name in RATE_EFFECTS:
        term = Term(effect(name))
        typical = [one.typical for one in term.effect.parameters(GYROSCOPE)]
        columns.append(rows.term_columns([term]) * typical)
    return (np.concatenate(columns, axis=1) / CLOSURE_NOISE).reshape(count, 2, -1)


def _up(rotation: PlannedRotation, tilt: float) -> FloatArray:
    """Up in the body frame at an angle from the start pose."""
    axis = np.eye(3)[AXES.index(rotation.axis)]
    return rotation_matrix(-math.radians(tilt) * axis) @ DIRECTIONS[START_POSES[rotation.axis]]
