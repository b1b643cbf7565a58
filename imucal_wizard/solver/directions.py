"""Which holds are repeats of one direction."""

import numpy as np

from imucal_wizard.readings import BoolArray, FloatArray, IntArray

SAME_DIRECTION = np.radians(12.0)
"""Holds closer than this are repeats: left out together, compared with one another."""


def unit_vectors(vectors: FloatArray) -> FloatArray:
    """The vectors, shape (…, 3), at length 1."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1)[..., None])


def group_directions(up: FloatArray, limit: float = SAME_DIRECTION) -> IntArray:
    """Number of the direction of each hold; a new direction begins beyond ``limit`` of all leaders.

    Args:
        up: unit up vectors, shape (n, 3).
        limit: rad.

    Returns:
        Labels 0, 1, 2 … in order of appearance, shape (n,).
    """
    labels = np.empty(len(up), np.int64)
    leaders: list[FloatArray] = []
    for index, vector in enumerate(up):
        cosines = [float(leader @ vector) for leader in leaders]
        best = int(np.argmax(cosines)) if cosines else -1
        if best >= 0 and cosines[best] > np.cos(limit):
            labels[index] = best
        else:
            labels[index] = len(leaders)
            leaders.append(vector)
    return labels


def near_any(up: FloatArray, others: FloatArray, limit: float = SAME_DIRECTION) -> BoolArray:
    """Which unit vectors (n, 3) are within ``limit``, rad, of any of the others (k, 3)."""
    return np.asarray(((up @ others.T) > np.cos(limit)).any(axis=1))
