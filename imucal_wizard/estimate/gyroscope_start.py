"""A start for the gyroscope's matrix that assumes nothing: neither unit, sign nor axis order.

While the device turns, ``u(t₁) − u(t₀) = ∫ u × M (y − b) dt``. With u inside the rotation taken
from the accelerometer this is linear in the nine entries of M. Hand accelerations make it a few per
cent wrong, which is near enough for the exact fit to begin from.
"""

import itertools

import numpy as np

from imucal_wizard.core.attitude import Attitudes, RotationSamples
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.quaternions import carried_back, quaternions
from imucal_wizard.core.readings import FloatArray, IntArray, distinct
from imucal_wizard.model.nominal_gains import nominal_of

UNSEEN = 0.02
"""Length of a column of M, over the longest, up to which no rotation was about that axis."""
PIECE_SECONDS = 0.5
"""Long enough to turn further than a hand's jerk tilts gravity, short enough not to come round."""


def start_matrix(
    samples: RotationSamples,
    before: FloatArray,
    after: FloatArray,
    up: FloatArray | None,
    bias: FloatArray,
    known: bool,
) -> FloatArray:
    """The best of the identity (where the unit is known) and what the accelerometer suggests.

    They are compared all along the rotations: at their ends a whole turn more or less, which a
    wrong unit or rate makes, does not show.

    Args:
        samples: of the gyroscope in m rotations.
        before: up at the hold before each, shape (m, 3).
        after: up at the hold after, shape (m, 3).
        up: direction of the calibrated specific force at each sample, shape (n, 3); None where the
            accelerometer in the rotations was not kept.
        bias: the gyroscope's reading at rest, shape (3,).
        known: the readings are in rad/s.

    Raises:
        DataError: neither can be had.
    """
    if up is None:
        if known:
            return np.eye(3)
        raise DataError(
            "its unit is raw counts and the accelerometer during the rotations was not kept"
        )
    aided = aided_start(samples, before, after, up, bias)
    if not aided.any():
        raise DataError("its readings do not change while the device turns: it is dead")
    aided = _completed(aided, known)
    tried = [aided, *_straightened(aided), *([np.eye(3)] if known else [])]
    return min(tried, key=lambda matrix: misfit(samples, before, up, matrix, bias))


def _completed(aided: FloatArray, known: bool) -> FloatArray:
    """The same with a scale for the sensor axes that no rotation was about, whose columns are zero.

    Such an axis feels one of the body axes that no other feels: by its usual scale where the unit
    is known, else by the mean of the others.
    """
    length = np.linalg.norm(aided, axis=0)
    unseen = np.flatnonzero(length < UNSEEN * length.max())
    seen = [channel for channel in range(3) if channel not in unseen]
    felt = {int(np.abs(aided[:, channel]).argmax()) for channel in seen}
    left = [axis for axis in range(3) if axis not in felt]
    # each takes the body axis of its own name where that is free
    order = sorted(left, key=lambda axis: axis not in unseen)
    whole = aided.copy()
    for channel in unseen.tolist():
        axis = channel if channel in order else order[0]
        order.remove(axis)
        whole[:, channel] = 0.0
        whole[axis, channel] = 1.0 if known else length[seen].mean()
    return whole


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


def aided_start(
    samples: RotationSamples,
    before: FloatArray,
    after: FloatArray,
    up: FloatArray,
    bias: FloatArray,
) -> FloatArray:
    """M from the accelerometer's direction during the rotations, rad/s per reading, shape (3, 3).

    Of least norm where the rotations do not determine all of it. The arguments are those of
    ``start_matrix``.
    """
    normal, slope = np.zeros((9, 9)), np.zeros(9)
    for index, (first, past) in enumerate(itertools.pairwise(samples.offsets.tolist())):
        within = np.vstack([before[index], up[first + 1 : past - 1], after[index]])
        time, reading = samples.time[first:past], samples.reading[first:past]
        rows, changes = _pieces(time, reading, within, bias)
        rows = rows.reshape(-1, 9)
        normal += rows.T @ rows
        slope += rows.T @ changes.ravel()
    # signal of the strongest direction against the few per cent that hand motion spoils
    return np.asarray(np.linalg.pinv(normal, rcond=1e-6, hermitian=True) @ slope).reshape(3, 3)


def _pieces(
    time: FloatArray, reading: FloatArray, up: FloatArray, bias: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """``∫ u × (E_ij y) dt`` for each gain and the change of up, piece by piece.

    From end to end alone a full turn would look like none.

    Returns:
        Shapes (k, 3, 9) and (k, 3).
    """
    middle = 0.5 * (up[:-1] + up[1:]) * np.diff(time)[:, None]
    rate = 0.5 * (reading[:-1] + reading[1:]) - bias
    count = max(int(np.ceil((time[-1] - time[0]) / PIECE_SECONDS)), 1)
    borders: IntArray = distinct(np.linspace(0, len(rate), count + 1).astype(int))
    sums = np.add.reduceat(middle[:, :, None] * rate[:, None, :], borders[:-1], axis=0)
    design = np.zeros((len(sums), 3, 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        design[:, i, k], design[:, i, j] = sums[:, j], -sums[:, k]
    return design.reshape(-1, 3, 9), np.diff(up[borders], axis=0)


def misfit(
    samples: RotationSamples,
    before: FloatArray,
    up: FloatArray,
    matrix: FloatArray,
    bias: FloatArray,
) -> float:
    """Mean square distance of carried up from the accelerometer's, all along the rotations."""
    turned = samples.rotation_vectors((samples.reading - bias) @ matrix.T)
    attitudes = Attitudes(quaternions(turned), samples.step_offsets)
    carried = carried_back(samples.at_samples(*attitudes.each), before[samples.rotation].T)
    return float(((carried - up.T) ** 2).sum(axis=0).mean())
