"""Standard errors that know of a setting which was itself found from the data."""

from dataclasses import replace

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.solver.result import Parameter


def with_doubt(fit: Extended, moved: Extended, steps: float) -> Extended:
    """The fit with the doubt about one more unknown in its standard errors.

    To first order ``Var = Var(known setting) + d dᵀ``, ``d`` what the parameters move by when the
    setting moves by one standard deviation.

    Args:
        fit: with the likeliest setting.
        moved: the same model with the setting moved.
        steps: standard deviations that it was moved by.
    """
    if fit.covariance is None:
        return fit
    change = (_flat(moved) - _flat(fit)) / steps
    covariance = fit.covariance + np.outer(change, change)
    ends = np.cumsum([len(size) for size in fit.sizes])[:-1]
    values = {one.name: one.value for one in moved.fit.parameters}
    parameters = tuple(_wider(one, values[one.name], steps) for one in fit.fit.parameters)
    return replace(
        fit,
        fit=replace(fit.fit, parameters=parameters),
        errors=tuple(np.split(np.sqrt(np.diag(covariance)), ends)),
        covariance=covariance,
    )


def _flat(fit: Extended) -> FloatArray:
    return np.concatenate([np.zeros(0), *fit.sizes])


def _wider(one: Parameter, moved: float, steps: float) -> Parameter:
    if one.standard_error is None:
        return one
    wider = float(np.hypot(one.standard_error, (moved - one.value) / steps))
    return replace(one, standard_error=wider)
