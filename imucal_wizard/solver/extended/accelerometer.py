"""The accelerometer with effects: fitted, judged on what it has not seen, reported."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.effects.effect import Effect
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.accelerometer import AccelerometerFit
from imucal_wizard.solver.carried import names_of
from imucal_wizard.solver.directions import unit_vectors
from imucal_wizard.solver.extended.hold_data import (
    BASE,
    HoldData,
    carried_base,
    checked_base,
)
from imucal_wizard.solver.extended.hold_fit import HoldFit, fit_holds, held_out, later
from imucal_wizard.solver.extended.hold_model import HoldPoint, levers
from imucal_wizard.solver.extended.knowledge import size_covariance, theta_covariance
from imucal_wizard.solver.extended.linear import Linear, RowInfo
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.solver.extended.sizes import size_errors, size_parameters
from imucal_wizard.solver.extended.terms import Term, columns_of
from imucal_wizard.solver.parameters import triangular_parameters, unit_of, with_errors
from imucal_wizard.solver.result import Parameter, SensorFit
from imucal_wizard.solver.rms import root_mean_square
from imucal_wizard.solver.start import errors_before

NAMES = ("bias_x", "bias_y", "bias_z", "xx", "xy", "xz", "yy", "yz", "zz")
"""Of the nine base parameters: biases and M's six entries."""
SMALLEST_DOUBT = 1e-12
"""Share of the largest variance below which a doubt is rounding."""


def fit_accelerometer_with(
    data: HoldData, terms: Sequence[Term] = (), base: Sequence[str] = BASE
) -> Extended:
    """Fit ``|M (y − b) − ε| = g`` with a prior on the size of each effect.

    Args:
        data: see ``hold_data``.
        terms: the effects.
        base: which terms of the base model are fitted; the others stay at their nominal value.

    Raises:
        DataError: the fit does not converge.
        UsageError: a term that the base does not have, or an effect of another sensor.
    """
    base = checked_base(base)
    fit = fit_holds(data, terms, base)
    out, late = held_out(fit), later(fit)
    together = fit.free.model.terms
    covariance = size_covariance(fit)
    sensor = _sensor_fit(fit, carried_base(data.task.carried, base), out)
    return Extended(
        fit=sensor,
        base=base,
        terms=tuple(terms),
        sizes=together.split(fit.point.sizes[0]),
        errors=together.split(size_errors(together, covariance)),
        covariance=covariance,
        linear=_linear(fit),
        rms_late=None if late is None else root_mean_square(late),
        late=late,
        accelerometer=_for_gyroscope(fit, sensor),
    )


def _sensor_fit(fit: HoldFit, base: tuple[str, ...], out: FloatArray | None) -> SensorFit:
    data, problem = fit.data, fit.data.task.problem
    matrix, bias = problem.matrix_and_bias(fit.point.theta[0])
    return SensorFit(
        sensor="accelerometer",
        model=(*base, *(term.name for term in fit.free.model.terms.terms)),
        method="map",
        frame="own",
        matrix=matrix,
        bias=bias,
        bias_unit=data.unit,
        parameters=(*_base_parameters(fit, base), *_size_parameters(fit)),
        unit="m/s^2",
        rms_before=root_mean_square(errors_before(problem, data.unit)),
        rms_fitted=root_mean_square(fit.residual),
        rms_held_out=None if out is None else root_mean_square(out),
        floor=root_mean_square(np.sqrt(data.noise)),
        residuals=fit.residual,
        held_out=out,
        covariance=problem.covariance(theta_covariance(fit)),
        warnings=(data.task.carried.reason,) if data.task.carried.reason else (),
        degrees_of_freedom=int(fit.freedom),
    )


def _size_parameters(fit: HoldFit) -> tuple[Parameter, ...]:
    terms = fit.free.model.terms
    return size_parameters(terms, fit.point.sizes[0], size_errors(terms, size_covariance(fit)))


def _base_parameters(fit: HoldFit, base: tuple[str, ...]) -> tuple[Parameter, ...]:
    problem, unit = fit.data.task.problem, fit.data.unit
    fixed = list(fit.data.task.carried.dropped)
    names = {
        "bias": [f"bias_{axis}" for axis in "xyz"],
        "scale": [f"sensitivity_{axis}" for axis in "xyz"],
        "non-orthogonality": ["theta_yz", "theta_zy", "theta_zx"],
    }
    for term in BASE:
        fixed += [] if term in base else names[term]
    return with_errors(
        lambda theta: triangular_parameters(*problem.matrix_and_bias(theta)),
        fit.point.theta[0],
        theta_covariance(fit),
        lambda name: unit_of(name, unit, "m/s^2"),
        tuple(fixed),
    )


def _linear(fit: HoldFit) -> Linear:
    data, model, point = fit.data, fit.free.model, fit.point
    sigma = np.sqrt(fit.variance)
    lever = levers(model, point)[0]
    here = model.at(point.force)

    def lift(effect: Effect, variant: float | None) -> FloatArray:
        columns = columns_of(Term(effect, variant), "accelerometer", here)
        return np.asarray(-np.einsum("ni,nip->np", lever, columns) / sigma[:, None])

    return Linear(
        residual=fit.residual / sigma,
        base=fit.columns,
        precision=fit.free.precision,
        names=(*names_of(fit.free.basis, NAMES), *model.terms.names),
        rows=tuple(RowInfo("hold", index) for index in range(len(sigma))),
        groups=data.task.labels,
        visits=data.visits,
        order=data.circumstances.time,
        sigma=sigma,
        floor=np.sqrt(data.noise),
        lift_of=lift,
    )


def _for_gyroscope(fit: HoldFit, sensor: SensorFit) -> AccelerometerFit:
    gravity = fit.data.gravity
    return AccelerometerFit(
        sensor,
        unit_vectors(fit.point.force[0]),
        fit.data.task.labels,
        fit.variance / gravity**2,
        _up_doubt(fit),
    )


def _up_doubt(fit: HoldFit) -> FloatArray | None:
    """Change of each hold's up for one standard deviation of each principal doubt, (n, 3, k)."""
    if fit.covariance is None or not len(fit.covariance):
        return None
    scale = np.sqrt(np.diag(fit.covariance))
    scale = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(fit.covariance / np.outer(scale, scale))
    seen = values > SMALLEST_DOUBT * values[-1]
    steps = (scale[:, None] * vectors[:, seen] * np.sqrt(values[seen])).T
    both = HoldPoint(
        np.repeat(fit.point.theta, 2 * len(steps), axis=0),
        np.repeat(fit.point.sizes, 2 * len(steps), axis=0),
        np.repeat(fit.point.force, 2 * len(steps), axis=0),
        np.repeat(fit.point.residual, 2 * len(steps), axis=0),
    )
    up = unit_vectors(fit.free.moved(both, np.concatenate([steps, -steps])).force)
    return np.asarray(np.moveaxis(0.5 * (up[: len(steps)] - up[len(steps) :]), 0, 2))
