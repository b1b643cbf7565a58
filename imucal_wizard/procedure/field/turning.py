"""How far the device has been turned about the vertical, by whatever tells it."""

import numpy as np

from imucal_wizard.readings import FloatArray

SECTOR = 5.0
"""Degrees; a circle is complete when hardly a sector of it is missing."""
SECTORS = round(360.0 / SECTOR)
LEAST_RADIUS = 6.0
"""Radius of a circle over the noise of a reading, from which its angle can be told."""


def covered(before: FloatArray, after: FloatArray) -> float:
    """How much of a circle arcs cover together, degrees from 0 to 360.

    Going to and fro covers an arc once, and what is left out of a circle is missing.

    Args:
        before: angle at which each arc begins, degrees, unwrapped, shape (n,).
        after: angle at which it ends.
    """
    if not len(before):
        return 0.0
    first = np.floor(np.minimum(before, after) / SECTOR).astype(int)
    last = np.floor(np.maximum(before, after) / SECTOR).astype(int)
    length = np.minimum(last - first + 1, SECTORS)
    within = np.arange(length.sum()) - np.repeat(np.cumsum(length) - length, length)
    touched = len(np.unique((np.repeat(first, length) + within) % SECTORS))
    # the first sector is touched by a device that does not turn
    return 360.0 if touched == SECTORS else (touched - 1) * SECTOR


def headings(vectors: FloatArray, up: FloatArray, noise: float) -> FloatArray | None:
    """Angle about the vertical from readings of the field alone, for a stream without a gyroscope.

    Args:
        vectors: readings in the order of time, corrected or not, shape (n, 3).
        up: mean up direction in the body frame, shape (3,).
        noise: of one reading, same unit.

    Returns:
        Degrees, unwrapped, shape (n,); None where the readings make no arc.
    """
    if len(vectors) < 4:
        return None
    first = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    first /= np.linalg.norm(first)
    flat = vectors @ np.column_stack([first, np.cross(up, first)])
    circle = _circle(flat)
    if circle is None or circle[2] < LEAST_RADIUS * noise:
        return None
    angles = np.arctan2(flat[:, 1] - circle[1], flat[:, 0] - circle[0])
    return np.asarray(np.degrees(np.unwrap(angles)))


def _circle(flat: FloatArray) -> tuple[float, float, float] | None:
    """Centre and radius of the circle through points, shape (n, 2), by Pratt's algebraic fit.

    Unlike Kåsa's it does not prefer small circles where only an arc is seen.
    V. Pratt, Computer Graphics 21 (1987) 145.
    """
    middle = flat.mean(axis=0)
    x, y = (flat - middle).T
    square = x * x + y * y
    size = float(np.sqrt(square.mean()))
    if not size > 0.0:
        return None
    design = np.column_stack([square / size**2, x / size, y / size, np.ones(len(x))])
    # B² + C² − 4AD = 1 is what Pratt keeps fixed
    inverse = np.array([[0.0, 0, 0, -0.5], [0, 1, 0, 0], [0, 0, 1, 0], [-0.5, 0, 0, 0]])
    values, vectors = np.linalg.eig(inverse @ (design.T @ design))
    real = np.where(np.abs(values.imag) < 1e-9, values.real, np.inf)
    real[real < -1e-9 * len(x)] = np.inf
    best = np.real(vectors[:, int(np.argmin(real))])
    if abs(best[0]) < 1e-9:
        return None
    centre = -best[1:3] / (2.0 * best[0]) * size
    radius = float(np.sqrt(max(centre @ centre - best[3] / best[0] * size**2, 0.0)))
    return float(centre[0] + middle[0]), float(centre[1] + middle[1]), radius
