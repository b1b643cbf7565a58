"""Every step says what to do, why it waits and how far it is, at the sizes people have."""

import asyncio
from dataclasses import replace
from typing import NoReturn

import pytest

from imucal_wizard.core.errors import DataError
from imucal_wizard.guide.kinds import Act, StepKind
from imucal_wizard.guide.state import Offer, Status
from imucal_wizard.tui.app import WizardApp, screen_for
from imucal_wizard.tui.widgets.big_text import BigText
from tests.tui import fakes
from tests.tui.terminals import LARGE, USUAL, VIRTUAL, app_with
from tests.tui.waiting import shows, until


@pytest.mark.parametrize("size", [USUAL, LARGE])
async def test_a_pose_is_told_with_words_drawing_reason_progress_and_list(
    size: tuple[int, int],
) -> None:
    app = app_with(fakes.FakeSource(fakes.poses_status()))
    async with app.run_test(size=size) as pilot:
        text = await shows(
            pilot,
            "7 of 18 poses taken",
            "the edge between the +x and −y faces on top",
            "23° away: tip it ",
            "z turns at 2.9 °/s, limit 0.8",
            "0.0 of 2.0 s",
            "18 POSES",
            "now",
            "wanted",
            "+x−y ◎",
            "+x+y ●",
            "+y−z ·",
            "100.0 Hz, 0 lost, 24.6 °C",
            "noise 1.2 mg, 0.06 °/s",
            "? help",
            "u undo",
            "q quit",
        )
        assert "██" in text or "█▀" in text  # the instruction in block letters
        assert app.screen.query_one(BigText).text == "TURN +X −Y UP"


@pytest.mark.parametrize("size", [(80, 38), (120, 40)])
async def test_a_taller_terminal_hides_neither_an_axis_nor_the_progress_of_a_hold(
    size: tuple[int, int],
) -> None:
    source = fakes.FakeSource(fakes.poses_status())
    async with app_with(source).run_test(size=size) as pilot:
        axes = (f"{sensor} {axis}  ▪" for sensor in "aω" for axis in "xyz")
        await shows(pilot, *axes, "HOLD", "0.0 of 2.0 s")


@pytest.mark.parametrize("size", [USUAL, LARGE])
async def test_up_down_shows_the_start_values_live(size: tuple[int, int]) -> None:
    source = fakes.FakeSource(fakes.up_down_status())
    async with app_with(source).run_test(size=size) as pilot:
        await shows(
            pilot, "3 of 6", "+x ●", "−y ◎", "yes ●", "1.3 of 2.0 s",
            "bias 0.110 m/s²", "sensitivity 9.820 m/s² per g", "+z ● 9.710     −z ·          m/s²",
        )  # fmt: skip


@pytest.mark.parametrize("size", [USUAL, LARGE])
async def test_settle_counts_the_seconds_measured(size: tuple[int, int]) -> None:
    async with app_with(fakes.FakeSource(fakes.settle_status())).run_test(size=size) as pilot:
        await shows(pilot, "4 of 10 s measured", "hands off", "4.0 of 10 s", "SETTLE")


@pytest.mark.parametrize("size", [USUAL, LARGE])
async def test_a_rotation_shows_angle_rate_range_and_what_is_wanted(size: tuple[int, int]) -> None:
    async with app_with(fakes.FakeSource(fakes.rotations_status())).run_test(size=size) as pilot:
        await shows(
            pilot, "+87°", "104 °/s, fastest 131, range 250", "within range",
            "3 of 18 rotations taken", "about x 3 of 6 taken", "+92° −78° +140°",
            "both senses ✓", "three speeds ✗", ", 120°, slow", "do this",
        )  # fmt: skip


async def test_a_range_that_is_not_known_is_taken_as_the_smallest_usual_one() -> None:
    status = fakes.rotations_status()
    assert status.rotation is not None
    source = fakes.FakeSource(replace(status, rotation=replace(status.rotation, range_known=False)))
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, "fastest 131, range 250 (usual)", "within range")
        fast = replace(status.rotation, range_known=False, fastest=240.0, clips=True)
        source.say(replace(status, rotation=fast))
        await shows(pilot, "▲ may clip")


async def test_a_terminal_that_is_too_small_says_so_and_recovers_when_it_grows() -> None:
    app = app_with(fakes.FakeSource(fakes.poses_status()))
    async with app.run_test(size=(60, 20)) as pilot:
        text = await shows(pilot, "60×20", "80×24")
        assert "of 18" not in text
        await pilot.resize_terminal(*USUAL)
        await shows(pilot, "7 of 18 poses taken", "+x−y ◎", "q quit")


async def test_a_problem_comes_before_the_ways_out_and_these_before_the_last_event() -> None:
    status = replace(
        fakes.poses_status(),
        offers=(
            Offer("loosen", "widen the limits to 1.6 times"),
            Offer("take", "take it anyway, marked hand-held"),
        ),
    )
    source = fakes.FakeSource(status)
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, "l  widen the limits", "t  take it anyway", "−y taken")
        source.stream = replace(source.stream, problem="the disk is full: make room")
        source.say(status)
        text = await shows(pilot, "▲ the disk is full: make room", "l  widen", "t  take")
        assert "−y taken" not in text
        source.stream = replace(source.stream, connected=False, problem="unplugged: plug it in")
        source.say(status)
        text = await shows(pilot, "▲ unplugged: plug it in", "STILL?  no samples")
        assert "l  widen" not in text  # nothing arrives that could be taken


async def test_a_lost_device_and_a_hold_that_counts_are_read_from_afar() -> None:
    source = fakes.FakeSource(fakes.poses_status())
    app = app_with(source)
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "7 of 18")
        words = app.screen.query_one(BigText)
        in_place = replace(
            fakes.poses_status(), act=Act.HOLD, instruction="HOLD STILL", still=fakes.still()
        )
        source.say(in_place)
        await until(pilot, lambda: words.text == "HOLD STILL")
        source.say(fakes.poses_status())
        await until(pilot, lambda: words.text == "TURN +X −Y UP")
        source.stream = replace(source.stream, connected=False)
        source.say(in_place)
        await until(pilot, lambda: words.text == "NOT CONNECTED")


async def test_the_screen_follows_the_machine_forwards_and_backwards() -> None:
    source = fakes.FakeSource(fakes.settle_status())
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, "▸SETTLE")
        for status, sign in (
            (fakes.up_down_status(), "▸UP/DOWN"),
            (fakes.poses_status(), "▸18 POSES"),
            (fakes.rotations_status(), "▸ROTATIONS"),
            (fakes.poses_status(), "▸18 POSES"),
        ):
            source.say(status)
            await shows(pilot, sign)


async def test_text_from_a_device_is_neither_markup_nor_a_command_to_the_terminal() -> None:
    source = fakes.FakeSource(fakes.poses_status())
    source.stream = replace(source.stream, source="[bold red]x[/] \x1b[2J\x07 [/nothing]")
    async with app_with(source).run_test(size=LARGE) as pilot:
        text = await shows(pilot, "[bold red]x[/]", "[/nothing]")
        assert "\x1b" not in text
        assert "\x07" not in text


async def test_the_procedure_is_told_that_a_recording_has_ended() -> None:
    source = fakes.FakeSource(fakes.poses_status())
    source.finished = True
    async with app_with(source).run_test(size=USUAL) as pilot:
        await until(pilot, lambda: ("end", "") in source.commands)


async def test_steps_that_were_skipped_are_marked() -> None:
    status = replace(fakes.rotations_status(), skipped=((StepKind.UP_DOWN, "no start values"),))
    async with app_with(fakes.FakeSource(status)).run_test(size=USUAL) as pilot:
        await shows(pilot, "–Up/down", "✓18 poses", "▸ROTATIONS")


async def test_a_result_that_there_is_not_is_not_ticked() -> None:
    """Nothing can be fitted, and the operator has gone on to the end."""

    def refuse(_collected: object, _snapshot: object) -> NoReturn:
        raise DataError("too few holds")

    status = replace(fakes.poses_status(), step=StepKind.SAVE)
    source = fakes.FakeSource(status)
    app = WizardApp(replace(fakes.services(source), fit=refuse), None, VIRTUAL)
    async with app.run_test(size=(120, 30)) as pilot:
        await shows(pilot, "not saved: too few holds")
        source.say(status)
        await shows(pilot, "–Result", "▸SAVE")


async def test_the_result_is_ticked_in_a_session_that_is_resumed_after_it() -> None:
    """Its fit is made again only when it is needed."""
    source = fakes.FakeSource(replace(fakes.poses_status(), step=StepKind.VALIDATE))
    async with app_with(source).run_test(size=(120, 30)) as pilot:
        await shows(pilot, "✓Result", "▸VALIDATE")


async def test_nothing_said_yet_is_no_reason_to_fail() -> None:
    app = app_with(fakes.FakeSource(Status(step=StepKind.POSES)))
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "▸18 POSES", "listening")


async def test_a_procedure_without_faces_has_no_place_for_them_in_the_header() -> None:
    """N's eight tilts: their number, and only the steps that there are."""
    steps = (StepKind.SOURCE, StepKind.SETTLE, StepKind.POSES, StepKind.RESULT, StepKind.SAVE)
    tilts = Status(
        step=StepKind.POSES,
        instruction="TILT −X TO +Z",
        detail="the −x face on top, tilted 30° towards +z",
        wanted="-x~+z",
        done=("+z~+x",),
        missing=("-x~+z", "+z~+y"),
        steps=steps,
        poses=8,
    )
    async with app_with(fakes.FakeSource(tilts)).run_test(size=USUAL) as pilot:
        text = await shows(pilot, "✓Settle ▸8 POSES", "tilted 30° towards +z", "tilts", "+z~+x ●")
        assert "Up/down" not in text
        assert "Rotations" not in text


@pytest.mark.parametrize("turns", [0, 1, 2, 8])
async def test_the_app_can_end_while_a_screen_opens(turns: int) -> None:
    """The new screen has only some of its widgets then."""
    app = app_with(fakes.FakeSource(fakes.poses_status()))
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "18 POSES")
        app.push_screen(screen_for(StepKind.POSES, app.state))
        for _ in range(turns):
            await asyncio.sleep(0)


async def test_a_step_with_measurements_is_repeated_only_after_its_cost_was_read() -> None:
    source = fakes.FakeSource(fakes.poses_status())
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, "7 of 18 poses taken")
        await pilot.press("r")
        await shows(pilot, "repeat Poses?", "be restored", "then u")
        await pilot.press("r", "u")
        await shows(pilot, "7 of 18 poses taken")
        assert source.commands == []
        await pilot.press("r")
        await shows(pilot, "repeat Poses?")
        await pilot.press("enter")
        await until(pilot, lambda: source.commands == [("repeat", "")])


async def test_a_step_that_is_done_ends_without_a_warning() -> None:
    done = replace(fakes.poses_status(18), offers=(Offer("skip", "all taken: go on"),))
    source = fakes.FakeSource(done)
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, "all taken: go on")
        await pilot.press("s")
        await until(pilot, lambda: source.commands == [("skip", "")])
