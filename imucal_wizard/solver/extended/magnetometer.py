"""The magnetometer with effects: fitted, judged on what it has not seen, reported."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.effects.effect import Effect
from imucal_wizard.ellipsoid.shape import TRIANGLE
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.carried import names_of
from imucal_wizard.solver.directions import unit_vectors
from imucal_wizard.solver.extended.field_data import FIELD_BASE, FieldData
from imucal_wizard.solver.extended.field_fit import (
    FieldFit,
    fit_field,
    groups_of,
    held_out,
    later,
)
from imucal_wizard.solver.extended.field_model import (
    SENSOR,
    effect_columns,
    levers,
    point_at,
    shown,
)
from imucal_wizard.solver.extended.hold_data import checked_base
from imucal_wizard.solver.extended.linear import Linear, RowInfo, Seen
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.solver.extended.sizes import size_errors, size_parameters
from imucal_wizard.solver.extended.terms import Term, Terms
from imucal_wizard.solver.magnetometer.parameters import AXES, unit_of
from imucal_wizard.solver.result import Parameter, SensorFit
from imucal_wizard.solver.rms import root_mean_square
from imucal_wizard.units import COUNT

BIASES = tuple(f"bias_{axis}" for axis in AXES)
ENTRIES = tuple(f"soft_iron_{AXES[i]}{AXES[j]}" for i, j in TRIANGLE)
"""Names of the nine parameters: b, then M."""


def fit_magnetometer_with(
    data: FieldData, terms: Sequence[Term] = (), base: Sequence[str] = FIELD_BASE
) -> Extended:
    """Fit magnitudes and dips together, with a prior on the size of each effect.

    Args:
        data: see ``field_data``.
        terms: the effects.
        base: which terms of the base model are fitted; one scale always is.

    Raises:
        DataError: the fit does not converge.
        UsageError: a term that the base does not have, or an effect of another sensor.
    """
    base = checked_base(base, FIELD_BASE)
    fit = fit_field(data, terms, base)
    covariance = fit.found.known(fit.sizes)
    late, out = later(fit), held_out(fit)
    return Extended(
        fit=_sensor_fit(fit, base, covariance, out),
        base=base,
        terms=tuple(terms),
        sizes=fit.terms.split(fit.point.sizes),
        errors=fit.terms.split(size_errors(fit.terms, covariance)),
        covariance=covariance,
        linear=_linear(fit),
        rms_late=None if late is None else root_mean_square(late),
        late=late,
    )


def _sensor_fit(
    fit: FieldFit, base: tuple[str, ...], sizes: FloatArray | None, out: FloatArray | None
) -> SensorFit:
    data, point, terms = fit.data, fit.point, fit.terms
    nominal = data.gain * np.eye(3), np.zeros(3) if data.unit != COUNT else data.start[1]
    before = point_at(data, Terms(SENSOR, ()), *nominal, np.zeros(0)).residual
    residual = fit.system.residual
    covariance = _base_covariance(fit)
    return SensorFit(
        sensor=SENSOR,
        model=(*base, *(term.name for term in terms.terms)),
        method="map",
        frame="own",
        matrix=point.matrix,
        bias=point.bias,
        bias_unit=data.unit,
        parameters=(
            *_base_parameters(fit, covariance),
            *size_parameters(terms, point.sizes, size_errors(terms, sizes)),
        ),
        unit="uT",
        rms_before=root_mean_square(before),
        rms_fitted=root_mean_square(residual),
        rms_held_out=None if out is None else root_mean_square(out),
        floor=root_mean_square(np.sqrt(fit.system.known)),
        residuals=residual,
        held_out=out,
        covariance=covariance,
        degrees_of_freedom=max(int(fit.found.freedom.min()), 0),
    )


def _base_covariance(fit: FieldFit) -> FloatArray | None:
    """Of b and M's six entries, reading units and µT per reading, shape (9, 9)."""
    free = fit.found.known(slice(0, fit.basis.shape[1]))
    if free is None:
        return None
    gain = fit.data.gain
    scale = np.concatenate([np.full(3, 1.0 / gain), np.full(6, gain)])[:, None] * fit.basis
    return np.asarray(scale @ free @ scale.T)


def _base_parameters(fit: FieldFit, covariance: FloatArray | None) -> tuple[Parameter, ...]:
    matrix, unit = fit.point.matrix, fit.data.unit
    values = [*fit.point.bias, *(matrix[i, j] for i, j in TRIANGLE)]
    carried = (fit.basis != 0.0).any(axis=1).tolist()
    units = [unit_of(name, unit, fit.data.field) for name in (*BIASES, *ENTRIES)]
    errors = [None] * 9 if covariance is None else [*np.sqrt(np.diag(covariance))]
    return tuple(
        Parameter(name, float(value), float(e) if own and e is not None else None, word, own)
        for name, value, e, word, own in zip(
            (*BIASES, *ENTRIES), values, errors, units, carried, strict=True
        )
    )


def _linear(fit: FieldFit) -> Linear:
    data, point = fit.data, fit.point
    sigma, lever = np.sqrt(fit.found.variance), levers(data, point)

    def lift(effect: Effect, variant: float | None) -> FloatArray:
        return effect_columns(data, point, lever, effect, variant) / sigma[:, None]

    field = data.circumstances.magnetic
    visits = np.concatenate([data.visits, data.visits.max(initial=-1) + 1 + data.dips.hold])
    return Linear(
        residual=fit.system.residual / sigma,
        base=fit.system.columns / sigma[:, None],
        precision=fit.found.precision,
        names=(*names_of(fit.basis, (*BIASES, *ENTRIES)), *fit.terms.names, *_place_names(fit)),
        rows=(
            *(RowInfo("field", index) for index in range(len(data))),
            *(RowInfo("dip", len(data) + index, 1) for index in range(len(data.dips))),
        ),
        groups=groups_of(data),
        visits=visits,
        order=data.circumstances.time,
        sigma=sigma,
        floor=np.sqrt(fit.system.known),
        lift_of=lift,
        seen=Seen(unit_vectors(field), shown(data, lever)),
    )


def _place_names(fit: FieldFit) -> list[str]:
    count = fit.system.columns.shape[1] - fit.sizes.stop
    return ["dip", *(f"accelerometer_{k}" for k in range(count - 1))][:count]
