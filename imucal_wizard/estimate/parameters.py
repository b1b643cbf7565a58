"""Conversion of matrix and bias to named parameters with standard errors.

The body frame is Q's: the sensor's x axis alone reads an input along x, its x and y axes one along
y. Then
``M = K·T`` (Q, eq. 3–8) with

    M_xx = k_x      M_xy = k_x θ_yz      M_xz = k_x (θ_yz θ_zx − θ_zy)
    M_yy = k_y      M_yz = k_y θ_zx      M_zz = k_z

``k`` multiplies the reading (a correction); the sensitivity, reading per input, is ``1/k``.
"""

from collections.abc import Callable

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import COUNT
from imucal_wizard.estimate.result import Parameter, SensorFit
from imucal_wizard.model.nominal_gains import nominal_of


def triangular_parameters(matrix: FloatArray, bias: FloatArray) -> dict[str, float]:
    """Biases, sensitivities and angles of an upper-triangular calibration."""
    yz = matrix[0, 1] / matrix[0, 0]
    zx = matrix[1, 2] / matrix[1, 1]
    zy = yz * zx - matrix[0, 2] / matrix[0, 0]
    return {
        **{f"bias_{axis}": float(bias[i]) for i, axis in enumerate(AXES)},
        **{f"sensitivity_{axis}": float(1.0 / matrix[i, i]) for i, axis in enumerate(AXES)},
        "theta_yz": float(yz),
        "theta_zy": float(zy),
        "theta_zx": float(zx),
    }


def nominal_angle(matrix: FloatArray) -> FloatArray:
    """The matrix with the angle between x and z at its nominal value, zero.

    ``M_xz`` is then the product of the others and not zero (Q, eq. 8).
    """
    out = matrix.copy()
    out[0, 2] = matrix[0, 1] * matrix[1, 2] / matrix[1, 1]
    return out


def full_parameters(matrix: FloatArray, bias: FloatArray) -> dict[str, float]:
    """Biases, sensitivities and the six cross-axis gains ``M_ij / M_jj`` of a full matrix.

    A cross-axis gain is the share of the rate read about axis j that the correction adds about axis
    i, rad: the opposite of the share of a rate about j that appears about i.

    Raises:
        DataError: a scale is zero.
    """
    if (np.diag(matrix) == 0.0).any():
        raise DataError("an axis has no scale at all: check that its column is connected")
    values = {f"bias_{axis}": float(bias[i]) for i, axis in enumerate(AXES)}
    values |= {f"sensitivity_{axis}": float(1.0 / matrix[i, i]) for i, axis in enumerate(AXES)}
    for i, row in enumerate(AXES):
        for j, column in enumerate(AXES):
            if i != j:
                values[f"cross_{row}{column}"] = float(matrix[i, j] / matrix[j, j])
    return values


def base_parameters(
    matrix: FloatArray, bias: FloatArray, unit: str, *, own_frame: bool
) -> dict[str, float]:
    """The parameters of an accelerometer or gyroscope.

    Args:
        matrix: M, shape (3, 3); upper triangular in the sensor's own frame.
        bias: shape (3,).
        unit: of the readings.
        own_frame: whether the frame is the sensor's own.

    Raises:
        DataError: a scale is zero.
    """
    if own_frame:
        return triangular_parameters(matrix, bias)
    return full_parameters(nominal_of(matrix, unit != COUNT).ordered(matrix), bias)


def unit_of(name: str, unit: str, of: str) -> str:
    """Unit of a parameter by its name, for readings in ``unit`` of an input in ``of``."""
    if name.startswith("bias"):
        return unit
    if name.startswith("sensitivity"):
        return f"{unit}/({of})" if unit == COUNT else "1"
    return "rad"


def with_errors(
    convert: Callable[[FloatArray], dict[str, float]],
    theta: FloatArray,
    covariance: FloatArray | None,
    units: Callable[[str], str],
    dropped: tuple[str, ...],
    repeats: FloatArray | None = None,
) -> tuple[Parameter, ...]:
    """Parameters with standard errors carried over from the covariance of ``theta``.

    The derivative of the conversion is taken by central differences at a step of a thousandth of
    each standard deviation, where its curvature is invisible, but not below what rounding allows.

    Args:
        convert: from the solver's parameters, shape (n,), to named values.
        theta: the solver's parameters.
        covariance: of ``theta``, or None when nothing is left over to judge it by.
        units: unit of a parameter by name.
        dropped: names of parameters that the data do not determine.
        repeats: covariance of ``theta`` from the repeats instead of the residual, or None.
    """
    values = convert(theta)
    errors: dict[str, float | None] = dict.fromkeys(values)
    by_repeats = errors
    if covariance is not None:
        slopes = _slopes(convert, theta, np.sqrt(np.diag(covariance)))
        errors = dict(zip(values, _spread(slopes, covariance), strict=True))
        if repeats is not None:
            by_repeats = dict(zip(values, _spread(slopes, repeats), strict=True))
    parameters = []
    for name, value in values.items():
        if name in dropped:
            value = round(value, 12) + 0.0  # nominal but for rounding, and never −0
        kept = name not in dropped
        error, repeated = (errors[name], by_repeats[name]) if kept else (None, None)
        parameters.append(Parameter(name, value, error, units(name), kept, repeated))
    return tuple(parameters)


def converted_covariance(
    convert: Callable[[FloatArray], dict[str, float]], theta: FloatArray, covariance: FloatArray
) -> FloatArray:
    """Covariance of the values that ``with_errors`` gives the standard errors of, shape (p, p)."""
    slopes = _slopes(convert, theta, np.sqrt(np.diag(covariance)))
    return np.asarray(slopes @ covariance @ slopes.T)


def covariance_of(fit: SensorFit) -> FloatArray | None:
    """Covariance of all parameters in their order, sizes of effects included, shape (n, n).

    The standard errors are those of the parameters, so that only the correlations are new; one that
    the data do not determine has zeros. None where there are no standard errors.

    Args:
        fit: with or without effects.
    """
    errors = np.array([one.standard_error or 0.0 for one in fit.parameters])
    if not errors.any():
        return None
    found, count = fit.minimum, len(fit.parameters)
    correlations = np.eye(count)
    if fit.parameter_covariance is not None:  # parameters found beside a method come after its own
        own = slice(0, len(fit.parameter_covariance))
        correlations[own, own] = _correlations(fit.parameter_covariance)
    joint = None if found is None else found.covariance()
    if found is not None and joint is not None:
        experiment, sizes = found.experiment, found.sizes
        basis, free = found.directions.columns, slice(0, sizes.start)
        entries = basis @ joint[free, free] @ basis.T

        def convert(theta: FloatArray) -> dict[str, float]:
            return experiment.named(theta[:9].reshape(3, 3), theta[9:])

        scale = np.sqrt(np.maximum(np.diag(entries), 0.0))
        slopes = _slopes(convert, found.calibration.entries, scale) @ basis
        # settled parameters stand between those of the base and the sizes
        base, effects = len(slopes), sizes.stop - sizes.start
        into = np.zeros((count, sizes.stop))
        into[:base, free] = slopes
        into[count - effects :, sizes] = np.eye(effects)
        together = into @ joint[: sizes.stop, : sizes.stop] @ into.T
        correlations = _correlations(together)
    return np.asarray(correlations * np.outer(errors, errors))


def _correlations(covariance: FloatArray) -> FloatArray:
    """Of parameters, none of which without an error has any."""
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    known = spread > 0.0
    spread = np.where(known, spread, 1.0)
    found = np.where(np.outer(known, known), covariance / np.outer(spread, spread), 0.0)
    np.fill_diagonal(found, 1.0)
    return found


def _spread(slopes: FloatArray, covariance: FloatArray) -> list[float]:
    """Standard errors of values with these slopes."""
    variances = np.einsum("ij,jk,ik->i", slopes, covariance, slopes)
    return [float(value) for value in np.sqrt(np.maximum(variances, 0.0))]


def _slopes(
    convert: Callable[[FloatArray], dict[str, float]], theta: FloatArray, scale: FloatArray
) -> FloatArray:
    """Derivative of the converted values, shape (values, parameters)."""
    columns = np.zeros((len(convert(theta)), len(theta)))
    for index in np.flatnonzero(scale):
        step = np.zeros_like(theta)
        step[index] = max(1e-3 * scale[index], 1e-8 * abs(theta[index]))
        above = np.array(list(convert(theta + step).values()))
        below = np.array(list(convert(theta - step).values()))
        columns[:, index] = (above - below) / (2.0 * step[index])
    return columns
