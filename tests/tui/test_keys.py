"""What a key does is said where it does it: help, sound, skipping, quitting, the virtual hand."""

from dataclasses import replace

import pytest

from imucal_wizard.guide.kinds import EventKind, StepKind
from imucal_wizard.guide.state import Event, Offer, Status
from tests.tui import fakes
from tests.tui.terminals import LARGE, USUAL, app_with
from tests.tui.waiting import seen, shows, until


async def test_the_key_of_an_offer_gives_its_command() -> None:
    status = replace(fakes.poses_status(), offers=(Offer("take", "take it anyway"),))
    source = fakes.FakeSource(status)
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, "take it anyway")
        await pilot.press("t", "u")
        await until(pilot, lambda: ("undo", "") in source.commands)
        assert source.commands == [("take", ""), ("undo", "")]


async def test_help_is_in_plain_words_and_closes_again() -> None:
    async with app_with(fakes.FakeSource(fakes.rotations_status())).run_test(size=USUAL) as pilot:
        await shows(pilot, "▸ROTATIONS")
        await pilot.press("question_mark")
        await shows(pilot, "Hold still, turn the device about the axis", "takes back the last hold")
        await pilot.press("escape")
        await until(pilot, lambda: "takes back" not in seen(pilot))


async def test_the_help_says_which_way_each_key_turns_the_virtual_device() -> None:
    """Both keys of a pair once, each with its own sense."""
    source = fakes.FakeSource(fakes.poses_status())
    source.hand = fakes.FakeHand()  # type: ignore[attr-defined]  # only some sources have one
    async with app_with(source).run_test(size=LARGE) as pilot:
        await shows(pilot, "▸18 POSES")
        await pilot.press("question_mark")
        text = await shows(pilot, "about its z axis, by +15° (←) or −15° (→)")
        for axis, keys in (("x", "(a) or −15° (d)"), ("y", "(↑) or −15° (↓)")):
            assert f"about its {axis} axis, by +15° {keys}" in text
        assert text.count("turns the virtual device") == 3


async def test_help_is_there_above_a_question_too_and_goes_with_its_step() -> None:
    source = fakes.FakeSource(fakes.poses_status())
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, "▸18 POSES")
        await pilot.press("s")
        await shows(pilot, "fewer directions")
        await pilot.press("question_mark")
        await shows(pilot, "help: poses", "Hold the device as it is drawn")
        source.say(fakes.rotations_status())
        await shows(pilot, "▸ROTATIONS", "about x 3 of 6 taken")
        assert "fewer directions" not in seen(pilot)
        assert "Hold the device as it is drawn" not in seen(pilot)


@pytest.mark.parametrize("step", [StepKind.SOURCE, StepKind.RESULT, StepKind.SAVE])
async def test_help_names_no_key_that_does_nothing_on_its_screen(step: StepKind) -> None:
    source = fakes.FakeSource(Status(step=step))
    async with app_with(source).run_test(size=LARGE) as pilot:
        await shows(pilot, f"▸{step.upper()}")
        await pilot.press("question_mark")
        text = await shows(pilot, f"help: {step}", "quits; the session can be")
        assert "skips the step" not in text
        assert "takes back" not in text
        assert "turn the virtual device" not in text
        assert ("goes back one step" in text) is (step is not StepKind.SOURCE)


async def test_quitting_asks_nothing_and_stops_the_source() -> None:
    source = fakes.FakeSource(fakes.poses_status())
    app = app_with(source)
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "7 of 18")
        await pilot.press("q")
        await until(pilot, lambda: not app.is_running)
    assert not source.running
    assert app.return_value is None


async def test_every_state_change_is_heard_until_the_sound_is_off() -> None:
    source = fakes.FakeSource(fakes.poses_status())
    app = app_with(source)
    rung: list[int] = []
    app.bell = lambda: rung.append(1)  # type: ignore[method-assign]  # the terminal's bell
    app.state.sounds = type(app.state.sounds)(
        app.bell, app.set_timer, lambda: float(100 * len(rung))
    )
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "7 of 18")
        source.happen(Event(EventKind.STEP_DONE, 1.0, "all 18 poses done"))
        await until(pilot, lambda: len(rung) == 3)
        await pilot.press("m")
        await shows(pilot, "sound off")
        source.happen(Event(EventKind.HOLD_TAKEN, 2.0, "a hold nobody hears"))
        await shows(pilot, "a hold nobody hears")
        assert len(rung) == 3


async def test_at_eighty_columns_the_mute_is_seen_and_no_word_is_cut() -> None:
    noise = "1.1 1.0 1.1 mg, 0.10 0.10 0.10 °/s"
    source = fakes.FakeSource(replace(fakes.poses_status(), noise=noise))
    source.stream = replace(source.stream, source="virtual IMU on /dev/pts/0")
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, noise)
        await pilot.press("m")
        text = await shows(pilot, "sound off", noise)
        assert "virtual" not in text
        await pilot.resize_terminal(*LARGE)
        await shows(pilot, "sound off", noise, "virtual IMU on /dev/pts/0")


async def test_a_virtual_hand_is_moved_by_keys_that_are_shown_only_then() -> None:
    source = fakes.FakeSource(fakes.poses_status())
    async with app_with(source).run_test(size=USUAL) as pilot:
        assert "snap" not in await shows(pilot, "7 of 18")
    source = fakes.FakeSource(fakes.poses_status())
    source.hand = hand = fakes.FakeHand()  # type: ignore[attr-defined]  # only some sources have one
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, "7 of 18", "space snap", "T tremble", "H hand does it")
        await pilot.press("left", "d", "space", "T")
        await until(pilot, lambda: hand.trembling)
        assert hand.commands == [("z", 15.0), ("x", -15.0), ("snap", "+x-y")]


@pytest.mark.parametrize(
    ("step", "says"),
    [(StepKind.POSES, "fewer directions"), (StepKind.RECHECK, "axes that were not measured")],
)
async def test_skipping_states_its_consequence_first(step: StepKind, says: str) -> None:
    source = fakes.FakeSource(replace(fakes.poses_status(), step=step, steps=()))
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, "s skip step")
        await pilot.press("s")
        await shows(pilot, says, "enter skip it")
        await pilot.press("s")  # the key of the first question, pressed twice
        await shows(pilot, says)
        assert source.commands == []
        await pilot.press("enter")
        await until(pilot, lambda: source.commands == [("skip", "")])


async def test_staying_after_all_skips_nothing() -> None:
    source = fakes.FakeSource(fakes.poses_status())
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, "▸18 POSES")
        await pilot.press("s")
        await shows(pilot, "fewer directions")
        await pilot.press("escape")
        await until(pilot, lambda: "fewer directions" not in seen(pilot))
        assert source.commands == []
