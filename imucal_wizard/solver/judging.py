"""How good a calibration from some holds would be, without making it in full."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.readings import FloatArray, IntArray
from imucal_wizard.solver.carried import expected_error
from imucal_wizard.solver.magnitude import jacobian, residuals
from imucal_wizard.solver.outliers import suspect_hold
from imucal_wizard.solver.task import Task, make_task


def judge(holds: Sequence[Hold], gravity: float, rests: IntArray | None = None) -> float:
    """Expected rms error of a calibration from these holds on other orientations, SI.

    The error of each direction left out stands for the noise of a hold; what becomes of it anywhere
    follows from the directions there are and the model they carry (``carried.expected_error``). The
    left-out error is that of the linearised fit, ``(I − H_dd)⁻¹ r_d`` for the holds of direction d;
    good to choose between ways of finding the holds, at a hundredth of the cost of refitting.

    Args:
        holds: still periods.
        gravity: local gravity, m/s².
        rests: number of the rest of which each hold is a piece, shape (n,); all pieces of a rest
            together count as one hold. None where each hold is a rest of its own.

    Returns:
        The error; infinite when the holds carry no calibration, or no direction can be left out.
    """
    shares = np.ones(len(holds)) if rests is None else 1.0 / np.bincount(rests)[rests]
    trial = _trial(holds, gravity, np.sqrt(shares))
    if trial is None or trial.task.carried.spare < 1:
        return np.inf
    hat = trial.columns @ np.linalg.pinv(trial.columns)
    squares = 0.0
    for label in range(len(trial.leaders)):
        rows = np.flatnonzero(trial.task.labels == label)
        inner = np.eye(len(rows)) - hat[np.ix_(rows, rows)]
        left_out = np.linalg.lstsq(inner, trial.errors[rows], rcond=1e-6)[0]
        squares += float(left_out @ left_out)
    noise = float(np.sqrt(squares / shares.sum()))
    return expected_error(trial.leaders, trial.task.carried.basis, noise) * gravity


def disturbed(holds: Sequence[Hold], gravity: float) -> int | None:
    """The hold that does not fit with all others, if one stands out."""
    trial = _trial(holds, gravity, np.ones(len(holds)))
    found = None if trial is None else suspect_hold(trial.errors, trial.columns)
    return None if found is None else found.index


@dataclass(frozen=True, eq=False)
class _Trial:
    """A fit, the weighted errors that it leaves, and their derivative."""

    task: Task
    leaders: FloatArray
    errors: FloatArray
    columns: FloatArray


def _trial(holds: Sequence[Hold], gravity: float, weights: FloatArray) -> _Trial | None:
    try:
        task = replace(make_task(holds, gravity, "least_squares"), weights=weights)
        theta = task.solve().theta
        leaders = task.leaders(theta)
    except DataError:
        return None
    columns = weights[:, None] * jacobian(theta, task.problem.points) @ task.carried.basis
    return _Trial(task, leaders, weights * residuals(theta, task.problem.points), columns)
