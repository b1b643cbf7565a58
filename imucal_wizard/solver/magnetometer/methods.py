"""The four methods as one: an ellipsoid, what it leaves, and what areas left out show."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.ellipsoid import binned
from imucal_wizard.ellipsoid.algebraic import from_moments, moments
from imucal_wizard.ellipsoid.bins import bin_of, by_area, folds
from imucal_wizard.ellipsoid.numeric import numeric
from imucal_wizard.ellipsoid.orthogonal import Rows, rows
from imucal_wizard.ellipsoid.shape import errors, look
from imucal_wizard.ellipsoid.two_step import two_step
from imucal_wizard.errors import DataError
from imucal_wizard.readings import BoolArray, FloatArray
from imucal_wizard.solver.magnetometer.model import FieldModel
from imucal_wizard.solver.magnetometer.nominal import with_nominal

METHODS = ("orthogonal", "algebraic", "two-step", "numeric")
FOLDS = folds()
PASSES = 12
SMALL = 0.3
"""A step of so many standard errors is the last: the next would be a hundredth of it."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """One method's ellipsoid.

    Attributes:
        theta: shape (9,).
        covariance: of θ, shape (9, 9), with what is left nominal; None where the method has none.
        freedom: degrees of freedom behind it.
        areas: the areas that hold samples, shape (k,).
        mean: mean of ``|x| − 1`` in each, shape (k,).
        square: mean square of it in each, shape (k,).
        left_out: the same for the fit without the area's fold, or None.
        iterations: how many it took.
        noise: variance of a sample's distance, dimensionless, or None.
        misfit: variance between areas beyond it, or None.
    """

    theta: FloatArray
    covariance: FloatArray | None
    freedom: int
    areas: NDArray[np.intp]
    mean: FloatArray
    square: FloatArray
    left_out: FloatArray | None
    iterations: int
    noise: float | None = None
    misfit: float | None = None


def by_orthogonal(
    points: FloatArray, start: FloatArray, variance: float, model: FieldModel
) -> Estimate:
    """The robust orthogonal fit, from a start near to it; density and misfit weighed.

    Args:
        points: undisturbed samples, dimensionless, shape (3, n).
        start: θ, shape (9,).
        variance: of a sample's distance, about.
        model: what is free.

    Raises:
        DataError: it does not converge.
        numpy.linalg.LinAlgError: the samples do not determine the parameters.
    """
    theta, basis = start.copy(), model.basis
    areas = bin_of(look(theta, points)[1])
    order = by_area(areas)
    areas, points = areas[order], points[:, order]
    passes = 0
    for _ in range(PASSES):
        passes += 1
        now = rows(theta, points, variance)
        sums = binned.summed(now, areas, basis)
        found = binned.weigh(sums)
        theta, variance = theta - basis @ found.step, found.noise
        if found.step @ np.linalg.pinv(found.covariance) @ found.step < SMALL**2:
            break
    else:
        raise DataError(_NO_CONVERGENCE)
    if not np.isfinite(theta).all():
        raise DataError(_NO_CONVERGENCE)
    error = errors(theta, points)
    mean, square = _per_area(error, areas, sums.area)
    out = binned.left_out(sums, found.weight, FOLDS)
    after = binned.mean_square(sums, -found.step)
    return Estimate(
        theta,
        with_nominal(basis @ found.covariance @ basis.T, theta, _normal(now, areas, found), basis),
        found.freedom,
        sums.area,
        mean,
        square,
        # distances and |x| − 1 differ by the gradient, which hardly changes within an area
        None if out is None else square * out / np.maximum(after, 1e-300),
        passes,
        found.noise,
        found.misfit,
    )


def _normal(now: Rows, areas: NDArray[np.intp], found: binned.Weighed) -> FloatArray:
    """The weighted normal matrix of all nine parameters, shape (9, 9)."""
    weight = np.repeat(found.weight, np.unique(areas, return_counts=True)[1])
    return np.asarray((now.slope * weight) @ now.slope.T)


def by_method(
    method: str, points: FloatArray, kept: BoolArray, model: FieldModel, start: FloatArray
) -> Estimate:
    """``algebraic``, ``two-step`` or ``numeric``, on all samples as printed, judged on those kept.

    Standard errors are from the fits without each fold (delete-a-group jackknife).

    Args:
        method: its name.
        points: all samples, dimensionless, shape (3, n).
        kept: which of them are undisturbed, shape (n,).
        model: what is free.
        start: a good ellipsoid, which tells the samples' directions, shape (9,).

    Raises:
        DataError: the method gives no ellipsoid.
    """
    areas = bin_of(look(start, points)[1])
    fold = FOLDS[areas]
    whole, each, iterations = _WAYS[method](points, fold, model)
    found = np.unique(areas[kept])
    mean, square = _per_area(errors(whole, points[:, kept]), areas[kept], found)
    left_out = np.full(len(found), np.nan)
    for number, theta in each.items():
        rows_out = kept & (fold == number)
        if rows_out.any():
            mine = FOLDS[found] == number
            out = _per_area(errors(theta, points[:, rows_out]), areas[rows_out], found[mine])
            left_out[mine] = out[1]
    deviations = np.array([theta - whole for theta in each.values()])
    groups = len(deviations)
    return Estimate(
        whole,
        (groups - 1.0) / groups * deviations.T @ deviations,
        groups - 1,
        found,
        mean,
        square,
        None if np.isnan(left_out).any() else left_out,
        iterations,
    )


Folded = tuple[FloatArray, dict[int, FloatArray], int]
"""θ of all samples, θ without each fold, iterations."""


def _algebraic(points: FloatArray, fold: NDArray[np.intp], model: FieldModel) -> Folded:
    parts = {int(one): moments(points[:, fold == one]) for one in np.unique(fold)}
    total = sum(parts.values())
    assert isinstance(total, np.ndarray)  # noqa: S101 - sum() of arrays is typed as int too
    each = {one: from_moments(total - part, model.quadrics) for one, part in parts.items()}
    return from_moments(total, model.quadrics), each, 1


def _two_step(points: FloatArray, fold: NDArray[np.intp], model: FieldModel) -> Folded:
    each = {
        int(one): two_step(points[:, fold != one], model.cross).theta for one in np.unique(fold)
    }
    return two_step(points, model.cross).theta, each, 2


def _numeric(points: FloatArray, fold: NDArray[np.intp], model: FieldModel) -> Folded:
    """Without a fold the minimum moves by one Newton step, which is all that is taken."""
    whole, iterations = numeric(points, two_step(points, model.cross), model.cross)
    now = rows(whole, points, 0.0)
    error = errors(whole, points)
    slope = model.basis.T @ (now.slope * (error / np.where(now.distance == 0, 1, now.distance)))
    each = {}
    for one in np.unique(fold):
        others = fold != one
        part = slope[:, others]
        step = np.linalg.lstsq(part @ part.T, part @ error[others], rcond=None)[0]
        each[int(one)] = whole - model.basis @ step
    return whole, each, iterations


_WAYS: dict[str, Callable[[FloatArray, NDArray[np.intp], FieldModel], Folded]] = {
    "algebraic": _algebraic,
    "two-step": _two_step,
    "numeric": _numeric,
}


def _per_area(
    error: FloatArray, areas: NDArray[np.intp], found: NDArray[np.intp]
) -> tuple[FloatArray, FloatArray]:
    """Mean and mean square in each of the areas ``found``, shape (k,) each."""
    count = np.maximum(np.bincount(areas, minlength=100)[found], 1)
    mean = np.bincount(areas, error, 100)[found] / count
    return mean, np.bincount(areas, error**2, 100)[found] / count


_NO_CONVERGENCE = (
    "the fit of the magnetometer does not converge: the readings are not of one constant field. "
    "Measure again, away from iron, magnets and loudspeakers"
)
