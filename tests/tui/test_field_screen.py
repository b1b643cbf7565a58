"""The magnetometer's step on the screen, at the sizes people have."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.notices import reworded
from imucal_wizard.core.poses import FACES
from imucal_wizard.estimate.ellipsoid.coverage import centres
from imucal_wizard.guide.field.checks import disturbance_text, resting, silence
from imucal_wizard.guide.kinds import Act, EventKind, StepKind
from imucal_wizard.guide.state import Event, FieldStatus, Offer, Status
from imucal_wizard.measurement.field_quality import (
    check_field,
    check_readings,
    check_saturation,
    check_scatter,
)
from imucal_wizard.tui.widgets.big_text import BigText
from tests.tui import fakes
from tests.tui.terminals import LARGE, USUAL, app_with
from tests.tui.waiting import seen, shows, until


def field() -> FieldStatus:
    """In the circle on −z: the lower half is covered."""
    counts = np.where(centres()[:, 2] < 0.0, 9, 0)
    return FieldStatus(
        face="-z", face_down="-z", turned=214.0, done=("+x", "-x"),
        missing=("+y", "-y", "-z", "+z"), counts=counts, here=61, gaps=23.4, variance=2.1,
        wobble=4.4, fit_error=0.8, magnitude=48.21, advice="lay the −y face on the table",
        samples=1234, left_out=12,
    )  # fmt: skip


def status(now: FieldStatus | None = None) -> Status:
    """The step with this field."""
    return Status(
        step=StepKind.FIELD,
        elapsed=431.0,
        act=Act.CIRCLE,
        instruction="TURN −Z DOWN",
        guidance="lay the −y face on the table",
        field=now or field(),
        up=(0.0, 0.0, 1.0),
        noise="1.2 mg, 0.06 °/s",
        last_event=Event(EventKind.HOLD_TAKEN, 420.0, "the circle on −x is done"),
    )


def disturbed_status(words: str) -> Status:
    """While iron passes."""
    now = replace(field(), disturbed=words)
    return replace(status(now), act=Act.WAIT, instruction="DISTURBED", guidance="")


def source_of(now: FieldStatus | None = None) -> fakes.FakeSource:
    """A stream with a magnetometer."""
    stream = replace(fakes.STREAM, magnetometer=(20.0, 3.0, -40.0))
    return fakes.FakeSource(status(now), stream)


@pytest.mark.parametrize("size", [USUAL, LARGE])
async def test_the_step_tells_angle_faces_sphere_quality_and_advice(size: tuple[int, int]) -> None:
    app = app_with(source_of())
    async with app.run_test(size=size) as pilot:
        text = await shows(
            pilot, "▸FIELD", "turned 214° of 360°", "−z down", "+x ●", "+y ·", "[−z ◎]",
            "front +z", "back −z", "█ covered", "· gap", "◆ now", "23 %   want 15", "2.1 % ✓ good",
            "4.4 % ▲ want 4", "0.80 % ✓ good", "48.2 µT", "1234 samples, 12 left out",
            "lay the −y face on the table", "the circle on −x is done", "s skip step", "? help",
        )  # fmt: skip
        explained = ("not seen yet", "off centre") if size == LARGE else ()
        await shows(pilot, *explained)
        assert text.count("◆") == 2  # where it is, and what the sign means
        assert app.screen.query_one(BigText).text == "TURN −Z DOWN"


async def test_a_disturbance_is_said_large_and_with_its_size_while_it_lasts() -> None:
    disturbed = "the field is disturbed: 12 µT too much; these samples are left out"
    source = source_of(replace(field(), disturbed=disturbed))
    source.say(disturbed_status(disturbed))
    app = app_with(source)
    async with app.run_test(size=USUAL) as pilot:
        text = await shows(pilot, disturbed)
        assert "▸ lay" not in text
        assert app.screen.query_one(BigText).text == "DISTURBED"
        source.say(status())
        await shows(pilot, "▸ lay the −y face")
        assert app.screen.query_one(BigText).text == "TURN −Z DOWN"


async def test_a_problem_that_prevents_calibration_comes_before_the_instruction() -> None:
    trouble = "The field is 140 µT: that is not the Earth's"
    async with app_with(source_of(replace(field(), trouble=trouble))).run_test(size=USUAL) as pilot:
        text = await shows(pilot, f"▲ {trouble}", "▸ lay the −y face")
        assert text.index(trouble) < text.index("▸ lay")


async def test_the_way_to_the_next_face_stands_once() -> None:
    way = "88° away: tip it away from you"
    source = fakes.FakeSource(replace(status(), guidance=way, detail="flat on the table"))
    async with app_with(source).run_test(size=USUAL) as pilot:
        text = await shows(pilot, f"▸ {way}", "the circle on −x is done", "flat on the table")
        assert "lay the −y face" not in text  # the advice of the field is not a second instruction


async def test_the_way_to_continue_stays_visible_beside_a_problem() -> None:
    way, wrong = (
        "88° away: tip it away from you",
        "the device does not turn: turn it once round",
    )
    shown = replace(status(replace(field(), trouble=wrong)), guidance=way)
    async with app_with(fakes.FakeSource(shown)).run_test(size=USUAL) as pilot:
        await shows(pilot, f"▲ {wrong}", f"▸ {way}")


async def test_a_disturbance_is_not_said_twice() -> None:
    disturbed = disturbance_text(0.25, 48.0, "uT")
    begun = reworded("Something disturbs the field: new samples are left out.", disturbed)
    shown = replace(disturbed_status(disturbed), last_event=Event(EventKind.WARNING, 430.0, begun))
    async with app_with(fakes.FakeSource(shown)).run_test(size=USUAL) as pilot:
        assert "Something disturbs" not in await shows(pilot, disturbed)


@pytest.mark.parametrize(("then", "now"), [(silence(20.0), silence(22.0)), (resting(20.0),) * 2])
async def test_instructions_are_not_repeated_without_new_data(then: str, now: str) -> None:
    """The way on that is offered says it; the reason stands above already, with newer numbers."""
    event = Event(EventKind.STUCK, 430.0, reworded(f"No progress for 20 s. {then}.", then))
    shown = replace(
        status(replace(field(), trouble=now)), last_event=event, detail="flat on it", guidance=""
    )
    async with app_with(fakes.FakeSource(shown)).run_test(size=USUAL) as pilot:
        assert "No progress" not in await shows(pilot, "flat on it", now)


async def test_the_way_to_continue_is_always_shown() -> None:
    trouble = (
        "the field has changed permanently: remove the iron or magnet that came near, or repeat "
        "the step in another place"
    )
    offers = (Offer("enough", "go on with these samples: the result is less certain"),)
    source = fakes.FakeSource(replace(status(replace(field(), trouble=trouble)), offers=offers))
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, "changed permanently", " g  go on with these samples")
        await pilot.press("g")
        await until(pilot, lambda: source.commands == [("enough", "")])


def refusals() -> dict[str, Callable[[], object]]:
    """What a step may be told of its readings, in the domain's own longest words."""
    turn = np.linspace(0.0, 2.0 * np.pi, 800)
    circle = 40.0 * np.column_stack([np.cos(turn), np.sin(turn), 0.1 * np.sin(3.0 * turn)])
    stuck = {"+x": np.arange(800) < 194}
    ball = np.random.default_rng(0).uniform(-40.0, 40.0, (800, 3)).cumsum(axis=0)
    inside = np.where(stuck["+x"], -9.0, 0.1 * np.sin(7.0 * turn))
    return {
        "lie in one plane": lambda: check_readings(circle),
        "is not the Earth's": lambda: check_field(48496.0, "uT", None),
        "is saturated": lambda: check_saturation(stuck, inside, np.zeros(3)),
        "always sends the same value": lambda: check_readings(0.0 * circle),
        "the field is not constant": lambda: check_scatter(0.21, 1.0, ball),
    }


@pytest.mark.parametrize("words", refusals())
async def test_a_long_problem_is_shown_whole_with_the_way_to_continue(words: str) -> None:
    with pytest.raises(DataError, match=words) as refused:
        refusals()[words]()
    trouble, way = str(refused.value), "88° away: tip it away from you"
    offers = (Offer("enough", "go on: the calibration will probably fail"),)
    shown = replace(status(replace(field(), trouble=trouble)), guidance=way, offers=offers)
    async with app_with(fakes.FakeSource(shown)).run_test(size=USUAL) as pilot:
        await shows(pilot, f"▸ {way}", " g  go on: the calibration", "█ covered")
        await until(pilot, lambda: trouble in " ".join(seen(pilot).split()))


async def test_how_to_lay_it_down_is_told_to_its_end() -> None:
    detail = "away from iron, magnets and loudspeakers; any face or free tumbling counts"
    shown = replace(status(), guidance="88° away: tip it away from you", detail=detail)
    event = Event(EventKind.WARNING, 430.0, 2 * "words that take two rows of eighty columns, ")
    async with app_with(fakes.FakeSource(replace(shown, last_event=event))).run_test() as pilot:
        await shows(pilot, detail)


async def test_before_the_first_fit_there_are_no_figures_and_no_zero() -> None:
    async with app_with(source_of(FieldStatus(face="-z"))).run_test(size=USUAL) as pilot:
        await shows(
            pilot,
            "turned 0° of 360°",
            "– %   want 15",
            "– %   want 4.5",
            "field     –",
            "0 samples",
        )


async def test_gaps_that_six_circles_leave_are_nothing_to_mend() -> None:
    """A small figure is the goal of tumbling only; all faces end the step as well."""
    whole = replace(field(), done=tuple(FACES), missing=(), face=None)
    async with app_with(source_of(whole)).run_test(size=USUAL) as pilot:
        await shows(pilot, "23 % ✓ 6 faces", "4.4 % ▲ want 4")


async def test_without_circles_any_motion_counts() -> None:
    async with app_with(source_of(replace(field(), face=None))).run_test(size=USUAL) as pilot:
        await shows(pilot, "all faces are done", "any motion counts now")


async def test_the_step_is_skipped_only_after_its_cost_was_read() -> None:
    source = source_of()
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, "▸FIELD")
        await pilot.press("s")
        await shows(pilot, "skip Field?", "no heading")
        await pilot.press("enter")
        await until(pilot, lambda: source.commands == [("skip", "")])
        await pilot.press("r", "u")
        await until(pilot, lambda: source.commands[1:] == [("repeat", ""), ("undo", "")])


async def test_help_says_what_the_sphere_and_the_figures_are() -> None:
    async with app_with(source_of()).run_test(size=LARGE) as pilot:
        await shows(pilot, "▸FIELD")
        await pilot.press("question_mark")
        await shows(pilot, "help: field", "seen from the device", "wobble:", "fit error:")


async def test_the_header_names_the_step_only_where_there_is_a_magnetometer() -> None:
    """All ten steps with the time in 80 columns; the first ones that are over are a tick."""
    source = fakes.FakeSource(fakes.poses_status())
    async with app_with(source).run_test(size=USUAL) as pilot:
        assert "Field" not in await shows(pilot, "▸18 POSES", "Save", "04:12")
        source.stream = replace(source.stream, magnetometer=(20.0, 3.0, -40.0))
        source.say(fakes.poses_status())
        await shows(pilot, "▸18 POSES", "Rotations  Field", "Save", "04:12")
        source.say(status())
        await shows(pilot, "✓18 poses ✓Rotations ▸FIELD", "Save", "07:11")


async def test_the_virtual_hand_turns_the_face_that_lies_there_and_lets_steel_pass() -> None:
    source = source_of(replace(field(), face="-y", face_down="-y"))
    source.hand = hand = fakes.FakeHand()  # type: ignore[attr-defined]  # only some sources have one
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, "S steel passes")
        await pilot.press("space", "S")
        await until(pilot, lambda: len(hand.commands) == 2)
        assert hand.commands == [("y", 372.0), ("steel", "")]


async def test_the_footer_says_whether_the_virtual_hand_is_at_work() -> None:
    """Who presses H twice should see that nobody turns the device any more."""
    source = source_of()
    source.hand = hand = fakes.FakeHand()  # type: ignore[attr-defined]  # only some sources have one
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, "H hand does it")
        await pilot.press("H")
        await shows(pilot, "H hand stops")
        assert hand.following
        await pilot.press("H")
        await shows(pilot, "H hand does it")
