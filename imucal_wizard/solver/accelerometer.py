"""The accelerometer's calibration from still positions: model chosen, fitted, judged."""

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.errors import DataError, UsageError
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.readings import FloatArray, IntArray
from imucal_wizard.solver.by_ellipsoid import ELLIPSOID_METHODS
from imucal_wizard.solver.least_squares import Solution
from imucal_wizard.solver.magnitude import jacobian, residuals, triangle
from imucal_wizard.solver.noise import hold_noise
from imucal_wizard.solver.outliers import Suspect, suspect_hold
from imucal_wizard.solver.parameters import triangular_parameters, unit_of, with_errors
from imucal_wizard.solver.result import SensorFit
from imucal_wizard.solver.rms import root_mean_square
from imucal_wizard.solver.slow_noise import spans_of
from imucal_wizard.solver.start import errors_before, six_position
from imucal_wizard.solver.task import Task, face_rows, make_task, up_directions
from imucal_wizard.solver.uncertainty import (
    Uncertainty,
    held_out,
    uncertainty,
    uncertainty_of_six,
    up_doubt,
    with_slow_noise,
)

METHODS = ("least_squares", "newton", "six-position", *ELLIPSOID_METHODS)
SIX = "six-position"
ANGLES = ("theta_yz", "theta_zy", "theta_zx")
NEEDS_ALL_SIX = "the six-position method needs all six faces, so none could be left out to check it"


@dataclass(frozen=True, eq=False)
class AccelerometerFit:
    """The fit and what the gyroscope needs of it.

    Attributes:
        fit: the result.
        up: unit up vector of each hold, calibrated, shape (n, 3).
        labels: number of each hold's direction, shape (n,).
        direction_variance: variance of ``up`` across gravity per hold, rad², shape (n,).
        up_doubt: change of ``up`` for one standard deviation along each of the k ways in which the
            calibration may be wrong, shape (n, 3, k); None when nothing is known of them.
        suspect: the hold that does not fit with all others, if one stands out.
    """

    fit: SensorFit
    up: FloatArray
    labels: IntArray
    direction_variance: FloatArray
    up_doubt: FloatArray | None = None
    suspect: Suspect | None = None


def fit_accelerometer(
    holds: Sequence[Hold], gravity: float, unit: str, method: str = "least_squares"
) -> AccelerometerFit:
    """Fit ``|M (y − b)| = g`` to the holds.

    Args:
        holds: still periods.
        gravity: local gravity, m/s².
        unit: unit of the readings, ``m/s^2`` or ``count``.
        method: ``least_squares``, ``newton``, ``six-position``, ``algebraic``, ``two-step`` or
            ``numeric``.

    Raises:
        DataError: the holds do not carry a calibration.
        UsageError: no method of that name.
    """
    if method not in METHODS:
        raise UsageError(f"{method!r} is no method; choose one of {', '.join(METHODS)}")
    task = make_task(holds, gravity, method)
    if method == SIX:
        solution = _six_position(task)
    elif method in ELLIPSOID_METHODS:
        solution = task.solve()
    elif method == "newton":
        solution = _newton(task)
    else:
        solution = task.solve()
        task = _reweighted(task, solution, holds)
        again = task.solve(start=solution.theta)
        solution = replace(again, iterations=solution.iterations + again.iterations)
    return _report(task, solution, holds, unit)


def _newton(task: Task) -> Solution:
    """From Q's up/down start where all six faces are there, else from the sphere."""
    start = task.start
    with contextlib.suppress(DataError):  # a face is missing; the sphere serves as well
        start = _six_position(task).theta
    return task.solve(start=start)


def _six_position(task: Task) -> Solution:
    """Q's start values as a result of their own: bias and scale, from the faces alone."""
    problem = task.problem
    rows = face_rows(up_directions(task.start, problem.points))
    faces = {name: problem.points[found].mean(axis=0) for name, found in rows.items()}
    bias, sensitivity = six_position(faces, 1.0)
    theta = np.zeros(9)
    theta[:3], theta[[3, 6, 8]] = bias, 1.0 / sensitivity
    errors = residuals(theta, problem.points)
    return Solution(theta, 1, float(errors @ errors))


def _reweighted(task: Task, solution: Solution, holds: Sequence[Hold]) -> Task:
    """Weights from the noise of each hold plus what the first fit leaves beyond it.

    The rest (placement, slow drift) is the same for every hold, long or short, so it keeps a long
    hold from outweighing a short one by its length alone.
    """
    errors = residuals(solution.theta, task.problem.points)
    freedom = len(errors) - task.carried.basis.shape[1]
    noise = _noise(task, holds, solution.theta)
    rest = max(float(errors @ errors) / freedom - float(noise.mean()), 0.0) if freedom > 0 else 0.0
    variance = noise + rest
    if not (variance > 0.0).all():
        return task
    return replace(task, weights=np.sqrt(variance.mean() / variance))


def _noise(task: Task, holds: Sequence[Hold], theta: FloatArray) -> FloatArray:
    """Variance of each hold's error by noise within the holds alone, dimensionless, shape (n,)."""
    return hold_noise(holds).accelerometer * _gain(task, theta) ** 2


def _gain(task: Task, theta: FloatArray) -> float:
    """Units of the magnitude per reading, at the axis that has most of them."""
    return float(np.linalg.norm(triangle(theta), ord=2)) / task.problem.span


def _report(task: Task, solution: Solution, holds: Sequence[Hold], unit: str) -> AccelerometerFit:
    problem, theta, gravity = task.problem, solution.theta, task.problem.magnitude
    six = task.method == SIX
    errors, noise = residuals(theta, problem.points), _noise(task, holds, theta)
    known = _known(task, theta, holds, noise)
    out, why = (None, NEEDS_ALL_SIX) if six else held_out(task, theta)
    matrix, bias = problem.matrix_and_bias(theta)
    suspect = None if six else _suspect(task, theta)
    fit = SensorFit(
        sensor="accelerometer",
        model=("bias", "scale") if six else task.carried.terms,
        method=task.method,
        frame="own",
        matrix=matrix,
        bias=bias,
        bias_unit=unit,
        parameters=with_errors(
            lambda t: triangular_parameters(*problem.matrix_and_bias(t)),
            theta,
            known.whole,
            lambda name: unit_of(name, unit, "m/s^2"),
            ANGLES if six else task.carried.dropped,
            known.by_repeats,
        ),
        unit="m/s^2",
        rms_before=root_mean_square(errors_before(problem, unit)),
        rms_fitted=root_mean_square(errors) * gravity,
        rms_held_out=None if out is None else root_mean_square(out) * gravity,
        floor=root_mean_square(np.sqrt(noise)) * gravity,
        residuals=errors * gravity,
        held_out=None if out is None else out * gravity,
        covariance=problem.covariance(known.whole),
        iterations=solution.iterations,
        warnings=_notes(task),
        degrees_of_freedom=known.freedom,
        repeat_rms=None if not known.repeat_variance else known.repeat_variance**0.5 * gravity,
        repeat_degrees_of_freedom=known.repeat_freedom,
        suspects=() if suspect is None else (suspect.index,),
        unused=_unused(task) if six else (),
        not_held_out=why,
    )
    return AccelerometerFit(
        fit,
        up_directions(theta, problem.points),
        task.labels,
        hold_noise(holds).across * _gain(task, theta) ** 2 + (known.variance or 0.0),
        up_doubt(task, theta, known.whole),
        suspect,
    )


def _known(task: Task, theta: FloatArray, holds: Sequence[Hold], noise: FloatArray) -> Uncertainty:
    """How well θ is known, by the scatter and by what noise slower than a hold adds."""
    known = uncertainty_of_six(task, theta) if task.method == SIX else uncertainty(task, theta)
    known = with_slow_noise(known, task, theta, spans_of(holds), noise)
    # what the first step of N's estimate errs is no noise, and nothing here says how much it is
    return replace(known, covariance=None) if task.method == "two-step" else known


def _unused(task: Task) -> tuple[int, ...]:
    """The holds that show no face and so are in none of Q's up/down formulae."""
    rows = face_rows(up_directions(task.start, task.problem.points)).values()
    return tuple(sorted(set(range(len(task.labels))).difference(*rows)))


def _notes(task: Task) -> tuple[str, ...]:
    if task.method == SIX:
        return ("the six-position method leaves all angles at their nominal value",)
    return (task.carried.reason,) if task.carried.reason else ()


def _suspect(task: Task, theta: FloatArray) -> Suspect | None:
    columns = task.weights[:, None] * jacobian(theta, task.problem.points) @ task.carried.basis
    errors = task.weights * residuals(theta, task.problem.points)
    return suspect_hold(errors, columns)
