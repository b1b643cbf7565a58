"""What the bench has added stays over the screens, is saved, and is not given up unasked."""

import threading
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import cast

import pytest
from textual.pilot import Pilot

from imucal_wizard.acquire.files import SUFFIX
from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.quantities import quantity
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.state import Status
from imucal_wizard.sessions import Session
from imucal_wizard.sessions.bench_draft import BenchDraft
from imucal_wizard.tui.app import WizardApp
from imucal_wizard.tui.run import BenchApp
from imucal_wizard.tui.screens.bench import BenchScreen
from imucal_wizard.tui.services import Saved
from tests.tui import fakes
from tests.tui.bench_steps import add_the_first, app_with, nowhere, open_from_wizard, ranked
from tests.tui.terminals import USUAL, VIRTUAL
from tests.tui.waiting import seen, shows, until
from tests.waiting import PATIENCE


def app_at(
    step: StepKind,
    report: FitReport,
    written: list[tuple[str, ...]],
    draft: Callable[[], BenchDraft] = lambda: BenchDraft(()),
) -> WizardApp:
    """The app at a step; notes the accelerometer's model whenever it is saved."""
    source = fakes.FakeSource(Status(step=step, elapsed=600.0, holds=24))
    plain = fakes.services(source)

    def save(fitted: FitReport, benches: Benches | None, place: Path | None) -> Saved:
        found = fitted if benches is None else benches.fitted()
        written.append(tuple(term.name for term in found.sensors["accelerometer"].terms))
        return plain.save(fitted, benches, place)

    lacking = fakes.diagnoses(accelerometer=Verdict.MISSING)
    services = replace(
        plain,
        fit=lambda _collected, _snapshot: report,
        save=save,
        draft=draft,
        diagnose=lambda _benches: lacking,
    )
    return WizardApp(services, None, VIRTUAL)


async def test_the_result_says_what_the_bench_has_added_and_it_is_saved(bent: FitReport) -> None:
    written: list[tuple[str, ...]] = []
    app = app_at(StepKind.RESULT, bent, written)
    async with app.run_test(size=USUAL) as pilot:
        await open_from_wizard(pilot)
        await add_the_first(pilot)
        await pilot.press("escape")
        await shows(pilot, "from the bench: accelerometer + second-order; not saved yet")
        shown = app.state.result
        assert shown is not None
        fit = shown.sensors["accelerometer"]
        await shows(pilot, f"→  {quantity(fit.rms_fitted, fit.unit)}")  # not the error without it
        await pilot.press("f")
        await shows(pilot, "model is complete")
        await pilot.press("escape", "s")
        await until(pilot, lambda: bool(written))
        await shows(pilot, "✓ from the bench: accelerometer + second-order; saved")
    assert written[0] == ("second-order",)


async def test_a_model_changed_after_saving_is_said_and_saved_by_one_key(bent: FitReport) -> None:
    written: list[tuple[str, ...]] = []
    async with app_at(StepKind.SAVE, bent, written).run_test(size=USUAL) as pilot:
        await until(pilot, lambda: written == [()])
        await pilot.press("f")
        await add_the_first(pilot)
        await pilot.press("escape")
        await shows(pilot, "s saves it")
        await pilot.press("s")
        await until(pilot, lambda: len(written) == 2)
        await until(pilot, lambda: "differs from" not in seen(pilot))
    assert written[1] == ("second-order",)


BUILT = "This model is not saved: accelerometer + second-order."


async def test_leaving_the_bench_asks_about_a_model_that_is_in_no_file(benches: Benches) -> None:
    places: Iterator[UsageError | Saved] = iter(
        [UsageError("the disk is full"), Saved(Path("built.json"))]
    )

    def save(_place: Path | None) -> Saved:
        place = next(places)
        if isinstance(place, UsageError):
            raise place
        return place

    app = app_with(benches, save)
    async with app.run_test(size=USUAL) as pilot:
        await add_the_first(pilot)
        await pilot.press("b")
        await shows(pilot, BUILT)
        await pilot.press("q", "ctrl+c", "enter")  # a key that repeats itself gives nothing up
        await shows(pilot, BUILT)
        await pilot.press("escape")
        await shows(pilot, "enter add it")
        await pilot.press("q", "s")
        await shows(pilot, "not saved: the disk is full")
        await pilot.press("escape", "s")
        await shows(pilot, "✓ saved: built.json")
        await pilot.press("escape")
    assert app.return_value == Saved(Path("built.json"))


async def test_leaving_while_a_term_is_added_waits_and_asks(benches: Benches) -> None:
    app = app_with(benches)
    async with app.run_test(size=USUAL) as pilot:
        await ranked(pilot)
        await pilot.press("enter", "q")
        await shows(pilot, BUILT)
        await pilot.press("d")
    assert app.return_value is None


@pytest.mark.parametrize("problem", ["", "the disk is full"])
async def test_leaving_while_the_calibration_is_written_waits_for_it(problem: str) -> None:
    """Enter, as it comes from a hand that does not wait for SAVED."""
    source = fakes.FakeSource(Status(step=StepKind.SAVE, elapsed=600.0, holds=24))
    plain, disk = fakes.services(source, Path("built.json")), threading.Event()

    def save(fitted: FitReport, benches: Benches | None, place: Path | None) -> Saved:
        assert disk.wait(PATIENCE)
        if problem:
            raise UsageError(problem)
        return plain.save(fitted, benches, place)

    app = WizardApp(replace(plain, save=save), None, VIRTUAL)
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "Writing the calibration")
        await pilot.press("enter", "enter", "q")
        await shows(pilot, "the program ends")
        disk.set()
        if problem:
            await shows(pilot, f"not saved: {problem}")
        else:
            await until(pilot, lambda: app.return_value is not None)
    assert app.return_value is None or not problem


@pytest.mark.study
async def test_a_model_outlives_a_program_that_is_ended_without_a_question(
    bent: FitReport, tmp_path: Path
) -> None:
    recorded = tmp_path / "a.csv"
    recorded.write_text("what was measured")

    async def opened(then: Callable[[Pilot[Saved]], Awaitable[None]]) -> None:
        app = BenchApp(lambda: Benches(bent), nowhere, [recorded])
        async with app.run_test(size=USUAL) as pilot:
            await then(pilot)

    async def built(pilot: Pilot[Saved]) -> None:
        bench = cast("BenchScreen", pilot.app.screen)
        await ranked(pilot)
        await pilot.press("e", *"k*a**3", "enter")
        await shows(pilot, "▸ formula")
        await pilot.press("enter")
        await until(pilot, lambda: not bench.busy)
        await add_the_first(pilot)
        cast("BenchApp", pilot.app).leave()  # as a signal does

    async def restored(pilot: Pilot[Saved]) -> None:
        await shows(pilot, "✓ Restored: accelerometer + formula + second-order (")
        await pilot.press("escape")
        await shows(pilot, "This model is not saved: accelerometer + formula +")
        await pilot.press("d")

    async def given_up(pilot: Pilot[Saved]) -> None:
        await ranked(pilot)
        assert "Restored" not in seen(pilot)

    await opened(built)
    await opened(restored)
    await opened(given_up)


async def test_the_result_of_a_resumed_session_has_the_model_again(
    bent: FitReport, tmp_path: Path
) -> None:
    recorded = tmp_path / "a.csv"
    recorded.write_text("what was measured in a session")
    written: list[tuple[str, ...]] = []
    for again in (False, True):
        app = app_at(StepKind.RESULT, bent, written, lambda: BenchDraft([recorded]))
        async with app.run_test(size=USUAL) as pilot:
            if again:
                await shows(pilot, "from the bench: accelerometer + second-order; not saved yet")
                await pilot.press("s")
                await until(pilot, lambda: bool(written))
            else:
                await open_from_wizard(pilot)
                await add_the_first(pilot)
                app.leave()  # as a signal does
    assert written == [("second-order",)]
    assert BenchDraft([recorded]).restore(Benches(bent)) == ""  # a file has it


async def test_a_session_is_resumed_with_the_model_that_its_file_has(
    bent: FitReport, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    session = tmp_path / f"a{SUFFIX}"
    Session.create(session, {}).close()
    written: list[tuple[str, ...]] = []

    def resumed() -> WizardApp:
        return app_at(StepKind.RESULT, bent, written, lambda: BenchDraft([session]))

    app = resumed()
    async with app.run_test(size=USUAL) as pilot:
        await open_from_wizard(pilot)
        await add_the_first(pilot)
        await pilot.press("escape", "s")
        await until(pilot, lambda: app.state.saved is not None)
        saved = app.state.saved
        assert saved is not None
        saved.path.write_text("a calibration")
    app = resumed()
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "from the bench: accelerometer + second-order; saved")
        assert app.unsaved_model() == ""
        await pilot.press("s")
        await until(pilot, lambda: len(written) == 2)
    assert written == [("second-order",)] * 2
    saved.path.unlink()
    assert "in no file" in BenchDraft([session]).restore(Benches(bent))


def test_a_base_that_was_made_smaller_is_what_is_saved(benches: Benches) -> None:
    benches.accelerometer.remove("scale")
    assert benches.changed({}) == ["accelerometer − scale"]
    assert "scale" not in benches.fitted().sensors["accelerometer"].model
    benches.accelerometer.undo()
    assert benches.changed({}) == []
