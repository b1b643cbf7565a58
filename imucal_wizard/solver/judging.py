"""How good a calibration from some holds would be, without making it in full."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.attitude import IntArray
from imucal_wizard.solver.carried import expected_error
from imucal_wizard.solver.magnitude import jacobian, residuals
from imucal_wizard.solver.task import make_task


def judge(holds: Sequence[Hold], gravity: float) -> float:
    """Expected rms error of a calibration from these holds on other orientations, SI.

    The error of each direction left out stands for the noise of a hold; what becomes of it anywhere
    follows from the directions there are and the model they carry (``carried.expected_error``). The
    direction that fits worst is set aside: one disturbed hold says nothing of the others.

    Returns:
        The error; infinite when the holds carry no calibration, or no direction can be left out.
    """
    try:
        task = make_task(holds, gravity, "least_squares")
        theta = task.solve().theta
        leaders = task.leaders(theta)
    except DataError:
        return np.inf
    if task.carried.spare < 2:
        return np.inf
    columns = jacobian(theta, task.problem.points) @ task.carried.basis
    errors = residuals(theta, task.problem.points)
    labels = task.labels
    _, drops = _left_out(columns, errors, labels)
    keep = labels != int(np.argmax(drops))
    squares, _ = _left_out(columns[keep], errors[keep], labels[keep])
    noise = float(np.sqrt(squares.sum() / keep.sum()))
    return expected_error(leaders, task.carried.basis, noise) * gravity


def _left_out(
    columns: FloatArray, errors: FloatArray, labels: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Squared errors of each direction left out, and fall of the sum of squares without it.

    Of the linearised fit: ``(I − H_dd)⁻¹ r_d`` for the holds of direction d, a hundredth of the
    cost of refitting and good enough to compare.
    """
    inverse = np.linalg.pinv(columns)
    errors = errors - columns @ (inverse @ errors)
    hat = columns @ inverse
    squares, drops = np.zeros(labels.max() + 1), np.zeros(labels.max() + 1)
    for label in np.unique(labels):
        rows = np.flatnonzero(labels == label)
        inner = np.eye(len(rows)) - hat[np.ix_(rows, rows)]
        left_out = np.linalg.lstsq(inner, errors[rows], rcond=1e-6)[0]
        squares[label], drops[label] = left_out @ left_out, errors[rows] @ left_out
    return squares, drops
