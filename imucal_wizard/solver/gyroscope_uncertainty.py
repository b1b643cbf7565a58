"""How well the gyroscope's parameters are known, and what each rotation does to them."""

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.closure import BIAS, MATRIX, SIZE, errors, frame_shift
from imucal_wizard.solver.rotation_data import Point, RotationData, freedom, inverted


def covariance_of(data: RotationData, point: Point) -> tuple[FloatArray, FloatArray]:
    """Covariance of the twelve parameters, and each one's share in what is not determined."""
    free = list(point.free)
    inverse, share = inverted(point.normal(data, point.columns(data))[0])
    covariance, blind = np.zeros((SIZE, SIZE)), np.zeros(SIZE)
    covariance[np.ix_(free, free)], blind[free] = inverse, share
    return covariance * np.outer(data.units, data.units), blind


def frame_covariance(data: RotationData, point: Point) -> FloatArray:
    """What the accelerometer's own uncertainty adds: it bends the frame of every rotation alike.

    Unlike the noise of single rotations it does not average out, and the closure hardly shows it.
    """
    covariance = np.zeros((SIZE, SIZE))
    shifts = frame_shift(data.turns, point.at)
    if shifts is None:
        return covariance
    columns = point.columns(data)
    inverse, _ = inverted(point.normal(data, columns)[0])
    sigma = point.closing * data.spread[:, None, None]
    moved = np.einsum("mip,mik->pk", columns, shifts / sigma)
    change = np.zeros((SIZE, moved.shape[1]))
    change[list(point.free)] = -inverse @ moved
    change *= data.units[:, None]
    return np.asarray(change @ change.T)


def held_out(data: RotationData, point: Point) -> FloatArray | None:
    """Closure error of each rotation under the fit of all others, rad, shape (m, 3).

    The fit without one rotation is one Gauss–Newton step from the fit of all; the step is so small
    that the next one would change the error by its square. The error itself is then integrated
    anew. None where leaving one out leaves too few.

    What stays is the choice of the gains, the weights, and the frame: gravity at both ends is what
    the accelerometer's calibration from all holds makes of it. The bias stays known from all holds.
    """
    turns, free = data.turns, list(point.free)
    if freedom(turns, free) <= 2:
        return None
    columns, weighted = point.columns(data), point.errors(data)
    normal, slope = point.normal(data, columns)
    matrices, biases = np.empty((len(turns), 3, 3)), np.empty((len(turns), 3))
    for index, own in enumerate(columns):
        inverse, blind = inverted(normal - own.T @ own)
        if blind.any():
            return None
        step = np.zeros(SIZE)
        step[free] = -inverse @ (slope - own.T @ weighted[index])
        change = step * data.units
        matrices[index] = point.matrix + change[MATRIX].reshape(3, 3)
        biases[index] = point.bias + change[BIAS]
    return errors(turns, matrices, biases)


def drops(data: RotationData, point: Point) -> FloatArray:
    """Fall of the weighted sum of squares without each rotation, ``rᵀ (I − H)⁻¹ r``, shape (m,)."""
    columns = point.columns(data)
    inverse, _ = inverted(point.normal(data, columns)[0])
    leverage = np.einsum("mip,pq,mjq->mij", columns, inverse, columns)
    free_of_itself = np.linalg.pinv(np.eye(3) - leverage, rcond=1e-6, hermitian=True)
    weighted = point.errors(data)
    return np.asarray(np.einsum("mi,mij,mj->m", weighted, free_of_itself, weighted))
