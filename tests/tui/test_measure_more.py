"""From the bench to exactly the poses it asks for, and back to the bench with more data."""

from dataclasses import replace

import pytest

from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.state import RotationStatus, Status
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.measurement.requests import requests_from_text
from imucal_wizard.run.snapshot import Snapshot
from imucal_wizard.tui.app import WizardApp
from imucal_wizard.tui.screens.bench import BenchScreen
from tests.tui import fakes
from tests.tui.bench_steps import add_the_first, app_with, open_from_wizard, ranked
from tests.tui.terminals import USUAL, VIRTUAL
from tests.tui.waiting import seen, shows, until

RESULT = Status(step=StepKind.RESULT, elapsed=600.0, holds=24)


def fitting(source: fakes.FakeSource, *reports: FitReport) -> fakes.FakeServices:
    """Services whose fits give these reports one after the other."""
    left = list(reports)

    def fit(_collected: Collected, _snapshot: Snapshot) -> FitReport:
        return left.pop(0) if left[1:] else left[0]

    # the bench opens on the accelerometer
    lacking = fakes.diagnoses(accelerometer=Verdict.MISSING)
    return replace(fakes.services(source), fit=fit, diagnose=lambda _benches: lacking)


@pytest.mark.study
async def test_one_key_asks_for_the_poses_listed_and_the_bench_opens_again_with_its_model(
    bent: FitReport,
) -> None:
    source = fakes.FakeSource(RESULT)
    services = fitting(source, bent, replace(bent, warnings=("more",)))
    async with WizardApp(services, None, VIRTUAL).run_test(size=USUAL) as pilot:
        await open_from_wizard(pilot)
        await add_the_first(pilot)
        await pilot.press("n")
        await shows(pilot, "m measures these now")
        await pilot.press("m")
        await shows(pilot, "▸MORE POSES")
        name, text = source.commands[-1]
        assert name == "measure"
        wanted = requests_from_text(text)[0]
        source.say(
            Status(
                step=StepKind.MORE, instruction="TURN IT UP", detail=wanted.words,
                guidance="23° away", wanted=wanted.pose, wanted_up=wanted.up, progress=(0, 1),
            )
        )  # fmt: skip
        await shows(
            pilot, "for the bench: 0 of 1 measurements taken", "23° away", wanted.words[:30]
        )
        source.say(RESULT)
        await shows(pilot, "BENCH  accelerometer", "model is complete")
        await pilot.press("2")
        await shows(pilot, "✓ second-order")


@pytest.mark.study
async def test_the_bench_opens_again_on_the_sensor_it_was_left_with(sagging: FitReport) -> None:
    source = fakes.FakeSource(RESULT)
    app = WizardApp(fitting(source, sagging, replace(sagging, warnings=("more",))), None, VIRTUAL)
    async with app.run_test(size=USUAL) as pilot:
        await open_from_wizard(pilot)
        await shows(pilot, "BENCH  accelerometer", "is complete")
        await pilot.press("g")
        await shows(pilot, "BENCH  gyroscope", "▸ g-sensitivity")
        await pilot.press("m")
        await shows(pilot, "▸MORE POSES")
        source.say(RESULT)
        await shows(pilot, "BENCH  gyroscope", "▸ g-sensitivity")


async def test_what_the_bench_asks_for_can_be_left_at_any_time(bent: FitReport) -> None:
    source = fakes.FakeSource(Status(step=StepKind.MORE, progress=(1, 4)))
    async with WizardApp(fitting(source, bent), None, VIRTUAL).run_test(size=USUAL) as pilot:
        await shows(pilot, "for the bench: 1 of 4 measurements taken")
        await pilot.press("s")
        await until(pilot, lambda: source.commands[-1:] == [("skip", "")])


async def test_turns_asked_for_show_their_angle_and_their_number(bent: FitReport) -> None:
    turning = RotationStatus("x", "+z", 40.0, 90.0, 120.0, 250.0, (92.0,), 6, False, 1)
    status = Status(step=StepKind.MORE, instruction="ROTATE ABOUT X", rotation=turning)
    async with WizardApp(
        fitting(fakes.FakeSource(status), bent), None, VIRTUAL
    ).run_test(size=USUAL) as pilot:  # fmt: skip
        await shows(pilot, "so far", "+40°", "1 of 6")


async def test_a_pose_wanted_twice_has_two_signs(bent: FitReport) -> None:
    status = Status(step=StepKind.MORE, done=("+x",), missing=("+x", "+y"), wanted="+y")
    async with WizardApp(
        fitting(fakes.FakeSource(status), bent), None, VIRTUAL
    ).run_test(size=USUAL) as pilot:  # fmt: skip
        await shows(pilot, "+x ●·", "+y ◎")


async def test_a_recording_lists_the_poses_and_offers_no_key_to_measure_them(
    benches: Benches,
) -> None:
    async with app_with(benches).run_test(size=USUAL) as pilot:
        await ranked(pilot)
        assert "m measure" not in seen(pilot)
        await pilot.press("n")
        text = await shows(pilot, "This is a recording", "MEASURE NEXT", "TILTED  ")
        assert "measure these now" not in text
        assert "IF YOU LIKE" not in text
        await pilot.press("m")
        await shows(pilot, "MEASURE NEXT")


@pytest.mark.study
async def test_a_disturbed_hold_that_is_chosen_is_what_is_measured_again(bent: FitReport) -> None:
    source = fakes.FakeSource(RESULT)
    async with WizardApp(fitting(source, bent), None, VIRTUAL).run_test(size=USUAL) as pilot:
        await open_from_wizard(pilot)
        await ranked(pilot)
        for _ in range(20):
            if "▸ disturbed" in seen(pilot):
                break
            await pilot.press("down")
        text = await shows(pilot, "▸ disturbed (#")
        number = text.split("▸ disturbed (#")[1].split(")")[0]
        await pilot.press("enter")
        await shows(pilot, "measure that pose again (m)")
        await pilot.press("n")
        await shows(pilot, f"hold {number} was disturbed")
        await pilot.press("m")
        await until(pilot, lambda: bool(source.commands))
    (asked,) = requests_from_text(source.commands[-1][1])
    assert asked.turns == 0


async def test_nothing_is_offered_to_measure_where_no_pose_is_listed(
    benches: Benches, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The pose of the chosen disturbed hold was held again already."""
    monkeypatch.setattr("imucal_wizard.diagnose.next_poses.measured_again", lambda *_: True)
    app = app_with(benches)
    async with app.run_test(size=USUAL) as pilot:
        screen = BenchScreen(lambda: benches, live=True)
        app.push_screen(screen)
        await ranked(pilot)
        for _ in range(20):
            if "▸ disturbed" in seen(pilot):
                break
            await pilot.press("down")
        await pilot.press("n")
        await shows(pilot, "what the data say", "More data show")
        assert "measure" not in {one.binding.action for one in app.screen.active_bindings.values()}
        await pilot.press("n", "m")
        await shows(pilot, "No pose is listed to measure")
        assert app.screen is screen
