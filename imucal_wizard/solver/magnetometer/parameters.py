"""From the ellipsoid to hard iron, soft iron and the field, with the scale fixed by a rule.

Magnitudes alone do not say how large the field is. With the local field given, M brings every
reading to it; without, ``det M = 1`` and the field's size S comes out in the reading's unit
(N leaves both free and fixes S by the sphere of the first step).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from imucal_wizard.ellipsoid.shape import TRIANGLE, Cloud
from imucal_wizard.readings import FloatArray

AXES = "xyz"


@dataclass(frozen=True, eq=False)
class Scaled:
    """M in the symmetric gauge, b, and the magnitude that corrected readings have.

    Attributes:
        matrix: M, symmetric, shape (3, 3): µT per reading, or of determinant 1.
        bias: b, hard iron, reading unit, shape (3,).
        magnitude: µT, or the reading's unit where the determinant is 1.
    """

    matrix: FloatArray
    bias: FloatArray
    magnitude: float


def scaled(cloud: Cloud, theta: FloatArray, field: float | None) -> Scaled:
    """The calibration with its scale fixed by the field, or by ``det M = 1``."""
    shape = cloud.shape(theta)
    magnitude = float(np.linalg.det(shape)) ** (-1.0 / 3.0) if field is None else field
    return Scaled(shape * magnitude, cloud.bias(theta), magnitude)


def converter(cloud: Cloud, field: float | None) -> Callable[[FloatArray], dict[str, float]]:
    """From θ to the named numbers; ``field`` is among them only where it was not given."""

    def convert(theta: FloatArray) -> dict[str, float]:
        found = scaled(cloud, theta, field)
        values = {f"bias_{axis}": float(found.bias[i]) for i, axis in enumerate(AXES)}
        for i, j in TRIANGLE:
            values[f"soft_iron_{AXES[i]}{AXES[j]}"] = float(found.matrix[i, j])
        if field is None:
            values["field"] = found.magnitude
        return values

    return convert


def unit_of(name: str, unit: str, field: float | None) -> str:
    """Unit of a named number for readings in ``unit``."""
    if name.startswith("soft_iron"):
        return "1" if field is None or unit == "uT" else f"uT/{unit}"
    return unit


def covariance_of(
    cloud: Cloud, theta: FloatArray, covariance: FloatArray, field: float | None
) -> FloatArray:
    """Covariance of (b, M's xx, xy, xz, yy, yz, zz), reading units and SI per reading, (9, 9).

    With ``det M = 1`` M moves by ``δM = λ (δP − P tr(P⁻¹δP)/3)``.
    """
    slope = np.zeros((9, 9))
    slope[:3, :3] = cloud.span * np.eye(3)
    found = scaled(cloud, theta, field)
    size = found.magnitude / cloud.span
    inverse = np.linalg.inv(found.matrix) * size
    for place, (i, j) in enumerate(TRIANGLE, 3):
        change = np.zeros((3, 3))
        change[i, j] = change[j, i] = size
        if field is None:
            share = inverse[i, j] * (1.0 if i == j else 2.0) / 3.0
            change -= found.matrix * share
        slope[3:, place] = [change[k, m] for k, m in TRIANGLE]
    return np.asarray(slope @ covariance @ slope.T)
