"""Never stuck without a reason: what is said, offered and done when the device is never still."""

import pytest

from imucal_wizard.core.limits.procedure import MAX_LOOSENED
from imucal_wizard.guide.kinds import Act, EventKind, StepKind
from imucal_wizard.guide.plan import standard
from tests.guide.device import Device, kinds, machine_at, texts


def test_the_axis_that_moves_is_named_with_its_value_and_limit() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    machine.feed(device.rotate("z", 30.0, 5.0).rotate("z", 6.0, 2.0).taken())
    worst = machine.status().still.worst
    assert worst is not None
    assert worst.channel == "gz"
    assert worst.unit == "°/s"
    assert worst.moving
    assert machine.status().still.reason.startswith("z turns at")
    assert {motion.channel for motion in machine.status().still.motions} == {
        "ax", "ay", "az", "gx", "gy", "gz",
    }  # fmt: skip


def test_a_tremor_is_offered_ways_out_after_fifteen_seconds_and_met_half_way_after_thirty() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    device.place("+x")
    machine.feed(device.shake(13.0, force=0.06, rate=0.002).taken())
    assert machine.status().offers[-1].command != "remeasure"
    events = machine.feed(device.shake(4.0, force=0.06, rate=0.002).taken())
    assert kinds(events).count(EventKind.STUCK) == 1
    commands = {offer.command for offer in machine.status().offers}
    assert {"loosen", "take", "remeasure"} <= commands
    events = machine.feed(device.shake(20.0, force=0.06, rate=0.002).taken())
    assert "2 times wider" in texts(events, EventKind.WARNING)[0]
    assert machine.status().still.loosened == 2.0
    assert machine.status().done == ("+x",)


def test_a_hold_that_breaks_again_and_again_is_offered_ways_out_too() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    device.place("+x")
    for _ in range(12):
        device.rest(0.9).rotate("y", 0.7, 0.4).rotate("y", -0.7, 0.4)
    events = machine.feed(device.taken())
    assert EventKind.STUCK in kinds(events)


def test_a_device_that_is_being_carried_does_not_loosen_the_limits() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    device.place("+x")
    events = machine.feed(device.shake(100.0, force=5.0, rate=2.0).taken())
    assert kinds(events).count(EventKind.STUCK) == 1
    assert machine.status().still.loosened == 1.0


def test_no_way_out_is_offered_where_no_hold_is_wanted() -> None:
    """In a pose that is taken the one instruction is to turn it into another one."""
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    wanted = machine.status().wanted
    events = machine.feed(device.shake(60.0, force=0.06, rate=0.002).taken())
    assert machine.status().act is Act.POSE
    assert machine.status().wanted == wanted
    assert machine.status().offers == ()
    assert EventKind.STUCK not in kinds(events)
    assert machine.status().still.loosened == 1.0


def test_the_way_out_is_no_longer_advised_once_the_device_has_left() -> None:
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.feed(device.place("+x").shake(17.0, force=0.06, rate=0.002).taken())
    event = machine.status().last_event
    assert event is not None
    assert event.kind is EventKind.STUCK
    machine.feed(device.rotate("y", 60.0).taken())
    assert machine.status().offers == ()
    assert machine.status().last_event is None


def test_the_limits_have_an_end() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    for _ in range(10):
        machine.command("loosen")
    assert machine.status().still.loosened == MAX_LOOSENED
    assert "cannot be wider" in machine.command("loosen")[0].text


def test_the_limits_loosen_at_the_operators_word() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    machine.feed(device.place("+x").shake(3.0, force=0.06, rate=0.002).taken())
    assert machine.status().done == ()
    machine.command("loosen")
    machine.feed(device.shake(3.0, force=0.06, rate=0.002).taken())
    assert machine.status().done == ("+x",)


def test_a_hold_can_be_taken_hand_held_from_the_newest_seconds() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    machine.feed(device.place("+x").shake(3.0, force=0.5, rate=0.3).taken())
    machine.command("take")
    hold = machine.collected().holds[-1]
    assert hold.hand_held
    assert hold.pose == "+x"
    assert hold.end - hold.start == pytest.approx(1.0, abs=0.11)
    assert machine.status().done == ("+x",)
    machine.feed(device.shake(2.0, force=0.5, rate=0.3).hold("+y").taken())
    assert machine.status().done == ("+x", "+y")
    assert not machine.collected().holds[-1].hand_held


def test_a_second_hand_held_hold_never_shares_samples_with_the_first() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    machine.feed(device.place("+x").shake(3.0).taken())
    machine.command("take")
    assert "too few samples" in machine.command("take")[0].text


def test_the_noise_can_be_measured_again_and_the_step_goes_on() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    machine.feed(device.hold("+x").place("+y").taken())
    machine.command("remeasure")
    assert machine.status().step is StepKind.SETTLE
    device.noise = (0.06, 0.001)
    machine.feed(device.rest(4.0).taken())
    assert machine.status().step is StepKind.POSES
    assert machine.status().still.motions[0].limit > 20.0
    machine.feed(device.hold("-x").taken())
    assert set(machine.status().done) == {"+x", "+y", "-x"}


def test_nothing_is_waited_for_while_a_hold_is_complete() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    events = machine.feed(device.hold("+x", 60.0).taken())
    assert EventKind.STUCK not in kinds(events)
    assert machine.status().still.waiting == 0.0


def test_limits_that_were_loosened_come_back_with_the_first_calm_hold() -> None:
    """A trembling hold keeps them wide; one that lies on the table does not need them."""
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    machine.feed(device.place("+x").shake(3.0, force=0.06, rate=0.002).taken())
    machine.command("loosen")
    machine.feed(device.shake(3.0, force=0.06, rate=0.002).taken())
    assert machine.status().done == ("+x",)
    assert machine.status().still.loosened == 2.0
    events = machine.feed(device.hold("+y").taken())
    assert machine.status().done == ("+x", "+y")
    assert machine.status().still.loosened == 1.0
    assert "limits are back" in texts(events, EventKind.WARNING)[0]
    assert kinds(events)[-1] is EventKind.HOLD_TAKEN


def test_a_slow_motion_within_wide_limits_is_not_called_still() -> None:
    """Its rest is as long as the step asks for, but no hold: the screen says why."""
    device = Device()
    machine = machine_at(StepKind.POSES, device, standard(2, settle_seconds=3.0))
    for _ in range(4):
        machine.command("loosen")
    device.place("+x")
    for _ in range(9):
        device.rotate("z", 3.0, 1.0).rotate("z", -3.0, 1.0)
    events = machine.feed(device.taken())
    still = machine.status().still
    assert still.held == still.needed
    assert (still.still, still.reason) == (False, "it turns or sways slowly")
    (stuck,) = texts(events, EventKind.STUCK)
    assert stuck == "No rest for 15 s: it turns or sways slowly. Lean it on something."


def test_a_slow_motion_that_rests_for_long_enough_is_taken_back_when_it_goes_on() -> None:
    """The whole rest decides, as in a recording, and the pose is asked for again."""
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    for _ in range(4):
        machine.command("loosen")
    device.place("+x").rotate("z", 1.5, 3.0).rotate("z", 3.0, 3.0).rotate("z", 10.0, 4.0)
    events = machine.feed(device.rotate("z", 90.0).taken())
    assert EventKind.HOLD_TAKEN in kinds(events)
    assert texts(events, EventKind.UNDONE) == ["+X was taken back: the device was turning slowly."]
    assert machine.status().done == ()
    assert not machine.collected().holds[1:]
