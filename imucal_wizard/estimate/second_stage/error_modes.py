"""Error modes: the principal directions in which two calibrations may be wrong.

A calibration with covariance C is its estimate plus ``Σ d_k ξ_k``, the ξ_k independent and of
variance one, with ``C = Σ d_k d_kᵀ``; each d_k is an error mode of one standard deviation. A result
that rests on two calibrations (the alignment of two sensors, a heading) moves with all their modes.
"""

import numpy as np

from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.ellipsoid.surface import ELLIPSOID_SIZE, symmetric_matrix
from imucal_wizard.estimate.magnitude import TRIANGLE, up_changes
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.estimate.split import principal_steps
from imucal_wizard.model.identifiability import ANGLES, basis_of, undetermined_modes


@dataclass(frozen=True, eq=False)
class ErrorModes:
    """Of the two calibrations that the second stage rests on.

    Attributes:
        magnetometer: see ``of_magnetometer``, shape (9, k).
        accelerometer: see ``of_accelerometer``, shape (9, l).
    """

    magnetometer: FloatArray
    accelerometer: FloatArray

    def of_field(self, fit: SensorFit, field: FloatArray) -> FloatArray:
        """Change of the unit field with each, shape (n, 3, k), from the corrected one, (n, 3)."""
        at, out = unit_vectors(field), np.zeros((*field.shape, self.magnetometer.shape[1]))
        for place, mode in enumerate(self.magnetometer.T):
            out[:, :, place] = unit_vectors(field_moved(fit, field, mode)) - at
        return out

    def of_up(self, up: FloatArray) -> FloatArray:
        """Change of unit up with each, shape (n, 3, l), from up, (n, 3)."""
        return up_changes(up, self.accelerometer)


def of_magnetometer(fit: SensorFit) -> FloatArray:
    """Error modes of hard and soft iron, b and M's six entries, shape (9, k)."""
    if fit.covariance is None:
        return np.zeros((ELLIPSOID_SIZE, 0))
    return principal_steps(fit.covariance)


def field_moved(fit: SensorFit, field: FloatArray, mode: FloatArray) -> FloatArray:
    """Corrected field with a calibration that is wrong so, both of shape (n, 3).

    Args:
        fit: the magnetometer in its own frame.
        field: corrected by it, shape (n, 3).
        mode: change of b and M's six entries, shape (9,).
    """
    matrix = fit.matrix + symmetric_matrix(mode)
    offsets = field @ np.linalg.inv(fit.matrix).T - mode[:3]
    return np.asarray(offsets @ matrix.T)


def of_accelerometer(fit: SensorFit, up: FloatArray, gravity: float) -> FloatArray:
    """Error modes of up, in units of gravity and rad, shape (9, k).

    They are three biases and six entries of a triangular matrix that changes what is corrected.
    A parameter that the fit leaves at its nominal value counts with its usual size, together with
    the shift that it causes in the fitted parameters at these still positions.

    Args:
        fit: the accelerometer's.
        up: unit up in each still position that it was fitted to, shape (n, 3).
        gravity: m/s².
    """
    basis = basis_of(_free(fit))
    noise = np.zeros((ELLIPSOID_SIZE, 0))
    if fit.covariance is not None:
        change = _of_corrected(fit, gravity)
        noise = principal_steps(change @ fit.covariance @ change.T)
        if np.diag(fit.covariance).all():
            return noise  # what stays nominal is part of it
        if noise.shape[1]:
            basis = noise
    return np.concatenate([noise, undetermined_modes(up, basis)], axis=1)


def _free(fit: SensorFit) -> tuple[int, ...]:
    """Places of the nine parameters that are fitted, by the names of those that are not."""
    left = {one.name for one in fit.parameters if not one.carried}
    return tuple(place for place in range(ELLIPSOID_SIZE) if ANGLES.get(place) not in left)


def _of_corrected(fit: SensorFit, gravity: float) -> FloatArray:
    """From changes of b and M to those of what is corrected: ``−M δb/g``, ``δM M⁻¹``, (9, 9)."""
    inverse = np.linalg.inv(fit.matrix)
    out = np.zeros((ELLIPSOID_SIZE, ELLIPSOID_SIZE))
    out[:3, :3] = -fit.matrix / gravity
    for place, (i, j) in enumerate(TRIANGLE, 3):
        change = np.zeros((3, 3))
        change[i] = inverse[j]
        out[3:, place] = [change[k, m] for k, m in TRIANGLE]
    return out
