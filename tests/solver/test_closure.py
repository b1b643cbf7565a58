"""Gravity carried through rotations: the error, and its derivative by all twelve parameters."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.attitude import lay_out
from imucal_wizard.solver.closure import (
    BIAS,
    MATRIX,
    Turns,
    between,
    errors,
    frame_shift,
    linearise,
)
from imucal_wizard.solver.directions import unit_vectors
from tests.solver.truth import Truth, even_directions, in_counts, turn, typical_gyroscope


def _turns(truth: Truth, seed: int = 0, fastest: float = 4.0) -> Turns:
    """Ten wobbling turns about random axes, up to this many rad/s."""
    rng = np.random.default_rng(seed)
    motions = []
    for _ in range(10):
        vector = rng.uniform(0.3, 3.0) * even_directions(1, rng)[0]
        seconds = float(2.2 * np.linalg.norm(vector) / rng.uniform(0.3 * fastest, fastest))
        wobble = rng.normal(scale=0.05, size=3)
        motions.append(turn(even_directions(1, rng)[0], vector, seconds=seconds, wobble=wobble))
    return Turns(
        lay_out([m.time for m in motions], [truth.readings(m.rate) for m in motions]),
        np.array([m.up[0] for m in motions]),
        np.array([m.up[-1] for m in motions]),
    )


def test_the_true_calibration_closes_every_rotation() -> None:
    """To the accuracy of the integration at 100 samples per second."""
    for truth in (typical_gyroscope(), in_counts(typical_gyroscope(), 4778.0)):
        assert np.abs(errors(_turns(truth), truth.matrix, truth.bias)).max() < 2e-6


def test_a_scale_error_leaves_its_share_of_the_angle() -> None:
    """A turn of 2 rad about a level axis with 1 % too much scale ends 0.02 rad too far."""
    motion = turn(np.array([0.0, 0.0, 1.0]), np.array([2.0, 0.0, 0.0]))
    turns = Turns(lay_out([motion.time], [motion.rate]), motion.up[:1], motion.up[-1:])
    error = errors(turns, 1.01 * np.eye(3), np.zeros(3))[0]
    assert error == pytest.approx([0.02, 0.0, 0.0], abs=1e-7)


def test_turning_about_gravity_leaves_no_trace() -> None:
    """Whatever the scale about the axis that points up."""
    motion = turn(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, 2.0]))
    turns = Turns(lay_out([motion.time], [motion.rate]), motion.up[:1], motion.up[-1:])
    assert np.abs(errors(turns, 1.3 * np.eye(3), np.zeros(3))).max() < 1e-12


def _numeric(turns: Turns, matrix: FloatArray, bias: FloatArray, units: FloatArray) -> FloatArray:
    """Differences of fourth order, shape (m, 3, 12)."""
    step = 1e-3

    def moved(unit: FloatArray, k: int) -> FloatArray:
        further = k * step * unit
        return errors(turns, matrix + further[MATRIX].reshape(3, 3), bias + further[BIAS])

    columns = [
        (moved(u, -2) - 8.0 * moved(u, -1) + 8.0 * moved(u, 1) - moved(u, 2)) / (12.0 * step)
        for u in np.diag(units)
    ]
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("counts", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_the_jacobian_is_the_numeric_one(seed: int, counts: bool) -> None:
    """Against differences of fourth order, to 1e-6 of each parameter's largest effect."""
    truth = in_counts(typical_gyroscope(), 4778.0) if counts else typical_gyroscope()
    turns = _turns(truth, seed)
    rng = np.random.default_rng(seed)
    gain = float(np.linalg.norm(truth.matrix, 2))
    matrix = truth.matrix + gain * rng.normal(scale=0.02, size=(3, 3))
    bias = truth.bias + rng.normal(scale=0.01, size=3) / gain
    units = np.concatenate([np.full(9, gain), np.full(3, 0.1 / gain)])
    numeric = _numeric(turns, matrix, bias, units)
    at = linearise(turns, matrix, bias)
    analytic = at.jacobian * units
    assert np.abs(at.errors - errors(turns, matrix, bias)).max() < 1e-13
    largest = np.abs(numeric).max(axis=(0, 1))
    assert (np.abs(analytic - numeric).max(axis=(0, 1)) < 1e-6 * largest).all()


def test_the_jacobian_is_the_numeric_one_where_every_rotation_closes() -> None:
    """There the error has no direction; its derivative has one all the same."""
    truth = typical_gyroscope()
    open_turns = _turns(truth)
    at = linearise(open_turns, truth.matrix, truth.bias)
    ends = np.einsum("mji,mj->mi", at.ends, open_turns.before)
    turns = Turns(open_turns.steps, open_turns.before, ends)
    units = np.concatenate([np.ones(9), np.full(3, 0.1)])
    numeric = _numeric(turns, truth.matrix, truth.bias, units)
    analytic = linearise(turns, truth.matrix, truth.bias).jacobian * units
    assert np.abs(errors(turns, truth.matrix, truth.bias)).max() < 1e-12
    largest = np.abs(numeric).max(axis=(0, 1))
    assert (np.abs(analytic - numeric).max(axis=(0, 1)) < 1e-6 * largest).all()


def test_each_rotation_may_have_its_own_calibration() -> None:
    """As for the rotations left out one at a time."""
    truth = typical_gyroscope()
    turns = _turns(truth)
    rng = np.random.default_rng(1)
    matrix = truth.matrix + rng.normal(scale=0.02, size=(len(turns), 3, 3))
    bias = truth.bias + rng.normal(scale=0.01, size=(len(turns), 3))
    together = errors(turns, matrix, bias)
    for index in range(len(turns)):
        alone = errors(turns, matrix[index], bias[index])[index]
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


def test_doubt_about_the_frame_is_carried_into_the_closure() -> None:
    """A doubt that tilts both ends moves the closure by what it moves it when it is true."""
    truth = typical_gyroscope()
    turns = _turns(truth)
    rng = np.random.default_rng(3)
    before, after = rng.normal(scale=1e-5, size=(2, len(turns), 3, 2))
    doubted = Turns(turns.steps, turns.before, turns.after, before, after)
    shift = frame_shift(doubted, linearise(turns, truth.matrix, truth.bias))
    assert shift is not None
    for k in range(2):
        moved = Turns(
            turns.steps,
            unit_vectors(turns.before + before[:, :, k]),
            unit_vectors(turns.after + after[:, :, k]),
        )
        change = errors(moved, truth.matrix, truth.bias) - errors(turns, truth.matrix, truth.bias)
        assert np.abs(change - shift[:, :, k]).max() < 1e-9
