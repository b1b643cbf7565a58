"""What is not known of the accelerometer is not known of the gyroscope either."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.fit import Minimum, minimum
from imucal_wizard.estimate.gyroscope import GyroscopeExperiment
from imucal_wizard.estimate.gyroscope_fit import gyroscope_minimum
from imucal_wizard.model.rows.gravity_closure import ClosureRows
from tests.estimate.motions import Turned, exact_accelerometer, experiment, hand_turns
from tests.estimate.truth import typical_gyroscope


def test_the_uncertainty_of_the_frame_is_in_the_covariance() -> None:
    """Against whole refits with both ends of every rotation moved by each doubt in turn.

    A doubt d moves the parameters by c and leaves more of the closures, Δr. As a parameter with
    the prior N(0, 1) it adds ``c (1 + Δrᵀ Σ⁻¹ Δr)⁻¹ cᵀ`` to their covariance (Woodbury): what the
    closures themselves tell of it is taken off.
    """
    rng = np.random.default_rng(0)
    data = experiment(hand_turns(4, rng), typical_gyroscope(), rng, tilt_sigma=1e-5)
    count = len(data.reference.up)
    doubt = rng.normal(scale=2e-6, size=(count, 3, 2))
    # a doubt is one of a direction, which moves across itself only
    up = data.reference.up
    doubt -= up[:, :, None] * np.einsum("hi,hik->hk", up, doubt)[:, None]
    whole = _found(replace(data, reference=replace(data.reference, doubt=doubt)))
    variance = whole.balance.variance
    plain = _found(data, variance)
    moved, left = [], []
    for k in range(2):
        ends = []
        for sign in (1.0, -1.0):
            reference = replace(data.reference, up=unit_vectors(up + sign * doubt[:, :, k]))
            ends.append(_found(replace(data, reference=reference), variance))
        entries = [one.calibration.entries for one in ends]
        errors = [_errors(one) / np.sqrt(variance[-1]) for one in ends]
        moved.append(0.5 * (entries[0] - entries[1])[:9])
        left.append(0.5 * (errors[0] - errors[1]))
    shown = np.eye(2) + np.array(left) @ np.array(left).T
    expected = np.array(moved).T @ np.linalg.solve(shown, np.array(moved))
    added = whole.balance.covariance[:9, :9] - plain.balance.covariance[:9, :9]
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    # the doubts are thousands of times smaller than what would bend the closures
    assert added / scale == pytest.approx(expected / scale, abs=1e-3)


def _found(data: Turned, variance: FloatArray | None = None) -> Minimum[GyroscopeExperiment]:
    known = exact_accelerometer(data.reference)
    fitted = gyroscope_minimum(data.holds, data.rotations, known, data.unit).experiment
    return minimum(fitted, variance=variance)


def _errors(found: Minimum[GyroscopeExperiment]) -> FloatArray:
    """All components of all closures, rad."""
    (closures,) = (rows for rows in found.rows if isinstance(rows, ClosureRows))
    return closures.closure.ravel()
