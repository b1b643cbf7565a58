"""The bench on the screen: look, learn, predict, add, see the error fall, take it back."""

import threading
from dataclasses import replace
from pathlib import Path

import pytest

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.quantities import number
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.diagnose.views import views_of
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.state import Status
from imucal_wizard.model.effects.second_order import SecondOrder
from imucal_wizard.tui.app import WizardApp
from imucal_wizard.tui.screens.bench import BenchScreen
from imucal_wizard.tui.services import Saved
from tests.model.restless import restless
from tests.tui import fakes
from tests.tui.bench_steps import app_with, open_from_wizard, ranked
from tests.tui.terminals import LARGE, USUAL, VIRTUAL
from tests.tui.waiting import seen, shows, until
from tests.waiting import PATIENCE

SIZES = pytest.mark.parametrize("size", [USUAL, LARGE])


def held_out(bench: Bench) -> str:
    """The held-out error as the screen shows it, mg."""
    return number((bench.fit.rms_held_out or 0.0) * 1000.0 / STANDARD_GRAVITY)


def noise(bench: Bench) -> str:
    """The noise of the force along x as the fit has it, in the words of the legend."""
    view = next(one for one in views_of(bench.fit) if one.x_label == "force along x, g")
    return f"▒ noise of each point ±{number(view.band or 0.0, 2)} mg"


@SIZES
async def test_the_suspects_stand_beside_what_is_left_and_what_is_to_be_said(
    benches: Benches, bench: Bench, size: tuple[int, int]
) -> None:
    async with app_with(benches).run_test(size=size) as pilot:
        await shows(
            pilot, "▸SUSPECTS", "▸ second-order", "asymmetry", held_out(bench), "<0.003", "x 5.0",
            "mg/g²", "▼", "pattern here", "second-order non-linearity, x", "force along x, g",
            noise(bench), "━ second-order",
        )  # fmt: skip


async def test_adding_the_suspect_lets_the_held_out_error_fall_and_undo_takes_it_back(
    benches: Benches, bench: Bench
) -> None:
    before = held_out(bench)
    async with app_with(benches).run_test(size=USUAL) as pilot:
        await ranked(pilot)
        await pilot.press("enter", "3")
        await shows(pilot, "▸LADDER", "+ second-order", "noise alone", "█", before)
        await shows(pilot, held_out(bench))
        await shows(pilot, "model is complete")
        await pilot.press("u")
        await until(pilot, lambda: "+ second-order" not in seen(pilot))
        assert bench.fit.model == ("bias", "scale", "non-orthogonality")


async def test_the_bench_waits_for_the_diagnosis_that_uses_it(benches: Benches) -> None:
    app = app_with(benches)
    app.models.lock.acquire()
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "Looking for what the accelerometer lacks")
        assert "▸ second-order" not in seen(pilot)
        app.models.lock.release()
        await ranked(pilot)


async def test_a_part_of_the_base_is_taken_out_and_put_back(benches: Benches, bench: Bench) -> None:
    async with app_with(benches).run_test(size=USUAL) as pilot:
        await ranked(pilot)
        await pilot.press("2", "down")
        await shows(pilot, "▸MODEL", "▸ ✓ scale", "f = T·s·(y − b)", "true force = matrix")
        await pilot.press("r")
        await shows(pilot, "· scale", "left out", "Scale of the base model is left out")
        await pilot.press("r")
        await shows(pilot, "scale is left out already")
        assert bench.ladder[-1].rms_fitted > 10.0 * bench.ladder[0].rms_fitted
        await pilot.press("enter")
        await shows(pilot, "✓ scale")
        await pilot.press("3")
        await shows(pilot, "− scale", "+ scale")


async def test_with_the_base_out_its_parts_are_the_first_suspects(benches: Benches) -> None:
    async with app_with(benches).run_test(size=USUAL) as pilot:
        await ranked(pilot)
        await pilot.press("r")
        await shows(pilot, "▸ non-orthogonality", "every sensor")
        await pilot.press("enter")
        await ranked(pilot)


@pytest.mark.study
async def test_the_base_can_be_taken_down_to_nothing_and_climbed_again(
    benches: Benches, bench: Bench
) -> None:
    async with app_with(benches).run_test(size=USUAL) as pilot:
        await ranked(pilot)
        for removed in ("non-orthogonality", "scale", "bias"):
            await pilot.press("r")
            await shows(pilot, f"▸ {removed}", "of the base model")
        assert not bench.fit.model
        for missing in ("scale", "non-orthogonality", "second-order"):
            await pilot.press("enter")
            await shows(pilot, f"▸ {missing}")
        assert bench.fit.model == ("bias", "scale", "non-orthogonality")


@SIZES
async def test_the_lesson_tells_what_happens_and_draws_the_signature(
    benches: Benches, size: tuple[int, int]
) -> None:
    async with app_with(benches).run_test(size=size) as pilot:
        await ranked(pilot)
        await pilot.press("l")
        await shows(pilot, "SECOND-ORDER NON-LINEARITY", "proof mass", "ε_i = K₂ᵢ x_i²")
        await pilot.press("pagedown")
        await shows(pilot, "force along x, g")
        await pilot.press("end")
        await shows(pilot, "what to do about it", "how to confirm it", "IEEE Std 1293")
        await pilot.press("l")
        await until(pilot, lambda: "proof mass" not in seen(pilot))


async def test_tab_changes_the_abscissa_of_the_residuals(benches: Benches) -> None:
    async with app_with(benches).run_test(size=USUAL) as pilot:
        for label in ("force along x", "force along y", "force along z", "pose: 6 faces",
                      "number of the hold", "time, min", "temperature",
                      "along x in the pose before"):  # fmt: skip
            await shows(pilot, label)
            await pilot.press("tab")


async def test_a_point_says_which_pose_it_is_and_what_was_read(benches: Benches) -> None:
    async with app_with(benches).run_test(size=USUAL) as pilot:
        await shows(pilot, "force along x, g")
        await pilot.press("right")
        await shows(pilot, "◆ hold 16, −x up", "residual −1.71 mg", "read −9.", "m/s²")


async def test_the_raw_trace_is_one_key_away_and_closed_by_the_same(benches: Benches) -> None:
    async with app_with(benches).run_test(size=USUAL) as pilot:
        await shows(pilot, "t shows its raw trace")
        await pilot.press("t")
        await shows(pilot, "raw trace", "residual: ", "Only the means")
        await pilot.press("t")
        await shows(pilot, "◆ hold ", "▸ second-order")


async def test_measurement_stands_beside_the_model_axis_by_axis(benches: Benches) -> None:
    async with app_with(benches).run_test(size=LARGE) as pilot:
        await shows(pilot, "holds: |a| − g")
        await pilot.press("a")
        await shows(pilot, "x axis: read beyond the true force: ∘ measured, × model", "⊗")
        await pilot.press("a", "a", "a")
        await shows(pilot, "holds: |a| − g")


async def test_the_chosen_suspect_is_drawn_against_what_it_would_explain(benches: Benches) -> None:
    async with app_with(benches).run_test(size=LARGE) as pilot:
        await ranked(pilot)
        await pilot.press("v")
        await shows(pilot, "does second-order x explain it? It would be 5.0")
        await pilot.press("down")
        await shows(pilot, "does asymmetry x explain it?")


async def test_in_lesson_mode_nothing_is_told_before_the_guess(
    benches: Benches, bench: Bench
) -> None:
    async with app_with(benches).run_test(size=USUAL) as pilot:
        await shows(pilot, "<0.003")
        await pilot.press("p")
        text = await shows(pilot, "Predict first", "▸ asymmetry")
        assert "<0.003" not in text
        assert "second-order (" not in text
        await pilot.press("enter")
        await shows(pilot, "predict: asymmetry", "largest on", "its sign")
        await pilot.press("right", "down", "right", "enter")
        await shows(pilot, "≈ you: asymmetry", "✓ you: x", "✓ you: +")
        await pilot.press("d")
        await shows(pilot, "model is complete")
        assert bench.fit.model[-1] == "second-order"


@SIZES
async def test_the_next_poses_show_their_gain(benches: Benches, size: tuple[int, int]) -> None:
    async with app_with(benches).run_test(size=size) as pilot:
        await ranked(pilot)
        await pilot.press("n")
        await shows(pilot, "SECOND-ORDER OR ASYMMETRY?", "With 6 more poses", "mg/g²", "TILTED  ")


async def test_a_typed_formula_becomes_a_suspect(benches: Benches, bench: Bench) -> None:
    async with app_with(benches).run_test(size=LARGE) as pilot:
        await ranked(pilot)
        await pilot.press("e", *"k*b", "enter")
        await shows(pilot, "▲ formula 'k*b'")
        await pilot.press(*(["backspace"] * 3), *"k*a**3", "enter")
        await shows(pilot, "formula  ")
        assert any(suspect.term == "formula" for suspect in bench.look().suspects)
        await shows(pilot, "▸ formula")


async def test_the_gyroscope_is_one_key_away_and_shows_turns_and_rest(
    sagged: Benches,
) -> None:
    async with app_with(sagged).run_test(size=LARGE) as pilot:
        await shows(pilot, "BENCH  accelerometer", "g gyroscope", "is complete")
        await pilot.press("g")
        await shows(pilot, "BENCH  gyroscope", "▸ g-sensitivity", "at rest, x axis", "force along")
        for _ in range(8):
            if "does not close" in seen(pilot):
                break
            await pilot.press("a")
        await shows(pilot, "rotations:", "does not close")
        await pilot.press("a")
        await shows(pilot, "at rest, x axis", "force along x, g")
        await pilot.press("right")
        await shows(pilot, "◆ hold")


async def test_it_is_reached_from_the_result_and_left_again(bent: FitReport) -> None:
    source = fakes.FakeSource(Status(step=StepKind.RESULT, elapsed=600.0, holds=24))
    lacking = fakes.diagnoses(accelerometer=Verdict.MISSING)
    services = replace(
        fakes.services(source),
        fit=lambda _collected, _snapshot: bent,
        diagnose=lambda _benches: lacking,
    )
    async with WizardApp(services, None, VIRTUAL).run_test(size=USUAL) as pilot:
        await open_from_wizard(pilot)
        await shows(pilot, "BENCH  accelerometer", "▸ second-order")
        await pilot.press("escape")
        await shows(pilot, "▸RESULT")


async def test_an_exercise_opens_with_nothing_told(benches: Benches) -> None:
    app = app_with(benches)
    async with app.run_test(size=USUAL) as pilot:
        await ranked(pilot)
        app.push_screen(BenchScreen(lambda: benches, predict=True))
        text = await shows(pilot, "Predict first", "p show the answer", "▸ asymmetry")
        assert "<0.003" not in text
        await pilot.press("n")
        assert "what the data say" not in seen(pilot)
        await pilot.press("p")
        await shows(pilot, "<0.003", "▸ second-order")


async def test_an_exercise_that_is_opened_again_hides_its_answer_until_it_was_shown(
    bent: FitReport,
) -> None:
    written: list[Benches | None] = []
    source = fakes.FakeSource(Status(step=StepKind.RESULT, elapsed=600.0, holds=24))
    plain = fakes.services(source)

    def save(fitted: FitReport, benches: Benches | None, place: Path | None) -> Saved:
        written.append(benches)
        return plain.save(fitted, benches, place)

    services = replace(plain, fit=lambda _collected, _snapshot: bent, save=save, exercise=True)
    app = WizardApp(services, None, VIRTUAL)
    async with app.run_test(size=USUAL) as pilot:
        for _ in range(2):
            await open_from_wizard(pilot)
            text = await shows(pilot, "Predict first", "▸ asymmetry")
            assert "issing:" not in text
            assert "second-order (" not in text
            await pilot.press("escape")
            await shows(pilot, "▸RESULT")
        app.state.save()
        assert written == [None], "verdicts give the answer away"
        await pilot.press("f")
        await shows(pilot, "▸ asymmetry")
        await pilot.press("p")
        await shows(pilot, "▸ second-order")
        await pilot.press("escape")
        await open_from_wizard(pilot)
        await shows(pilot, "▸ second-order")


async def test_nothing_is_told_of_a_model_that_is_being_fitted(
    benches: Benches, bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    going_on, done = threading.Event(), threading.Event()

    def slow(name: str) -> None:
        going_on.set()
        assert done.wait(PATIENCE)
        Bench.add(bench, name)

    async with app_with(benches).run_test(size=USUAL) as pilot:
        await ranked(pilot)
        monkeypatch.setattr(bench, "add", slow)
        await pilot.press("enter")
        await shows(pilot, "Adding second-order and fitting again")
        await pilot.press("n", "enter", "m", "u")
        assert "what the data say" not in seen(pilot)
        done.set()
        await shows(pilot, "model is complete")
        assert bench.fit.model[-1] == "second-order"


async def test_an_effect_that_cannot_be_fitted_is_refused_in_words(
    benches: Benches, bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    restless(monkeypatch, SecondOrder)
    async with app_with(benches).run_test(size=USUAL) as pilot:
        await ranked(pilot)
        await pilot.press("enter")
        await shows(pilot, "second-order cannot be fitted to these data", "▸ second-order")
        assert bench.fit.model == ("bias", "scale", "non-orthogonality")


async def test_the_panels_are_not_named_after_a_sensor_that_is_still_being_diagnosed(
    sagged: Benches, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual, ready = Benches.bench, threading.Event()

    def bench_of(self: Benches, sensor: str) -> Bench | None:
        if sensor == "gyroscope":
            assert ready.wait(PATIENCE)
        return usual(self, sensor)

    monkeypatch.setattr(Benches, "bench", bench_of)
    async with app_with(sagged).run_test(size=USUAL) as pilot:
        await shows(pilot, "model is complete")
        await pilot.press("g")
        await shows(pilot, "Looking for what the gyroscope lacks", "BENCH  accelerometer")
        ready.set()
        await shows(pilot, "BENCH  gyroscope")


async def test_a_sensor_whose_model_is_lost_under_the_present_reference_keeps_the_bench_open(
    sagged: Benches, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = Benches.bench

    def bench_of(self: Benches, sensor: str) -> Bench | None:
        if sensor == "gyroscope":
            raise DataError("the fit of the gyroscope does not converge")
        return usual(self, sensor)

    monkeypatch.setattr(Benches, "bench", bench_of)
    async with app_with(sagged).run_test(size=USUAL) as pilot:
        await shows(pilot, "model is complete")
        await pilot.press("g")
        await shows(pilot, "the fit of the gyroscope does not converge")
        await pilot.press("g")
        await shows(pilot, "model is complete")
