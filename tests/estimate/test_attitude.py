"""Attitude from rate: fourth order in the interval, and the same however steps are joined."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.core.attitude import (
    STEPS_PER_PIECE,
    Attitudes,
    RotationSamples,
    rotation_samples,
    strictly_later,
)
from imucal_wizard.core.quaternions import matrices, multiply, quaternions
from imucal_wizard.core.readings import FloatArray


def _integrated(samples: RotationSamples) -> Attitude:
    """Attitude at the end of the first rotation, readings being rates."""
    steps = quaternions(samples.rotation_vectors(samples.reading))
    return Attitude.from_quat(Attitudes(steps, samples.step_offsets).whole[[1, 2, 3, 0], 0])


def _coning(time: FloatArray) -> tuple[FloatArray, Attitude]:
    """A body whose axis goes round a cone: rate in closed form, attitude in closed form.

    ``R = exp(Ω t z) exp(α x) exp(−ν t z)`` has the body rate
    ``Ω Rᵀ z − ν z``, with ``Rᵀ z = exp(ν t z) exp(−α x) z``.
    """
    alpha, spin, nu = 0.4, 3.0, 7.0
    angle = nu * time
    up = np.column_stack(
        [
            -np.sin(angle) * np.sin(alpha),
            np.cos(angle) * np.sin(alpha),
            np.full_like(time, np.cos(alpha)),
        ]
    )
    rate = spin * up - np.array([0.0, 0.0, nu])

    def at(t: float) -> Attitude:
        first = Attitude.from_rotvec([0.0, 0.0, spin * t])
        return first * Attitude.from_rotvec([alpha, 0, 0]) * Attitude.from_rotvec([0, 0, -nu * t])

    return rate, at(float(time[0])).inv() * at(float(time[-1]))


def _coning_error(count: int) -> float:
    time = np.linspace(0.0, 2.0, count + 1)
    rate, truth = _coning(time)
    return float((_integrated(rotation_samples([time], [rate])).inv() * truth).magnitude())


def test_coning_is_integrated_to_fourth_order() -> None:
    """Half the interval, a sixteenth of the error; the trapezoidal rule alone would give a fourth.

    At 100 samples per second and this motion (8 rad/s) the error of two seconds is below 1e-6 rad.
    """
    coarse, medium, fine = (_coning_error(count) for count in (100, 200, 400))
    assert 13.0 < coarse / medium < 20.0
    assert 14.0 < medium / fine < 18.0
    assert medium < 1e-6


def test_a_constant_rate_is_integrated_exactly() -> None:
    """Whatever the intervals: 1 rad/s for 3 s is 3 rad."""
    rng = np.random.default_rng(0)
    time = np.sort(rng.uniform(0.0, 3.0, 50))
    time[[0, -1]] = 0.0, 3.0
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    found = _integrated(rotation_samples([time], [np.tile(axis, (50, 1))]))
    assert np.allclose(found.as_rotvec(), Attitude.from_rotvec(3.0 * axis).as_rotvec(), atol=1e-14)


def test_uneven_intervals_cost_little() -> None:
    """Two lost samples in a row are bridged by the cubic, not by a straight line."""
    time = np.linspace(0.0, 2.0, 201)
    rate, truth = _coning(time)
    keep = np.delete(np.arange(201), [80, 81, 150])
    found = _integrated(rotation_samples([time[keep]], [rate[keep]]))
    assert (found.inv() * truth).magnitude() < 3e-5


def test_samples_that_seem_to_be_a_microsecond_apart_cost_no_more_than_their_times() -> None:
    """Times late by up to nine tenths of an interval, two of them all but equal."""
    time = np.linspace(0.0, 2.0, 201)
    rate, truth = _coning(time)
    late = time + 0.009 * np.random.default_rng(3).random(201)
    late[[0, -1]] = time[[0, -1]]
    late[81] = late[80] + 1e-6
    error = (_integrated(rotation_samples([late], [rate])).inv() * truth).magnitude()
    steps = 0.5 * (rate[1:] + rate[:-1]) * np.diff(late)[:, None]
    straight = Attitude.identity()
    for step in steps:
        straight = straight * Attitude.from_rotvec(step)
    # the trapezoidal rule, which divides by no interval
    assert error < 1.2 * (straight.inv() * truth).magnitude()


def test_repeated_and_late_samples_are_left_out() -> None:
    """A time that stands still or goes back adds nothing."""
    time = np.array([0.0, 0.01, 0.01, 0.02, 0.015, 0.03])
    assert strictly_later(time).tolist() == [True, True, False, True, False, True]
    rate = np.ones((6, 3))
    samples = rotation_samples([time], [rate])
    assert samples.dt.sum() == pytest.approx(0.03)
    assert np.isfinite(samples.rotation_vectors(samples.reading)).all()


def _quaternions(count: int, seed: int) -> FloatArray:
    return quaternions(np.random.default_rng(seed).normal(scale=0.3, size=(3, count)))


@given(
    pieces=st.lists(st.integers(1, 7), min_size=1, max_size=6),
    seed=st.integers(0, 2**31),
)
def test_joining_by_pairs_is_joining_one_by_one(pieces: list[int], seed: int) -> None:
    """Attitude before and after every step, equal a plain loop over the steps."""
    offsets = np.concatenate([[0], np.cumsum(pieces)]).astype(np.int64) * STEPS_PER_PIECE
    steps = _quaternions(int(offsets[-1]), seed)
    found = Attitudes(steps, offsets)
    before, after = found.each
    for number, (first, past) in enumerate(itertools.pairwise(offsets)):
        joined = np.array([1.0, 0.0, 0.0, 0.0])
        for step in range(first, past):
            assert np.abs(before[:, step] - joined).max() < 1e-12
            joined = multiply(joined, steps[:, step])
            assert np.abs(after[:, step] - joined).max() < 1e-12
        assert np.abs(found.whole[:, number] - joined).max() < 1e-12


@pytest.mark.parametrize(
    "count", [3, STEPS_PER_PIECE, STEPS_PER_PIECE + 1, STEPS_PER_PIECE + 2, 500]
)
def test_a_rotation_of_any_length_is_filled_up(count: int) -> None:
    """Empty steps turn nothing and belong to their rotation."""
    time = np.arange(count) / 100.0
    samples = rotation_samples([time, time], [np.ones((count, 3)), 2.0 * np.ones((count, 3))])
    offsets = samples.step_offsets
    assert (np.diff(offsets) % STEPS_PER_PIECE == 0).all()
    assert len(samples.dt) == offsets[-1] == 2 * offsets[1]
    sums = np.add.reduceat(samples.dt, offsets[:-1])
    assert sums == pytest.approx([time[-1], time[-1]])


def test_quaternions_are_scipys() -> None:
    """Exponential, product and matrix, small angles and large ones."""
    rng = np.random.default_rng(4)
    phi = rng.standard_normal((3, 50)) * np.logspace(-12, 0.8, 50)
    q = quaternions(phi)
    there = Attitude.from_rotvec(phi.T)
    assert np.abs(matrices(q).transpose(2, 0, 1) - there.as_matrix()).max() < 1e-14
    product = multiply(q[:, :25], q[:, 25:])
    expected = (there[:25] * there[25:]).as_matrix()
    assert np.abs(matrices(product).transpose(2, 0, 1) - expected).max() < 1e-14
