"""Start values: a sphere through the data, and Q's up/down formulae."""

from collections.abc import Mapping

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.magnitude import Problem, residuals
from imucal_wizard.units import COUNT


def sphere(problem: Problem) -> FloatArray:
    """Parameters of the sphere nearest to the points, by linear least squares, shape (9,).

    ``|z|² = 2 z·b + (r² − |b|²)`` is linear in b and the last bracket.

    Raises:
        DataError: the points lie in a plane or do not bend like a sphere.
    """
    points = problem.points
    columns = np.column_stack([2.0 * points, np.ones(len(points))])
    solution, _, rank, _ = np.linalg.lstsq(columns, (points**2).sum(axis=1), rcond=1e-6)
    centre = solution[:3]
    square = float(solution[3] + centre @ centre)
    if rank < 4 or square <= 0.0:
        raise DataError(
            "the still positions do not surround the sensor: their readings lie in one plane. "
            "Hold the device still with each of its six faces up"
        )
    theta = np.zeros(9)
    theta[:3] = centre
    theta[[3, 6, 8]] = 1.0 / np.sqrt(square)
    return theta


def errors_before(problem: Problem, unit: str) -> FloatArray:
    """Errors with the nominal conversion only; for counts, of the best sphere."""
    if unit == COUNT:
        return residuals(sphere(problem), problem.points) * problem.magnitude
    readings = problem.centre + problem.span * problem.points
    return np.asarray(np.linalg.norm(readings, axis=1)) - problem.magnitude


def six_position(faces: Mapping[str, FloatArray], gravity: float) -> tuple[FloatArray, FloatArray]:
    """Bias and sensitivity of each axis from its up and its down position (Q, eq. 13–14).

    ``sensitivity = (a_up − a_down) / (2 g)`` is reading per input; the correction is 1 over it.

    Args:
        faces: mean reading, shape (3,), by face on top: ``+x``, ``-x`` … ``-z``.
        gravity: m/s².

    Returns:
        Bias (reading units, shape (3,)) and sensitivity (reading per m/s², shape (3,)).

    Raises:
        DataError: a face is missing or an axis does not see gravity.
    """
    missing = [face for axis in "xyz" for face in (f"+{axis}", f"-{axis}") if face not in faces]
    if missing:
        raise DataError(
            f"six positions are needed; missing with this face up: {', '.join(missing)}"
        )
    up = np.array([faces[f"+{axis}"][i] for i, axis in enumerate("xyz")])
    down = np.array([faces[f"-{axis}"][i] for i, axis in enumerate("xyz")])
    sensitivity = (up - down) / (2.0 * gravity)
    if (sensitivity == 0.0).any():
        dead = ", ".join(axis for axis, k in zip("xyz", sensitivity, strict=True) if k == 0.0)
        raise DataError(f"axis {dead} reads the same up and down: it is dead or not connected")
    return (up + down) / 2.0, sensitivity
