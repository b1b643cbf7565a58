"""A start for the gyroscope's matrix that assumes nothing: neither unit, sign nor axis order.

While the device turns, ``u(t₁) − u(t₀) = ∫ u × M (y − b) dt``. With u inside the rotation taken
from the accelerometer this is linear in the nine entries of M. Hand accelerations make it a few per
cent wrong, which is near enough for the exact fit to begin from.
"""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.attitude import skews
from imucal_wizard.solver.closure import Turns


def aided_start(turns: Turns, inside: Sequence[FloatArray], bias: FloatArray) -> FloatArray | None:
    """M from the accelerometer's direction during the rotations, shape (3, 3).

    Args:
        turns: the rotations.
        inside: for each rotation the calibrated specific force at its samples, shape (n, 3).
        bias: the gyroscope's reading at rest, shape (3,).

    Returns:
        M, rad/s per reading, of least norm where the rotations do not carry all of it; None when
        there is no rotation.
    """
    rows, changes = [], []
    steps = turns.steps
    for index, force in enumerate(inside):
        part = slice(int(steps.offsets[index]), int(steps.offsets[index + 1]))
        length = np.linalg.norm(force, axis=1)
        up = force / np.maximum(length, 1e-9 * max(float(length.max()), 1e-300))[:, None]
        middle = 0.5 * (up[:-1] + up[1:])
        rate = 0.5 * (steps.first[part] + steps.last[part]) - bias
        weights = skews(middle) * steps.dt[part, None, None]
        rows.append(np.einsum("nia,nc->iac", weights, rate).reshape(3, 9))
        changes.append(turns.after[index] - turns.before[index])
    if not rows:
        return None
    design, change = np.concatenate(rows), np.concatenate(changes)
    # signal of the strongest direction against the few per cent that hand motion spoils
    solution = np.linalg.lstsq(design, change, rcond=1e-3)[0]
    return np.asarray(solution.reshape(3, 3))
