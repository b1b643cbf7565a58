"""Q's static and dynamic approach, and the angle they take from the accelerometer."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.estimate.methods.single_axis import (
    AxisTurn,
    ScaleAndBias,
    dynamic_approach,
    static_approach,
)
from imucal_wizard.estimate.result import AxisComparison, single_axis_note
from imucal_wizard.measurement.rotation_angle import rotation_between, tilt_about_axis

LEVEL = ([0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
"""Q's figure 2: z up for turns about x and y, x up for turns about z."""
CENTRES = [0.0, 32998.43]


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("degrees", [-170.0, -91.0, -1.0, 1.0, 45.0, 89.0, 91.0, 135.0, 170.0])
def test_the_angle_has_the_sign_and_the_reach_that_eq_25_to_28_lose(
    axis: int, degrees: float
) -> None:
    """A right-handed turn about the axis is positive, up to ±180° and not ±90°."""
    before = np.array(LEVEL[axis])
    turned = Attitude.from_rotvec(np.radians(degrees) * np.eye(3)[axis])
    after = turned.inv().apply(before)
    angle = rotation_between(before, after, "xyz"[axis], 0.0)
    assert angle == pytest.approx(np.radians(degrees), abs=1e-12)


@given(
    axis=st.integers(0, 2),
    start=st.floats(-3.1, 3.1),
    angle=st.floats(-20.0, 20.0),
    lean=st.floats(-0.3, 0.3),
    wrong=st.floats(0.9, 1.1),
)
def test_whole_turns_are_counted_with_the_integrated_rate(
    axis: int, start: float, angle: float, lean: float, wrong: float
) -> None:
    """From any start, leaning a little, and with a rate that is wrong by a tenth."""
    along = np.eye(3)[axis]
    leaning = along * np.sin(lean) + np.array(LEVEL[axis]) * np.cos(lean)
    before = Attitude.from_rotvec(start * along).inv().apply(leaning)
    after = Attitude.from_rotvec(angle * along).inv().apply(before)
    rough = angle * wrong
    if abs(rough - angle) < 3.0:
        assert rotation_between(before, after, "xyz"[axis], rough) == pytest.approx(angle, abs=1e-9)


def test_the_angle_grows_with_positive_rotation() -> None:
    """du/dt = u × w: turning about +x carries up from z towards y in the body frame."""
    assert tilt_about_axis(np.array([0.0, 1.0, 0.0]), "x") == pytest.approx(np.pi / 2)
    assert tilt_about_axis(np.array([0.0, 0.0, 1.0]), "x") == 0.0


def _turns(scale: float, bias: float, centre: float, noise: float = 0.0) -> list[AxisTurn]:
    """Eighteen turns up to beyond half a turn, in 1 to 3 s."""
    rng = np.random.default_rng(0)
    turns = []
    for angle in np.radians(np.linspace(-230.0, 225.0, 18)):
        seconds = rng.uniform(1.0, 3.0)
        integral = angle / scale + (bias + centre) * seconds
        measured = angle + noise * rng.standard_normal()
        turns.append(AxisTurn(float(measured), float(integral), float(seconds), bias + centre))
    return turns


@pytest.mark.parametrize("centre", CENTRES)
@pytest.mark.parametrize("scale", [0.9754, 1.0 / 3206.91])
def test_both_approaches_are_exact_without_noise(scale: float, centre: float) -> None:
    """Scale (a correction, rad/s per reading) and bias of tables III and V come back."""
    turns = _turns(scale, -0.0482, centre)
    static, dynamic = static_approach(turns), dynamic_approach(turns)
    assert static is not None
    assert dynamic is not None
    assert static.scale == pytest.approx(scale, rel=1e-9)
    assert static.bias == pytest.approx(centre - 0.0482, abs=1e-12)
    assert dynamic.scale == pytest.approx(scale, rel=1e-9)
    assert dynamic.bias == pytest.approx(centre - 0.0482, abs=1e-6)


def test_the_dynamic_approach_is_eq_21() -> None:
    """The normal equations of A = [w̄T, −T], solved as they stand."""
    turns = _turns(0.98, 0.05, 0.0, noise=0.01)
    A = np.array([[t.integral, -t.duration] for t in turns])
    k, kb = np.linalg.solve(A.T @ A, A.T @ np.array([t.angle for t in turns]))
    found = dynamic_approach(turns)
    assert found is not None
    assert found.scale == pytest.approx(k, rel=1e-12)
    assert found.bias == pytest.approx(kb / k, rel=1e-10)


def test_the_dynamic_approach_finds_a_bias_that_rest_does_not_show() -> None:
    """What Q made it for: the static one then errs in scale where senses are unequal."""
    turns = [
        AxisTurn(t.angle, t.integral + 0.02 * t.duration, t.duration, t.bias)
        for t in _turns(0.98, 0.05, 0.0)
    ]
    dynamic = dynamic_approach(turns)
    assert dynamic is not None
    assert dynamic.bias == pytest.approx(0.07, abs=1e-10)
    assert dynamic.scale == pytest.approx(0.98, abs=1e-10)


def test_standard_errors_hold_the_truth_as_often_as_they_say() -> None:
    """The dynamic scale and bias are within 2.12 s.e. (t, 16 dof) of the truth 95 % of the time.

    300 repetitions; the tolerance is three binomial standard deviations.
    """
    rng = np.random.default_rng(3)
    inside = np.zeros(2)
    for _ in range(300):
        turns = [
            AxisTurn(t.angle + 0.01 * rng.standard_normal(), t.integral, t.duration, t.bias)
            for t in _turns(0.98, 0.05, 0.0)
        ]
        found = dynamic_approach(turns)
        assert found is not None
        inside[0] += abs(found.scale - 0.98) < 2.12 * (found.scale_error or 0.0)
        inside[1] += abs(found.bias - 0.05) < 2.12 * (found.bias_error or 0.0)
    assert (np.abs(inside / 300 - 0.95) < 3.0 * np.sqrt(0.95 * 0.05 / 300)).all()


@pytest.mark.parametrize("approach", [static_approach, dynamic_approach])
def test_scale_and_bias_err_together_as_said(
    approach: Callable[[list[AxisTurn]], ScaleAndBias | None],
) -> None:
    """Turns in one sense, which move the scale with the bias, over 500 repetitions."""
    rng, found, said = np.random.default_rng(4), [], []
    for _ in range(500):
        turns = []
        for t in _turns(0.98, 0.05, 0.0)[10:]:
            # the readings at rest before and after a turn show another bias than the last ones
            bias = 0.05 + 0.01 * rng.standard_normal()
            angle = t.angle + 0.01 * rng.standard_normal()
            turns.append(AxisTurn(float(angle), t.integral, t.duration, bias))
        one = approach(turns)
        assert one is not None
        found.append([one.scale, one.bias])
        said.append(
            [
                [(one.scale_error or 0.0) ** 2, one.shared],
                [one.shared, (one.bias_error or 0.0) ** 2],
            ]
        )
    true, mean = np.cov(np.transpose(found)), np.mean(said, axis=0)
    assert abs(true[0, 1]) > 0.5 * np.sqrt(true[0, 0] * true[1, 1])
    assert mean[0, 1] == pytest.approx(true[0, 1], rel=0.15)


def test_too_few_data_give_no_result() -> None:
    """Two rotations have no residual; equal ones do not tell scale from bias; none is nothing."""
    turns = _turns(0.98, 0.05, 0.0)
    assert dynamic_approach(turns[:2]) is None
    assert dynamic_approach([turns[0]] * 5) is None
    assert static_approach([]) is None
    single = static_approach(turns[:1])
    assert single is not None
    assert single.scale_error is None


def test_an_axis_that_says_nothing_is_not_divided_by() -> None:
    """A dead or swapped axis integrates to nothing but its bias."""
    dead = [AxisTurn(1.0, 0.1 * t, t, 0.1) for t in (1.0, 2.0, 3.0)]
    assert static_approach(dead) is None
    assert dynamic_approach(dead) is None


@pytest.mark.parametrize("scale", [0.98, 1.0 / 3206.91])
def test_the_dynamic_errors_are_those_of_moved_angles(scale: float) -> None:
    """Against a shift of each angle in turn, with a bias that rest does not show."""
    turns = [
        AxisTurn(t.angle, t.integral + 0.3 / scale * t.duration, t.duration, t.bias)
        for t in _turns(scale, 0.05 / scale, 0.0, noise=0.01)
    ]
    found = dynamic_approach(turns)
    assert found is not None
    columns = []
    for place, turn in enumerate(turns):
        ends = []
        for shift in (1e-5, -1e-5):
            moved = AxisTurn(turn.angle + shift, turn.integral, turn.duration, turn.bias)
            fit = dynamic_approach([*turns[:place], moved, *turns[place + 1 :]])
            assert fit is not None
            ends.append((fit.scale, fit.bias))
        columns.append((np.array(ends[0]) - ends[1]) / 2e-5)
    left = [t.angle - found.scale * (t.integral - found.bias * t.duration) for t in turns]
    sigma = np.sqrt(np.sum(np.square(left)) / (len(turns) - 2))
    expected = sigma * np.linalg.norm(columns, axis=0)
    assert found.scale_error == pytest.approx(expected[0], rel=1e-6)
    assert found.bias_error == pytest.approx(expected[1], rel=1e-4)


def test_the_static_errors_are_those_of_a_mean() -> None:
    """The standard error of the mean of single scales, and of single biases; of one turn none."""
    rng = np.random.default_rng(7)
    turns = [
        AxisTurn(t.angle, t.integral, t.duration, t.bias + 0.01 * rng.standard_normal())
        for t in _turns(0.98, 0.05, 0.0, noise=0.01)
    ]
    found = static_approach(turns)
    assert found is not None
    scales = [t.angle / (t.integral - t.bias * t.duration) for t in turns]
    assert found.scale_error == pytest.approx(stats.sem(scales))
    assert found.bias_error == pytest.approx(stats.sem([t.bias for t in turns]))
    alone = static_approach(turns[:1])
    assert alone is not None
    assert (alone.scale_error, alone.bias_error) == (None, None)
    pair = static_approach(turns[:2])
    assert pair is not None
    assert pair.scale_error is not None


def test_three_rotations_are_enough_and_two_are_not() -> None:
    """Two unknowns, and one rotation to contradict them."""
    turns = _turns(0.98, 0.05, 0.0)
    assert dynamic_approach(turns[4:7]) is not None
    assert dynamic_approach(turns[4:6]) is None


@pytest.mark.parametrize(
    ("scale", "error", "says"),
    [
        (1.0005, 0.0001, ""),
        (1.02, 0.03, "differ from vector by up to 2 %: their standard errors are as large."),
        (1.02, None, "differ from vector by up to 2 %: too few rotations show whether"),
        (1.02, 0.002, "are off by up to 2 %: they treat each rotation as one about a single axis"),
    ],
)
def test_only_what_scatter_does_not_explain_is_put_down_to_the_single_axis(
    scale: float, error: float | None, says: str
) -> None:
    row = AxisComparison(
        "x", 4, static_scale=scale, static_scale_error=error, vector_scale=1.0, dynamic_scale=1.0
    )
    said = single_axis_note([row])
    assert says in said
    assert bool(says) == bool(said)


def test_a_larger_difference_that_may_be_chance_is_told_beside_the_certain_one() -> None:
    """The table shows both, and the sentence speaks of both."""
    rows = [
        AxisComparison(axis, 4, static_scale=scale, static_scale_error=error, vector_scale=1.0)
        for axis, scale, error in (("x", 1.03, 0.02), ("y", 1.004, 0.001))
    ]
    said = single_axis_note(rows)
    assert "differ from vector by up to 3 %" in said
    assert "they are off by up to 0.4 %" in said
