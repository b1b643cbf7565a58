"""N's eight tilted orientations, and no rotations where the offset of the gyroscope will do."""

import itertools

import numpy as np
import pytest

from imucal_wizard.core.poses import EIGHT_TILTS, NAMED, TILTS, nearest_pose, pose_in_words
from imucal_wizard.estimate.recording import FitOptions, fit_collected
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.plan import standard
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.guide.wording import label, turn_up
from imucal_wizard.simulate.actions import direction
from imucal_wizard.simulate.scripts import TILTED_POSES
from tests.guide.device import Device

NIESPODZIANY = standard(0, poses="8", settle_seconds=3.0, hold_seconds=1.0)


def at_the_poses() -> tuple[Device, StateMachine]:
    """A device that has settled and is asked for its first tilt."""
    device = Device()
    machine = StateMachine(NIESPODZIANY, rate=device.rate)
    machine.command("start")
    machine.feed(device.rest(4.0).taken())
    return device, machine


def test_the_eight_are_asked_for_in_words_and_then_it_is_done() -> None:
    """No faces before, no rotations after: nothing else belongs to the procedure."""
    device, machine = at_the_poses()
    status = machine.status()
    assert status.step is StepKind.POSES
    assert status.instruction == "TILT +Z TO +X"
    assert status.detail == "the +z face on top, tilted 30° towards +x"
    assert status.poses == 8
    assert not {StepKind.UP_DOWN, StepKind.ROTATIONS} & set(status.steps)
    machine.feed(device.poses(reversed(EIGHT_TILTS)).taken())
    assert machine.status().step is StepKind.RESULT
    assert machine.status().skipped == ()
    holds = machine.collected().holds
    assert [hold.pose for hold in holds if hold.pose in EIGHT_TILTS] == list(reversed(EIGHT_TILTS))


def test_they_are_those_of_the_virtual_hand_and_no_two_can_be_mistaken() -> None:
    """``simulate --poses 8`` tilts by 25° and 65°: each is nearest to one of the eight."""
    for up in TILTED_POSES:
        assert nearest_pose(direction(up), EIGHT_TILTS, 6.0) is not None
    named = [NAMED[name] for name in EIGHT_TILTS]
    nearer = max(float(one @ other) for one, other in itertools.combinations(named, 2))
    assert np.degrees(np.arccos(nearer)) > 40.0


@pytest.mark.parametrize("name", sorted(TILTS))
def test_the_virtual_hand_knows_the_tilts_by_the_same_names(name: str) -> None:
    assert direction(name) == pytest.approx(TILTS[name])


def test_a_tilt_is_read_as_it_is_written() -> None:
    assert label("-x~+z") == "−X TO +Z"
    assert turn_up("-x~+z") == "TILT −X TO +Z"
    assert pose_in_words("-x~+z") == "the −x face on top, tilted 30° towards +z"


def test_what_eight_tilts_do_not_determine_is_left_out_and_named() -> None:
    """Nine directions with the first rest carry fewer than nine parameters; the report says so."""
    device, machine = at_the_poses()
    machine.feed(device.poses(EIGHT_TILTS).taken())
    units = {"accelerometer": "m/s^2", "gyroscope": "rad/s"}
    options = FitOptions(gyroscope_method="offset")
    report = fit_collected(machine.collected(), units, device.rate, options)
    accelerometer, gyroscope = report.sensors["accelerometer"], report.sensors["gyroscope"]
    left = {one.name for one in accelerometer.parameters if not one.carried}
    assert left
    assert left <= {"theta_yz", "theta_zy", "theta_zx"}
    assert any("do not determine" in text for text in report.warnings)
    assert gyroscope.method == "offset"
    assert gyroscope.model == ("bias",)
    np.testing.assert_array_equal(gyroscope.matrix, np.eye(3))
