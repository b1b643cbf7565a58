"""Numerical estimate: quasi-Newton on the rms of ``|W⁻¹ (S_p − V₀)| − S`` (N, V-B, figures 3–4).

``S`` and the start of ``V₀`` are those of the two-step estimate; ``W⁻¹`` starts at the identity.
Every sample counts the same, so the fit follows the directions that hold more of them (VII-C).
"""

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray, IntArray
from imucal_wizard.estimate.ellipsoid.surface import COLUMNS, ROWS, parameters, symmetric_matrix
from imucal_wizard.estimate.method_data import Magnitudes, MethodEstimate
from imucal_wizard.estimate.methods import Method
from imucal_wizard.estimate.methods.two_step import EVERY, TwoStep, two_step
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.identifiability import basis_of

QUASI_NEWTON_ITERATIONS = 2000
"""As in figure 3."""
FLAT_SLOPE = 1e-4
"""Slope, in units of the magnitude, above which the iteration did not end at a minimum."""


def run(data: Magnitudes) -> SensorFit:
    """Figure 3 on all samples alike; what a change of some samples does begins from there."""
    known: list[MethodEstimate] = []

    def estimate(points: FloatArray, rows: IntArray) -> MethodEstimate:
        samples = points[rows]
        found = numeric(samples, two_step(samples, data.free), data.free, *known)
        known[:] = known or [found]
        return found

    return data.judged("numeric", estimate)


def numeric(
    samples: FloatArray,
    start: TwoStep,
    free: tuple[int, ...] = EVERY,
    near: MethodEstimate | None = None,
) -> MethodEstimate:
    """Figure 3.

    Args:
        samples: in units near 1, shape (n, 3).
        start: where ``V₀`` and ``S`` are taken from.
        free: free parameters, as of the two-step estimate.
        near: of almost the same samples, where the iteration then begins.

    Returns:
        ``W⁻¹ / S`` and ``V₀``.

    Raises:
        DataError: it does not converge.
    """
    from scipy.optimize import minimize

    basis = basis_of(free, common_scale=3 not in free)
    theta = parameters(np.eye(3), start.offset)
    if near is not None:
        theta = parameters(near.matrix * start.magnitude, near.bias)

    def freed(x: FloatArray) -> tuple[float, FloatArray]:
        value, slope = performance(theta + basis @ x, samples, start.magnitude)
        return value, basis.T @ slope

    found = minimize(
        freed,
        np.zeros(basis.shape[1]),
        jac=True,
        method="BFGS",
        options={"maxiter": QUASI_NEWTON_ITERATIONS, "gtol": 1e-9},
    )
    theta += basis @ found.x
    _, slope = performance(theta, samples, start.magnitude)
    if not np.abs(basis.T @ slope).max() < FLAT_SLOPE:
        raise DataError(
            "the numeric method does not converge: the readings are not of one magnitude; use the "
            "default method"
        )
    matrix = symmetric_matrix(theta) / start.magnitude
    if not np.linalg.eigvalsh(matrix)[0] > 0.0:
        raise DataError("the numeric method ended at a matrix that turns directions around")
    return MethodEstimate(matrix, theta[:3].copy(), int(found.nit))


def performance(
    theta: FloatArray, samples: FloatArray, magnitude: float
) -> tuple[float, FloatArray]:
    """Figure 4 over the magnitude, which moves no minimum, and its derivative, shape (9,).

    Args:
        theta: ``V₀`` and the six entries of ``W⁻¹``, shape (9,).
        samples: shape (n, 3).
        magnitude: ``S``.
    """
    offsets, matrix = samples - theta[:3], symmetric_matrix(theta)
    vectors = offsets @ matrix
    lengths = np.sqrt(np.einsum("ni,ni->n", vectors, vectors))
    error = lengths / magnitude - 1.0
    value = float(np.sqrt(error @ error / len(error)))
    pull = vectors * (error / np.maximum(lengths, 1e-12))[:, None]
    outer = pull.T @ offsets
    slope = np.empty(9)
    slope[:3] = -pull.sum(axis=0) @ matrix
    slope[3:] = (outer + outer.T - np.diag(np.diag(outer)))[ROWS, COLUMNS]
    return value, slope / (len(error) * magnitude * max(value, 1e-12))


METHODS = (
    Method(
        "numeric",
        ("accelerometer", "magnetometer"),
        "quasi-Newton on the magnitude (figures 3–4)",
        "N",
        run,
    ),
)
