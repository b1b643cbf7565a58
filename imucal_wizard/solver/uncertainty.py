"""How well the accelerometer's parameters are known: from the residual, and from the repeats.

The residual counts everything the model does not explain, physics that it lacks included. Holds
that repeat a direction differ only by what does not repeat (noise, slow drift): their scatter
about their own mean is the pure error, whatever the model. Where the two disagree the model lacks
something.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.carried import TYPICAL_NOISE, UNCALIBRATED, amplification
from imucal_wizard.solver.directions import near_any
from imucal_wizard.solver.magnitude import BIAS, SCALE, jacobian, residuals
from imucal_wizard.solver.task import Task, face_rows, up_directions

LARGEST_HOLE = UNCALIBRATED / TYPICAL_NOISE
"""Amplification by the other directions beyond which the error of one left out says nothing of the
calibration, but only of the hole that it leaves: usual noise would then pass for a usual bias."""


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Dimensionless throughout.

    Attributes:
        covariance: of the nine parameters, shape (9, 9), scaled by the residual; None when no
            degrees of freedom are left.
        variance: of one hold of average weight, from the residual; None likewise.
        freedom: degrees of freedom of the residual.
        repeat_variance: of one hold, from the repeats alone; None without any.
        repeat_freedom: degrees of freedom of the repeats.
    """

    covariance: FloatArray | None
    variance: float | None
    freedom: int
    repeat_variance: float | None
    repeat_freedom: int


def uncertainty(task: Task, theta: FloatArray) -> Uncertainty:
    """Of the least-squares fit; Newton's cost has the same minimum to first order."""
    basis = task.carried.basis
    errors = task.weights * residuals(theta, task.problem.points)
    freedom = len(errors) - basis.shape[1]
    covariance = variance = None
    if freedom > 0:
        columns = task.weights[:, None] * jacobian(theta, task.problem.points) @ basis
        variance = float(errors @ errors) / freedom
        root = basis @ np.linalg.pinv(columns)
        covariance = variance * root @ root.T
    return Uncertainty(covariance, variance, freedom, *_repeats(task, errors))


def uncertainty_of_six(task: Task, theta: FloatArray) -> Uncertainty:
    """Of Q's up/down formulae, which look at nothing but each face's own axis.

    With s² the variance of a hold and n₊, n₋ holds per face, bias and sensitivity have the variance
    ``(s²/4) (1/n₊ + 1/n₋)``, and ``(s²/4) (1/n₊ − 1/n₋)`` in common.
    """
    faces = face_rows(up_directions(task.start, task.problem.points))
    rows = sorted({row for found in faces.values() for row in found})
    errors = residuals(theta, task.problem.points)
    freedom = len(rows) - len(BIAS) - len(SCALE)
    if freedom <= 0:
        return Uncertainty(None, None, max(freedom, 0), *_repeats(task, errors))
    variance = float(errors[rows] @ errors[rows]) / freedom
    covariance = np.zeros((9, 9))
    for axis, (b, k) in enumerate(zip(BIAS, SCALE, strict=True)):
        up, down = (1.0 / len(faces[sign + "xyz"[axis]]) for sign in "+-")
        quarter = variance / theta[k] ** 2 / 4.0
        covariance[b, b] = quarter * (up + down)
        covariance[k, k] = quarter * (up + down) * theta[k] ** 4
        covariance[b, k] = covariance[k, b] = -quarter * (up - down) * theta[k] ** 2
    return Uncertainty(covariance, variance, freedom, *_repeats(task, errors))


def _repeats(task: Task, errors: FloatArray) -> tuple[float | None, int]:
    """Variance of weighted errors about the mean of their direction, and degrees of freedom."""
    labels = task.labels
    count = np.bincount(labels)
    freedom = int((count - 1).sum())
    if freedom == 0:
        return None, 0
    squared = task.weights**2
    mean = np.bincount(labels, task.weights * errors) / np.bincount(labels, squared)
    scatter = errors - task.weights * mean[labels]
    return float(scatter @ scatter) / freedom, freedom


def held_out(task: Task, theta: FloatArray) -> tuple[FloatArray | None, str]:
    """Error of each hold under the fit without its whole direction.

    With a direction go all holds within 12° of any of its own, those counted to a neighbouring
    direction too. What stays is the choice of the model, which looks at where the directions are
    and not at what was read there, the weights of the holds, and which holds there are: of a
    recording the limits of rest were chosen by all of them.

    Returns:
        The errors, dimensionless, shape (n,), or None; and why there are none, or "".
    """
    points = task.problem.points
    up, leaders = up_directions(theta, points), task.leaders(theta)
    if task.carried.spare < 1:
        return None, (
            f"the {len(leaders)} directions carry this model and no more, so none could be left "
            "out to check it: add others"
        )
    errors = np.empty(len(task.labels))
    for label in range(len(leaders)):
        out = task.labels == label
        kept = ~near_any(up, up[out])
        others = leaders[np.unique(task.labels[kept])]
        if amplification(others, task.carried.basis).max() > LARGEST_HOLE:
            return None, (
                f"without one of the {len(leaders)} directions the others do not carry this model, "
                "so none could be left out to check it: add others"
            )
        errors[out] = residuals(task.solve(kept, theta).theta, points[out])
    return errors, ""


def up_doubt(task: Task, theta: FloatArray, covariance: FloatArray | None) -> FloatArray | None:
    """Change of each hold's up for one standard deviation of each principal doubt, (n, 3, k)."""
    if covariance is None:
        return None
    values, vectors = np.linalg.eigh(covariance)
    seen = values > 1e-12 * values[-1]
    points = task.problem.points
    columns = [
        0.5 * (up_directions(theta + doubt, points) - up_directions(theta - doubt, points))
        for doubt in (vectors[:, seen] * np.sqrt(values[seen])).T
    ]
    return np.stack(columns, axis=-1) if columns else None
