"""How good a calibration from some holds would be, without making it in full."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.solver.carried import expected_error
from imucal_wizard.solver.magnitude import jacobian, residuals
from imucal_wizard.solver.task import make_task


def judge(holds: Sequence[Hold], gravity: float) -> float:
    """Expected rms error of a calibration from these holds on other orientations, SI.

    The error of each direction left out stands for the noise of a hold; what becomes of it anywhere
    follows from the directions there are and the model they carry (``carried.expected_error``). The
    left-out error is that of the linearised fit, ``(I − H_dd)⁻¹ r_d`` for the holds of direction d;
    good to choose between ways of finding the holds, at a hundredth of the cost of refitting.

    Returns:
        The error; infinite when the holds carry no calibration, or no direction can be left out.
    """
    try:
        task = make_task(holds, gravity, "least_squares")
        theta = task.solve().theta
        leaders = task.leaders(theta)
    except DataError:
        return np.inf
    if task.carried.spare < 1:
        return np.inf
    columns = jacobian(theta, task.problem.points) @ task.carried.basis
    hat = columns @ np.linalg.pinv(columns)
    errors = residuals(theta, task.problem.points)
    squares = 0.0
    for label in range(int(task.labels.max()) + 1):
        rows = np.flatnonzero(task.labels == label)
        inner = np.eye(len(rows)) - hat[np.ix_(rows, rows)]
        squares += float((np.linalg.lstsq(inner, errors[rows], rcond=None)[0] ** 2).sum())
    noise = float(np.sqrt(squares / len(errors)))
    return expected_error(leaders, task.carried.basis, noise) * gravity
