"""The accelerometer's calibration from still positions: model chosen, fitted, judged."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.procedure.poses import FACES, POSE_TOLERANCE_DEG
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.attitude import IntArray
from imucal_wizard.solver.carried import Carried, basis_of, decide, mean_amplification
from imucal_wizard.solver.directions import group_directions
from imucal_wizard.solver.least_squares import Solution, least_squares
from imucal_wizard.solver.magnitude import (
    SCALE,
    Problem,
    corrected,
    jacobian,
    make_problem,
    residuals,
    triangle,
)
from imucal_wizard.solver.newton import newton
from imucal_wizard.solver.noise import hold_noise
from imucal_wizard.solver.parameters import triangular_parameters, with_errors
from imucal_wizard.solver.result import SensorFit
from imucal_wizard.solver.start import six_position, sphere
from imucal_wizard.units import COUNT

METHODS = ("least_squares", "newton", "six-position")


@dataclass(frozen=True, eq=False)
class AccelerometerFit:
    """The fit and what the gyroscope needs of it.

    Attributes:
        fit: the result.
        up: unit up vector of each hold, calibrated, shape (n, 3).
        labels: number of each hold's direction, shape (n,).
        direction_variance: variance of ``up`` across gravity per hold, rad², shape (n,).
    """

    fit: SensorFit
    up: FloatArray
    labels: IntArray
    direction_variance: FloatArray


@dataclass(frozen=True, eq=False)
class _Work:
    """One fit in progress."""

    problem: Problem
    start: FloatArray
    carried: Carried
    labels: IntArray
    weights: FloatArray
    method: str

    def solve(self, keep: FloatArray | None = None, start: FloatArray | None = None) -> Solution:
        """Fit all points, or those kept."""
        points, weights = self.problem.points, self.weights
        if keep is not None:
            points, weights = points[keep], weights[keep]
        begin = self.start if start is None else start
        if self.method == "newton":
            return newton(points, begin, self.carried.basis)
        return least_squares(points, begin, self.carried.basis, weights)


def fit_accelerometer(
    holds: Sequence[Hold], gravity: float, unit: str, method: str = "least_squares"
) -> AccelerometerFit:
    """Fit ``|M (y − b)| = g`` to the holds.

    Args:
        holds: still periods.
        gravity: local gravity, m/s².
        unit: unit of the readings, ``m/s^2`` or ``count``.
        method: ``least_squares``, ``newton`` or ``six-position``.

    Raises:
        DataError: the holds do not carry a calibration.
    """
    means = np.array([hold.accelerometer for hold in holds])
    _check(means)
    problem = make_problem(means, gravity)
    work = _prepare(problem, holds, method)
    if method == "six-position":
        solution = _six_position(work, holds)
    else:
        solution = work.solve()
        if method == "least_squares":
            work = _reweighted(work, solution, holds)
            again = work.solve(start=solution.theta)
            solution = replace(again, iterations=solution.iterations + again.iterations)
    return _report(work, solution, holds, unit)


def judge(holds: Sequence[Hold], gravity: float) -> float:
    """Expected rms error of a calibration from these holds on other orientations, SI.

    The error of each direction left out, times the amplification of the directions there are. The
    left-out error is that of the linearised fit, ``(I − H_dd)⁻¹ r_d`` for the holds of direction d;
    good to choose between ways of finding the holds, at a hundredth of the cost of refitting.

    Returns:
        The error; infinite when the holds carry no calibration, or no direction can be left out.
    """
    try:
        means = np.array([hold.accelerometer for hold in holds])
        _check(means)
        work = _prepare(make_problem(means, gravity), holds, "least_squares")
        theta = work.solve().theta
    except DataError:
        return np.inf
    if work.carried.spare < 1:
        return np.inf
    columns = jacobian(theta, work.problem.points) @ work.carried.basis
    hat = columns @ np.linalg.pinv(columns)
    errors = residuals(theta, work.problem.points)
    squares = 0.0
    for label in range(int(work.labels.max()) + 1):
        rows = np.flatnonzero(work.labels == label)
        inner = np.eye(len(rows)) - hat[np.ix_(rows, rows)]
        squares += float((np.linalg.lstsq(inner, errors[rows], rcond=None)[0] ** 2).sum())
    up = _leaders(_unit(corrected(theta, work.problem.points)), work.labels)
    spread = mean_amplification(up, work.carried.basis)
    return float(np.sqrt(squares / len(errors))) * spread * gravity


def _check(means: FloatArray) -> None:
    if len(means) < 4:
        raise DataError(
            f"{len(means)} still position{'s' * (len(means) != 1)} found; at least six are needed. "
            "Hold the device still for two seconds with each of its six faces up"
        )
    spread = np.ptp(means, axis=0)
    if spread.max() == 0.0:
        raise DataError("the accelerometer always reads the same: it is dead or not connected")
    if (spread < 0.02 * spread.max()).any():
        dead = ", ".join(a for a, s in zip("xyz", spread, strict=True) if s < 0.02 * spread.max())
        raise DataError(
            f"accelerometer axis {dead} hardly changes between the positions: turn the device so "
            "that it points up and down, and check the axis if you did"
        )


def _prepare(problem: Problem, holds: Sequence[Hold], method: str) -> _Work:
    rough = sphere(problem)
    if triangle(rough)[0, 0] <= 0.0:
        raise DataError("the still positions do not lie around one centre: check the columns")
    up = _unit(corrected(rough, problem.points))
    labels = group_directions(up)
    carried = decide(_leaders(up, labels))
    return _Work(problem, rough, carried, labels, np.ones(len(holds)), method)


def _reweighted(work: _Work, solution: Solution, holds: Sequence[Hold]) -> _Work:
    """Weights from the noise of each hold plus what the first fit leaves beyond it.

    The rest (placement, slow drift) is the same for every hold, long or short, so it keeps a long
    hold from outweighing a short one by its length alone.
    """
    errors = residuals(solution.theta, work.problem.points)
    freedom = len(errors) - work.carried.basis.shape[1]
    noise = hold_noise(holds).accelerometer / work.problem.span**2
    noise = noise * np.linalg.norm(triangle(solution.theta), ord=2) ** 2
    rest = max(float(errors @ errors) / freedom - float(noise.mean()), 0.0) if freedom > 0 else 0.0
    variance = noise + rest
    if not (variance > 0.0).all():
        return work
    weights = np.sqrt(variance.mean() / variance)
    return _Work(work.problem, work.start, work.carried, work.labels, weights, work.method)


def _six_position(work: _Work, holds: Sequence[Hold]) -> Solution:
    """Q's start values as a result of their own: bias and scale, from the faces alone."""
    up = _unit(corrected(work.start, work.problem.points))
    faces = {}
    for name, direction in FACES.items():
        close = up @ direction > np.cos(np.radians(POSE_TOLERANCE_DEG))
        if close.any():
            rows = np.flatnonzero(close).tolist()
            faces[name] = np.mean([holds[row].accelerometer for row in rows], axis=0)
    bias, sensitivity = six_position(faces, work.problem.magnitude)
    theta = work.problem.theta(np.diag(1.0 / sensitivity), bias)
    errors = residuals(theta, work.problem.points)
    return Solution(theta, 1, float(errors @ errors), True)


def _report(work: _Work, solution: Solution, holds: Sequence[Hold], unit: str) -> AccelerometerFit:
    problem, theta = work.problem, solution.theta
    gravity = problem.magnitude
    matrix, bias = problem.matrix_and_bias(theta)
    errors = residuals(theta, problem.points) * gravity
    basis = basis_of((0, 1, 2, *SCALE)) if work.method == "six-position" else work.carried.basis
    dropped = work.carried.dropped
    if work.method == "six-position":
        dropped = ("theta_yz", "theta_zy", "theta_zx")
    covariance, variance = _covariance(work, theta, basis)
    held_out = None if work.method == "six-position" else _held_out(work, theta)
    vectors = corrected(theta, problem.points)
    parameters = with_errors(
        lambda t: triangular_parameters(*problem.matrix_and_bias(t)),
        theta,
        covariance,
        lambda name: _unit_of(name, unit),
        dropped,
    )
    fit = SensorFit(
        sensor="accelerometer",
        model=work.carried.terms if work.method != "six-position" else ("bias", "scale"),
        method=work.method,
        frame="own",
        matrix=matrix,
        bias=bias,
        bias_unit=unit,
        parameters=parameters,
        unit="m/s^2",
        rms_before=_rms(_errors_before(problem, unit)),
        rms_fitted=_rms(errors),
        rms_held_out=None if held_out is None else _rms(held_out),
        floor=_floor(work, holds, theta),
        residuals=errors,
        held_out=held_out,
        covariance=None if covariance is None else _in_reading_units(problem, covariance),
        iterations=solution.iterations,
        warnings=(work.carried.reason,) if work.carried.reason else (),
    )
    across = hold_noise(holds).accelerometer / problem.span**2 + (variance or 0.0)
    return AccelerometerFit(fit, _unit(vectors), work.labels, across)


def _covariance(
    work: _Work, theta: FloatArray, basis: FloatArray
) -> tuple[FloatArray | None, float | None]:
    """Covariance of ``theta`` and the residual variance, both dimensionless; None without spare."""
    columns = work.weights[:, None] * jacobian(theta, work.problem.points) @ basis
    errors = work.weights * residuals(theta, work.problem.points)
    freedom = len(errors) - basis.shape[1]
    if freedom <= 0:
        return None, None
    variance = float(errors @ errors) / freedom
    return variance * basis @ np.linalg.pinv(columns.T @ columns) @ basis.T, variance


def _in_reading_units(problem: Problem, covariance: FloatArray) -> FloatArray:
    """Covariance of (b, M's six entries) in reading units and SI per reading."""
    scale = np.full(9, problem.magnitude / problem.span)
    scale[:3] = problem.span
    return covariance * np.outer(scale, scale)


def _held_out(work: _Work, theta: FloatArray) -> FloatArray | None:
    """Error of each hold when its whole direction is left out of the fit, SI; None if it cannot be.

    A direction can be left out when the rest still carries the model.
    """
    if work.carried.spare < 1:
        return None
    errors = np.empty(len(work.labels))
    for label in range(int(work.labels.max()) + 1):
        out = work.labels == label
        columns = jacobian(theta, work.problem.points[~out]) @ work.carried.basis
        if np.linalg.matrix_rank(columns, tol=1e-6 * np.linalg.norm(columns, 2)) < columns.shape[1]:
            return None
        fitted = work.solve(~out, theta)
        errors[out] = residuals(fitted.theta, work.problem.points[out])
    return errors * work.problem.magnitude


def _errors_before(problem: Problem, unit: str) -> FloatArray:
    """Errors with the nominal conversion only; for counts, of the best sphere."""
    if unit == COUNT:
        return residuals(sphere(problem), problem.points) * problem.magnitude
    readings = problem.centre + problem.span * problem.points
    return np.asarray(np.linalg.norm(readings, axis=1)) - problem.magnitude


def _floor(work: _Work, holds: Sequence[Hold], theta: FloatArray) -> float:
    """The rms that the noise within the holds alone would leave, SI."""
    noise = hold_noise(holds).accelerometer / work.problem.span**2
    gain = np.linalg.norm(triangle(theta), ord=2)
    return float(np.sqrt(noise.mean()) * gain * work.problem.magnitude)


def _unit_of(name: str, unit: str) -> str:
    if name.startswith("bias"):
        return unit
    if name.startswith("sensitivity"):
        return f"{unit}/(m/s^2)" if unit == COUNT else "1"
    return "rad"


def _leaders(up: FloatArray, labels: IntArray) -> FloatArray:
    _, first = np.unique(labels, return_index=True)
    return up[first]


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])


def _rms(errors: FloatArray) -> float:
    return float(np.sqrt(np.mean(errors**2)))
