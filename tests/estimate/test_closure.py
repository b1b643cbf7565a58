"""Gravity carried through rotations: the error, and its derivative by all twelve parameters."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model.rows.gravity_closure import GravityClosure, between
from imucal_wizard.model.rows.source import BIAS, MATRIX
from tests.estimate.closures import closed, closures
from tests.estimate.truth import Truth, even_directions, in_counts, turn, typical_gyroscope


def _turns(truth: Truth, seed: int = 0, fastest: float = 4.0) -> GravityClosure:
    """Ten wobbling turns about random axes, up to this many rad/s."""
    rng = np.random.default_rng(seed)
    motions = []
    for _ in range(10):
        vector = rng.uniform(0.3, 3.0) * even_directions(1, rng)[0]
        seconds = float(2.2 * np.linalg.norm(vector) / rng.uniform(0.3 * fastest, fastest))
        wobble = rng.normal(scale=0.05, size=3)
        motions.append(turn(even_directions(1, rng)[0], vector, seconds=seconds, wobble=wobble))
    return closures(
        [m.time for m in motions],
        [truth.readings(m.rate) for m in motions],
        np.array([m.up[0] for m in motions]),
        np.array([m.up[-1] for m in motions]),
    )


def test_the_true_calibration_closes_every_rotation() -> None:
    """To the accuracy of the integration at 100 samples per second."""
    for truth in (typical_gyroscope(), in_counts(typical_gyroscope(), 4778.0)):
        assert np.abs(_turns(truth).closures(truth.matrix, truth.bias)).max() < 2e-6


def test_a_scale_error_leaves_its_share_of_the_angle() -> None:
    """A turn of 2 rad about a level axis with 1 % too much scale ends 0.02 rad too far."""
    motion = turn(np.array([0.0, 0.0, 1.0]), np.array([2.0, 0.0, 0.0]))
    turns = closures([motion.time], [motion.rate], motion.up[:1], motion.up[-1:])
    error = turns.closures(1.01 * np.eye(3), np.zeros(3))[0]
    assert error == pytest.approx([0.02, 0.0, 0.0], abs=1e-7)


def test_turning_about_gravity_leaves_no_trace() -> None:
    """Whatever the scale about the axis that points up."""
    motion = turn(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, 2.0]))
    turns = closures([motion.time], [motion.rate], motion.up[:1], motion.up[-1:])
    assert np.abs(turns.closures(1.3 * np.eye(3), np.zeros(3))).max() < 1e-12


def _numeric(
    turns: GravityClosure, matrix: FloatArray, bias: FloatArray, units: FloatArray
) -> FloatArray:
    """Differences of fourth order, shape (m, 3, 12)."""
    step = 1e-3

    def moved(unit: FloatArray, k: int) -> FloatArray:
        further = k * step * unit
        return turns.closures(matrix + further[MATRIX].reshape(3, 3), bias + further[BIAS])

    columns = [
        (moved(u, -2) - 8.0 * moved(u, -1) + 8.0 * moved(u, 1) - moved(u, 2)) / (12.0 * step)
        for u in np.diag(units)
    ]
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("counts", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_the_jacobian_is_the_numeric_one(seed: int, counts: bool) -> None:
    """Against differences of fourth order, to the coning that the derivative leaves out.

    A test of the gyroscope's fit says that this moves no parameter.
    """
    truth = in_counts(typical_gyroscope(), 4778.0) if counts else typical_gyroscope()
    turns = _turns(truth, seed)
    rng = np.random.default_rng(seed)
    gain = float(np.linalg.norm(truth.matrix, 2))
    matrix = truth.matrix + gain * rng.normal(scale=0.02, size=(3, 3))
    bias = truth.bias + rng.normal(scale=0.01, size=3) / gain
    units = np.concatenate([np.full(9, gain), np.full(3, 0.1 / gain)])
    numeric = turns.rows_of(_numeric(turns, matrix, bias, units))
    rows = closed(turns, matrix, bias)
    assert np.abs(rows.closure - turns.closures(matrix, bias)).max() < 1e-13
    largest = np.abs(numeric).max(axis=0)
    analytic = rows.base_columns() * units
    assert (np.abs(analytic - numeric).max(axis=0) < 5e-3 * largest).all()


def test_each_rotation_may_have_its_own_calibration() -> None:
    """As for the rotations left out one at a time."""
    truth = typical_gyroscope()
    turns = _turns(truth)
    rng = np.random.default_rng(1)
    matrix = truth.matrix + rng.normal(scale=0.02, size=(10, 3, 3))
    bias = truth.bias + rng.normal(scale=0.01, size=(10, 3))
    together = turns.closures(matrix, bias)
    for index in range(10):
        alone = turns.closures(matrix[index], bias[index])[index]
        assert together[index] == pytest.approx(alone, abs=1e-12)


def test_between_is_the_shortest_rotation() -> None:
    """From tiny angles to nearly opposite ones, as SciPy turns vectors."""
    rng = np.random.default_rng(2)
    a = even_directions(60, rng)
    across = np.cross(a, even_directions(60, rng))
    across /= np.linalg.norm(across, axis=1)[:, None]
    turned = across * np.linspace(1e-9, np.pi - 1e-6, 60)[:, None]
    b = Attitude.from_rotvec(turned).apply(a)
    assert np.abs(between(a, b) - turned).max() < 2e-9


def test_between_equal_and_opposite_vectors() -> None:
    """Nothing from a vector to itself; half a turn about some axis across to its opposite."""
    up = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.48, 0.64, -0.6]])
    assert np.abs(between(up, up)).max() == 0.0
    half = between(up, -up)
    assert np.linalg.norm(half, axis=1) == pytest.approx(np.full(3, np.pi))
    assert np.abs((half * up).sum(axis=1)).max() < 1e-15
