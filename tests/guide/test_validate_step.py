"""Validation: orientations that the fit has not seen, away from all that it has."""

import pytest

from imucal_wizard.guide.kinds import EventKind, StepKind
from imucal_wizard.guide.state_machine import StateMachine
from tests.guide.device import Device, kinds, machine_at, texts


def validating() -> tuple[Device, StateMachine]:
    """A device with a few poses taken, at the beginning of the validation."""
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    machine.feed(device.hold("+x").hold("+y").taken())
    machine.command("goto", "result")
    machine.command("validate")
    return device, machine


def test_new_orientations_go_to_the_validation_only_and_then_it_is_time_to_save() -> None:
    device, machine = validating()
    before = machine.collected()
    device.poses(["+x+y+z", "-x+y+z", "-x-y+z"])
    events = machine.feed(device.taken())
    assert kinds(events).count(EventKind.HOLD_TAKEN) == 3
    assert machine.status().progress == (3.0, 4.0)
    machine.feed(device.hold("-x-y-z").taken())
    assert machine.status().step is StepKind.SAVE
    collected = machine.collected()
    assert len(collected.validation) == 4
    assert [hold.start for hold in collected.holds] == [hold.start for hold in before.holds]
    assert len(collected.rotations) == len(before.rotations)


def test_what_is_saved_does_not_change_while_the_device_goes_on_resting() -> None:
    """Saved twice it would make two files with slightly different errors."""
    device, machine = validating()
    machine.feed(device.poses(["+x+y+z", "-x+y+z", "-x-y+z", "-x-y-z"]).taken())
    assert machine.status().step is StepKind.SAVE
    before = [hold.end for hold in machine.collected().validation]
    machine.feed(device.rest(5.0).taken())
    machine.command("back")
    machine.feed(device.rest(5.0).taken())
    assert machine.status().step is StepKind.VALIDATE  # the rest is no new orientation
    machine.feed(device.hold("+x+y+z").taken())
    assert machine.status().step is StepKind.VALIDATE
    machine.command("skip")
    assert machine.status().step is StepKind.SAVE
    assert [hold.end for hold in machine.collected().validation] == before


def test_what_was_said_before_the_result_is_not_said_of_the_validation() -> None:
    _, machine = validating()
    assert machine.status().last_event is None


def test_saving_without_it_leaves_it_out_and_back_leads_to_the_result() -> None:
    _, machine = validating()
    machine.command("back")
    machine.command("save")
    status = machine.status()
    assert status.step is StepKind.SAVE
    assert "known from held-out data only" in dict(status.skipped)[StepKind.VALIDATE]
    machine.command("back")
    assert machine.status().step is StepKind.RESULT
    machine.command("validate")
    assert StepKind.VALIDATE not in dict(machine.status().skipped)


def test_an_orientation_that_the_fit_has_seen_is_refused() -> None:
    device, machine = validating()
    device.place("+x").rotate("z", 8.0).rest(2.0)
    events = machine.feed(device.taken())
    refused = texts(events, EventKind.WRONG_POSE)
    assert refused == ["Held only 8° from a pose already taken."]
    assert machine.collected().validation == ()


def test_a_device_that_still_lies_in_a_pose_after_an_interruption_is_asked_to_tilt() -> None:
    """A session that is resumed there said "Held only 0° from a pose already taken"."""
    device, machine = validating()
    events = machine.feed(device.gap(60.0).rest(4.0).taken())
    refused = texts(events, EventKind.WRONG_POSE)
    assert refused == ["This pose is already taken. Tilt it to a new one."]


def test_an_orientation_validated_already_is_refused() -> None:
    device, machine = validating()
    events = machine.feed(device.hold("+x+y+z").hold("-z").hold("+x+y+z").taken())
    assert len(machine.collected().validation) == 2
    assert EventKind.WRONG_POSE in kinds(events)


def test_corners_are_asked_for_but_any_new_orientation_will_do() -> None:
    device, machine = validating()
    machine.feed(device.rest(1.0).taken())
    wanted = machine.status().wanted
    assert wanted is not None
    assert len(wanted) == 6
    machine.feed(device.hold("-x-z").taken())
    assert machine.status().progress == (1.0, 4.0)


def test_the_last_validation_can_be_undone() -> None:
    device, machine = validating()
    machine.feed(device.hold("+x+y+z").taken())
    machine.command("undo")
    assert machine.collected().validation == ()
    assert machine.status().step is StepKind.VALIDATE


def test_rest_before_the_validation_is_not_part_of_it() -> None:
    device, machine = validating()
    machine.feed(device.rest(4.0).taken())
    assert machine.collected().validation == ()
    assert machine.status().progress == pytest.approx((0.0, 4.0))


def test_saved_without_it_the_validation_counts_as_skipped_until_it_is_done() -> None:
    device, machine = validating()
    machine.command("save")
    said = dict(machine.status().skipped)[StepKind.VALIDATE]
    assert said == "the error is known from held-out data only, not from new orientations"
    machine.command("validate")
    assert StepKind.VALIDATE not in dict(machine.status().skipped)
    machine.feed(device.hold("+x+y+z").taken())
    machine.command("save")
    said = dict(machine.status().skipped)[StepKind.VALIDATE]
    assert said == "1 of 4 new orientations were taken"
    machine.command("validate")
    machine.feed(device.poses(["-x+y+z", "-x-y+z", "-x-y-z"]).taken())
    assert machine.status().step is StepKind.SAVE
    assert StepKind.VALIDATE not in dict(machine.status().skipped)
