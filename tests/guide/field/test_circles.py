"""Six circles by hand: recognised, counted, and enough."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.poses import FACES
from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.estimate.magnetometer.fit import fit_magnetometer
from imucal_wizard.guide.kinds import EventKind, StepKind
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.simulate.actions import Action, LieStill, PlacePose, Rotate
from imucal_wizard.simulate.magnetometer import TrueField
from tests.guide.field.compass import (
    QUICK,
    RATE,
    SEED,
    Session,
    circle,
    circles,
    field_of,
    played,
    turned,
    with_field,
)


def test_six_circles_in_any_order_end_the_step_by_themselves() -> None:
    """Nobody presses a key, and no face is asked for in this order."""
    order = ("+y", "-z", "-x", "+z", "-y", "+x")
    session = Session(turned(circles(order))).play()
    taken = session.texts(EventKind.ROTATION_TAKEN)
    assert [text[:2] for text in taken] == ["+Y", "−Z", "−X", "+Z", "−Y", "+X"]
    assert session.step == StepKind.RESULT
    assert session.texts(EventKind.FINISHED)


def test_what_is_collected_calibrates_the_magnetometer() -> None:
    """The hard iron of the virtual sensor, from the step's spans alone."""
    collected = played(circles()).machine.collected()
    assert collected.magnetometer is not None
    ((start, end),) = collected.field_spans
    found = fit_magnetometer(collected.magnetometer.between(start, end))
    named = {parameter.name: parameter for parameter in found.fit.parameters}
    bias = np.array([named[f"bias_{axis}"].value for axis in "xyz"])
    error = np.array([named[f"bias_{axis}"].standard_error for axis in "xyz"])
    assert (np.abs(bias - TrueField.drawn(SEED).hard_iron) < 4.0 * error).all()


def test_all_samples_of_the_stream_are_kept_for_the_second_stage() -> None:
    """Those from before the step, too; only what the last block lacks is not there yet."""
    readings = turned(circles())
    whole = readings.magnetometer
    kept = played(circles()).machine.collected().magnetometer
    assert whole is not None
    assert kept is not None
    assert len(whole) - len(kept) < 10
    assert (kept.values == whole.values[: len(kept)]).all()
    assert (kept.time == whole.time[: len(kept)]).all()


def test_while_it_turns_the_angle_grows_and_the_face_is_named() -> None:
    session = Session(turned(circle("-z")))
    session.play()
    angles = [seen.turned for seen in session.seen if seen.face_down == "-z"]
    assert max(np.diff(angles)) <= 90.0  # half a second at 180 degrees a second
    assert angles[0] < 20.0
    assert angles[-1] >= 350.0
    assert session.field.done == ("-z",)


def test_to_and_fro_over_half_a_circle_is_half_a_circle() -> None:
    """However long it is done: no circle is counted that was not turned."""
    swings = [Rotate("z", degrees, 180.0) for degrees in (-180.0, 180.0) * 6]
    session = Session(turned((PlacePose("+z"), LieStill(1.3), *swings))).play()
    assert 175.0 <= session.field.turned <= 210.0
    assert session.field.done == ()
    assert not session.texts(EventKind.ROTATION_TAKEN)


def test_a_face_that_was_done_already_is_kept_as_a_repeat() -> None:
    session = Session(turned(circles(("+x", "-y", "+x")))).play()
    assert len(session.texts(EventKind.ROTATION_TAKEN)) == 2
    assert "+X was done already" in session.texts(EventKind.ALREADY_DONE)[0]


def test_without_a_gyroscope_the_field_tells_the_angle() -> None:
    readings = replace(turned(circles()), gyroscope=None)
    session = Session(readings).play()
    assert len(session.texts(EventKind.ROTATION_TAKEN)) == 6
    assert not any("does not turn" in seen.trouble for seen in session.seen)
    assert session.step == StepKind.RESULT


def test_a_gyroscope_in_counts_is_not_asked_for_angles() -> None:
    readings = turned(circles())
    gyroscope = readings.gyroscope
    assert gyroscope is not None
    counts = Series(gyroscope.time, np.round(gyroscope.values * 3200.0 + 32768.0), "count")
    session = Session(replace(readings, gyroscope=counts)).play()
    assert session.step == StepKind.RESULT


def test_readings_written_down_again_are_no_new_ones() -> None:
    """A stream that repeats the last value in every line says no more than one that does not."""
    readings = turned(circles())
    series, time = readings.magnetometer, readings.accelerometer.time
    assert series is not None
    held = np.searchsorted(series.time, time, side="right") - 1
    repeated = replace(readings, magnetometer=Series(time, series.values[held], "uT"))
    plain, other = played(circles()), Session(repeated).play()
    assert other.step == StepKind.RESULT
    assert abs(other.field.samples - plain.field.samples) <= 0.02 * plain.field.samples


def test_a_slow_magnetometer_serves_as_well() -> None:
    """Ten samples a second of its own, most blocks of the accelerometer with one or none."""
    readings = turned(tuple(a for face in FACES for a in circle(face, fastest=60.0)))
    series = readings.magnetometer
    assert series is not None
    tenth = Series(series.time[::9], series.values[::9], "uT")
    session = Session(replace(readings, magnetometer=tenth)).play()
    assert session.step == StepKind.RESULT


def test_free_tumbling_that_fills_the_sphere_is_as_good() -> None:
    rng = np.random.default_rng(0)
    ups = rng.standard_normal((70, 3))
    script: list[Action] = [PlacePose((float(x), float(y), float(z))) for x, y, z in ups]
    session = Session(turned(tuple(script))).play()
    assert session.step == StepKind.RESULT
    assert session.field.missing
    assert session.field.gaps is not None
    assert session.field.gaps < 20.0


def test_an_hours_rest_in_the_step_does_not_drown_the_circles() -> None:
    """What is collected is the turning, not what lay on the table for longer than a hand pauses."""
    lying = turned((LieStill(30.0), *circles()))
    session = Session(lying).play()
    assert session.step == StepKind.RESULT
    collected = session.machine.collected()
    assert collected.magnetometer is not None
    plain = played(circles()).machine.collected()
    rests, turns = (
        sum(end - start for start, end in one.field_spans) for one in (collected, plain)
    )
    assert rests - turns < 15.0
    assert collected.field_left_out == ()


def test_a_slow_smooth_turn_after_a_long_rest_is_seen_without_a_gyroscope() -> None:
    """An accelerometer on a table feels nothing of it."""
    script = (*circles(("-z", "+x", "+z")), *circle("-z", degrees=5.0), LieStill(20.0))
    readings = turned((*script, Rotate("z", 372.0, 60.0)))
    session = Session(replace(readings, gyroscope=None)).play()
    assert session.texts(EventKind.ALREADY_DONE)


def test_counts_have_no_size_in_microtesla() -> None:
    readings = turned(circles())
    session = Session(with_field(readings, 10.0 * field_of(readings), "count")).play()
    assert session.step == StepKind.RESULT
    assert session.field.magnitude is None


def test_a_stream_without_a_magnetometer_has_no_such_step() -> None:
    """Not on the way to the result, not backwards, and not by its name; no word of it."""
    readings = replace(turned(circle("-z")), magnetometer=None)
    machine = StateMachine(QUICK, rate=RATE)
    machine.command("start")
    machine.feed(readings)
    machine.command("goto", "rotations")
    machine.command("skip")
    assert machine.status().step is StepKind.RESULT
    machine.command("back")
    assert machine.status().step is StepKind.ROTATIONS
    machine.command("goto", "field")
    assert machine.status().step is StepKind.ROTATIONS
    assert StepKind.FIELD not in dict(machine.status().skipped)
    assert machine.collected().magnetometer is None


@pytest.mark.parametrize("seed", [0, 1, SEED])
def test_nothing_is_called_disturbed_where_nothing_disturbs(seed: int) -> None:
    session = played(circles(), seed)
    assert session.step == StepKind.RESULT
    assert session.field.left_out == 0
    assert not any(seen.disturbed for seen in session.seen)


def test_the_step_needs_no_rest_before_it() -> None:
    """Readings that begin in the middle of the first circle: the other five are counted."""
    whole = turned(circles())
    a, g, m = whole.accelerometer, whole.gyroscope, whole.magnetometer
    assert g is not None
    assert m is not None
    machine = StateMachine(QUICK, rate=RATE)
    machine.command("start")
    for first, past in ((600, 620), (620, len(a))):
        span = m.between(a.time[first], a.time[past - 1])
        machine.feed(Readings(a.part(first, past), g.part(first, past), span))
        machine.command("goto", "field")
    status = machine.status().field
    assert status is not None
    assert len(status.done) == 5


def test_a_rotation_without_samples_is_not_counted() -> None:
    """Half a circle before a gap in the stream and half a circle after it are two halves."""
    whole = turned(circle("-z"))
    a, g, m = whole.accelerometer, whole.gyroscope, whole.magnetometer
    assert g is not None
    assert m is not None
    a, g, m = (
        Series(np.where(s.time < 7.5, s.time, s.time + 5.0), s.values, s.unit) for s in (a, g, m)
    )
    session = Session(Readings(a, g, m)).play()
    assert max(seen.turned for seen in session.seen) > 100.0
    assert session.field.done == ()
    assert session.field.turned < 300.0
