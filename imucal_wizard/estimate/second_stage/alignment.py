"""The rotation between magnetometer and accelerometer, from the constancy of dip.

Whatever the device's attitude, the field stands at one angle to the vertical. With each sensor
calibrated in its own frame, the rotation R from the magnetometer's to the accelerometer's makes

    u·R m = −sin(dip)

the same in every still position (u: up, m: unit field). A small rotation ω of R moves the left side
by ``ω·(R m × u)``.

The descent starts from the 24 rotations that bring axes onto axes. The best of them is within 63°
of any rotation, but not always in the valley of the right one: the squares of the dip's error have
several minima, the more the flatter the field.
"""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.poses import axes_in_words
from imucal_wizard.core.quaternions import (
    cross,
    quarter_turns,
    rotation_matrix,
    rotation_vector,
)
from imucal_wizard.core.readings import BoolArray, FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import robust_deviation
from imucal_wizard.estimate.distributions import exceeded

LARGEST_ANGLE_ERROR = np.radians(5.0)
"""Standard error of an angle beyond which the positions do not determine the rotation."""
DIP_UNKNOWNS = 4
"""Three angles and the dip."""
MIN_ALIGNED_POSITIONS = 6
"""Still positions: two more, to contradict them."""
SMALLEST_AMBIGUITY = np.radians(15.0)
"""Rotations that differ by less are one, whose error says how well it is known."""
SMALLEST_PROBABILITY = 0.01
"""How rarely chance makes the errors of the wrong one of two rotations so much larger."""
FAR_OFF = 6.0
"""Robust standard deviations beyond which a position has no part in the first fit ..."""
OUTLIER = 4.0
"""... and how many beyond which it is left out (iron near that place)."""
EXACT_SINE = 1e-9
"""Error of a sine below which positions are exact."""
ALIGNMENT_ITERATIONS = 50
"""Steps of a descent at most."""
LAST_STEP = 1e-10
"""Of a step, rad, after which R no longer changes; from each start ..."""
ROUGH_STEP = 1e-3
"""... to this, which distinguishes the minima."""
LARGEST_DAMPING = 1e6
ALIGNMENT_FINALISTS = 4
"""Ends that go on by absolute errors: several starts lead to each."""
End = tuple[FloatArray, float]
"""R, shape (3, 3), and the level ``−sin(dip)``."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """How the magnetometer lies in the accelerometer's frame.

    Attributes:
        rotation: R, from the magnetometer's frame to the accelerometer's, shape (3, 3).
        covariance: of a small rotation from the left, by all there is, rad², shape (3, 3).
        own: the same by the errors of the dip alone.
        shifts: small rotation from the left by which each error mode of the field, then of up,
            moves R, rad, shape (3, k + l).
        dip: angle of the field below the horizon, rad, positive on the northern half.
        dip_error: its standard error, rad.
        residuals: error of the dip in each still position, rad, shape (n,).
        used: which positions were used, shape (n,).
        degrees_of_freedom: behind the covariance.
    """

    rotation: FloatArray
    covariance: FloatArray
    own: FloatArray
    shifts: FloatArray
    dip: float
    dip_error: float
    residuals: FloatArray
    used: BoolArray
    degrees_of_freedom: int

    @property
    def axes(self) -> str:
        """How the magnetometer's axes are mounted, in words; "" if they are the accelerometer's."""
        return axes_in_words(self.rotation, "the accelerometer's")

    @property
    def mirrored(self) -> str:
        """The same for the opposite field, which no motion tells from this one."""
        return axes_in_words(-self.rotation, "the accelerometer's")

    @property
    def rms(self) -> float:
        """Of the dip's error over the positions used, rad."""
        return float(np.sqrt(np.mean(self.residuals[self.used] ** 2)))

    @property
    def scatter(self) -> float:
        """Standard deviation of the dip in a position, rad."""
        square = float((self.residuals[self.used] ** 2).sum())
        return float(np.sqrt(square / self.degrees_of_freedom))


def align(
    up: FloatArray,
    field: FloatArray,
    field_modes: FloatArray | None = None,
    up_modes: FloatArray | None = None,
) -> Alignment:
    """R and dip from still positions.

    Args:
        up: unit up in the accelerometer's frame, shape (n, 3).
        field: unit field in the magnetometer's own frame, shape (n, 3).
        field_modes: change of ``field`` with each of the k error modes of the magnetometer's
            calibration, shape (n, 3, k).
        up_modes: the same of ``up`` and the l modes of the accelerometer's, shape (n, 3, l).

    Raises:
        DataError: too few positions, or positions that do not determine the rotation, or leave two.
    """
    if len(up) < MIN_ALIGNED_POSITIONS:
        raise DataError(
            f"the magnetometer stood still in {len(up)} of the still positions, too few to align "
            f"it: hold the device still in at least {MIN_ALIGNED_POSITIONS} orientations. If you "
            "did, the clocks of the two sensors are seconds apart: correct the times"
        )
    found = ends(up, field)
    rotation, level = found[0]
    spread = np.linalg.norm(_moved(up, field, rotation, field_modes, up_modes), axis=1)
    used = near(up, field, found[0], spread)
    for _ in range(3):
        rotation, level = descent(up[used], field[used], rotation, level)
        kept = fitting(up, field, (rotation, level), used, spread)
        if (kept == used).all() or kept.sum() < MIN_ALIGNED_POSITIONS:
            break
        used = kept
    rotation, level = descent(up[used], field[used], rotation, level)
    moved = _moved(up, field, rotation, field_modes, up_modes)
    alignment = _alignment(up, field, rotation, level, used, moved)
    refuse_two(up[used], field[used], (rotation, level), found[1:])
    return alignment


def _moved(
    up: FloatArray,
    field: FloatArray,
    rotation: FloatArray,
    field_modes: FloatArray | None,
    up_modes: FloatArray | None,
) -> FloatArray:
    """Change of each position's error with each error mode, shape (n, k + l)."""
    parts = [np.zeros((len(up), 0))]
    if field_modes is not None:
        parts.append(np.einsum("ni,ij,njk->nk", up, rotation, field_modes))
    if up_modes is not None:
        parts.append(np.einsum("ni,nik->nk", field @ rotation.T, up_modes))
    return np.concatenate(parts, axis=1)


def _alignment(
    up: FloatArray,
    field: FloatArray,
    rotation: FloatArray,
    level: float,
    used: BoolArray,
    moved: FloatArray,
) -> Alignment:
    """The result at the minimum; ``moved`` is the error's change with each error mode, (n, k)."""
    turned, error = field @ rotation.T, dip_errors(up, field, rotation, level)
    columns = dip_columns(up[used], turned[used])
    freedom = int(used.sum()) - DIP_UNKNOWNS
    variance = float(error[used] @ error[used]) / max(freedom, 1)
    values, vectors = np.linalg.eigh(columns.T @ columns)
    if values[0] < 1e-9 * values[-1]:
        raise DataError(_BLIND)
    inverse = (vectors / values) @ vectors.T
    shifts = -inverse @ columns.T @ moved[used]
    covariance = variance * inverse + shifts @ shifts.T
    if freedom < 1 or np.sqrt(np.diag(covariance)[:3]).max() > LARGEST_ANGLE_ERROR:
        raise DataError(_BLIND)
    cosine = float(np.sqrt(max(1.0 - level**2, 1e-6)))
    return Alignment(
        rotation,
        covariance[:3, :3],
        variance * inverse[:3, :3],
        shifts[:3],
        -float(np.arcsin(np.clip(level, -1.0, 1.0))),
        float(np.sqrt(covariance[3, 3])) / cosine,
        error / cosine,
        used,
        freedom,
    )


def leaning(up: FloatArray, turned: FloatArray) -> FloatArray:
    """By how much small changes of up in each position turn R, rotation vector, shape (3, n, 3).

    Args:
        up: unit up in the accelerometer's frame, shape (n, 3).
        turned: unit field there, by the alignment to these positions, shape (n, 3).
    """
    return np.asarray(-np.linalg.pinv(dip_columns(up, turned))[:3, :, None] * turned)


def ends(up: FloatArray, field: FloatArray) -> list[End]:
    """R and level where the descents from all starts end, the one of least absolute errors first.

    The best few go on by these, which one position beside iron does not decide.

    Args:
        up: unit up in the accelerometer's frame, shape (n, 3).
        field: unit field in the magnetometer's own frame, shape (n, 3).
    """
    starts = [(turn, float((up * (field @ turn.T)).sum(axis=1).mean())) for turn in quarter_turns()]
    found = [descent(up, field, *start, ROUGH_STEP) for start in starts]
    found.sort(key=lambda end: _absolute(up, field, *end))
    best = [robust_descent(up, field, *end) for end in found[:ALIGNMENT_FINALISTS]]
    best.sort(key=lambda end: _absolute(up, field, *end))
    return [*best, *found[ALIGNMENT_FINALISTS:]]


def dip_errors(up: FloatArray, field: FloatArray, rotation: FloatArray, level: float) -> FloatArray:
    """``u·R m − level`` of each position, shape (n,)."""
    return _errors(up, field @ rotation.T, level)


def _errors(up: FloatArray, turned: FloatArray, level: float) -> FloatArray:
    return np.asarray((up * turned).sum(axis=1) - level)


def dip_columns(up: FloatArray, turned: FloatArray) -> FloatArray:
    """Derivative of ``u·R m − level`` by a small rotation from the left and by the level."""
    columns = np.full((len(up), 4), -1.0)
    columns[:, :3] = cross(turned.T, up.T).T
    return columns


def descent(
    up: FloatArray,
    field: FloatArray,
    rotation: FloatArray,
    level: float,
    tolerance: float = LAST_STEP,
) -> End:
    """Gauss–Newton with damping, to a minimum of the squares of the dip's error.

    Args:
        up: unit up in the accelerometer's frame, shape (n, 3).
        field: unit field in the magnetometer's own frame, shape (n, 3).
        rotation: R to start from.
        level: the level to start from.
        tolerance: of the last step.
    """
    damping = 1e-6
    turned = field @ rotation.T
    error = _errors(up, turned, level)
    for _ in range(ALIGNMENT_ITERATIONS):
        columns = dip_columns(up, turned)
        normal = columns.T @ columns
        step = -np.linalg.solve(normal + damping * np.eye(4), columns.T @ error)
        trial = rotation_matrix(np.asarray(step[:3], float)) @ rotation
        moved = field @ trial.T
        new = _errors(up, moved, level + float(step[3]))
        if new @ new <= error @ error + 1e-18:
            rotation, level, turned, error = trial, level + float(step[3]), moved, new
            damping = max(damping / 10.0, 1e-12)
            if np.abs(step).max() < tolerance:
                break
        else:
            damping *= 10.0
            if (
                damping > LARGEST_DAMPING
            ):  # nothing is lower: the bottom, within the numerical precision
                break
    return rotation, level


def robust_descent(up: FloatArray, field: FloatArray, rotation: FloatArray, level: float) -> End:
    """To a minimum of the absolute errors, by squares weighed with one over the last error.

    Squares let one wrong position bend the rotation until it no longer stands out.
    """
    turned = field @ rotation.T
    error = _errors(up, turned, level)
    for _ in range(ALIGNMENT_ITERATIONS):
        columns, size = dip_columns(up, turned), np.abs(error)
        weight = 1.0 / np.maximum(size, 1e-3 * float(size.max()) + 1e-12)
        normal = (columns.T * weight) @ columns
        ridge = 1e-9 * float(np.trace(normal)) * np.eye(4)
        step = -np.linalg.solve(normal + ridge, columns.T @ (weight * error))
        trial = rotation_matrix(np.asarray(step[:3], float)) @ rotation
        moved = field @ trial.T
        error = _errors(up, moved, level + float(step[3]))
        if not np.abs(error).sum() < size.sum():
            break
        rotation, level, turned = trial, level + float(step[3]), moved
        if np.abs(step).max() < ROUGH_STEP * float(size.mean()):
            break
    return rotation, level


def _absolute(up: FloatArray, field: FloatArray, rotation: FloatArray, level: float) -> float:
    return float(np.abs(dip_errors(up, field, rotation, level)).sum())


def near(up: FloatArray, field: FloatArray, end: End, spread: FloatArray) -> BoolArray:
    """The positions that are not far off where absolute errors are least; all if they are few.

    Args:
        up: unit up in the accelerometer's frame, shape (n, 3).
        field: unit field in the magnetometer's own frame, shape (n, 3).
        end: R and level there.
        spread: standard deviation of each error by the errors of the calibrations, (n,).
    """
    error = np.abs(dip_errors(up, field, *end))
    # as many of them as there are unknowns were made zero
    sigma = robust_deviation(np.sort(error)[DIP_UNKNOWNS:])
    close = error <= np.maximum(FAR_OFF * np.hypot(sigma, spread), EXACT_SINE)
    return np.asarray(close) if close.sum() >= MIN_ALIGNED_POSITIONS else np.ones(len(up), bool)


def fitting(
    up: FloatArray, field: FloatArray, end: End, used: BoolArray, spread: FloatArray
) -> BoolArray:
    """The positions within ``OUTLIER`` standard deviations, each where its share in the fit counts.

    With leverage h the error of one that was used is ``σ √(1 − h)``, of another ``σ √(1 + h)``.

    Args:
        up: unit up in the accelerometer's frame, shape (n, 3).
        field: unit field in the magnetometer's own frame, shape (n, 3).
        end: R and level of the positions used.
        used: which these are, shape (n,).
        spread: standard deviation of each error by the errors of the calibrations, (n,).
    """
    error, columns = dip_errors(up, field, *end), dip_columns(up, field @ end[0].T)
    sigma = np.sqrt((error[used] ** 2).sum() / (used.sum() - DIP_UNKNOWNS))
    inverse = np.linalg.pinv(columns[used].T @ columns[used])
    leverage = np.einsum("ni,ij,nj->n", columns, inverse, columns)
    share = np.maximum(1.0 + np.where(used, -leverage, leverage), 0.0)
    limit = OUTLIER * np.hypot(sigma * np.sqrt(share), spread)
    return np.asarray(np.abs(error) <= np.maximum(limit, EXACT_SINE))


def refuse_two(up: FloatArray, field: FloatArray, best: End, others: Sequence[End]) -> None:
    """Refuse positions that fit with another rotation hardly worse.

    Raises:
        DataError: they do.
    """
    freedom = len(up) - DIP_UNKNOWNS
    least = float((dip_errors(up, field, *best) ** 2).sum())
    for rotation, level in others:
        angle = float(np.linalg.norm(rotation_vector(rotation @ best[0].T)))
        ratio = float((dip_errors(up, field, rotation, level) ** 2).sum()) / max(least, 1e-300)
        if angle > SMALLEST_AMBIGUITY and exceeded(ratio, freedom, freedom) > SMALLEST_PROBABILITY:
            raise DataError(
                "the still positions leave two rotations between magnetometer and accelerometer "
                f"possible, {np.degrees(angle):.0f}° apart: hold the device still in more "
                "orientations, its edges and corners up too"
            )


_BLIND = (
    "the still positions do not determine the rotation between magnetometer and accelerometer: "
    "hold the device still with each of its faces up, and rotate it about the vertical in between"
)
