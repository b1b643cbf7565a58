"""From anywhere to the rotation that makes the dip the same: a descent from many starts.

The starts are the 24 ways in which axes may lie along axes. The best of them is within 63° of any
rotation, but not always in the valley of the right one: the squares of the dip's error have several
minima, the more the flatter the field.
"""

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.second_stage.rotation import exponential, quarter_turns

MAX_ITERATIONS = 50
TOLERANCE = 1e-10
"""Of a step, rad, after which R no longer changes; from each start ..."""
ROUGH = 1e-3
"""... to this, which tells one minimum from another."""
LARGEST_DAMPING = 1e6
FINALISTS = 4
"""Ends that go on by absolute errors: several starts lead to each."""

End = tuple[FloatArray, float]
"""R, shape (3, 3), and the level ``−sin(dip)``."""


def ends(up: FloatArray, field: FloatArray) -> list[End]:
    """R and level where the descents from all starts end, the one of least absolute errors first.

    The best few go on by these, which one position beside iron does not decide.

    Args:
        up: unit up in the accelerometer's frame, shape (n, 3).
        field: unit field in the magnetometer's own frame, shape (n, 3).
    """
    starts = [(turn, float((up * (field @ turn.T)).sum(axis=1).mean())) for turn in quarter_turns()]
    found = [descent(up, field, *start, ROUGH) for start in starts]
    found.sort(key=lambda end: _absolute(up, field, *end))
    best = [robust_descent(up, field, *end) for end in found[:FINALISTS]]
    best.sort(key=lambda end: _absolute(up, field, *end))
    return [*best, *found[FINALISTS:]]


def errors(up: FloatArray, field: FloatArray, rotation: FloatArray, level: float) -> FloatArray:
    """``u·R m − level`` of each position, shape (n,)."""
    return np.asarray((up * (field @ rotation.T)).sum(axis=1) - level)


def columns_of(up: FloatArray, turned: FloatArray) -> FloatArray:
    """Derivative of ``u·R m − level`` by a small rotation from the left and by the level."""
    return np.column_stack([np.cross(turned, up), -np.ones(len(up))])


def descent(
    up: FloatArray,
    field: FloatArray,
    rotation: FloatArray,
    level: float,
    tolerance: float = TOLERANCE,
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
    turned, error = field @ rotation.T, errors(up, field, rotation, level)
    for _ in range(MAX_ITERATIONS):
        columns = columns_of(up, turned)
        normal = columns.T @ columns
        step = -np.linalg.solve(normal + damping * np.eye(4), columns.T @ error)
        trial = exponential(np.asarray(step[:3], float)) @ rotation
        new = errors(up, field, trial, level + float(step[3]))
        if new @ new <= error @ error + 1e-18:
            rotation, level, error = trial, level + float(step[3]), new
            turned = field @ rotation.T
            damping = max(damping / 10.0, 1e-12)
            if np.abs(step).max() < tolerance:
                break
        else:
            damping *= 10.0
            if damping > LARGEST_DAMPING:  # nothing is lower: the bottom, as far as numbers tell
                break
    return rotation, level


def robust_descent(up: FloatArray, field: FloatArray, rotation: FloatArray, level: float) -> End:
    """To a minimum of the absolute errors, by squares weighed with one over the last error.

    Squares let one wrong position bend the rotation until it no longer stands out.
    """
    for _ in range(MAX_ITERATIONS):
        error = errors(up, field, rotation, level)
        columns = columns_of(up, field @ rotation.T)
        weight = 1.0 / np.maximum(np.abs(error), 1e-3 * float(np.abs(error).max()) + 1e-12)
        normal = (columns.T * weight) @ columns
        ridge = 1e-9 * float(np.trace(normal)) * np.eye(4)
        step = -np.linalg.solve(normal + ridge, columns.T @ (weight * error))
        trial = exponential(np.asarray(step[:3], float)) @ rotation, level + float(step[3])
        if not _absolute(up, field, *trial) < _absolute(up, field, rotation, level):
            break
        rotation, level = trial
        if np.abs(step).max() < ROUGH * float(np.abs(error).mean()):
            break
    return rotation, level


def _absolute(up: FloatArray, field: FloatArray, rotation: FloatArray, level: float) -> float:
    return float(np.abs(errors(up, field, rotation, level)).sum())
