"""Skip, undo, repeat, go back; and the same bits however the samples are cut."""

import itertools
from functools import cache

from hypothesis import given, settings
from hypothesis import strategies as st

from imucal_wizard.core.readings import Readings
from imucal_wizard.guide.kinds import EventKind, StepKind
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.simulate.actions import LieStill, PlacePose
from tests.guide.field.compass import QUICK, RATE, Session, circle, circles, played, turned

TWO = circles(("-z", "+x"))


def fingerprint(machine: StateMachine) -> list[object]:
    """All that was measured and is shown of the field, bit by bit."""
    collected, status = machine.collected(), machine.status()
    assert collected.magnetometer is not None
    prints: list[object] = [status.step, collected.field_spans, collected.field_left_out]
    prints += [collected.magnetometer.time.tobytes(), collected.magnetometer.values.tobytes()]
    field = status.field
    if field is not None:
        prints += [field.counts.tobytes(), field.turned, field.done, field.here, field.advice]
        prints += [field.gaps, field.variance, field.wobble, field.fit_error, field.magnitude]
    return prints


@cache
def recording() -> Readings:
    """Three circles."""
    return turned(circles(("-z", "+x", "-y")))


def fed(cuts: list[int]) -> list[object]:
    """The recording cut before these samples; the step begins with sample 280."""
    whole = recording()
    a, g, m = whole.accelerometer, whole.gyroscope, whole.magnetometer
    assert g is not None
    assert m is not None
    machine = StateMachine(QUICK, rate=RATE)
    events = list(machine.command("start"))
    for first, past in itertools.pairwise([0, *sorted({280, *cuts}), len(a)]):
        begin = a.time[first] if first else -1.0
        end = a.time[past] if past < len(a) else 1e9
        part = Readings(a.part(first, past), g.part(first, past), m.between(begin, end))
        events += machine.feed(part)
        if past == 280:
            events += machine.command("goto", "field")
        machine.status()
    return [*events, *fingerprint(machine)]


@cache
def in_one_piece() -> list[object]:
    """The same without a cut."""
    return fed([])


@settings(max_examples=5, deadline=None)
@given(st.lists(st.integers(1, 2300), max_size=25))
def test_what_is_measured_does_not_depend_on_the_cuts(cuts: list[int]) -> None:
    assert len(recording()) > 2300
    assert fed(cuts) == in_one_piece()


def test_one_sample_at_a_time_gives_the_same_bits_as_all_at_once() -> None:
    assert fed(list(range(1, len(recording())))) == in_one_piece()


def test_skipping_states_its_cost_and_keeps_nothing() -> None:
    session = played(TWO)
    (event,) = [e for e in session.machine.command("skip") if e.kind is EventKind.STEP_SKIPPED]
    assert "not calibrated" in event.text
    assert session.step == StepKind.RESULT
    assert session.machine.collected().field_spans == ()


def test_who_comes_back_to_a_skipped_step_finds_it_as_it_was() -> None:
    session = played(TWO)
    ((before, _),) = session.machine.collected().field_spans
    session.machine.command("skip")
    session.machine.command("back")
    assert session.step == StepKind.FIELD
    status = session.machine.status().field
    assert status is not None
    assert status.done == ("+x", "-z")
    ((after, _),) = session.machine.collected().field_spans
    assert after == before


def test_undo_takes_the_last_circle_back_and_no_other() -> None:
    session = played(TWO)
    assert session.field.done == ("+x", "-z")
    (event,) = session.machine.command("undo")
    assert "+X" in event.text
    status = session.machine.status().field
    assert status is not None
    assert status.done == ("-z",)
    (kept,) = session.machine.collected().field_spans
    assert kept[1] < 12.0


def test_undo_twice_takes_two_circles_back_however_long_lies_between() -> None:
    """What begins by itself on the face where the device still lies is not in the way."""
    session = Session(turned(TWO, after=5.0)).play(until=18.0)
    assert session.field.done == ("+x", "-z")
    session.machine.command("undo")
    session.play()
    assert session.field.samples > 0
    (event,) = session.machine.command("undo")
    assert "−Z" in event.text
    assert session.machine.collected().field_spans == ()


def test_undo_before_anything_was_turned_goes_back_to_what_was_measured_before() -> None:
    """Here to the rest at the beginning, which had counted as a face."""
    session = Session(turned((LieStill(4.0),))).play()
    assert session.field.face_down == "-z"
    (event,) = session.machine.command("undo")
    assert "+Z was taken back" in event.text
    assert session.step == StepKind.UP_DOWN


def test_undo_takes_a_tumble_back() -> None:
    """It is no circle on any face, and it is not nothing."""
    ups = ((1.0, 1.0, 1.0), (-1.0, 1.0, 0.5), (0.3, -1.0, 1.0), (1.0, 0.2, -1.0))
    session = Session(turned(tuple(PlacePose(up) for up in ups * 2))).play()
    (event,) = session.machine.command("undo")
    assert "The tumbling" in event.text
    assert session.machine.collected().field_spans == ()


def test_undo_in_the_result_comes_back_to_the_last_circle() -> None:
    session = played(circles())
    assert session.step == StepKind.RESULT
    session.machine.command("undo")
    assert session.step == StepKind.FIELD
    status = session.machine.status().field
    assert status is not None
    assert status.missing == ("-z",)


def test_repeat_begins_with_nothing() -> None:
    session = played(TWO)
    (event,) = session.machine.command("repeat")
    assert "2 circles taken back" in event.text
    collected, status = session.machine.collected(), session.machine.status().field
    assert collected.field_spans == ()
    assert collected.magnetometer is not None
    assert status is not None
    assert (status.samples, status.done, int(status.counts.sum())) == (0, (), 0)


def test_after_a_repeat_only_what_comes_then_counts() -> None:
    session = Session(turned((*circle("-z"), *circles()))).play(until=9.0)
    session.machine.command("repeat")
    session.play()
    assert session.step == StepKind.RESULT
    assert session.machine.collected().field_spans[0][0] >= 9.0


def test_who_goes_back_to_a_finished_step_is_not_thrown_out_of_it() -> None:
    session = Session(turned(circles(), after=5.0)).play(until=50.0)
    assert session.step == StepKind.RESULT
    session.machine.command("back")
    session.play()
    assert session.step == StepKind.FIELD
    assert any(offer.command == "skip" for offer in session.machine.status().offers)
    session.machine.command("skip")
    assert session.step == StepKind.RESULT
    assert StepKind.FIELD not in dict(session.machine.status().skipped)


def test_enough_is_for_the_magnetometers_step_alone() -> None:
    machine = StateMachine(QUICK, rate=RATE)
    machine.command("start")
    (event,) = machine.command("enough")
    assert event.kind is EventKind.WARNING
    assert machine.status().step is StepKind.SETTLE


def test_the_series_handed_out_stays_as_it_is() -> None:
    """What was collected before more samples came is not changed by them."""
    session = Session(turned(TWO)).play(until=6.0)
    early: Collected = session.machine.collected()
    assert early.magnetometer is not None
    before = early.magnetometer.values.tobytes()
    session.play()
    assert early.magnetometer.values.tobytes() == before


def test_a_recording_that_ends_in_the_step_leaves_what_it_has() -> None:
    """Whoever goes on to the result then has not skipped the step."""
    session = played(TWO)
    session.machine.flush()
    session.machine.command("goto", "result")
    assert StepKind.FIELD not in dict(session.machine.status().skipped)
    assert session.machine.collected().field_spans


def test_a_recording_that_ends_with_hardly_a_sample_has_skipped_it() -> None:
    session = Session(turned(TWO)).play(until=3.2)
    session.machine.flush()
    session.machine.command("goto", "result")
    assert StepKind.FIELD in dict(session.machine.status().skipped)
    assert session.machine.collected().field_spans == ()


def test_who_went_on_too_early_and_comes_back_can_complete_the_step() -> None:
    """It ends by itself as ever; until then the way on is open, and called what it is."""
    session = Session(turned((*circle("-z"), LieStill(25.0), *circles()))).play(until=33.0)
    session.machine.command("enough")
    assert session.step == StepKind.RESULT
    session.machine.command("back")
    (offer,) = session.machine.status().offers
    assert offer.command == "enough"
    session.play()
    assert session.step == StepKind.RESULT
    assert len(session.texts(EventKind.ROTATION_TAKEN)) == 6
