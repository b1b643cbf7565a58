"""A magnetometer's model in the accelerometer's frame, in which a calibration is used.

The bench works in the magnetometer's own axes: ``(1 + A) x = M (y − b) − ε`` with A the effect of
the misalignment. In the accelerometer's frame the field is ``T (M (y − b) − ε)`` with
``T = R₀ (1 + A)⁻¹``, R₀ being the nearest way in which the axes of one chip lie along those of the
other: ``T M`` is the matrix, ``T ε`` the error, and no misalignment is left.
"""

from dataclasses import replace

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.magnetometer.field_data import FieldData
from imucal_wizard.estimate.result import Parameter, SensorFit
from imucal_wizard.model.effect import BiasEffect, Circumstances
from imucal_wizard.model.effects.misalignment import Misalignment


def in_body_frame(model: SensorFit, data: FieldData, rotation: FloatArray | None) -> SensorFit:
    """The same model with its matrix and its effects in the accelerometer's frame.

    Args:
        model: in the magnetometer's own axes.
        data: what it was fitted to.
        rotation: from the magnetometer's frame to the accelerometer's by the second stage, for a
            model without the misalignment; None where that is not known.

    Returns:
        The model as it is where nothing is known of the rotation, or an effect of the user's own
        cannot be turned.
    """
    turn = _turn(model, data, rotation)
    turned = [term for term in model.terms if not isinstance(term.effect, Misalignment)]
    if turn is None or not all(isinstance(term.effect, BiasEffect) for term in turned):
        return model
    keep = [k for k, term in enumerate(model.terms) if term in turned]
    sizes = tuple(turn @ model.sizes[k] for k in keep)
    errors = tuple(np.sqrt(turn**2 @ model.size_errors[k] ** 2) for k in keep)
    found = {
        f"{model.terms[k].name}_{axis}": (float(size[i]), float(error[i]))
        for k, size, error in zip(keep, sizes, errors, strict=True)
        for i, axis in enumerate("xyz")
    }
    return replace(
        model,
        frame="accelerometer",
        matrix=turn @ model.matrix,
        covariance=None,
        parameters=tuple(_told(one, found.get(one.name)) for one in model.parameters),
        terms=tuple(turned),
        sizes=sizes,
        size_errors=errors,
    )


def _turn(model: SensorFit, data: FieldData, rotation: FloatArray | None) -> FloatArray | None:
    for term, size in zip(model.terms, model.sizes, strict=True):
        if isinstance(term.effect, Misalignment):
            slope = term.effect.columns(model.sensor, _unit_fields(), term.variant) @ size
            return np.asarray(data.dips.turn @ np.linalg.inv(np.eye(3) + slope.T))
    return rotation


def _unit_fields() -> Circumstances:
    """A field of one along each axis in turn."""
    nothing, unknown = np.full((3, 3), np.nan), np.full(3, np.nan)
    return Circumstances(
        nothing, nothing, unknown, np.zeros(3), nothing, unknown, magnetic=np.eye(3)
    )


def _told(one: Parameter, found: tuple[float, float] | None) -> Parameter:
    if found is None:
        return one
    error = found[1] if np.isfinite(found[1]) else None
    return replace(one, value=found[0], standard_error=error)
