"""The gyroscope with effects: fitted, judged on what it has not seen, reported."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.effects.effect import Effect
from imucal_wizard.readings import FloatArray, IntArray
from imucal_wizard.solver.closure import BIAS, SIZE
from imucal_wizard.solver.extended.hold_data import BASE, checked_base
from imucal_wizard.solver.extended.levers import coarse_levers, effect_columns
from imucal_wizard.solver.extended.linear import Linear, RowInfo
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.solver.extended.sizes import size_errors, size_parameters
from imucal_wizard.solver.extended.terms import Term, Terms
from imucal_wizard.solver.extended.turn_data import TurnData
from imucal_wizard.solver.extended.turn_fit import TurnFit, fit_turns, stacked
from imucal_wizard.solver.extended.turn_judging import (
    held_out_rotations,
    later,
    row_times,
    witnesses,
)
from imucal_wizard.solver.extended.turn_model import point_at
from imucal_wizard.solver.parameters import full_parameters, unit_of, with_errors
from imucal_wizard.solver.result import Parameter, SensorFit
from imucal_wizard.solver.rms import root_mean_square

AXES = "xyz"


def fit_gyroscope_with(
    data: TurnData, terms: Sequence[Term] = (), base: Sequence[str] = BASE
) -> Extended:
    """Fit rotations and still means together, with a prior on the size of each effect.

    Args:
        data: see ``turn_data``.
        terms: the effects.
        base: which terms of the base model are fitted; the others stay at their nominal value.

    Raises:
        DataError: the fit does not converge.
        UsageError: a term that the base does not have, or an effect of another sensor.
    """
    base = checked_base(base)
    fit = fit_turns(data, terms, base)
    covariance = fit.found.known(slice(len(fit.free), fit.model))
    late = later(fit)
    return Extended(
        fit=_sensor_fit(fit, base, held_out_rotations(fit)),
        base=base,
        terms=tuple(terms),
        sizes=fit.terms.split(fit.point.sizes),
        errors=fit.terms.split(size_errors(fit.terms, covariance)),
        covariance=covariance,
        linear=_linear(fit),
        rms_late=None if late is None else root_mean_square(late),
        late=None if late is None else np.linalg.norm(late, axis=1),
        witnesses=witnesses(fit) if terms else None,
    )


def _sensor_fit(fit: TurnFit, base: tuple[str, ...], out: FloatArray | None) -> SensorFit:
    data, point = fit.data, fit.point
    return SensorFit(
        sensor="gyroscope",
        model=(*base, *(term.name for term in fit.terms.terms)),
        method="map",
        frame="accelerometer",
        matrix=point.matrix,
        bias=point.bias,
        bias_unit=data.unit,
        parameters=(*_base_parameters(fit), *_size_parameters(fit)),
        unit="rad",
        rms_before=root_mean_square(_before(data)),
        rms_fitted=root_mean_square(point.closure),
        rms_held_out=None if out is None else root_mean_square(out),
        floor=float(np.sqrt(2.0 * data.closing_noise.mean())),
        residuals=np.linalg.norm(point.closure, axis=1),
        held_out=None if out is None else np.linalg.norm(out, axis=1),
        covariance=_base_covariance(fit),
        degrees_of_freedom=max(int(fit.found.freedom.min()), 0),
    )


def _before(data: TurnData) -> FloatArray:
    """Closure with the nominal conversion only; of counts, with one common scale and the bias."""
    return point_at(data, Terms("gyroscope", ()), *data.begin(()), np.zeros(0)).closure


def _base_covariance(fit: TurnFit) -> FloatArray | None:
    """Of M's nine entries by rows and the biases, shape (12, 12).

    As in the plain fit with what slow noise may do to the biases, which no residual shows.
    """
    free = fit.found.known(slice(0, len(fit.free)))
    if free is None:
        return None
    covariance = np.zeros((SIZE, SIZE))
    covariance[np.ix_(fit.free, fit.free)] = free
    biases = [index for index in fit.free if index >= BIAS.start]
    covariance[biases, biases] += fit.data.slow[[index - BIAS.start for index in biases]]
    return covariance


def _base_parameters(fit: TurnFit) -> tuple[Parameter, ...]:
    data = fit.data
    return with_errors(
        lambda t: full_parameters(data.nominal.ordered(t[:9].reshape(3, 3)), t[9:]),
        np.concatenate([fit.point.matrix.ravel(), fit.point.bias]),
        _base_covariance(fit),
        lambda name: unit_of(name, data.unit, "rad/s"),
        tuple(_name(data, index) for index in range(SIZE) if index not in fit.free),
    )


def _name(data: TurnData, index: int) -> str:
    """Name of one of the twelve base parameters."""
    return data.nominal.parameter(index) if index < 9 else f"bias_{AXES[index - 9]}"


def _size_parameters(fit: TurnFit) -> tuple[Parameter, ...]:
    covariance = fit.found.known(slice(len(fit.free), fit.model))
    return size_parameters(fit.terms, fit.point.sizes, size_errors(fit.terms, covariance))


def _linear(fit: TurnFit) -> Linear:
    data, point, basis = fit.data, fit.point, fit.basis
    sigma = np.sqrt(fit.found.variance)
    lever = coarse_levers(data, point)

    def lift(effect: Effect, variant: float | None) -> FloatArray:
        columns = stacked(basis, *effect_columns(data, point, Term(effect, variant), lever))
        return np.asarray(columns / sigma[:, None])

    doubts = data.before_doubt.shape[2]
    return Linear(
        residual=fit.system.residual / sigma,
        base=fit.system.columns / sigma[:, None],
        precision=fit.found.precision,
        names=(
            *(_name(data, index) for index in fit.free),
            *fit.terms.names,
            *(f"accelerometer_{k}" for k in range(doubts)),
        ),
        rows=_rows(data),
        groups=_groups(data),
        visits=np.concatenate([np.repeat(data.visits, 3), np.full(2 * len(data), -1)]),
        order=row_times(data),
        sigma=sigma,
        floor=np.sqrt(fit.system.known),
        lift_of=lift,
    )


def _rows(data: TurnData) -> tuple[RowInfo, ...]:
    still = [RowInfo("still", int(hold), axis) for hold in data.still_rows for axis in range(3)]
    closing = [RowInfo("rotation", int(one), k) for one in data.rotations for k in range(2)]
    return (*still, *closing)


def _groups(data: TurnData) -> IntArray:
    """Rotations by their own number, still means by direction after them."""
    return np.concatenate(
        [np.repeat(len(data) + data.labels, 3), np.repeat(np.arange(len(data)), 2)]
    ).astype(np.int64)
