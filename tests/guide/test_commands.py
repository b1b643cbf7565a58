"""Skip, undo, repeat, go back and forth: always safe, and the consequence is stated."""

import pytest

from imucal_wizard.core.errors import UsageError
from imucal_wizard.guide.kinds import TITLES, EventKind, StepKind
from imucal_wizard.guide.plan import RECHECK_STEPS, Procedure
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.measurement.requests import requests_to_text
from tests.guide.device import RATE, Device, holds_of, kinds, machine_at, pose_asked, texts


def test_skipping_states_the_consequence() -> None:
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.command("skip")
    events = machine.command("skip")
    assert "nominal values" in texts(events, EventKind.STEP_SKIPPED)[0]
    assert machine.status().step is StepKind.ROTATIONS
    machine.command("skip")
    assert machine.status().step is StepKind.RESULT
    skipped = [kind for kind, _ in machine.status().skipped]
    assert skipped == [StepKind.UP_DOWN, StepKind.POSES, StepKind.ROTATIONS]


def test_a_step_gone_back_to_is_not_skipped_any_more() -> None:
    machine = machine_at(StepKind.UP_DOWN, Device())
    machine.command("skip")
    machine.command("back")
    assert machine.status().step is StepKind.UP_DOWN
    assert machine.status().skipped == ()


def test_the_settle_step_can_be_skipped_and_poses_are_still_recognised() -> None:
    device = Device().rest(2.0).hold("+x").hold("-y")
    machine = StateMachine(rate=RATE)
    machine.command("start")
    machine.feed(Device().rest(0.5).readings())
    machine.command("skip")
    machine.feed(device.gap(1.0).readings())
    assert machine.status().done == ("+x", "-y")


def test_undo_takes_back_the_last_hold_and_asks_for_its_pose_again() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    machine.feed(device.hold("+x").hold("+y").taken())
    before = len(machine.collected().holds)
    rotations = len(machine.collected().rotations)
    events = machine.command("undo")
    assert texts(events, EventKind.UNDONE) == ["+Y was taken back."]
    assert machine.status().done == ("+x",)
    assert machine.status().wanted == "+y"
    assert len(machine.collected().holds) == before - 1
    assert len(machine.collected().rotations) == rotations - 1
    machine.feed(device.rest(3.0).taken())
    assert machine.status().done == ("+x",)
    machine.feed(device.place("+z").hold("+y").taken())
    assert set(machine.status().done) == {"+x", "+y"}


def test_undo_after_the_last_hold_of_a_step_goes_back_to_it() -> None:
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.feed(device.poses(["-z", "+x", "-x", "+y", "-y"]).taken())
    machine.command("undo")
    status = machine.status()
    assert (status.step, status.missing) == (StepKind.UP_DOWN, ("-y",))
    machine.feed(device.place("+z").hold("-y").taken())
    assert machine.status().step is StepKind.POSES


def test_a_skipped_step_stays_skipped_when_undo_leads_from_it_to_a_later_one() -> None:
    """The last measurement is one of the poses; up/down is not done by that."""
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.command("skip")
    machine.feed(device.hold("+x+y").taken())
    machine.command("back")
    assert machine.status().step is StepKind.UP_DOWN
    assert texts(machine.command("undo"), EventKind.UNDONE) == ["+X +Y was taken back."]
    assert machine.status().step is StepKind.POSES
    assert [kind for kind, _ in machine.status().skipped] == [StepKind.UP_DOWN]


def test_undo_after_a_skip_takes_back_the_skip_alone() -> None:
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.feed(device.hold("+x").taken())
    taken = machine.status().done
    assert "+x" in taken
    machine.command("skip")
    machine.command("skip")
    assert machine.status().step is StepKind.ROTATIONS
    for step in (StepKind.POSES, StepKind.UP_DOWN):
        (said,) = texts(machine.command("undo"), EventKind.UNDONE)
        assert said == f"The skip of {TITLES[step]} was taken back."
        assert machine.status().step is step
    assert machine.status().done == taken
    assert machine.status().skipped == ()
    assert texts(machine.command("undo"), EventKind.UNDONE) == ["+X was taken back."]


def test_undo_after_a_hold_in_the_step_after_a_skipped_one_takes_back_the_hold_first() -> None:
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.command("skip")
    machine.feed(device.hold("+x+y").taken())
    assert texts(machine.command("undo"), EventKind.UNDONE) == ["+X +Y was taken back."]
    assert machine.status().step is StepKind.POSES
    machine.command("undo")
    assert machine.status().step is StepKind.UP_DOWN


def test_undo_takes_back_the_last_rotation() -> None:
    device = Device()
    machine = machine_at(StepKind.ROTATIONS, device)
    device.rest(0.5).rotate("x", 90.0).rest(2.0).rotate("x", -50.0).rest(2.0)
    machine.feed(device.taken())
    before = machine.status().progress
    machine.command("undo")
    assert machine.status().progress[0] == before[0] - 1
    machine.feed(device.rotate("y", 90.0).taken())
    assert machine.status().step is StepKind.ROTATIONS


def test_undo_of_the_settled_face_keeps_the_noise() -> None:
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.feed(device.rest(0.5).taken())
    assert texts(machine.command("undo"), EventKind.UNDONE) == ["+Z was taken back."]
    assert machine.status().done == ()
    assert machine.status().wanted == "+z"
    assert len(machine.collected().holds) == 1
    assert "nothing to undo" in machine.command("undo")[0].text


def test_everything_can_be_undone_one_by_one() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    machine.feed(device.poses(["+x", "+y", "+x", "+x+y+z"]).taken())
    for _ in range(4):
        machine.command("undo")
    assert machine.status().done == ()
    assert len(machine.collected().holds) == 1


def test_repeat_begins_the_step_again_without_what_it_took() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    machine.feed(device.hold("+x").hold("+y").taken())
    events = machine.command("repeat")
    assert "2 holds taken back" in events[-1].text
    assert machine.status().done == ()
    machine.feed(device.rest(3.0).taken())
    assert machine.status().done == ("+y",)


def test_repeat_of_the_rotations_begins_with_the_first_axis() -> None:
    device = Device()
    machine = machine_at(StepKind.ROTATIONS, device)
    machine.feed(device.rest(0.5).rotate("x", 90.0).rest(2.0).rotate("x", -90.0).rest(2.0).taken())
    assert machine.status().rotation is not None
    machine.command("repeat")
    assert machine.status().progress == (0.0, 6.0)
    machine.feed(device.rest(2.0).rotate("x", 90.0).rest(2.0).taken())
    assert machine.status().progress == (1.0, 6.0)


def test_repeat_of_the_settle_step_measures_the_noise_anew() -> None:
    device = Device()
    machine = machine_at(StepKind.SETTLE, device)
    machine.feed(device.rest(1.0).taken())
    machine.command("repeat")
    machine.feed(device.rest(2.9).taken())
    assert machine.status().step is StepKind.SETTLE
    machine.feed(device.rest(1.0).taken())
    assert machine.status().step is StepKind.UP_DOWN


def test_a_finished_step_gone_back_to_keeps_its_holds_and_offers_to_go_on() -> None:
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.feed(device.poses(["-z", "+x", "-x", "+y", "-y"]).taken())
    machine.command("goto", "up-down")
    machine.feed(device.rest(3.0).taken())
    assert machine.status().step is StepKind.UP_DOWN
    assert [offer.command for offer in machine.status().offers] == ["skip"]
    machine.command("skip")
    assert machine.status().step is StepKind.POSES
    assert machine.status().skipped == ()


def test_one_more_hold_in_a_finished_step_goes_on_by_itself() -> None:
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.feed(device.poses(["-z", "+x", "-x", "+y", "-y"]).taken())
    machine.command("back")
    events = machine.feed(device.hold("+x").taken())
    assert EventKind.ALREADY_DONE in kinds(events)
    assert machine.status().step is StepKind.POSES
    assert len(holds_of(machine, StepKind.UP_DOWN)) == 7


def test_a_rest_does_not_end_the_rotations_that_the_user_went_back_to() -> None:
    """A key does, and nothing is skipped."""
    device = Device()
    machine = machine_at(StepKind.ROTATIONS, device)
    for axis, degrees in (("x", 90.0), ("y", 90.0), ("z", 90.0)) * 6:
        if machine.status().step is not StepKind.ROTATIONS:
            break
        start = {"x": "+z", "y": "+z", "z": "+x"}[axis]
        device.hold(start).rotate(axis, degrees).rest(2.5).rotate(axis, -degrees).rest(2.5)
        machine.feed(device.taken())
    assert machine.status().step is StepKind.RESULT
    machine.command("back")
    machine.feed(device.rest(5.0).taken())
    assert machine.status().step is StepKind.ROTATIONS
    before = machine.status().skipped
    machine.command("skip")
    assert machine.status().step is StepKind.RESULT
    assert machine.status().skipped == before


def test_steps_that_are_jumped_over_count_as_skipped_with_their_consequence() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    machine.feed(device.hold("+x+y").taken())
    machine.command("goto", "result")
    skipped = dict(machine.status().skipped)
    assert set(skipped) == {StepKind.UP_DOWN, StepKind.POSES, StepKind.ROTATIONS}
    assert "motions made before" in skipped[StepKind.ROTATIONS]
    machine.command("back")
    assert StepKind.ROTATIONS not in dict(machine.status().skipped)


def test_after_an_undo_the_device_must_be_moved_before_it_counts_again() -> None:
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.feed(device.hold("+x").taken())
    assert not machine.status().still.spent
    machine.command("undo")
    machine.feed(device.rest(2.0).taken())
    status = machine.status()
    assert status.still.spent
    assert status.still.held == 0.0
    assert (status.wanted, status.guidance) == ("+x", "lift it and put it back the same way")
    machine.feed(device.hold("-y").taken())
    assert not machine.status().still.spent


def test_back_from_the_first_step_stays_there() -> None:
    machine = StateMachine(rate=RATE)
    machine.command("back")
    assert machine.status().step is StepKind.SOURCE


@pytest.mark.parametrize(
    ("step", "after"), [("poses", "result"), ("validate", "save"), ("source", "source")]
)
def test_when_the_data_end_a_step_that_measures_gives_way(step: str, after: str) -> None:
    machine = machine_at(StepKind.POSES, Device())
    machine.command("goto", step)
    machine.command("end")
    assert machine.status().step == after


@pytest.mark.parametrize(("name", "argument"), [("dance", ""), ("goto", "nowhere"), ("goto", "")])
def test_an_unknown_command_says_which_there_are(name: str, argument: str) -> None:
    with pytest.raises(UsageError, match="give one of"):
        StateMachine(rate=RATE).command(name, argument)


@pytest.mark.parametrize("step", [*Procedure().kinds, StepKind.MORE])
@pytest.mark.parametrize(
    "name",
    ["start", "skip", "undo", "repeat", "back", "loosen", "take", "remeasure", "validate", "end"],
)
def test_every_command_is_safe_in_every_step(step: StepKind, name: str) -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    if step is StepKind.MORE:
        machine.command("goto", "result")
        machine.command("measure", requests_to_text([pose_asked("+x"), pose_asked("-y")]))
    else:
        machine.command("goto", step)
    machine.command(name)
    machine.feed(device.rest(1.0).hold("+x+y+z").shake(1.0).taken())
    machine.command(name)
    machine.feed(device.hold("+y").taken())
    machine.flush()
    collected = machine.collected()
    starts = [hold.start for hold in collected.holds]
    assert starts == sorted(starts)
    machine.command("goto", "up-down")
    machine.feed(device.shake(1.0).hold("-z").taken())
    assert "-z" in machine.status().done


@pytest.mark.parametrize("step", [one.kind for one in RECHECK_STEPS])
@pytest.mark.parametrize("name", ["undo", "back", "save", "end"])
def test_every_command_is_safe_in_a_recheck(step: StepKind, name: str) -> None:
    device = Device()
    machine = StateMachine(Procedure(RECHECK_STEPS), rate=RATE)
    machine.command("start")
    machine.feed(device.rest(8.0).taken())
    machine.command("goto", step)
    machine.command(name)
    machine.feed(device.rest(1.0).hold("+x+y+z").shake(1.0).taken())
    machine.command(name)
    machine.feed(device.hold("+y").taken())
    machine.flush()
    machine.command("goto", "recheck")
    machine.feed(device.shake(1.0).hold("-z").taken())
    assert "-z" in {hold.pose for hold in machine.collected().holds}
