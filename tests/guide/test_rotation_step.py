"""Rotations by hand between still periods: what is taken, and what is rejected with its reason."""

import math

import numpy as np
import pytest

from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.guide.kinds import Act, EventKind, StepKind
from imucal_wizard.guide.live_checks import speeds
from imucal_wizard.guide.plan import standard
from imucal_wizard.guide.state import RotationStatus
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.measurement.clipping import clipped_axis
from tests.guide.device import Device, kinds, machine_at, rotations_of, texts


def rotating() -> tuple[Device, StateMachine]:
    """A device that lies with +z up at the beginning of the rotations."""
    device = Device()
    machine = machine_at(StepKind.ROTATIONS, device)
    machine.feed(device.rotate("x", 10.0).rotate("x", -10.0).rest(2.0).taken())
    return device, machine


@pytest.mark.parametrize("degrees", [90.0, -75.0, 170.0, -240.0, 400.0])
def test_a_rotation_between_holds_is_taken_with_its_angle(degrees: float) -> None:
    device, machine = rotating()
    events = machine.feed(device.rotate("x", degrees, 3.0).rest(2.0).taken())
    assert EventKind.ROTATION_TAKEN in kinds(events)
    rotation = machine.status().rotation
    assert rotation is not None
    assert list(rotation.done) == pytest.approx([degrees], abs=0.3)


def test_the_samples_go_from_inside_one_hold_to_inside_the_other() -> None:
    device, machine = rotating()
    machine.feed(device.rotate("x", 90.0).rest(3.0).rotate("x", -90.0).rest(2.0).taken())
    rotations = rotations_of(machine)
    assert len(rotations) == 2
    for rotation in rotations:
        assert rotation.before.start < rotation.time[0] < rotation.before.end
        assert rotation.after.start < rotation.time[-1] < rotation.after.end
        assert np.diff(rotation.time) == pytest.approx(0.01)
    assert rotations[0].after is rotations[1].before


def test_a_rotation_from_a_rest_in_which_the_hand_begins_to_tremble_is_measured_whole() -> None:
    """The hold ends with the calm part; the device tilts by 2° before it is still called moving."""
    device, machine = rotating()
    device.rest(3.0).shake(1.0, force=0.02, rate=0.004)
    for _ in range(4):
        device.rotate("x", 0.5, 1.2).shake(0.4, force=0.02, rate=0.004)
    events = machine.feed(device.rotate("x", 88.0, 3.0).rest(3.0).taken())
    (rotation,) = rotations_of(machine)
    assert rotation.problem is None
    assert rotation.before.start < rotation.time[0] < rotation.before.end
    turned = (rotation.rate[:, 0] - device.gyro_bias[0]).sum() / device.rate
    assert math.degrees(turned) == pytest.approx(90.0, abs=0.1)
    assert EventKind.ROTATION_TAKEN in kinds(events)


def test_the_live_angle_and_rates_follow_the_turn() -> None:
    device, machine = rotating()
    machine.feed(device.rotate("x", -120.0, 2.0).taken())
    rotation = machine.status().rotation
    assert rotation is not None
    assert rotation.angle == pytest.approx(-120.0, abs=2.0)
    assert rotation.fastest == pytest.approx(120.0, abs=3.0)
    assert machine.status().instruction == "ROTATE ABOUT X"
    machine.feed(device.rest(2.0).taken())
    after = machine.status().rotation
    assert after is not None
    assert after.angle == 0.0


def test_the_drawing_shows_what_is_left_of_a_rotation_and_then_asks_for_a_hold() -> None:
    """The place to stop at stays where it is while the device turns towards it."""
    device, machine = rotating()
    asked = machine.status().rotation
    assert asked is not None
    machine.feed(device.rotate("x", 0.6 * asked.wanted_angle, 2.0).taken())
    turn = machine.status().turn
    assert turn is not None
    assert math.degrees(turn.angle) == pytest.approx(0.4 * abs(asked.wanted_angle), abs=2.0)
    machine.feed(device.rotate("x", 0.45 * asked.wanted_angle, 2.0).taken())
    status = machine.status()
    assert not status.still.still
    assert status.act is Act.HOLD
    assert status.turn is None


def test_a_gap_ends_a_rotation_at_once_and_a_new_hold_is_asked_for() -> None:
    """What the rotation has turned before the gap cannot count: it must not be continued."""
    device, machine = rotating()
    machine.feed(device.rotate("x", 60.0).gap(5.0).rotate("x", 60.0).taken())
    status = machine.status()
    assert status.act is Act.HOLD
    assert status.rotation is not None
    assert status.rotation.angle == 0.0
    events = machine.feed(device.rest(2.0).taken())
    assert texts(events, EventKind.ROTATION_REJECTED) == [
        "Rotation not used: samples are missing in it."
    ]
    assert machine.status().act is Act.ROTATE


def test_a_gap_at_rest_asks_for_a_new_hold_and_rejects_no_rotation() -> None:
    device, machine = rotating()
    events = machine.feed(device.gap(5.0).rest(0.5).taken())
    assert machine.status().act is Act.HOLD
    events += machine.feed(device.rest(2.0).taken())
    assert EventKind.ROTATION_REJECTED not in kinds(events)
    assert machine.status().act is Act.ROTATE


def test_what_is_asked_for_about_each_axis_has_both_senses_and_three_speeds() -> None:
    """Whoever does what is asked has both ticks at the end, beginning with either sense."""
    device = Device()
    machine = machine_at(StepKind.ROTATIONS, device, standard(4, settle_seconds=3.0))
    machine.feed(device.place("+z").rest(4.0).taken())
    seen: dict[str, RotationStatus] = {}
    while machine.status().step is StepKind.ROTATIONS:
        asked = machine.status().rotation
        assert asked is not None
        if machine.status().act is Act.POSE:
            machine.feed(device.place(asked.start_pose).rest(4.0).taken())
            continue
        assert machine.status().act is Act.ROTATE
        seconds = 2.0 * abs(asked.wanted_angle) / asked.wanted_rate
        machine.feed(device.rotate(asked.axis, asked.wanted_angle, seconds).taken())
        done = machine.status().rotation
        assert done is not None
        seen[asked.axis] = done
        machine.feed(device.rest(4.0).taken())
        after = machine.status().rotation
        if after is not None and after.axis == asked.axis:
            assert after.done[-1] == pytest.approx(asked.wanted_angle, abs=1.0)
            seen[asked.axis] = after
    assert set(seen) == set("xyz")
    turned = [one for one in machine.collected().rotations if one.axis]
    for axis in "xyz":
        angles = seen[axis].done
        assert seen[axis].senses, (axis, angles)
        assert seen[axis].speeds == 3, (axis, angles)
    assert len(rotations_of(machine)) == 12, turned


def test_motion_under_the_wrong_axis_is_rejected_and_says_which_it_was() -> None:
    device, machine = rotating()
    events = machine.feed(device.rotate("y", 60.0).rest(2.0).taken())
    assert "mostly about y" in texts(events, EventKind.ROTATION_REJECTED)[0]
    rotation = machine.collected().rotations[-1]
    assert (rotation.axis, rotation.problem) == (None, None)


def test_a_small_rotation_is_rejected() -> None:
    device, machine = rotating()
    events = machine.feed(device.rotate("x", 12.0).rest(2.0).taken())
    assert "only +12° of at least 20°" in texts(events, EventKind.ROTATION_REJECTED)[0]
    assert rotations_of(machine) == []
    events = machine.feed(device.rotate("x", 19.7).rest(2.0).taken())
    assert "only +19° of at least 20°" in texts(events, EventKind.ROTATION_REJECTED)[0]


def test_a_nudge_is_not_called_a_rotation() -> None:
    device, machine = rotating()
    events = machine.feed(device.rotate("x", 2.0, 0.5).rest(2.0).taken())
    assert EventKind.ROTATION_REJECTED not in kinds(events)


def test_a_rotation_with_missing_samples_is_rejected() -> None:
    device, machine = rotating()
    events = machine.feed(device.rotate("x", 40.0).gap(0.2).rotate("x", 40.0).rest(2.0).taken())
    assert "missing" in texts(events, EventKind.ROTATION_REJECTED)[0]
    assert "missing" in (machine.collected().rotations[-1].problem or "")


def test_a_clipped_rotation_is_rejected_without_knowing_the_range() -> None:
    device, machine = rotating()
    readings = device.rotate("x", 160.0, 1.0).rest(2.0).taken()
    assert readings.gyroscope is not None
    limit = np.radians(250.0)
    values = np.clip(readings.gyroscope.values, -limit, limit)
    clipped_gyroscope = Series(readings.gyroscope.time, values, "rad/s")
    events = machine.feed(Readings(readings.accelerometer, clipped_gyroscope))
    assert "clipped" in texts(events, EventKind.ROTATION_REJECTED)[0]


def test_a_rotation_that_took_longer_than_a_minute_is_dropped_with_the_reason() -> None:
    device, machine = rotating()
    device.rotate("x", 45.0).shake(61.0, force=5.0, rate=1.0).rotate("x", 45.0).rest(2.0)
    events = machine.feed(device.taken())
    assert "longer than 60 s" in texts(events, EventKind.ROTATION_REJECTED)[0]
    assert rotations_of(machine) == []


def test_the_start_pose_is_asked_for_until_the_axis_lies_level() -> None:
    device = Device(up="+x")
    machine = machine_at(StepKind.ROTATIONS, device)
    machine.feed(device.rest(1.0).taken())
    status = machine.status()
    assert (status.instruction, status.wanted) == ("TURN +Z UP", "+z")
    events = machine.feed(device.place("+z").rest(2.0).taken())
    assert EventKind.ROTATION_REJECTED not in kinds(events)
    assert machine.status().instruction == "ROTATE ABOUT X"
    assert machine.status().wanted is None


def test_rotations_about_z_begin_with_x_up() -> None:
    device, machine = rotating()
    for axis in "xy":
        device.place("+z").rest(2.0)
        device.rotate(axis, 90.0).rest(2.0).rotate(axis, -90.0).rest(2.0)
    machine.feed(device.taken())
    rotation = machine.status().rotation
    assert rotation is not None
    assert (rotation.axis, rotation.start_pose) == ("z", "+x")
    machine.feed(device.place("+x").rest(2.0).rotate("z", 80.0).rest(2.0).taken())
    after = machine.status().rotation
    assert after is not None
    assert list(after.done) == pytest.approx([80.0], abs=0.3)


def test_without_a_gyroscope_there_are_no_rotations() -> None:
    device = Device().rest(5.0).poses(["-z", "+x", "-x", "+y", "-y"])
    machine = StateMachine(rate=device.rate)
    machine.command("start")
    machine.command("skip")
    machine.command("skip")
    machine.feed(device.readings(gyro=False))
    machine.command("skip")
    assert machine.status().step is StepKind.RESULT
    assert dict(machine.status().skipped)[StepKind.ROTATIONS] == "the stream has no gyroscope"


def test_a_reading_at_the_end_of_the_range_is_clipped() -> None:
    rate = np.zeros((50, 3))
    rate[20, 2] = -4.36
    assert clipped_axis(rate, np.zeros(3), 4.363, "rad/s") == "z"
    assert clipped_axis(rate, np.zeros(3), 8.7, "rad/s") is None


@pytest.mark.parametrize(("size", "clipped"), [(0.005, None), (2.18, "x")])
def test_a_plateau_within_every_usual_range_is_not_clipped(
    size: float, clipped: str | None
) -> None:
    """An axis at rest repeats its largest reading, too, where its noise is a few coarse steps."""
    rate = np.zeros((50, 3))
    rate[:20, 0] = np.arange(20) % 2 * size / 10.0
    rate[20:26, 0] = size
    assert clipped_axis(rate, np.zeros(3), None, "rad/s") == clipped


def test_a_smooth_peak_is_not_clipped_even_when_it_is_coarse() -> None:
    time = np.linspace(0.0, 1.0, 200)
    rate = np.zeros((200, 3))
    rate[:, 1] = np.round(np.sin(np.pi * time) ** 2 * 40.0) / 10.0
    assert clipped_axis(rate, np.zeros(3), None, "rad/s") is None


@pytest.mark.parametrize(
    ("peaks", "number"),
    [([], 0), ([50.0, 55.0, 60.0], 1), ([50.0, 100.0, 110.0], 2), ([30.0, 60.0, 120.0, 240.0], 3)],
)
def test_speeds_count_as_different_when_they_clearly_are(peaks: list[float], number: int) -> None:
    assert speeds(peaks) == number
