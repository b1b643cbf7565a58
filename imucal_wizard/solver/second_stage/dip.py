"""The rotation between magnetometer and accelerometer, from the constancy of dip.

Whatever the device's attitude, the field stands at one angle to the vertical. With each sensor
calibrated in its own frame, the rotation R from the magnetometer's to the accelerometer's makes

    u·R m = −sin(dip)

the same in every still position (u: up, m: unit field). A small rotation ω of R moves the left side
by ``ω·(R m × u)``. The start is the best of the 24 ways in which the axes of two chips may lie.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.attitude import matrices, quaternions

FEWEST = 6
"""Still positions: three angles and the dip, and two to contradict them."""
MAX_ITERATIONS = 50
TOLERANCE = 1e-10
LOOSEST = np.radians(5.0)
"""Standard error of an angle beyond which the positions do not carry the rotation."""
BoolArray = NDArray[np.bool_]

OUTLIER = 4.0
"""Robust standard deviations beyond which a position is left out (iron near that place)."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """How the magnetometer lies in the accelerometer's frame.

    Attributes:
        rotation: R, from the magnetometer's frame to the accelerometer's, shape (3, 3).
        covariance: of a small rotation from the left, rad², shape (3, 3).
        dip: angle of the field below the horizon, rad, positive on the northern half.
        dip_error: its standard error, rad.
        residuals: error of the dip in each still position, rad, shape (n,).
        used: which positions were used, shape (n,).
        degrees_of_freedom: behind the covariance.
    """

    rotation: FloatArray
    covariance: FloatArray
    dip: float
    dip_error: float
    residuals: FloatArray
    used: BoolArray
    degrees_of_freedom: int

    @property
    def rms(self) -> float:
        """Of the dip's error over the positions used, rad."""
        return float(np.sqrt(np.mean(self.residuals[self.used] ** 2)))


def align(up: FloatArray, field: FloatArray, doubt: FloatArray | None = None) -> Alignment:
    """R and dip from still positions.

    Args:
        up: unit up in the accelerometer's frame, shape (n, 3).
        field: unit field in the magnetometer's own frame, shape (n, 3).
        doubt: change of ``field`` for one standard deviation along each of the k ways in which the
            magnetometer's calibration may be wrong, shape (n, 3, k).

    Raises:
        DataError: too few positions, or positions that do not carry the rotation.
    """
    if len(up) < FEWEST:
        raise DataError(
            f"{len(up)} still positions with a magnetometer are too few to align it: hold the "
            f"device still in at least {FEWEST} orientations while it records"
        )
    best: tuple[float, FloatArray, float] | None = None
    for start in quarter_turns():
        sine = (up * (field @ start.T)).sum(axis=1)
        cost = float(sine.var())
        if best is None or cost < best[0]:
            best = cost, start, float(sine.mean())
    assert best is not None  # noqa: S101 - there are 24 starts
    rotation, level = best[1], best[2]
    used = np.ones(len(up), bool)
    for _ in range(3):
        rotation, level = _solve(up[used], field[used], rotation, level)
        error = (up * (field @ rotation.T)).sum(axis=1) - level
        spread = 1.4826 * float(np.median(np.abs(error[used])))
        kept = np.abs(error) <= max(OUTLIER * spread, 1e-9)
        if (kept == used).all() or kept.sum() < FEWEST:
            break
        used = kept
    return _alignment(up, field, rotation, level, used, doubt)


def quarter_turns() -> list[FloatArray]:
    """The 24 rotations that bring axes onto axes."""
    out = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if np.linalg.det(matrix) > 0.0:
                out.append(matrix)
    return out


def _columns(up: FloatArray, turned: FloatArray) -> FloatArray:
    """Derivative of ``u·R m − level`` by a small rotation from the left and by the level."""
    return np.column_stack([np.cross(turned, up), -np.ones(len(up))])


def _solve(
    up: FloatArray, field: FloatArray, rotation: FloatArray, level: float
) -> tuple[FloatArray, float]:
    """Gauss–Newton with damping.

    Raises:
        DataError: it does not converge.
    """
    damping = 1e-6
    turned = field @ rotation.T
    error = (up * turned).sum(axis=1) - level
    for _ in range(MAX_ITERATIONS):
        columns = _columns(up, turned)
        normal = columns.T @ columns
        step = -np.linalg.solve(normal + damping * np.eye(4), columns.T @ error)
        trial = exponential(step[:3]) @ rotation
        moved = field @ trial.T
        new = (up * moved).sum(axis=1) - (level + step[3])
        if new @ new <= error @ error + 1e-18:
            rotation, level, turned, error = trial, level + float(step[3]), moved, new
            damping = max(damping / 10.0, 1e-12)
            if np.abs(step).max() < TOLERANCE:
                return rotation, level
        else:
            damping *= 10.0
            if damping > 1e6:
                break
    if damping <= 1e6:
        return rotation, level
    raise DataError("the rotation between magnetometer and accelerometer does not converge")


def _alignment(
    up: FloatArray,
    field: FloatArray,
    rotation: FloatArray,
    level: float,
    used: BoolArray,
    doubt: FloatArray | None,
) -> Alignment:
    turned = field @ rotation.T
    error = (up * turned).sum(axis=1) - level
    columns = _columns(up[used], turned[used])
    freedom = int(used.sum()) - 4
    variance = float(error[used] @ error[used]) / max(freedom, 1)
    values, vectors = np.linalg.eigh(columns.T @ columns)
    if values[0] < 1e-9 * values[-1]:
        raise DataError(_BLIND)
    inverse = (vectors / values) @ vectors.T
    covariance = variance * inverse
    if doubt is not None:
        moved = np.einsum("ni,ij,njk->nk", up[used], rotation, doubt[used])
        shift = inverse @ columns.T @ moved
        covariance = covariance + shift @ shift.T
    if freedom < 1 or np.sqrt(np.diag(covariance)[:3]).max() > LOOSEST:
        raise DataError(_BLIND)
    cosine = float(np.sqrt(max(1.0 - level**2, 1e-6)))
    return Alignment(
        rotation,
        covariance[:3, :3],
        -float(np.arcsin(np.clip(level, -1.0, 1.0))),
        float(np.sqrt(covariance[3, 3])) / cosine,
        error / cosine,
        used,
        freedom,
    )


def exponential(vector: FloatArray) -> FloatArray:
    """Rotation matrix of a rotation vector, rad, shape (3, 3)."""
    return np.asarray(matrices(quaternions(vector[:, None]))[:, :, 0])


def rotation_vector(rotation: FloatArray) -> FloatArray:
    """The rotation vector of a rotation matrix, rad, shape (3,)."""
    sine = 0.5 * np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    size = float(np.linalg.norm(sine))
    angle = float(np.arctan2(size, 0.5 * (np.trace(rotation) - 1.0)))
    if size > 1e-9:
        return np.asarray(sine * (angle / size))
    if angle < 1.0:
        return sine
    # half a turn: the axis is the column of R + 1 that is longest
    columns = rotation + np.eye(3)
    longest = columns[:, np.argmax(np.diag(columns))]
    return np.asarray(np.pi * longest / np.linalg.norm(longest))


_BLIND = (
    "the still positions do not carry the rotation between magnetometer and accelerometer: hold "
    "the device still with each of its faces up, and turned about the vertical in between"
)
