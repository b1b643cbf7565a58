"""What the bench asks for beyond the plan: exactly that, by itself, and back to the result."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.poses import DIRECTIONS, TILTS
from imucal_wizard.core.readings import Series
from imucal_wizard.guide.kinds import EventKind, StepKind
from imucal_wizard.guide.state import Event
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.measurement.requests import (
    MeasurementRequest,
    requests_from_text,
    requests_to_text,
)
from tests.guide.device import Device, machine_at, part, pose_asked, rotations_of, texts

CORNERS = ("+x+y+z", "-x-y+z")


def at_result(*faces: str) -> tuple[Device, StateMachine]:
    """A machine at its result, with some faces held."""
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.feed(device.poses(faces or ("+x", "-y")).taken())
    machine.command("goto", "result")
    return device, machine


def ask(machine: StateMachine, *asked: MeasurementRequest) -> None:
    """Ask for these."""
    machine.command("measure", requests_to_text(asked))


def turn(axis: str, count: int, start: str = "+z") -> MeasurementRequest:
    """Some turns about an axis."""
    return MeasurementRequest(pose_asked(start).up, start, "", axis=axis, turns=count)


def test_exactly_these_poses_are_asked_for_in_any_order_and_the_result_comes_by_itself() -> None:
    device, machine = at_result()
    ask(machine, *map(pose_asked, CORNERS))
    status = machine.status()
    assert status.step is StepKind.MORE
    assert set(status.missing) == set(CORNERS)
    assert status.wanted in CORNERS
    machine.feed(device.hold(CORNERS[1]).taken())
    assert machine.status().done == (CORNERS[1],)
    assert machine.status().progress == (1.0, 2.0)
    machine.feed(device.hold(CORNERS[0]).taken())
    assert machine.status().step is StepKind.RESULT
    assert [hold.pose for hold in machine.collected().holds[-2:]] == [CORNERS[1], CORNERS[0]]


def test_the_reason_stands_beside_the_pose() -> None:
    _, machine = at_result()
    ask(machine, pose_asked("+x+y", "tells one from the other", warm=True))
    assert machine.status().reason == "tells one from the other"
    assert "warm it first" in machine.status().detail


def test_the_placement_in_which_it_was_asked_counts_only_after_a_move() -> None:
    device, machine = at_result("+x", "-y")
    ask(machine, pose_asked("-y"))
    machine.feed(device.rest(5.0).taken())
    assert machine.status().missing == ("-y",)
    assert "lift it" in machine.status().guidance
    machine.feed(device.rotate("x", 30.0).rotate("x", -30.0).rest(3.0).taken())
    assert machine.status().step is StepKind.RESULT


def test_a_pose_asked_for_twice_is_held_twice() -> None:
    device, machine = at_result("+x")
    ask(machine, pose_asked("+z"), pose_asked("+z"), pose_asked("-z"))
    machine.feed(device.hold("+z").taken())
    assert sorted(machine.status().missing) == ["+z", "-z"]
    assert machine.status().wanted == "-z"
    machine.feed(device.hold("-z").hold("+z").taken())
    assert machine.status().step is StepKind.RESULT


def test_a_direction_without_a_name_is_recognised() -> None:
    device, machine = at_result("+x")
    up = DIRECTIONS["+x"] * np.cos(0.4) + DIRECTIONS["+y"] * np.sin(0.4)
    ask(machine, MeasurementRequest((float(up[0]), float(up[1]), float(up[2]))))
    assert machine.status().wanted is None
    assert machine.status().wanted_up == pytest.approx(tuple(up))
    machine.feed(device.rotate("z", np.degrees(-0.4)).rest(3.0).taken())
    assert machine.status().step is StepKind.RESULT


def test_a_tilt_between_face_and_edge_is_neither_of_them() -> None:
    device, machine = at_result("+x")
    x, y, z = TILTS["+x~+y"].tolist()
    ask(machine, MeasurementRequest((x, y, z)))
    assert machine.status().detail == "the +x face on top, tilted 30° towards +y"
    machine.feed(device.hold("+x+y").taken())
    assert machine.status().step is StepKind.MORE
    machine.feed(device.rotate("z", 15.0).rest(3.0).taken())
    assert machine.status().step is StepKind.RESULT


def test_a_pose_that_was_not_requested_is_kept() -> None:
    device, machine = at_result("+x")
    held = len(machine.collected().holds)
    ask(machine, pose_asked("+x+y+z"))
    events = machine.feed(device.hold("-x").taken())
    assert "off +X +Y +Z" in texts(events, EventKind.WRONG_POSE)[0]
    assert machine.status().missing == ("+x+y+z",)
    assert len(machine.collected().holds) == held + 1


def test_turns_are_taken_like_those_of_the_plan() -> None:
    device, machine = at_result("+x", "+z")
    ask(machine, turn("x", 2))
    assert machine.status().rotation is not None
    machine.feed(device.rest(2.0).rotate("x", 90.0).rest(2.0).taken())
    status = machine.status()
    assert status.rotation is not None
    assert status.rotation.done == pytest.approx((90.0,), abs=1.0)
    assert status.progress == (1.0, 2.0)
    machine.feed(device.rotate("x", -90.0).rest(2.0).taken())
    assert machine.status().step is StepKind.RESULT
    assert len(rotations_of(machine)) == 2


def test_undo_takes_back_the_last_turn_and_not_the_hold_that_ends_it() -> None:
    device, machine = at_result("+x", "+z")
    ask(machine, turn("x", 3))
    machine.feed(device.rest(2.0).rotate("x", 90.0).rest(2.0).rotate("x", -90.0).rest(2.0).taken())
    machine.command("undo")
    machine.command("undo")
    assert machine.status().step is StepKind.MORE
    assert machine.status().progress == (0.0, 3.0)


def test_undo_from_the_result_asks_for_the_last_pose_again() -> None:
    device, machine = at_result("+x")
    ask(machine, pose_asked("+y"))
    machine.feed(device.hold("+y").taken())
    machine.command("undo")
    assert machine.status().step is StepKind.MORE
    assert machine.status().missing == ("+y",)
    assert machine.status().wanted == "+y"


@pytest.mark.parametrize("command", ["back", "skip"])
def test_the_step_can_be_left_early(command: str) -> None:
    device, machine = at_result("+x")
    ask(machine, *map(pose_asked, CORNERS))
    machine.feed(device.hold(CORNERS[0]).taken())
    machine.command(command)
    assert machine.status().step is StepKind.RESULT
    assert machine.collected().holds[-1].pose == CORNERS[0]


def test_repeating_takes_back_this_round_only() -> None:
    device, machine = at_result("+x")
    ask(machine, pose_asked("+y"))
    machine.feed(device.hold("+y").taken())
    held = len(machine.collected().holds)
    ask(machine, pose_asked("-y"), pose_asked("-z"))
    machine.feed(device.hold("-y").taken())
    machine.command("repeat")
    assert len(machine.collected().holds) == held
    assert set(machine.status().missing) == {"-y", "-z"}


def test_poses_that_need_a_warm_device_come_last() -> None:
    _, machine = at_result("+x")
    ask(machine, pose_asked("+x", warm=True), pose_asked("-z"))
    assert machine.status().wanted == "-z"


def test_a_pose_for_a_warm_device_is_asked_again_until_it_is_warm() -> None:
    """One instruction: how warm, and the same pose; the cold hold counts for nothing asked."""
    device, machine = at_result("+x")

    def held(pose: str, degrees: float) -> list[Event]:
        readings = device.hold(pose).taken()
        time = readings.accelerometer.time
        warmth = Series(time, np.full((len(time), 1), degrees), "degC")
        return [*machine.feed(replace(readings, temperature=warmth))]

    ask(machine, pose_asked("+y", warm=True), pose_asked("-z"))
    held("-z", 24.0)
    events = held("+y", 28.0)
    said = texts(events, EventKind.WARNING)
    assert said == [
        "The device has only 28.0 °C: warm it to at least 29.0 °C, then hold this pose again."
    ]
    assert not texts(events, EventKind.HOLD_TAKEN)
    assert machine.status().wanted == "+y"
    assert "warm it first" in machine.status().detail
    device.place("+x")
    held("+y", 39.5)
    assert machine.status().step is StepKind.RESULT


def test_before_a_result_nothing_more_is_asked_for() -> None:
    machine = machine_at(StepKind.POSES, Device())
    events = machine.command("measure", requests_to_text([pose_asked("+x")]))
    assert "only after the result" in texts(events, EventKind.WARNING)[0]
    assert machine.status().step is StepKind.POSES


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '[{"up":[0,0,0]}]', '[{"up":[0,0,1],"axis":"q","turns":1}]', "+x"]
)
def test_an_impossible_request_is_refused(text: str) -> None:
    _, machine = at_result("+x")
    with pytest.raises(UsageError, match="measure"):
        machine.command("measure", text)
    assert machine.status().step is StepKind.RESULT


def test_what_is_asked_for_comes_back_from_its_text() -> None:
    asked = (pose_asked("+x+y+z", "why", warm=True), turn("z", 6, "+x"))
    assert requests_from_text(requests_to_text(asked)) == asked


def test_however_the_samples_are_cut_the_holds_are_the_same() -> None:
    device = Device().rest(4.0).poses(["+x", "+y"])
    first = device.taken()
    more = device.hold("-x-y+z").hold("+x+y+z").taken()
    found = []
    for size in (len(more), 37):
        machine = StateMachine(rate=device.rate)
        machine.command("start")
        machine.feed(first)
        machine.command("goto", "result")
        ask(machine, *map(pose_asked, CORNERS))
        for k in range(0, len(more), size):
            machine.feed(part(more, k, min(k + size, len(more))))
        found.append([hold.accelerometer.tobytes() for hold in machine.collected().holds])
    assert found[0] == found[1]
