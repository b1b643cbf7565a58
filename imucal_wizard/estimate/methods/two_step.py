"""Two-step analytic estimate: a sphere, then the matrix about its centre (N, V-A, figure 2).

N's model is ``S = W⁻¹ (S_p − V₀)`` (eq. 4) with ``W⁻¹`` symmetric (eq. 7) and ``|S|`` the same for
all samples. Both steps are linear least squares. Step 1 takes the ellipsoid for a sphere,

    |S_p|² = 2 S_p·V₀ + (S² − |V₀|²)

and step 2 fits ``W⁻²`` to the samples about its centre,

    d·W⁻² d = S²,    d = S_p − V₀

(eq. 8 writes B where S² is meant). Step 2 cannot correct the error that step 1 makes if the
ellipsoid is not a sphere.
"""

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.ellipsoid.surface import QUADRIC_ENTRIES, positive_root
from imucal_wizard.estimate.method_data import Magnitudes, MethodEstimate
from imucal_wizard.estimate.methods import Method
from imucal_wizard.estimate.methods.algebraic import quadrics
from imucal_wizard.estimate.result import SensorFit

EVERY = tuple(range(9))
"""Places of all parameters of an ellipsoid: ``V₀`` and the six entries of ``W⁻¹``."""
SMALLEST_EIGENVALUE = 1e-12
"""Of ``x'x`` with columns of length 1, below which it has no inverse."""


@dataclass(frozen=True, eq=False)
class TwoStep:
    """N's figure 6.

    Attributes:
        magnitude: ``S``, in the samples' unit.
        offset: ``V₀``, shape (3,).
        matrix: ``W⁻¹``, symmetric, shape (3, 3).
    """

    magnitude: float
    offset: FloatArray
    matrix: FloatArray


def run(data: Magnitudes) -> SensorFit:
    """The two steps on all samples alike."""

    def estimate(points: FloatArray, rows: IntArray) -> MethodEstimate:
        found = two_step(points[rows], data.free)
        return MethodEstimate(found.matrix / found.magnitude, found.offset, 2)

    return data.judged("two-step", estimate, biased=True)


def two_step(samples: FloatArray, free: tuple[int, ...] = EVERY) -> TwoStep:
    """Figure 2.

    Args:
        samples: in any unit, shape (n, 3).
        free: free parameters. N leaves ``w₄`` to ``w₆`` (4, 5 and 7) at zero where few
            orientations were taken (VII-A); without any scale (3, 6, 8) there is one for all.

    Raises:
        DataError: the samples lie in a plane, or on no ellipsoid.
    """
    offset, magnitude = fit_sphere(samples)
    centred = samples - offset
    products = np.column_stack([centred[:, i] * centred[:, j] for i, j in QUADRIC_ENTRIES])
    products[:, 3:] *= 2.0
    basis = quadrics(free)[:6, :-4]
    beta = basis @ _solve(products @ basis, np.full(len(samples), magnitude**2))
    square = np.zeros((3, 3))
    for value, (i, j) in zip(beta, QUADRIC_ENTRIES, strict=True):
        square[i, j] = square[j, i] = value
    return TwoStep(magnitude, offset, positive_root(square))


def fit_sphere(samples: FloatArray) -> tuple[FloatArray, float]:
    """Step 1: centre, shape (3,), and radius of the sphere through samples, shape (n, 3).

    Raises:
        DataError: the samples lie in a plane.
    """
    beta = _solve(
        np.column_stack([samples, np.ones(len(samples))]), np.einsum("ni,ni->n", samples, samples)
    )
    centre = beta[:3] / 2.0
    square = float(beta[3] + centre @ centre)
    if not square > 0.0:
        raise DataError(_NO_SPHERE)
    return centre, float(np.sqrt(square))


def _solve(x: FloatArray, y: FloatArray) -> FloatArray:
    """N's ``(x'x)⁻¹ x'y``, refused where ``x'x`` has no inverse."""
    normal = x.T @ x
    scale = np.sqrt(np.diag(normal))
    if (scale == 0.0).any():
        raise DataError(_NO_SPHERE)
    even = normal / np.outer(scale, scale)
    if np.linalg.eigvalsh(even)[0] < SMALLEST_EIGENVALUE:
        raise DataError(_NO_SPHERE)
    return np.asarray(np.linalg.solve(even, x.T @ y / scale) / scale)


_NO_SPHERE = (
    "the readings do not surround a centre: they lie in a plane or near one point. Turn the device "
    "about all of its axes"
)

METHODS = (
    Method(
        "two-step",
        ("accelerometer", "magnetometer"),
        "a sphere, then the symmetric matrix (figure 2)",
        "N",
        run,
    ),
)
