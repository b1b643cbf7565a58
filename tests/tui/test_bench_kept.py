"""What the bench has added stays over the screens, and is what is saved."""

from dataclasses import replace

from imucal_wizard.core.quantities import quantity
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.state import Status
from imucal_wizard.tui.app import WizardApp
from imucal_wizard.tui.services import Saved
from tests.tui import fakes
from tests.tui.bench_steps import add_the_first, open_from_wizard
from tests.tui.terminals import USUAL, VIRTUAL
from tests.tui.waiting import seen, shows, until


def app_at(step: StepKind, report: FitReport, written: list[tuple[str, ...]]) -> WizardApp:
    """The app at a step; notes the accelerometer's model whenever it is saved."""
    source = fakes.FakeSource(Status(step=step, elapsed=600.0, holds=24))
    plain = fakes.services(source)

    def save(fitted: FitReport, benches: Benches | None) -> Saved:
        found = fitted if benches is None else benches.fitted()
        written.append(tuple(term.name for term in found.sensors["accelerometer"].terms))
        return plain.save(fitted, benches)

    services = replace(plain, fit=lambda _collected, _snapshot: report, save=save)
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
        await until(pilot, lambda: "another model than" not in seen(pilot))
    assert written[1] == ("second-order",)
