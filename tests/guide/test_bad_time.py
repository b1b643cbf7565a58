"""Time that jumps, numbers that are none: nothing crashes and nothing measured is lost."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.guide.kinds import StepKind
from tests.guide.device import Device, machine_at


@pytest.mark.parametrize("jump", [-1000.0, -0.5, 0.5, 3600.0, 1e9])
def test_a_jump_in_time_breaks_the_hold_and_nothing_else(jump: float) -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    machine.feed(device.hold("+x").hold("+y", 0.7).gap(jump).rest(2.5).hold("-x").taken())
    status = machine.status()
    assert set(status.done) == {"+x", "+y", "-x"}
    assert all(0.5 < hold.end - hold.start < 5.0 for hold in machine.collected().holds)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=8))
def test_any_jumps_at_all_do_not_crash(jumps: list[float]) -> None:
    device = Device()
    machine = machine_at(StepKind.ROTATIONS, device)
    for jump in jumps:
        device.gap(jump).rest(1.6).rotate("x", 50.0, 0.6)
    machine.feed(device.taken())
    machine.command("take")
    assert machine.status().step is StepKind.ROTATIONS
    assert np.isfinite(machine.status().elapsed)


def test_readings_that_are_not_numbers_break_a_hold_and_are_not_averaged() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    readings = device.hold("+x", 0.6).rest(3.0).taken()
    values = readings.accelerometer.values.copy()
    values[-280, 1] = np.nan
    machine.feed(Readings(Series(readings.accelerometer.time, values, "m/s^2"), readings.gyroscope))
    assert machine.status().done == ("+x",)
    assert np.isfinite(machine.collected().holds[-1].accelerometer).all()


def test_a_stream_of_nothing_but_nan_says_nothing_and_waits() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    readings = device.rest(40.0).taken()
    nothing = Series(readings.accelerometer.time, np.full((4000, 3), np.nan), "m/s^2")
    machine.feed(Readings(nothing, readings.gyroscope))
    status = machine.status()
    assert status.up is None
    assert not status.still.still
    assert status.still.worst is not None
    assert status.still.worst.moving


def test_an_empty_batch_changes_nothing() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    empty = Readings(Series(np.zeros(0), np.zeros((0, 3)), "m/s^2"))
    before = machine.status()
    assert machine.feed(empty) == ()
    assert machine.status() == before
