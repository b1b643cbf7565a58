"""How well the accelerometer's parameters are known: from the residual, and from the repeats.

The residual counts everything the model does not explain, physics that it lacks included. Holds
that repeat a direction differ only by what does not repeat (noise, slow drift): their scatter
about their own mean is the pure error, whatever the model. Where the two disagree the model lacks
something. Neither sees the slowest noise, which is the same in all holds: ``slow_noise`` adds it.
"""

from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.carried import TYPICAL_NOISE, UNCALIBRATED, amplification
from imucal_wizard.solver.directions import near_any
from imucal_wizard.solver.magnitude import BIAS, SCALE, jacobian, residuals
from imucal_wizard.solver.slow_noise import Shown, slow_covariances, unseen
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
        pull: by how much the weighted error of each hold moves each parameter, shape (9, n).
        slow: what slow noise adds to the covariance of the parameters, shape (9, 9).
    """

    covariance: FloatArray | None
    variance: float | None
    freedom: int
    repeat_variance: float | None
    repeat_freedom: int
    pull: FloatArray
    slow: FloatArray | float = 0.0

    @property
    def whole(self) -> FloatArray | None:
        """Covariance of the parameters by all that is known to move them."""
        return None if self.covariance is None else self.covariance + self.slow

    @property
    def by_repeats(self) -> FloatArray | None:
        """The same with the scatter of the repeats instead of the residual."""
        if self.covariance is None or self.repeat_variance is None or not self.variance:
            return None
        return self.covariance * (self.repeat_variance / self.variance) + self.slow


def uncertainty(task: Task, theta: FloatArray) -> Uncertainty:
    """Of the least-squares fit; Newton's cost has the same minimum to first order."""
    basis = task.carried.basis
    errors = task.weights * residuals(theta, task.problem.points)
    freedom = len(errors) - basis.shape[1]
    columns = task.weights[:, None] * jacobian(theta, task.problem.points) @ basis
    pull = -basis @ np.linalg.pinv(columns)
    return _known(task, errors, freedom, errors, pull)


def uncertainty_of_six(task: Task, theta: FloatArray) -> Uncertainty:
    """Of Q's up/down formulae, which look at nothing but each face's own axis.

    An error e of the magnitude at one of n₊ holds with the face up moves the axis's reading by e/k,
    so that bias and sensitivity move by half of that over n₊; at one of n₋ holds with the face
    down the bias moves the other way.
    """
    faces = face_rows(up_directions(task.start, task.problem.points))
    errors = residuals(theta, task.problem.points)
    pull = np.zeros((9, len(errors)))
    for axis, (b, k) in enumerate(zip(BIAS, SCALE, strict=True)):
        for sign, name in ((1.0, "+"), (-1.0, "-")):
            rows = faces[name + "xyz"[axis]]
            pull[b, rows] = sign * 0.5 / theta[k] / len(rows)
            pull[k, rows] = -0.5 * theta[k] / len(rows)
    used = sorted({row for found in faces.values() for row in found})
    freedom = len(used) - len(BIAS) - len(SCALE)
    return _known(task, errors, freedom, errors[used], pull)


def _known(
    task: Task, errors: FloatArray, freedom: int, judged: FloatArray, pull: FloatArray
) -> Uncertainty:
    covariance = variance = None
    if freedom > 0:
        variance = float(judged @ judged) / freedom
        covariance = variance * pull @ pull.T
    return Uncertainty(covariance, variance, max(freedom, 0), *_repeats(task, errors), pull)


def with_slow_noise(
    known: Uncertainty, task: Task, theta: FloatArray, spans: FloatArray, noise: FloatArray
) -> Uncertainty:
    """The same with what slow noise may do to the parameters, above all to the biases.

    The bias of each axis wanders by itself, so that two holds show the same slow error as far as
    they point the same way.

    Args:
        known: what the residual says.
        task: the fit.
        theta: its parameters.
        spans: beginning and end of each hold, s, shape (n, 2).
        noise: variance of each hold's error by the noise within it, dimensionless, shape (n,).
    """
    up = up_directions(theta, task.problem.points)
    columns = jacobian(theta, task.problem.points) @ task.carried.basis
    shown = Shown(residuals(theta, task.problem.points), columns, noise, up @ up.T)
    slow = slow_covariances(spans, [shown])[0] * np.outer(task.weights, task.weights)
    more = unseen(slow, task.weights[:, None] * columns, known.variance or 0.0)
    return replace(known, slow=known.pull @ more @ known.pull.T)


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
