"""The rotation between magnetometer and accelerometer, from the constancy of dip.

Whatever the device's attitude, the field stands at one angle to the vertical. With each sensor
calibrated in its own frame, the rotation R from the magnetometer's to the accelerometer's makes

    u·R m = −sin(dip)

the same in every still position (u: up, m: unit field). A small rotation ω of R moves the left side
by ``ω·(R m × u)``.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.readings import BoolArray, FloatArray
from imucal_wizard.solver.second_stage.descent import columns_of, descent, ends, errors
from imucal_wizard.solver.second_stage.positions import (
    FEWEST,
    UNKNOWNS,
    fitting,
    near,
    refuse_two,
)

LOOSEST = np.radians(5.0)
"""Standard error of an angle beyond which the positions do not carry the rotation."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """How the magnetometer lies in the accelerometer's frame.

    Attributes:
        rotation: R, from the magnetometer's frame to the accelerometer's, shape (3, 3).
        covariance: of a small rotation from the left, by all there is, rad², shape (3, 3).
        own: the same by the errors of the dip alone.
        shifts: small rotation from the left by which each doubt about the field, then about up,
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
    field_doubt: FloatArray | None = None,
    up_doubt: FloatArray | None = None,
) -> Alignment:
    """R and dip from still positions.

    Args:
        up: unit up in the accelerometer's frame, shape (n, 3).
        field: unit field in the magnetometer's own frame, shape (n, 3).
        field_doubt: change of ``field`` for one standard deviation along each of the k ways in
            which the magnetometer's calibration may be wrong, shape (n, 3, k).
        up_doubt: the same of ``up`` and the l ways of the accelerometer's, shape (n, 3, l).

    Raises:
        DataError: too few positions, or positions that do not carry the rotation, or leave two.
    """
    if len(up) < FEWEST:
        raise DataError(
            f"the magnetometer stood still in {len(up)} of the still positions, too few to align "
            f"it: hold the device still in at least {FEWEST} orientations while it records. If it "
            "was, the clocks of the two sensors are seconds apart"
        )
    found = ends(up, field)
    rotation, level = found[0]
    doubt = np.linalg.norm(_moved(up, field, rotation, field_doubt, up_doubt), axis=1)
    used = near(up, field, found[0], doubt)
    for _ in range(3):
        rotation, level = descent(up[used], field[used], rotation, level)
        kept = fitting(up, field, (rotation, level), used, doubt)
        if (kept == used).all() or kept.sum() < FEWEST:
            break
        used = kept
    rotation, level = descent(up[used], field[used], rotation, level)
    moved = _moved(up, field, rotation, field_doubt, up_doubt)
    alignment = _alignment(up, field, rotation, level, used, moved)
    refuse_two(up[used], field[used], (rotation, level), found[1:])
    return alignment


def _moved(
    up: FloatArray,
    field: FloatArray,
    rotation: FloatArray,
    field_doubt: FloatArray | None,
    up_doubt: FloatArray | None,
) -> FloatArray:
    """Change of each position's error with each doubt, shape (n, k + l)."""
    parts = [np.zeros((len(up), 0))]
    if field_doubt is not None:
        parts.append(np.einsum("ni,ij,njk->nk", up, rotation, field_doubt))
    if up_doubt is not None:
        parts.append(np.einsum("ni,nik->nk", field @ rotation.T, up_doubt))
    return np.concatenate(parts, axis=1)


def _alignment(
    up: FloatArray,
    field: FloatArray,
    rotation: FloatArray,
    level: float,
    used: BoolArray,
    moved: FloatArray,
) -> Alignment:
    """What follows at the minimum; ``moved`` is the change of the error with each doubt, (n, k)."""
    turned, error = field @ rotation.T, errors(up, field, rotation, level)
    columns = columns_of(up[used], turned[used])
    freedom = int(used.sum()) - UNKNOWNS
    variance = float(error[used] @ error[used]) / max(freedom, 1)
    values, vectors = np.linalg.eigh(columns.T @ columns)
    if values[0] < 1e-9 * values[-1]:
        raise DataError(_BLIND)
    inverse = (vectors / values) @ vectors.T
    shifts = -inverse @ columns.T @ moved[used]
    covariance = variance * inverse + shifts @ shifts.T
    if freedom < 1 or np.sqrt(np.diag(covariance)[:3]).max() > LOOSEST:
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


_BLIND = (
    "the still positions do not carry the rotation between magnetometer and accelerometer: hold "
    "the device still with each of its faces up, and turned about the vertical in between"
)
