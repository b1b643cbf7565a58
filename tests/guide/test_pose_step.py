"""Up/down and poses: any order, recognised by themselves, and nothing of a broken hold."""

import numpy as np
import pytest

from imucal_wizard.core.poses import EDGES, FACES
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.guide.kinds import Act, EventKind, StepKind
from imucal_wizard.guide.plan import standard
from imucal_wizard.guide.state_machine import StateMachine
from tests.guide.device import QUICK, RATE, Device, holds_of, kinds, machine_at, texts

CENTRED = list(np.random.default_rng(4).permutation([*FACES, *EDGES]))


def test_the_hold_of_the_settle_step_counts_as_the_face_it_lies_on() -> None:
    device = Device(up="-y")
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.feed(device.rest(0.2).taken())
    assert machine.status().done == ("-y",)
    assert len(holds_of(machine, StepKind.UP_DOWN)) == len(machine.collected().holds) == 1


def test_poses_are_taken_in_any_order() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    machine.feed(device.poses(CENTRED).taken())
    assert machine.status().step is StepKind.ROTATIONS
    taken = [hold.pose for hold in holds_of(machine, StepKind.POSES)]
    assert taken == CENTRED


def test_a_hold_is_taken_at_the_needed_length_and_goes_on_growing() -> None:
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device, standard(settle_seconds=3.0, hold_seconds=2.0))
    events = machine.feed(device.hold("+x", 2.6).taken())
    assert EventKind.HOLD_TAKEN in kinds(events)
    first = machine.collected().holds[-1]
    assert first.end - first.start == pytest.approx(2.0, abs=0.35)
    machine.feed(device.rest(5.0).taken())
    grown = machine.collected().holds[-1]
    assert (grown.start, grown.pose) == (first.start, "+x")
    assert grown.end - grown.start > 7.0
    machine.feed(device.rotate("z", 30.0).taken())
    final = machine.collected().holds[-1]
    assert final.end - final.start == pytest.approx(7.4, abs=0.25)
    assert final.samples == round((final.end - final.start) * RATE)


def test_the_mean_of_a_hold_is_that_of_its_own_samples_alone() -> None:
    device = Device(noise=(0.0, 0.0))
    machine = machine_at(StepKind.POSES, device)
    machine.feed(device.hold("+x-y", 2.0).place("+z").taken())
    hold = machine.collected().holds[-1]
    expected = STANDARD_GRAVITY * np.array([1.0, -1.0, 0.0]) / np.sqrt(2.0)
    assert hold.accelerometer == pytest.approx(expected, abs=1e-12)
    assert hold.gyroscope == pytest.approx(device.gyro_bias, abs=1e-12)


def test_a_broken_hold_leaves_nothing() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    before = len(machine.collected().holds)
    device.hold("+x", 0.9).rotate("y", 3.0, 0.5).rest(0.9).rotate("y", 4.0, 0.5)
    events = machine.feed(device.taken())
    assert kinds(events).count(EventKind.HOLD_BROKEN) == 2
    assert "y" in texts(events, EventKind.HOLD_BROKEN)[0]
    assert len(machine.collected().holds) == before
    assert machine.status().done == ()


def test_a_pose_done_already_says_so_and_is_kept_as_a_repeat() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    machine.feed(device.hold("+x").hold("+y").taken())
    before = len(machine.collected().holds)
    events = machine.feed(device.hold("+x").taken())
    assert texts(events, EventKind.ALREADY_DONE)[0].startswith("+X is done already")
    assert len(machine.collected().holds) == before + 1
    assert machine.status().progress == (2.0, 18.0)


def test_an_unnamed_pose_shows_its_distance_and_is_kept_for_the_fit() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    events = machine.feed(device.hold("+x+y+z").taken())
    wrong = texts(events, EventKind.WRONG_POSE)
    assert len(wrong) == 1
    assert wrong[0].startswith("Held 35° off")
    assert machine.status().done == ()
    assert machine.collected().holds[-1].pose is None
    assert holds_of(machine, StepKind.POSES) == []


def test_the_faces_are_taken_again_after_a_move() -> None:
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.feed(device.poses(["-z", "+x", "-x", "+y", "-y"]).taken())
    assert machine.status().step is StepKind.POSES
    machine.feed(device.rest(5.0).taken())
    assert machine.status().done == ()
    assert machine.status().wanted != "-y"
    machine.feed(device.place("+z").hold("-y").taken())
    assert machine.status().done == ("-y",)


def test_the_faces_of_the_up_down_step_can_be_counted() -> None:
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.feed(device.poses(["-z", "+x", "-x", "+y", "-y"]).taken())
    assert "count-faces" in {offer.command for offer in machine.status().offers}
    machine.command("count-faces")
    status = machine.status()
    assert set(status.done) == set(FACES)
    assert "count-faces" not in {offer.command for offer in status.offers}
    assert holds_of(machine, StepKind.UP_DOWN) == holds_of(machine, StepKind.POSES)


def test_a_face_held_twice_counts_once_among_the_poses() -> None:
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.feed(device.poses(["-z", "+x", "-z", "-x", "+x", "+y", "-y"]).taken())
    assert len(holds_of(machine, StepKind.UP_DOWN)) > len(FACES)
    (said,) = machine.command("count-faces")
    assert said.text == "6 faces of the up/down step counted among the poses."
    assert set(machine.status().done) == set(FACES)


def test_faces_count_twice_when_the_procedure_says_so() -> None:
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device, standard(settle_seconds=3.0, count_faces=True))
    machine.feed(device.poses(["-z", "+x", "-x", "+y", "-y"]).taken())
    assert machine.status().step is StepKind.POSES
    assert set(machine.status().missing) == set(EDGES)


def test_the_nearest_missing_pose_is_asked_for_and_stays_asked_for() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    machine.feed(device.hold("+x").taken())
    wanted = machine.status().wanted
    assert wanted in {"+x+y", "+x-y", "+x+z", "+x-z"}
    readings = device.rotate("z", 60.0, 2.0).rotate("x", 60.0, 2.0).taken()
    machine.feed(readings)
    assert machine.status().wanted == wanted


def test_the_status_says_how_far_and_which_way_to_turn() -> None:
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.feed(device.rest(1.5).taken())
    status = machine.status()
    assert status.wanted == "+x"
    assert status.instruction == "TURN +X UP"
    assert status.off_by == pytest.approx(90.0, abs=1.0)
    assert status.guidance == "90° away: tip it to the left"
    machine.feed(device.rotate("y", -90.0).taken())
    assert machine.status().recognised == "+x"
    assert machine.status().guidance == "there: hold it still"


def test_start_values_are_the_papers_equations_13_and_14() -> None:
    device = Device(noise=(0.0, 0.0))
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.feed(device.hold("-z").hold("+x").taken())
    x, y, z = machine.status().start_values
    assert x.up == pytest.approx(STANDARD_GRAVITY)
    assert x.sensitivity is None
    assert y.up is None
    assert z.bias == pytest.approx(0.0, abs=1e-12)
    assert z.sensitivity == pytest.approx(STANDARD_GRAVITY)


def test_a_gap_breaks_a_hold() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    events = machine.feed(device.hold("+x", 0.9).gap(0.3).rest(0.9).taken())
    assert "missing" in texts(events, EventKind.HOLD_BROKEN)[0]
    assert machine.status().done == ()


def test_the_end_of_the_data_completes_a_hold_that_is_long_enough() -> None:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    machine.feed(device.hold("+x", 3.0).taken())
    machine.flush()
    held = machine.collected().holds[-1]
    assert held.end - held.start == pytest.approx(2.8, abs=0.2)


@pytest.mark.parametrize("gyro", [True, False])
def test_a_long_rest_does_not_grow_for_ever(gyro: bool) -> None:
    machine = StateMachine(QUICK, rate=10.0)
    machine.command("start")
    machine.feed(Device(rate=10.0).rest(700.0).readings(gyro=gyro))
    hold = machine.collected().holds[0]
    assert hold.end - hold.start == pytest.approx(300.0, abs=1.0)
    assert machine.status().done == ("+z",)


def test_the_status_says_whether_a_hold_here_counts() -> None:
    device = Device(up="-y")
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.feed(device.rest(0.2).taken())
    assert machine.status().act is Act.POSE  # it is taken already
    machine.feed(device.place("+x").rest(0.3).taken())
    assert machine.status().act is Act.HOLD
    machine.feed(device.place("-z").rest(1.0).taken())  # not the one that is asked for
    assert machine.status().act is Act.HOLD
    assert machine.status().detail == "−Z counts too"
    machine.feed(device.place("+x+y").rest(0.3).taken())
    assert machine.status().act is Act.POSE
