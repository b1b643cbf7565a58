"""What ignoring an effect costs, against closed forms."""

import math

import numpy as np
import pytest

from imucal_wizard.model.catalogue import effect, effects_for
from imucal_wizard.model.effect import ACCELEROMETER, GYROSCOPE
from imucal_wizard.model.lesson import (
    DIP,
    FIELD,
    cost_of_ignoring,
    cost_text,
    left_by_magnitude,
    left_by_rotations,
    lookalikes,
    session_poses,
    session_rotations,
)


def on_x(value: float, p: int = 3) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    sizes = np.zeros(p)
    sizes[0] = value
    return sizes


def test_a_second_order_term_tilts_up_although_the_fit_looks_good() -> None:
    """A fit of the magnitude takes 0.6 K₂ as bias; √(24/175) K₂ rms of the rest lies across."""
    price = cost_of_ignoring(effect("second-order"), "accelerometer", on_x(3.0))
    closed = math.degrees(3e-3 * math.sqrt(24.0 / 175.0))
    assert price.tilt_rms == pytest.approx(closed, rel=0.01)
    assert price.rotation_rms is None


def test_a_bias_that_moves_by_eight_milli_g_tilts_a_level_axis_by_as_many_milliradians() -> None:
    """0.8 mg/°C over ±10 °C; the worst direction is the one with the axis level."""
    price = cost_of_ignoring(effect("bias-temperature"), "accelerometer", on_x(0.8))
    assert price.tilt_worst == pytest.approx(math.degrees(8e-3), rel=0.01)


def test_a_turn_at_fifty_degrees_per_second_gathers_g_sensitivity_for_seven_seconds() -> None:
    """0.1 °/s/g under 1 g is 0.1 °/s for 360/50 s; at rest √(1/3) · 0.1 °/s for 60 s."""
    price = cost_of_ignoring(effect("g-sensitivity"), "gyroscope", on_x(0.1, 9))
    assert price.rotation_worst == pytest.approx(0.1 * 360.0 / 50.0)
    assert price.rest_rms == pytest.approx(6.0 / math.sqrt(3.0))
    assert price.tilt_rms is None


def test_a_hard_iron_turns_the_heading_by_its_part_towards_east() -> None:
    """The axis points anywhere: √(1/3) of what the bias does not absorb points east."""
    c = session_poses()
    moved = 0.5 * np.std(c.current)
    price = cost_of_ignoring(effect("current"), "magnetometer", on_x(0.5))
    closed = math.degrees(moved * math.sqrt(1.0 / 3.0) / (FIELD * math.cos(DIP)))
    assert price.heading_rms == pytest.approx(closed, rel=0.03)


@pytest.mark.parametrize("time_constant", [180.0, 1200.0])
def test_the_cost_is_that_of_the_setting(time_constant: float) -> None:
    """A warm-up of 5 mg on x: what is left of its course after the base model tilts gravity."""
    c = session_poses()
    course = 5e-3 * c.gravity * np.exp(-c.time / time_constant)
    left = left_by_magnitude(c.force, course[:, None] * np.eye(3)[0])
    up = c.force / c.gravity
    across = left - up * (left * up).sum(axis=1, keepdims=True)
    tilt = math.degrees(math.sqrt((across**2).sum(axis=1).mean())) / c.gravity
    price = cost_of_ignoring(effect("warm-up"), "accelerometer", on_x(5.0), time_constant)
    assert price.tilt_rms == pytest.approx(tilt, rel=1e-6)


def test_a_cost_too_small_to_state_is_not_called_none() -> None:
    price = cost_of_ignoring(effect("second-order"), "accelerometer", on_x(1e-4))
    assert price.words() == "less than 0.00005°"


def test_what_the_base_can_explain_costs_nothing() -> None:
    """A bias and a scale error of the accelerometer; a bias and any gain of the gyroscope."""
    c = session_poses()
    error = c.force * np.array([0.01, -0.02, 0.005]) + np.array([0.1, -0.2, 0.3])
    assert np.abs(left_by_magnitude(c.force, error)).max() < 1e-12
    rate = session_rotations().rate
    assert np.abs(left_by_rotations(rate, rate @ np.full((3, 3), 0.02) + 0.01)).max() < 1e-12


def test_a_cost_is_stated_with_the_conditions_that_it_depends_on_and_no_others() -> None:
    for one in effects_for(ACCELEROMETER):
        text = cost_text(one, ACCELEROMETER)
        assert ("temperature" in text) == (one.against == "temperature"), one.name
        assert ("20 minutes" in text) == (one.against in ("time", "temperature")), one.name
        assert ("vibration" in text) == (one.against == "vibration"), one.name
    for one in effects_for(GYROSCOPE):
        assert "a full rotation at 50 to 300 °/s wrong by" in cost_text(one, GYROSCOPE), one.name


def test_what_separates_lookalikes_is_something_that_the_sensor_measures() -> None:
    for sensor, foreign in ((ACCELEROMETER, "speed"), (GYROSCOPE, " g")):
        every = effects_for(sensor)
        assert not any(foreign in lookalikes(one, sensor, every) for one in every)
