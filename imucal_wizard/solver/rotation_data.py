"""A gyroscope calibration in the making: the data, the parameters, what the data say of them.

Parameters are made dimensionless: gains in units of the overall gain, biases in units of the
scatter of the still means.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.closure import BIAS, MATRIX, SIZE, Linearised, Turns, linearise

BLIND = 1e-10
"""Share of a combination of parameters in what the rotations show, below which they do not."""


@dataclass(frozen=True, eq=False)
class RotationData:
    """Rotations and still means, with the units that make the parameters dimensionless.

    Attributes:
        turns: the rotations.
        stills: mean reading of each hold, shape (n, 3).
        still_sigma: scatter of these means, which weighs them, shape (3,).
        gain: the overall gain, rad/s per reading.
        spread: standard deviation of each rotation's closure relative to the rms of all, shape
            (m,): a long one gathers more noise.
    """

    turns: Turns
    stills: FloatArray
    still_sigma: FloatArray
    gain: float
    spread: FloatArray

    @property
    def units(self) -> FloatArray:
        """What one unit of each dimensionless parameter is, shape (12,)."""
        return np.concatenate([np.full(9, self.gain), self.still_sigma])


@dataclass(frozen=True, eq=False)
class Point:
    """A calibration, and what the data say of it.

    Attributes:
        matrix: M.
        bias: b.
        at: closure there.
        closing: rms closure per component of a rotation of average spread, rad.
        free: which of the twelve parameters are fitted.
    """

    matrix: FloatArray
    bias: FloatArray
    at: Linearised
    closing: float
    free: tuple[int, ...]

    def shifted(self, data: RotationData, step: FloatArray) -> "Point":
        """The parameters a dimensionless step (12,) further; ``at`` is not brought up to date."""
        change = step * data.units
        matrix = self.matrix + change[MATRIX].reshape(3, 3)
        return replace(self, matrix=matrix, bias=self.bias + change[BIAS])

    def distance(self, data: RotationData, other: "Point") -> FloatArray:
        """Dimensionless distance of each parameter from another point's, shape (12,)."""
        gains = (self.matrix - other.matrix).ravel()
        return np.concatenate([gains, self.bias - other.bias]) / data.units

    def columns(self, data: RotationData) -> FloatArray:
        """Weighted derivative of the closures by the free dimensionless parameters, (m, 3, p)."""
        sigma = self.closing * data.spread[:, None, None]
        return (self.at.jacobian * data.units)[:, :, self.free] / sigma

    def errors(self, data: RotationData) -> FloatArray:
        """Weighted closure errors, shape (m, 3)."""
        return self.at.errors / (self.closing * data.spread[:, None])

    def normal(self, data: RotationData, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Normal matrix and gradient of the free parameters."""
        flat = columns.reshape(-1, len(self.free))
        still = np.zeros((SIZE, SIZE))
        still[BIAS, BIAS] = len(data.stills) * np.eye(3)
        pull = np.zeros(SIZE)
        pull[BIAS] = ((data.stills - self.bias) / data.still_sigma).sum(axis=0)
        chosen = np.ix_(self.free, self.free)
        slope = flat.T @ self.errors(data).ravel() - pull[list(self.free)]
        return flat.T @ flat + still[chosen], slope


def point_at(
    data: RotationData, matrix: FloatArray, bias: FloatArray, closing: float, free: tuple[int, ...]
) -> Point:
    """The closure at these parameters."""
    return Point(matrix, bias, linearise(data.turns, matrix, bias), closing, free)


def moved_by(data: RotationData, point: Point, step: FloatArray) -> Point:
    """The closure a dimensionless step (12,) further."""
    further = point.shifted(data, step)
    return replace(further, at=linearise(data.turns, further.matrix, further.bias))


def inverted(normal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Inverse over what is determined, and each parameter's share in what is not."""
    scale = np.sqrt(np.diag(normal))
    scale = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(normal / np.outer(scale, scale))
    seen = values > BLIND
    inverse = (vectors[:, seen] / values[seen]) @ vectors[:, seen].T
    return inverse / np.outer(scale, scale), (vectors[:, ~seen] ** 2).sum(axis=1)


def freedom(turns: Turns, free: Sequence[int]) -> int:
    """Two closures per rotation, the turn about gravity being unseen, less the gains fitted."""
    return 2 * len(turns) - sum(index < 9 for index in free)


def rotation_data(
    turns: Turns, stills: FloatArray, floor: FloatArray, start: FloatArray
) -> RotationData:
    """The data, with biases weighed by the scatter of the still means, or their noise alone."""
    scatter = stills.std(axis=0, ddof=1) if len(stills) > 2 else floor
    tiny = 1e-9 * max(float(np.abs(stills).max()), 1e-9)
    sigma = np.maximum(np.maximum(scatter, floor), tiny)
    return RotationData(turns, stills, sigma, float(np.linalg.norm(start, 2)), np.ones(len(turns)))
