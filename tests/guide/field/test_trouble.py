"""What goes wrong in the magnetometer's step is said in words, and nothing is made of it."""

import numpy as np
import pytest

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.notices import same_matter
from imucal_wizard.core.readings import FloatArray, Readings
from imucal_wizard.estimate.magnetometer.fit import fit_magnetometer
from imucal_wizard.guide.kinds import EventKind, StepKind
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.simulate.actions import LieStill, PassSteel, PlacePose, Rotate
from tests.guide.field.compass import (
    QUICK,
    RATE,
    Session,
    circle,
    circles,
    field_of,
    pieces,
    turned,
    with_field,
)

STEEL = (
    *circles(("+x", "-x", "+y")),
    PlacePose("+z"),
    LieStill(1.3),
    Rotate("z", 120.0, 60.0),
    PassSteel(),
    Rotate("z", 260.0, 60.0),
    *circles(("-y", "+z", "-z")),
)
"""Something of steel passes in the middle of the fourth circle."""


def steel_passes(readings: Readings) -> tuple[float, float]:
    """When it does: where the field differs from the same hand's without it."""
    plain = turned(tuple(action for action in STEEL if not isinstance(action, PassSteel)))
    series = readings.magnetometer
    assert series is not None
    differs = np.flatnonzero((np.abs(series.values - field_of(plain)) > 1.0).any(axis=1))
    return float(series.time[differs[0]]), float(series.time[differs[-1]])


def test_steel_that_passes_is_said_in_words_while_it_passes() -> None:
    readings = turned(STEEL)
    start, end = steel_passes(readings)
    session = Session(readings).play(until=0.5 * (start + end) + 0.3)
    assert "the field is disturbed" in session.field.disturbed
    assert "µT" in session.field.disturbed
    (told,) = [text for text in session.texts(EventKind.WARNING) if "is disturbed" in text]
    assert same_matter(told, session.field.disturbed)
    session.play(until=end + 1.0)
    assert session.field.disturbed == ""
    assert session.events[-1].kind is EventKind.FIELD_BACK


def test_samples_with_steel_near_are_left_out_with_the_reason() -> None:
    """All samples that are off by as much as noise never is, and hardly any others."""
    readings = turned(STEEL)
    start, end = steel_passes(readings)
    session = Session(readings).play()
    collected = session.machine.collected()
    assert session.step == StepKind.RESULT
    assert len(collected.field_spans) == 2
    ((since, until, reason),) = collected.field_left_out
    assert "the field was" in reason
    assert "µT too" in reason
    assert start - 0.5 < since < start + 0.6
    assert end - 0.6 < until < end + 0.5
    for first, last in collected.field_spans:
        assert last <= since + 1e-6 or first >= until - 1e-6


def test_a_circle_is_not_whole_where_it_was_disturbed() -> None:
    """What was turned while steel passed has to be turned again."""
    known = circles(("+x", "-x", "+y"))
    laid, turn = (PlacePose("+z"), LieStill(1.3)), Rotate("z", 372.0, 180.0)
    without = Session(turned((*known, *laid, turn))).play()
    with_steel = Session(turned((*known, *laid, PassSteel(), turn))).play()
    assert "-z" in without.field.done
    assert "-z" not in with_steel.field.done
    assert 250.0 < with_steel.field.turned < 340.0


def test_a_magnet_that_stays_is_not_waited_for() -> None:
    """From the fourth circle on the field is another one: words say what to do about it."""
    readings = turned(circles())
    values = field_of(readings).copy()
    values[len(values) // 2 :] += (60.0, -35.0, 20.0)
    session = Session(with_field(readings, values)).play()
    assert session.step == StepKind.FIELD
    assert any("repeat the step" in seen.trouble for seen in session.seen)
    assert not session.field.good


def test_half_a_circle_only_does_not_end_the_step() -> None:
    """The way on is offered after a while, and what was measured is refused by the fit."""
    session = Session(turned((*circle("-z", degrees=180.0), LieStill(25.0)))).play()
    assert session.step == StepKind.FIELD
    assert session.texts(EventKind.STUCK)
    (offer,) = session.machine.status().offers
    assert offer.command == "enough"
    assert "probably fail" in offer.text
    session.machine.command("enough")
    assert session.step == StepKind.RESULT
    collected = session.machine.collected()
    assert collected.magnetometer is not None
    ((start, end),) = collected.field_spans
    with pytest.raises(DataError, match="Turn it once round"):
        fit_magnetometer(collected.magnetometer.between(start, end))


def test_one_face_alone_is_called_a_plane() -> None:
    """A second circle on the same face adds nothing; one circle is a beginning and no trouble."""
    session = Session(turned((*circle("-z"), *circle("-z"), LieStill(15.0)))).play()
    assert "plane" in session.field.trouble
    first_circle = [seen for seen in session.seen if seen.turned < 340.0 and not seen.done]
    assert not any("plane" in seen.trouble for seen in first_circle)


def test_a_device_that_lies_still_is_told_to_turn() -> None:
    session = Session(turned((LieStill(12.0),))).play()
    assert "does not turn" in session.field.trouble
    assert session.field.counts.sum() == 0


def test_a_constant_reading_is_not_a_rotation() -> None:
    """A coarse sensor gives no new value at rest; what it gave before is not looked at any more."""
    readings = turned((*circle("-z", degrees=180.0), LieStill(12.0)))
    series, values = readings.magnetometer, field_of(readings).copy()
    assert series is not None
    values[series.time > series.time[-1] - 12.3] = values[-1]
    session = Session(with_field(readings, values)).play()
    assert "does not turn" in session.field.trouble


def test_a_sensor_that_falls_silent_while_disturbed_is_missed_all_the_same() -> None:
    """What disturbed it then is no news any more."""
    readings = turned(STEEL)
    start, end = steel_passes(readings)
    series = readings.magnetometer
    assert series is not None
    cut = series.between(0.0, 0.5 * (start + end))
    session = Session(Readings(readings.accelerometer, readings.gyroscope, cut))
    assert session.play(until=cut.time[-1] + 0.5).field.disturbed
    session.play(until=cut.time[-1] + 3.0)
    assert session.field.disturbed == ""
    assert "has sent nothing" in session.field.trouble


def test_on_a_face_that_is_done_it_is_not_told_to_turn() -> None:
    """It is told the way to the next face, and that a plane is too little."""
    session = Session(turned((*circle("-z"), LieStill(12.0)))).play()
    assert session.field.done == ("-z",)
    assert session.field.face_down == "-z"
    assert session.field.face != "-z"
    assert "does not turn" not in session.field.trouble


def test_with_nothing_measured_only_leaving_it_out_is_offered() -> None:
    readings = turned((*circle("-z"), LieStill(25.0)))
    session = Session(with_field(readings, np.full_like(field_of(readings), 3.0))).play()
    assert any("always sends the same value" in seen.trouble for seen in session.seen)
    (offer,) = session.machine.status().offers
    assert offer.command == "skip"
    session.machine.command("skip")
    assert StepKind.FIELD in dict(session.machine.status().skipped)


def test_a_sensor_that_falls_silent_is_missed() -> None:
    readings = turned(circles())
    series = readings.magnetometer
    assert series is not None
    cut = Readings(readings.accelerometer, readings.gyroscope, series.between(0.0, 8.0))
    session = Session(cut).play(until=12.0)
    assert "has sent nothing" in session.field.trouble


def _not_the_earths(values: FloatArray) -> FloatArray:
    return 4.0 * values


def _saturated(values: FloatArray) -> FloatArray:
    low, high = np.percentile(values[:, 0], (2.0, 80.0))
    return np.column_stack([np.clip(values[:, 0], low, high), values[:, 1:]])


def _dead_axis(values: FloatArray) -> FloatArray:
    return np.column_stack([np.full(len(values), 7.0), values[:, 1:]])


def _noise_alone(values: FloatArray) -> FloatArray:
    return np.random.default_rng(0).normal(0.0, 5.0, values.shape)


def test_values_that_are_no_readings_are_passed_over() -> None:
    """One in twenty of them, and the circles are counted all the same."""
    readings = turned(circles())
    values = field_of(readings).copy()
    values[::20, 1] = np.resize([np.nan, np.inf, -1e300], len(values[::20]))
    session = Session(with_field(readings, values)).play()
    assert session.step == StepKind.RESULT
    assert session.field.left_out == 0


@pytest.mark.parametrize(
    ("spoil", "word"),
    [
        (_not_the_earths, "not the Earth's"),
        (_saturated, "saturated"),
        (_dead_axis, "dead"),
        (_noise_alone, "does not turn"),
    ],
)
def test_readings_of_which_nothing_can_come_are_called_by_their_name(
    spoil: object, word: str
) -> None:
    """After six whole circles the step is not done, and says why."""
    assert callable(spoil)
    readings = turned(circles(), after=2.0)
    session = Session(with_field(readings, spoil(field_of(readings)))).play()
    assert session.step == StepKind.FIELD
    assert not session.field.good
    assert word in session.field.trouble


def test_a_gyroscopes_bias_turns_no_device_that_lies_still() -> None:
    """Without the settle step nobody knows the bias; at rest there is nothing but bias."""
    readings = turned((LieStill(120.0),))
    assert readings.gyroscope is not None
    bias = float(np.degrees(readings.gyroscope.values[:, 2].mean()))
    assert abs(bias) * 120.0 > 60.0
    machine = StateMachine(QUICK, rate=RATE)
    machine.command("start")
    machine.command("skip")
    for piece in pieces(readings, 400):
        machine.feed(piece)
        machine.command("goto", "field")
    status = machine.status().field
    assert status is not None
    assert status.face_down == "-z"
    assert status.turned <= 10.0
