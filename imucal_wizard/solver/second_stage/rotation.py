"""Rotations as matrices: from a vector, to a vector, and those that bring axes onto axes."""

import itertools

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.quaternions import matrices, quaternions


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
