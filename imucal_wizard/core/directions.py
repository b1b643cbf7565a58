"""Directions: groups of equal ones, and their means."""

import numpy as np

from imucal_wizard.core.readings import FloatArray, IntArray

SAME_DIRECTION = np.radians(12.0)
"""Holds that all lie closer together than this are repeats of one direction: they are left out
together and compared with one another. A hand repeats a pose to about 5°."""


def unit_vectors(vectors: FloatArray) -> FloatArray:
    """The vectors scaled to length 1, shape (…, 3)."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1)[..., None])


def group_directions(up: FloatArray, limit: float = SAME_DIRECTION) -> IntArray:
    """Cluster directions by complete linkage; no two in a cluster are farther apart than ``limit``.

    Args:
        up: unit vectors, shape (n, 3).
        limit: rad.

    Returns:
        Labels 0, 1, 2 … in order of appearance, shape (n,).
    """
    apart = np.arccos(np.clip(up @ up.T, -1.0, 1.0))
    np.fill_diagonal(apart, np.inf)
    labels = np.arange(len(up))
    while len(up) > 1:
        first, second = np.unravel_index(np.argmin(apart), apart.shape)
        if not apart[first, second] <= limit:
            break
        labels[labels == labels[second]] = labels[first]
        apart[first] = np.maximum(apart[first], apart[second])
        apart[:, first] = apart[first]
        apart[second], apart[:, second] = np.inf, np.inf
        apart[first, first] = np.inf
    found = labels.tolist()
    order = {label: place for place, label in enumerate(dict.fromkeys(found))}
    return np.array([order[label] for label in found], np.int64)


def mean_directions(up: FloatArray, labels: IntArray) -> FloatArray:
    """Mean direction of each group, unit vectors, shape (d, 3)."""
    sums = np.zeros((int(labels.max(initial=-1)) + 1, 3))
    np.add.at(sums, labels, up)
    return unit_vectors(sums)


def even_directions(count: int) -> FloatArray:
    """Directions spread evenly over the sphere, as are any that follow one another, (count, 3).

    Along z and about it they are the additive sequence of the plastic number, ``ρ³ = ρ + 1``.
    """
    index, step = np.arange(count) + 0.5, 1.3247179572447460
    z, turn = 1.0 - 2.0 * (index / step % 1.0), 2.0 * np.pi * index / step**2
    ring = np.sqrt(1.0 - z * z)
    return np.column_stack([ring * np.cos(turn), ring * np.sin(turn), z])


def farthest_from(up: FloatArray) -> tuple[FloatArray, float]:
    """The direction in the middle of the largest gap between directions.

    Args:
        up: unit vectors, shape (n, 3).

    Returns:
        The direction, a unit vector, to about 5°; its angle to the nearest of ``up``, rad.
    """
    everywhere = even_directions(1000)
    nearest = (everywhere @ up.T).max(axis=1)
    place = int(nearest.argmin())
    return everywhere[place], float(np.arccos(np.clip(nearest[place], -1.0, 1.0)))
