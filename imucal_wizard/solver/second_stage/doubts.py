"""The ways in which two calibrations may be wrong, each by one standard deviation.

A calibration with covariance C is as good as its value plus ``Σ d_k ξ_k``, the ξ_k independent and
of variance one, with ``C = Σ d_k d_kᵀ``: its principal doubts. What follows from two calibrations
together (how one sensor lies in the other's frame, a heading) is moved by each of them.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.ellipsoid.shape import SIZE, TRIANGLE, symmetric_matrix
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.carried import ANGLES, TYPICAL_SIZE, basis_of, design
from imucal_wizard.solver.directions import unit_vectors
from imucal_wizard.solver.magnitude import triangle
from imucal_wizard.solver.result import SensorFit

SEEN = 1e-9
"""Share of the largest eigenvalue below which a covariance has none in that direction."""


@dataclass(frozen=True, eq=False)
class Doubts:
    """About the two calibrations that the second stage rests on.

    Attributes:
        magnetometer: see ``of_magnetometer``, shape (9, k).
        accelerometer: see ``of_accelerometer``, shape (9, l).
    """

    magnetometer: FloatArray
    accelerometer: FloatArray

    def of_field(self, fit: SensorFit, field: FloatArray) -> FloatArray:
        """Change of the unit field with each, shape (n, 3, k), from the corrected one, (n, 3)."""
        at, out = unit_vectors(field), np.zeros((*field.shape, self.magnetometer.shape[1]))
        for place, doubt in enumerate(self.magnetometer.T):
            out[:, :, place] = unit_vectors(field_moved(fit, field, doubt)) - at
        return out

    def of_up(self, up: FloatArray) -> FloatArray:
        """Change of unit up with each, shape (n, 3, l), from up, (n, 3)."""
        out = np.zeros((*up.shape, self.accelerometer.shape[1]))
        for place, doubt in enumerate(self.accelerometer.T):
            out[:, :, place] = unit_vectors(up_moved(up, doubt)) - up
        return out


def principal(covariance: FloatArray) -> FloatArray:
    """Principal doubts, the same for parameters in any units.

    Args:
        covariance: shape (p, p); zero for what is not fitted.

    Returns:
        Columns d, shape (p, k), with ``d dᵀ`` the covariance.
    """
    error = np.sqrt(np.diag(covariance))
    known = np.where(error > 0.0, error, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(known, known))
    seen = values > SEEN * max(float(values[-1]), 0.0)
    return np.asarray(error[:, None] * vectors[:, seen] * np.sqrt(values[seen]))


def of_magnetometer(fit: SensorFit) -> FloatArray:
    """Principal doubts about hard and soft iron, b and M's six entries, shape (9, k)."""
    return np.zeros((SIZE, 0)) if fit.covariance is None else principal(fit.covariance)


def field_moved(fit: SensorFit, field: FloatArray, doubt: FloatArray) -> FloatArray:
    """Corrected field with a calibration that is wrong so, both of shape (n, 3).

    Args:
        fit: the magnetometer in its own frame.
        field: corrected by it, shape (n, 3).
        doubt: change of b and M's six entries, shape (9,).
    """
    matrix = fit.matrix + symmetric_matrix(doubt)
    offsets = field @ np.linalg.inv(fit.matrix).T - doubt[:3]
    return np.asarray(offsets @ matrix.T)


def of_accelerometer(fit: SensorFit, up: FloatArray, gravity: float) -> FloatArray:
    """Doubts about up, in units of gravity and rad, shape (9, k).

    They are three biases and six entries of a triangular matrix that changes what is corrected.
    What the fit leaves at its nominal value, no sensor has: an angle of the usual size moves the
    others as the still positions would have made it.

    Args:
        fit: the accelerometer's.
        up: unit up in each still position that it was fitted to, shape (n, 3).
        gravity: m/s².
    """
    basis = basis_of(_free(fit))
    noise = np.zeros((SIZE, 0))
    if fit.covariance is not None:
        change = _of_corrected(fit, gravity)
        noise = principal(change @ fit.covariance @ change.T)
        if noise.shape[1]:
            basis = noise
    columns = design(up)
    taken = basis @ np.linalg.pinv(columns @ basis) @ columns
    nominal = (np.eye(SIZE) - taken) * TYPICAL_SIZE
    kept = np.linalg.norm(nominal, axis=0) > SEEN
    return np.concatenate([noise, nominal[:, kept]], axis=1)


def up_moved(up: FloatArray, doubt: FloatArray) -> FloatArray:
    """Up with an accelerometer that is wrong so: not of length one, both of shape (n, 3).

    Args:
        up: unit up, shape (n, 3).
        doubt: see ``of_accelerometer``, shape (9,).
    """
    return np.asarray(up + doubt[:3] + up @ triangle(doubt).T)


def _free(fit: SensorFit) -> tuple[int, ...]:
    """Places of the nine parameters that are fitted, by the names of those that are not."""
    left = {one.name for one in fit.parameters if not one.carried}
    return tuple(place for place in range(SIZE) if ANGLES.get(place) not in left)


def _of_corrected(fit: SensorFit, gravity: float) -> FloatArray:
    """From changes of b and M to those of what is corrected: ``−M δb/g``, ``δM M⁻¹``, (9, 9)."""
    inverse = np.linalg.inv(fit.matrix)
    out = np.zeros((SIZE, SIZE))
    out[:3, :3] = -fit.matrix / gravity
    for place, (i, j) in enumerate(TRIANGLE, 3):
        change = np.zeros((3, 3))
        change[i] = inverse[j]
        out[3:, place] = [change[k, m] for k, m in TRIANGLE]
    return out
