"""The hand's motion: rate, attitude and specific force belong together."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.simulate import attitude
from imucal_wizard.simulate.actions import Action, LieStill, PlacePose, Rotate, Shake, direction
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.motion import Motion
from imucal_wizard.simulate.scripts import perform_rotations

MOVES: list[Action] = [
    LieStill(0.5),
    PlacePose("+x-y"),
    LieStill(0.2),
    Rotate("z", 140.0, 200.0),
    Rotate("x", -165.0, 110.0),
    PlacePose((0.3, -0.9, -0.32)),
    PlacePose("-z"),
    LieStill(0.3),
]


def _moved(rate: float, seed: int = 3, tremble: bool = False) -> Motion:
    hand = VirtualHand(rate, seed)
    hand.tremble(tremble)
    hand.perform(MOVES)
    return hand.advance(round(9.0 * rate))


def _turn_between(q: FloatArray, p: FloatArray) -> float:
    """Angle between two attitudes, rad."""
    back = attitude.hamilton_product(q * np.array([1.0, -1.0, -1.0, -1.0]), p)
    return float(2.0 * np.arctan2(np.linalg.norm(back[1:]), abs(back[0])))


def _carried(rates: FloatArray, start: FloatArray, step: float) -> FloatArray:
    """Attitude after integrating rates sampled at twice the step, fourth order (Magnus)."""
    q = start
    for first, middle, last in zip(rates[:-2:2], rates[1:-1:2], rates[2::2], strict=True):
        mean = (first + 4.0 * middle + last) / 6.0
        bend = np.cross(first, last) * step * step / 12.0
        q = attitude.hamilton_product(q, attitude.rotation_quaternion(mean * step + bend))
    return q


@pytest.mark.parametrize("tremble", [False, True])
def test_the_integral_of_the_rate_is_the_change_of_attitude(tremble: bool) -> None:
    """Rates at 800 Hz, integrated independently, end within a microradian of the attitude."""
    rate = 800.0
    motion = _moved(rate, tremble=tremble)
    last = (len(motion.time) - 1) // 2 * 2
    carried = _carried(motion.rate[: last + 1], motion.attitude[0], 2.0 / rate)
    assert np.abs(motion.rate).max() > np.radians(150.0)
    assert _turn_between(carried, motion.attitude[last]) < 1e-6


def test_the_rate_is_the_derivative_of_the_attitude_at_every_sample() -> None:
    """Central differences of the attitude at 4 kHz agree with the rate."""
    rate = 4000.0
    motion = _moved(rate, tremble=True)
    before, after = motion.attitude[:-2], motion.attitude[2:]
    conjugate = before * np.array([1.0, -1.0, -1.0, -1.0])
    vector = attitude.hamilton_product(conjugate, after)[:, 1:]
    np.testing.assert_allclose(vector * rate, motion.rate[1:-1], atol=2e-4)


def test_specific_force_is_gravity_plus_acceleration_seen_from_the_body() -> None:
    """Turned back to the world, what is left of the specific force is the acceleration."""
    motion = _moved(100.0, tremble=True)
    world = attitude.to_world(motion.attitude, motion.specific_force)
    expected = np.tile([0.0, 0.0, STANDARD_GRAVITY], (900, 1))
    np.testing.assert_allclose(world - motion.acceleration, expected, atol=1e-12)
    assert np.abs(motion.acceleration).max() > 0.05


def test_a_device_laid_down_is_exactly_at_rest() -> None:
    """No rate and exactly one g after the last move."""
    motion = _moved(100.0)
    assert not motion.rate[-20:].any()
    assert np.ptp(motion.specific_force[-20:], axis=0).max() == 0.0
    assert np.linalg.norm(motion.specific_force[-1]) == pytest.approx(STANDARD_GRAVITY, rel=1e-12)


def test_a_device_held_in_the_hand_trembles() -> None:
    """Held, it turns by some tenths of a degree per second up to a few."""
    hand = VirtualHand()
    hand.tremble(True)
    held = hand.advance(1000).rate[100:]
    assert np.radians(0.3) < held.std() < np.radians(5.0)
    hand.tremble(False)
    assert not hand.advance(1000).rate[100:].any()


def test_a_vibrating_support_shakes_without_turning() -> None:
    """The rms per axis is the one asked for, as nearly as a few tones at random tell it."""
    hand = VirtualHand()
    hand.perform([Shake(0.2), LieStill(20.0)])
    motion = hand.advance(2000)
    assert not motion.rate.any()
    rms = np.sqrt((motion.acceleration**2).mean(0))
    np.testing.assert_allclose(rms, 0.2, rtol=0.2)


@settings(deadline=None, max_examples=40)  # a slow machine is no failure
@given(
    up=st.tuples(*[st.floats(-1.0, 1.0) for _ in "xyz"]).filter(
        lambda v: sum(c * c for c in v) > 0.01
    ),
    start=st.sampled_from(["+z", "-z", "+x", "-y", "+x-y+z"]),
)
def test_a_careful_hand_brings_any_direction_on_top(
    up: tuple[float, float, float], start: str
) -> None:
    """Placed without error, the direction asked for points up, upside down included."""
    hand = VirtualHand(up=start)
    hand.perform([PlacePose(up, error=0.0)])
    hand.advance(600)
    np.testing.assert_allclose(hand.up, direction(up), atol=1e-9)


def test_a_hand_misses_a_pose_by_a_few_degrees() -> None:
    """Placement errors are typically one to four degrees."""
    missed = []
    for seed in range(40):
        hand = VirtualHand(seed=seed)
        hand.snap_to("+x-y")
        hand.advance(400)
        missed.append(np.degrees(np.arccos(hand.up @ direction("+x-y"))))
    assert 1.0 < np.median(missed) < 4.0
    assert max(missed) < 8.0


def test_a_turn_is_about_its_axis_by_its_angle_at_its_speed() -> None:
    """A turn by +90° about x carries the up direction from +z to +y, at 200 °/s at most."""
    hand = VirtualHand()
    hand.perform([Rotate("x", 90.0, 200.0, error=0.0)])
    motion = hand.advance(200)
    np.testing.assert_allclose(hand.up, [0.0, 1.0, 0.0], atol=1e-9)
    assert np.degrees(motion.rate[:, 0].max()) == pytest.approx(200.0, rel=0.15)
    assert 0.5 < np.degrees(np.abs(motion.rate[:, 1:]).max()) < 40.0


def test_keys_pressed_quickly_are_one_turn() -> None:
    """Three presses of 15° arrive together, before one could have ended."""
    hand = VirtualHand()
    for _ in range(3):
        hand.turn("y", 15.0)
    hand.advance(100)
    assert np.degrees(np.arccos(hand.up[2])) == pytest.approx(45.0, abs=3.0)
    assert not hand.busy


@settings(deadline=None, max_examples=20)  # a slow machine is no failure
@given(cuts=st.lists(st.integers(1, 700), min_size=1, max_size=12))
def test_motion_does_not_depend_on_how_it_is_cut(cuts: list[int]) -> None:
    """The same samples to the last bit, in any batches."""
    whole = _moved(100.0, tremble=True)
    hand = VirtualHand(100.0, 3)
    hand.tremble(True)
    hand.perform(MOVES)
    parts, left = [], 900
    while left > 0:
        for cut in cuts:
            parts.append(hand.advance(min(cut, max(left, 1))))
            left -= cut
    rates = np.concatenate([part.rate for part in parts])[:900]
    forces = np.concatenate([part.specific_force for part in parts])[:900]
    np.testing.assert_array_equal(rates, whole.rate)
    np.testing.assert_array_equal(forces, whole.specific_force)


def test_the_pose_before_is_remembered_across_small_corrections() -> None:
    """Only a pose that was held counts as the pose before."""
    hand = VirtualHand()
    hand.perform(
        [LieStill(2.0), PlacePose("+x", error=0.0), Rotate("y", 3.0, error=0.0), LieStill(2.0)]
    )
    np.testing.assert_allclose(hand.advance(500).previous[-1], [0.0, 0.0, 1.0], atol=1e-12)
    hand.perform([PlacePose("-y", error=0.0)])
    np.testing.assert_allclose(
        hand.advance(300).previous[-1], direction((1.0, 0.0, 0.0524)), atol=0.11
    )


def test_the_rotations_go_both_ways_about_every_axis_at_three_speeds() -> None:
    turns = [action for action in perform_rotations(6, 4.0) if isinstance(action, Rotate)]
    for axis in "xyz":
        angles = [turn.degrees for turn in turns if turn.axis == axis]
        assert len(angles) == 6
        assert min(angles) < 0.0 < max(angles)
        assert len({turn.fastest for turn in turns if turn.axis == axis}) == 3


def test_unknown_poses_and_axes_are_refused_with_the_reason() -> None:
    """A slip of the finger is told apart from a pose."""
    hand = VirtualHand()
    for wrong in ("x", "+x+x", "", "+w", "up"):
        with pytest.raises(UsageError, match="not a pose"):
            hand.snap_to(wrong)
    with pytest.raises(UsageError, match="not a direction"):
        hand.snap_to((0.0, 0.0, 0.0))
    for axis in ("w", "", "xy"):
        with pytest.raises(UsageError, match="not an axis"):
            hand.turn(axis, 90.0)
    with pytest.raises(UsageError, match="not a pose"):
        hand.perform([LieStill(1.0), PlacePose("up")])
    assert not hand.busy
