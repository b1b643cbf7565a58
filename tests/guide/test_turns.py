"""The angle of a turn from gravity: closed forms, the full circle, and its sign."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imucal_wizard.core.poses import DIRECTIONS, START_POSES
from imucal_wizard.measurement.rotation_angle import (
    RotationAngle,
    axis_elevation,
    integrated_rate,
    rotation_between,
    tilt_about_axis,
    unwrapped,
)
from tests.guide.device import UNIT_AXES, turned

AXES = "xyz"


@given(st.sampled_from(AXES), st.floats(-179.9, 179.9))
def test_a_turn_from_the_start_pose_has_its_angle_and_sign(axis: str, degrees: float) -> None:
    before = DIRECTIONS[START_POSES[axis]]
    after = turned(before, math.radians(degrees) * UNIT_AXES[axis])
    angle = rotation_between(before, after, axis, 0.0)
    assert angle is not None
    assert math.degrees(angle) == pytest.approx(degrees, abs=1e-9)


def test_beyond_ninety_degrees_the_angle_goes_on_where_a_root_would_turn_back() -> None:
    after = turned(DIRECTIONS["+z"], math.radians(140.0) * UNIT_AXES["y"])
    angle = rotation_between(DIRECTIONS["+z"], after, "y", 0.0)
    assert angle == pytest.approx(math.radians(140.0))


@pytest.mark.parametrize("degrees", [-500.0, -190.0, 185.0, 350.0, 720.0])
def test_whole_circles_come_from_the_integrated_rate(degrees: float) -> None:
    after = turned(DIRECTIONS["+z"], math.radians(degrees) * UNIT_AXES["x"])
    angle = rotation_between(DIRECTIONS["+z"], after, "x", math.radians(degrees * 1.1))
    assert angle == pytest.approx(math.radians(degrees))


def test_an_upright_axis_has_no_tilt() -> None:
    assert tilt_about_axis(DIRECTIONS["+z"], "z") is None
    assert axis_elevation(DIRECTIONS["+z"], "z") == pytest.approx(90.0)
    assert axis_elevation(DIRECTIONS["+x+z"], "x") == pytest.approx(45.0)
    assert axis_elevation(DIRECTIONS["+y"], "z") == 0.0


@given(st.floats(-10.0, 10.0), st.floats(-30.0, 30.0))
def test_unwrapping_adds_whole_circles_and_lands_within_half_a_one(
    angle: float, near: float
) -> None:
    near_by = unwrapped(angle, near)
    assert abs(near_by - near) <= math.pi + 1e-9
    circles = (near_by - angle) / (2.0 * math.pi)
    assert circles == pytest.approx(round(circles), abs=1e-9)


@pytest.mark.parametrize("scale_known", [True, False])
def test_a_turn_under_way_is_followed_round_the_circle(scale_known: bool) -> None:
    up = DIRECTIONS["+x"]
    turn = RotationAngle("z", up)
    step = math.radians(12.0)
    for _ in range(40):
        up = turned(up, step * UNIT_AXES["z"])
        angle = turn.add(up, step if scale_known else None)
    assert angle == pytest.approx(math.radians(480.0))


def test_the_integral_of_a_constant_rate_is_rate_times_time() -> None:
    time = np.array([0.0, 0.1, 0.3, 0.35])
    rate = np.tile([1.0, -2.0, 0.5], (4, 1))
    assert integrated_rate(time, rate) == pytest.approx([0.35, -0.7, 0.175])
