"""Standard errors of added effects where the bias wanders: its path looks like a slow effect.

The fit takes the noise of different holds for independent. With ``ω² K`` the covariance that a
wandering bias adds (see ``noise``), the estimate ``C Aᵀ r`` has the variance ``C + ω² C Aᵀ K A C``.
"""

from dataclasses import replace

import numpy as np

from imucal_wizard.bench.evidence import Jury
from imucal_wizard.bench.hypotheses import nothing
from imucal_wizard.bench.misfit import Misfit
from imucal_wizard.bench.noise import SQUARES, frame_of, walk_of
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.solver.extended.terms import Terms
from imucal_wizard.solver.result import Parameter


def with_wander(fit: Extended, misfit: Misfit) -> Extended:
    """The fit with the wandering of the bias in the standard errors of its effects.

    Args:
        fit: the fit.
        misfit: what it leaves.
    """
    names = Terms(fit.fit.sensor, fit.terms).names
    if fit.covariance is None or not names:
        return fit
    linear = fit.linear
    normal = linear.base.T @ linear.base + np.diag(linear.precision)
    places = [linear.names.index(name) for name in names]
    estimate = np.linalg.pinv(normal, hermitian=True)[places] @ linear.base.T
    estimate = estimate * (linear.floor / linear.sigma)
    added = _wander(misfit) * (estimate @ walk_of(misfit)) @ estimate.T
    wider = np.sqrt(np.diag(fit.covariance) + np.diag(added))
    errors = dict(zip(names, wider, strict=True))
    ends = np.cumsum([len(size) for size in fit.sizes])[:-1]
    parameters = tuple(_wider(one, errors.get(one.name)) for one in fit.fit.parameters)
    return replace(
        fit,
        fit=replace(fit.fit, parameters=parameters),
        errors=tuple(np.split(wider, ends)),
        covariance=fit.covariance + added,
    )


def _wander(misfit: Misfit) -> float:
    """Expected square of the wander, in units of the noise within the holds, by what is left."""
    frame = frame_of(misfit)
    jury = Jury(frame, [nothing(frame)])
    weight = jury.log_noise(frame.across.T @ misfit.residual)
    share: FloatArray = np.exp(weight - weight.max())
    return float(np.array(frame.wanders) ** 2 @ share @ SQUARES / share.sum())


def _wider(one: Parameter, error: float | None) -> Parameter:
    if error is None or one.standard_error is None:
        return one
    return replace(one, standard_error=float(error))
