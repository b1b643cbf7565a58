"""What looks wrong while measuring is said at once."""

import numpy as np
import pytest

from imucal_wizard.procedure.state import EventKind, StepKind
from imucal_wizard.procedure.steps import Machine
from imucal_wizard.readings import Readings, Series
from tests.procedure.device import QUICK, RATE, Device, texts


def with_rate(readings: Readings, factor: float) -> Readings:
    """The same readings with a gyroscope that is wrong by a factor."""
    assert readings.gyroscope is not None
    gyroscope = Series(readings.gyroscope.time, readings.gyroscope.values * factor, "rad/s")
    return Readings(readings.accelerometer, gyroscope)


def turned_by(factor: float) -> list[str]:
    """The warnings, and rejections, of a quarter turn with such a gyroscope."""
    device = Device(noise=(0.01, 1e-4)).rest(5.0)
    machine = Machine(QUICK, rate=RATE)
    machine.command("start")
    machine.feed(with_rate(device.taken(), factor))
    machine.command("goto", "rotations")
    device.rest(2.0).rotate("x", 90.0).rest(2.0)
    events = machine.feed(with_rate(device.taken(), factor))
    return texts(events, EventKind.WARNING) + texts(events, EventKind.ROTATION_REJECTED)


@pytest.mark.parametrize("factor", [2.0, 0.5, -1.0])
def test_a_gyroscope_that_disagrees_with_gravity_is_doubted(factor: float) -> None:
    assert "check its unit, its sign and the sample rate" in turned_by(factor)[0]


def test_a_gyroscope_in_the_wrong_unit_is_refused() -> None:
    assert "is its unit right?" in turned_by(57.3)[0]


@pytest.mark.parametrize("factor", [0.95, 1.0, 1.05])
def test_the_errors_of_a_common_gyroscope_are_not_doubted(factor: float) -> None:
    assert turned_by(factor) == []


def test_an_axis_at_the_end_of_its_range_is_doubted() -> None:
    readings = Device().rest(12.0).hold("+x").readings()
    clipped = np.clip(readings.accelerometer.values, -9.7, 9.7)
    force = Series(readings.accelerometer.time, np.round(clipped, 3), "m/s^2")
    machine = Machine(rate=RATE)
    machine.command("start")
    events = machine.feed(Readings(force, readings.gyroscope))
    assert machine.status().step is StepKind.UP_DOWN
    warnings = texts(events, EventKind.WARNING)
    assert any(text.startswith("x of the accelerometer does not change") for text in warnings)


def test_a_dead_axis_is_named_when_it_should_carry_gravity() -> None:
    readings = Device().rest(12.0).hold("+x").readings()
    values = readings.accelerometer.values * np.array([0.0, 1.0, 1.0])
    machine = Machine(rate=RATE)
    machine.command("start")
    force = Series(readings.accelerometer.time, values, "m/s^2")
    events = machine.feed(Readings(force, readings.gyroscope))
    assert "is an axis dead" in texts(events, EventKind.WRONG_POSE)[0]
