"""A start for the gyroscope's matrix that assumes nothing: neither unit, sign nor axis order.

While the device turns, ``u(t₁) − u(t₀) = ∫ u × M (y − b) dt``. With u inside the rotation taken
from the accelerometer this is linear in the nine entries of M. Hand accelerations make it a few per
cent wrong, which is near enough for the exact fit to begin from.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.attitude import attitudes, rotation_vectors
from imucal_wizard.solver.closure import Turns
from imucal_wizard.solver.gains import nominal_of
from imucal_wizard.solver.quaternions import matrices, quaternions

PIECE_SECONDS = 0.5
"""Long enough to turn further than a hand's jerk tilts gravity, short enough not to come round."""


@dataclass(frozen=True, eq=False)
class Path:
    """One rotation with what the accelerometer felt during it.

    Attributes:
        time: sample times, s, ever later, shape (n,).
        reading: the gyroscope, shape (n, 3).
        up: direction of the calibrated specific force, unit vectors, shape (n, 3).
    """

    time: FloatArray
    reading: FloatArray
    up: FloatArray


def start_matrix(turns: Turns, paths: Sequence[Path], bias: FloatArray, known: bool) -> FloatArray:
    """The best of the identity (where the unit is known) and what the accelerometer suggests.

    They are compared all along the rotations: at their ends a whole turn more or less, which a
    wrong unit or rate makes, does not show.

    Args:
        turns: the rotations.
        paths: the same with the accelerometer in them, or none when it was not kept.
        bias: the gyroscope's reading at rest, shape (3,).
        known: the readings are in rad/s.

    Raises:
        DataError: neither can be had.
    """
    if not paths:
        if known:
            return np.eye(3)
        raise DataError(
            "its unit is raw counts and the accelerometer during the turns was not kept"
        )
    aided = aided_start(turns, paths, bias)
    if not aided.any():
        raise DataError("its readings do not change while the device turns: it is dead")
    tried = [aided, *_straightened(aided), *([np.eye(3)] if known else [])]
    return min(tried, key=lambda matrix: misfit(turns, paths, matrix, bias))


def _straightened(aided: FloatArray) -> list[FloatArray]:
    """The same without cross-axis gains, a scale per axis or one for all; none if axes are unclear.

    Real cross-axis gains are a few per cent; what a jerky hand puts there is often more.
    """
    nominal = nominal_of(aided, known=True)
    if not nominal.clear:
        return []
    scales = aided.flat[list(nominal.scales)]
    found = []
    for size in (scales, np.abs(scales).mean() * np.sign(scales)):
        straight = np.zeros((3, 3))
        straight.flat[list(nominal.scales)] = size
        found.append(straight)
    return found


def aided_start(turns: Turns, paths: Sequence[Path], bias: FloatArray) -> FloatArray:
    """M from the accelerometer's direction during the rotations, rad/s per reading, shape (3, 3).

    Of least norm where the rotations do not carry all of it.
    """
    normal, slope = np.zeros((9, 9)), np.zeros(9)
    for path, before, after in zip(paths, turns.before, turns.after, strict=True):
        rows, changes = _pieces(path, np.vstack([before, path.up[1:-1], after]), bias)
        normal += np.einsum("kcp,kcq->pq", rows, rows)
        slope += np.einsum("kcp,kc->p", rows, changes)
    # signal of the strongest direction against the few per cent that hand motion spoils
    return np.asarray(np.linalg.pinv(normal, rcond=1e-6, hermitian=True) @ slope).reshape(3, 3)


def _pieces(path: Path, up: FloatArray, bias: FloatArray) -> tuple[FloatArray, FloatArray]:
    """``∫ u × (E_ij y) dt`` for each gain and the change of up, piece by piece.

    From end to end alone a full turn would look like none.

    Returns:
        Shapes (k, 3, 9) and (k, 3).
    """
    middle = 0.5 * (up[:-1] + up[1:]) * np.diff(path.time)[:, None]
    rate = 0.5 * (path.reading[:-1] + path.reading[1:]) - bias
    count = max(int(np.ceil((path.time[-1] - path.time[0]) / PIECE_SECONDS)), 1)
    borders = np.unique(np.linspace(0, len(rate), count + 1).astype(int))
    sums = np.add.reduceat(middle[:, :, None] * rate[:, None, :], borders[:-1], axis=0)
    design = np.zeros((len(sums), 3, 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        design[:, i, k], design[:, i, j] = sums[:, j], -sums[:, k]
    return design.reshape(-1, 3, 9), np.diff(up[borders], axis=0)


def misfit(turns: Turns, paths: Sequence[Path], matrix: FloatArray, bias: FloatArray) -> float:
    """Mean square distance of carried up from the accelerometer's, all along the rotations."""
    steps = turns.steps
    _, ends = attitudes(quaternions(rotation_vectors(steps, matrix, bias)), steps.offsets)
    squares, count = 0.0, 0
    for index, path in enumerate(paths):
        first = int(steps.offsets[index])
        turned = matrices(ends[:, first : first + len(path.time) - 1])
        carried = np.einsum("jin,j->ni", turned, turns.before[index])
        squares += float(((carried - path.up[1:]) ** 2).sum())
        count += len(carried)
    return squares / max(count, 1)
