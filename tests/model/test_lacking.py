"""What data lack is told before anything is fitted to them."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.model.catalogue import effect, effects_for
from imucal_wizard.model.effect import Circumstances
from imucal_wizard.model.lesson import session_poses, session_rotations
from tests.model.sphere import at_rest, full_sphere


@pytest.mark.parametrize("sensor", ["accelerometer", "gyroscope"])
def test_a_session_in_which_everything_varies_lacks_nothing(sensor: str) -> None:
    """All effects can be tested on it."""
    c = session_poses() if sensor == "accelerometer" else session_rotations()
    assert [known.name for known in effects_for(sensor) if known.lacking(sensor, c)] == []


def still_life() -> Circumstances:
    """Eight poses within 10 s at one temperature, on a quiet table, order unknown."""
    c = at_rest(full_sphere(8))
    return replace(c, time=c.time / 60.0, previous=np.full((8, 3), np.nan))


@pytest.mark.parametrize(
    ("sensor", "name", "says"),
    [
        ("accelerometer", "bias-temperature", "only one temperature, 25.0 °C"),
        ("gyroscope", "scale-temperature", "only one temperature"),
        ("accelerometer", "warm-up", "shorter than a minute"),
        ("accelerometer", "bias-drift", "shorter than a minute"),
        ("gyroscope", "bias-step", "shorter than a minute"),
        ("accelerometer", "hysteresis", "different sides"),
        ("accelerometer", "vibration-rectification", "equally quiet"),
        ("gyroscope", "second-order", "contain no rotation"),
        ("gyroscope", "cross-product", "contain no rotation"),
    ],
)
def test_what_does_not_vary_is_named(sensor: str, name: str, says: str) -> None:
    """With what to do about it."""
    reason = effect(name).lacking(sensor, still_life())
    assert reason is not None
    assert says in reason


def test_without_a_thermometer_nothing_follows_the_temperature() -> None:
    """The message asks for the chip's temperature."""
    c = replace(session_poses(), temperature=np.full(len(session_poses()), np.nan))
    reason = effect("bias-temperature").lacking("accelerometer", c)
    assert reason is not None
    assert "no temperature was recorded" in reason


def test_turns_in_one_sense_hide_the_even_terms() -> None:
    """A second-order term or an asymmetry is then part of the scale; a third-order term is not."""
    c = replace(session_rotations(), rate=np.abs(session_rotations().rate))
    for name in ("second-order", "asymmetry"):
        reason = effect(name).lacking("gyroscope", c)
        assert reason is not None
        assert "one sense only" in reason
    assert effect("third-order").lacking("gyroscope", c) is None
    assert effect("second-order").lacking("accelerometer", c) is None


def test_one_pose_shows_no_dependence_on_gravity() -> None:
    """Neither g-sensitivity nor the turning Earth."""
    up = np.tile([0.0, 0.0, 1.0], (5, 1))
    for name in ("g-sensitivity", "g2-sensitivity", "earth-rate"):
        reason = effect(name).lacking("gyroscope", at_rest(up))
        assert reason is not None
        assert "one side only" in reason


def test_a_step_needs_three_holds_on_either_side() -> None:
    """Five holds are too few."""
    reason = effect("bias-step").lacking("accelerometer", at_rest(full_sphere(5)))
    assert reason is not None
    assert "only 5 holds" in reason


@pytest.mark.parametrize("name", ["bias-step", "scale-step"])
def test_samples_in_motion_are_no_holds_of_a_gyroscope(name: str) -> None:
    """Five rests and the samples of the rotations between them."""
    session = session_rotations()
    still = np.flatnonzero(~session.rate.any(axis=1))
    few = np.append(np.flatnonzero(session.rate.any(axis=1)), still[:: len(still) // 4])
    assert "only 5 holds" in (effect(name).lacking("gyroscope", session.select(few)) or "")
