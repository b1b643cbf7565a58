"""What looks wrong while measuring is said at once."""

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.guide.kinds import EventKind, StepKind
from imucal_wizard.guide.state import Event
from imucal_wizard.guide.state_machine import StateMachine
from tests.guide.device import QUICK, RATE, Device, texts


def with_gyroscope(readings: Readings, matrix: FloatArray) -> Readings:
    """The same readings with a gyroscope that is wrong by a matrix."""
    assert readings.gyroscope is not None
    gyroscope = Series(readings.gyroscope.time, readings.gyroscope.values @ matrix.T, "rad/s")
    return Readings(readings.accelerometer, gyroscope)


def events_of_a_turn(matrix: FloatArray) -> tuple[StateMachine, tuple[Event, ...]]:
    """What a quarter turn about x makes of such a gyroscope."""
    device = Device(noise=(0.01, 1e-4)).rest(5.0)
    machine = StateMachine(QUICK, rate=RATE)
    machine.command("start")
    machine.feed(with_gyroscope(device.taken(), matrix))
    machine.command("goto", "rotations")
    device.rest(2.0).rotate("x", 90.0).rest(2.0)
    return machine, machine.feed(with_gyroscope(device.taken(), matrix))


def turned_by(factor: float) -> list[str]:
    """The warnings, and rejections, of a quarter turn with a gyroscope wrong by a factor."""
    _, events = events_of_a_turn(factor * np.eye(3))
    return texts(events, EventKind.WARNING) + texts(events, EventKind.ROTATION_REJECTED)


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        (np.eye(3)[[1, 0, 2]], "by +90° about y: are axes of one of the two swapped?"),
        (np.diag([0.0, 1.0, 1.0]), "not at all: is its x axis dead"),
    ],
)
def test_a_rotation_seen_only_by_gravity_counts_with_a_warning(
    matrix: FloatArray, words: str
) -> None:
    machine, events = events_of_a_turn(matrix)
    rotation = machine.status().rotation
    assert rotation is not None
    assert list(rotation.done) == pytest.approx([90.0], abs=0.5)
    (warning,) = texts(events, EventKind.WARNING)
    assert words in warning


@pytest.mark.parametrize("factor", [2.0, 0.5])
def test_a_gyroscope_that_disagrees_with_gravity_gives_a_warning(factor: float) -> None:
    assert "check its unit and the sample rate" in turned_by(factor)[0]


def test_a_wrong_sign_is_told_from_a_wrong_unit() -> None:
    (warning,) = turned_by(-1.0)
    assert warning.startswith("Gravity turned by +90° about x, the gyroscope by −90°")
    assert "the sign of its x axis is wrong, or that of the accelerometer's y or z axis" in warning


def test_a_gyroscope_in_the_wrong_unit_is_refused() -> None:
    assert "is its unit right?" in turned_by(57.3)[0]


@pytest.mark.parametrize("factor", [0.95, 1.0, 1.05])
def test_the_errors_of_a_common_gyroscope_give_no_warning(factor: float) -> None:
    assert turned_by(factor) == []


def test_an_axis_at_the_end_of_its_range_gives_a_warning() -> None:
    readings = Device().rest(12.0).hold("+x").readings()
    clipped = np.clip(readings.accelerometer.values, -9.7, 9.7)
    force = Series(readings.accelerometer.time, np.round(clipped, 3), "m/s^2")
    machine = StateMachine(rate=RATE)
    machine.command("start")
    events = machine.feed(Readings(force, readings.gyroscope))
    assert machine.status().step is StepKind.UP_DOWN
    warnings = texts(events, EventKind.WARNING)
    assert any(text.startswith("x of the accelerometer does not change") for text in warnings)


def test_a_dead_axis_is_named_when_it_should_carry_gravity() -> None:
    readings = Device().rest(12.0).hold("+x").readings()
    values = readings.accelerometer.values * np.array([0.0, 1.0, 1.0])
    machine = StateMachine(rate=RATE)
    machine.command("start")
    force = Series(readings.accelerometer.time, values, "m/s^2")
    events = machine.feed(Readings(force, readings.gyroscope))
    assert "reads almost nothing" in texts(events, EventKind.WRONG_POSE)[0]
