"""The hand that follows: whatever the wizard asks for, it does, the same at any speed."""

from dataclasses import dataclass

import numpy as np
import pytest

from imucal_wizard.core.instruction import Instruction, RotationRequest
from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.plan import standard
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.measurement.holds import Collected, Rotation
from imucal_wizard.simulate.hand import REACTION_SECONDS, VirtualHand
from imucal_wizard.simulate.imu import VirtualImu
from imucal_wizard.simulate.samples import VirtualStream
from imucal_wizard.simulate.scripts import ANGLES_DEG, LARGEST_TILT_DEG, next_angle
from imucal_wizard.simulate.sensor import SensorModel
from tests.guide.device import holds_of, rotations_of

LONGEST = 400.0


@dataclass(frozen=True)
class _Outcome:
    step: StepKind
    seconds: float
    collected: Collected
    faces: int
    poses: int
    turns: list[Rotation]


def _led(batch: int) -> _Outcome:
    """The whole procedure: the machine asks, the hand does."""
    hand = VirtualHand(seed=3)
    stream = VirtualStream(hand, SensorModel.drawn(3), seed=3)
    machine = StateMachine(standard(rotations_per_axis=2), rate=100.0, listener=hand.follow)
    machine.command("start")
    while hand.time < LONGEST and machine.status().step is not StepKind.SAVE:
        samples = stream.take(batch)
        t = samples.time
        force = Series(t, samples.accelerometer, "m/s^2")
        rate = Series(t, samples.gyroscope, "rad/s")
        machine.feed(Readings(force, rate, None, Series(t, samples.temperature[:, None], "degC")))
        if machine.status().step is StepKind.RESULT:
            machine.command("validate")
    faces, poses = (len(holds_of(machine, one)) for one in (StepKind.UP_DOWN, StepKind.POSES))
    step, turns = machine.status().step, rotations_of(machine)
    return _Outcome(step, hand.time, machine.collected(), faces, poses, turns)


@pytest.fixture(scope="module")
def led() -> _Outcome:
    return _led(batch=10)


@pytest.mark.study
def test_the_whole_procedure_is_done_without_a_key(led: _Outcome) -> None:
    """Every step to the end in some minutes of samples, with nothing left out."""
    assert led.step is StepKind.SAVE
    assert led.seconds < 300.0
    assert led.faces == 6
    assert led.poses == 18
    assert len(led.turns) >= 6
    assert len(led.collected.validation) >= 4


def test_turns_are_taken_in_both_senses(led: _Outcome) -> None:
    """About each axis the hand turns one way and the other."""
    for axis in "xyz":
        mean = [
            float(np.mean(turn.rate[:, "xyz".index(axis)]))
            for turn in led.turns
            if turn.axis == axis
        ]
        assert min(mean) < 0.0 < max(mean)


def test_what_is_measured_does_not_depend_on_when_the_wizard_is_heard(led: _Outcome) -> None:
    """The same holds to the last bit in pieces of a tenth of a second and of 1.4 s."""
    other = _led(140)
    assert [hold.start for hold in other.collected.holds] == [
        hold.start for hold in led.collected.holds
    ]
    for one, two in zip(led.collected.holds, other.collected.holds, strict=True):
        np.testing.assert_array_equal(one.accelerometer, two.accelerometer)


def _asked(
    step: StepKind, *, pose: str | None = None, rotation: RotationRequest | None = None
) -> Instruction:
    return Instruction(step, pose, rotation, held=9.0, needed=2.0)


def _hears(hand: VirtualHand, asked: Instruction) -> None:
    """The hand is told of all samples so far, and its reaction time passes."""
    hand.follow(asked, hand.sample)
    hand.advance(round(REACTION_SECONDS * 100.0))


def test_the_hand_rests_where_nothing_is_asked() -> None:
    """In settle, result and save it does not touch the device."""
    hand = VirtualHand()
    for step in (StepKind.SOURCE, StepKind.SETTLE, StepKind.RESULT, StepKind.SAVE):
        hand.advance(100)
        _hears(hand, _asked(step))
        assert not np.any(hand.advance(300).rate)


def test_an_instruction_is_acted_on_after_the_reaction_time_and_not_a_sample_sooner() -> None:
    """Also when it was heard only a moment before."""
    hand = VirtualHand()
    hand.advance(100)
    hand.follow(_asked(StepKind.POSES, pose="+x"), 50)
    before = hand.advance(100)
    assert not before.rate.any()
    assert np.abs(hand.advance(50).rate).max() > 0.5


def test_a_pose_asked_for_is_placed_once_and_again_when_it_is_not_taken() -> None:
    """It waits for the wizard's word, and tries once more after some seconds."""
    hand = VirtualHand()
    asked = _asked(StepKind.POSES, pose="+x-y")
    hand.advance(10)
    _hears(hand, asked)
    hand.advance(500)
    before = hand.up
    assert before[0] > 0.6
    assert before[1] < -0.6
    _hears(hand, asked)
    assert not np.any(hand.advance(10).rate)
    hand.advance(1500)
    _hears(hand, asked)
    assert np.any(hand.advance(10).rate)


def test_an_instruction_from_before_the_last_move_is_not_obeyed() -> None:
    """What the wizard said before it saw the move is out of date."""
    hand = VirtualHand()
    hand.snap_to("+x")
    hand.advance(300)
    hand.follow(_asked(StepKind.POSES, pose="-y"), 50)
    hand.advance(300)
    assert hand.up[0] > 0.9


def test_rotations_begin_in_their_start_pose() -> None:
    """For z the x face is brought up first, then the turn is about z."""
    hand = VirtualHand()
    asked = _asked(StepKind.ROTATIONS, rotation=RotationRequest("z", "+x"))
    hand.advance(10)
    _hears(hand, asked)
    hand.advance(800)
    assert hand.up[0] > 0.99
    _hears(hand, asked)
    motion = hand.advance(800)
    assert np.abs(motion.rate).max(0).argmax() == 2


def test_turns_keep_within_one_turn_of_the_start() -> None:
    """However many, the device never goes round and round."""
    tilt = 0.0
    for turn in range(40):
        tilt += next_angle(turn, tilt)
        assert abs(tilt) <= LARGEST_TILT_DEG
    assert len(ANGLES_DEG) == 10


@pytest.mark.parametrize(("angle", "fastest"), [(-150.0, 50.0), (60.0, 220.0)])
def test_the_hand_makes_the_rotation_that_is_asked_for(angle: float, fastest: float) -> None:
    """Its axis, sense, angle and speed."""
    hand = VirtualHand()
    asked = _asked(StepKind.ROTATIONS, rotation=RotationRequest("x", "+z", (90.0,), angle, fastest))
    hand.advance(10)
    _hears(hand, asked)
    hand.advance(300)
    _hears(hand, asked)
    rate = np.degrees(hand.advance(1200).rate[:, 0])
    assert rate.sum() / 100.0 == pytest.approx(angle, abs=2.5)
    assert np.abs(rate).max() == pytest.approx(fastest, rel=0.15)


def _all(imu: VirtualImu, reads: int = 4) -> int:
    """How many lines it prints when it is read so often."""
    return sum(imu.read(0.0).count(b"\n") for _ in range(reads))


def test_no_sample_is_made_beyond_the_reaction_time_to_the_newest_instruction() -> None:
    imu = VirtualImu(speed=float("inf"), following=True)
    assert imu.read(0.0).count(b"\n") == 1 + 200
    imu.follow(_asked(StepKind.SETTLE), 190)
    assert imu.read(0.0).count(b"\n") == 140
    assert imu.hand.sample == 190 + 150


def test_a_procedure_that_falls_silent_while_it_asks_for_something_is_not_waited_for() -> None:
    imu = VirtualImu(speed=float("inf"), following=True)
    imu.follow(_asked(StepKind.SETTLE), 100)
    assert not imu.waiting
    assert _all(imu) > 800


@pytest.mark.parametrize("step", [StepKind.SOURCE, StepKind.RESULT, StepKind.SAVE])
def test_where_nobody_moves_it_the_device_stands_still_as_long_as_it_takes(step: StepKind) -> None:
    """Whoever reads a result takes his time; the samples after it are the same in every run."""
    imu = VirtualImu(speed=float("inf"), following=True)
    imu.follow(_asked(step), 100)
    imu.follow(_asked(step), 110)
    expected = 200 if step is StepKind.SOURCE else 250
    assert imu.rest().count(b"\n") >= expected
    assert imu.hand.sample == expected
    assert imu.waiting
    assert _all(imu) == 0
    imu.follow(_asked(StepKind.VALIDATE), 110)
    assert not imu.waiting
    assert _all(imu) >= 260 - expected


def test_a_hand_that_is_told_to_stop_forgets_what_was_asked() -> None:
    imu = VirtualImu(speed=float("inf"), following=True)
    imu.follow(_asked(StepKind.POSES, pose="+x"), 10)
    imu.hand.following = False
    assert _all(imu) > 800
    assert imu.hand.up[2] == pytest.approx(1.0)
