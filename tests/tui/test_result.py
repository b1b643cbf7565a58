"""The result, its table, the validation and the place where it is saved."""

import re
import threading
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from imucal_wizard.api import load
from imucal_wizard.core.errors import DataError, UsageError
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.grade import graded
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.state import Status
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.terms import Term
from imucal_wizard.run.snapshot import Snapshot
from imucal_wizard.tui.app import WizardApp
from imucal_wizard.tui.options import AppSettings, WizardOptions
from imucal_wizard.tui.panels.report import fit_summary
from imucal_wizard.tui.screens.bench import BenchScreen
from imucal_wizard.tui.screens.result import SaveScreen
from imucal_wizard.tui.services import Saved, WizardServices
from imucal_wizard.tui.sounds import Sounds
from imucal_wizard.tui.widgets.big_text import BigText, dots, half_blocks
from tests.tui import fakes
from tests.tui.terminals import LARGE, USUAL, VIRTUAL, app_with, printed
from tests.tui.waiting import seen, shows, until
from tests.waiting import PATIENCE

RESULT = Status(step=StepKind.RESULT, elapsed=600.0, holds=24, rotations=18)


def all_good(source: fakes.FakeSource) -> fakes.FakeServices:
    """Services that find nothing missing."""
    return replace(
        fakes.services(source), diagnose=lambda _benches: fakes.diagnoses(Verdict.COMPLETE)
    )


@pytest.mark.parametrize("size", [USUAL, LARGE])
async def test_the_result_says_before_after_held_out_and_a_verdict(size: tuple[int, int]) -> None:
    source = fakes.FakeSource(RESULT)
    async with app_with(source).run_test(size=size) as pilot:
        await shows(
            pilot, "0.160 mg held out", "limit 2.0 mg", "no explanation is certain",
            "f: find out", "31.4 mg  →", "4.80°  →", "0.619°", "b back", "? help", "q quit",
        )  # fmt: skip


async def test_the_bench_opens_on_the_sensor_that_lacks_something() -> None:
    """The accelerometer is complete, the gyroscope's error is unexplained."""
    source = fakes.FakeSource(RESULT)
    app = app_with(source)
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "f: find out")
        await pilot.press("f")
        await until(pilot, lambda: isinstance(app.screen, BenchScreen))
        assert isinstance(app.screen, BenchScreen)
        assert app.screen.sensor == "gyroscope"


@pytest.mark.parametrize(
    ("gyroscope", "words", "bells"),
    [
        (Verdict.COMPLETE, ["GOOD", "GOOD"], 6),
        (Verdict.DISTURBED, ["GOOD", "DOUBTFUL"], 4),
        (Verdict.WAITING, ["GOOD", "DOUBTFUL"], 4),
    ],
)
async def test_only_a_good_result_goes_on_by_itself_and_every_verdict_is_heard(
    gyroscope: Verdict, words: list[str], bells: int
) -> None:
    source = fakes.FakeSource(RESULT)
    found = replace(fakes.services(source), diagnose=lambda _: fakes.diagnoses(gyroscope))
    app = WizardApp(found, AppSettings(countdown=1.0), VIRTUAL)
    rung: list[int] = []
    app.state.sounds = Sounds(lambda: rung.append(1), app.set_timer, time.monotonic)
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, *(row.rstrip() for row in half_blocks(dots(words[1]) or [])))
        assert [one.grade.word for one in app.state.grades.values()] == words
        await until(pilot, lambda: len(rung) == bells)
        good = gyroscope is Verdict.COMPLETE
        await until(pilot, lambda: good == (("validate", "") in source.commands))


async def test_effects_that_an_earlier_bench_has_left_stop_what_goes_on_by_itself(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    source = fakes.FakeSource(RESULT)
    app = WizardApp(all_good(source), AppSettings(countdown=0.1), VIRTUAL)
    judged = app.state.judged

    def with_effect(result: FitReport, diagnoses: Mapping[str, Diagnosis]) -> None:
        fit = replace(result.sensors["accelerometer"], terms=(Term(effect("asymmetry")),))
        judged(replace(result, sensors={**result.sensors, "accelerometer": fit}), diagnoses)

    monkeypatch.setattr(app.state, "judged", with_effect)
    async with app.run_test(size=USUAL) as pilot:
        await until(pilot, lambda: bool(app.state.grades))
        await pilot.pause(1.0)
        assert source.commands == []
        await shows(pilot, "v: validate with a few new poses")


async def test_everything_is_reached_by_scrolling() -> None:
    source = fakes.FakeSource(RESULT)
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, "31.4 mg")
        await pilot.press("pagedown")
        await shows(pilot, "by three methods")
        await pilot.press("pagedown")
        await shows(pilot, "0.97520 ±0.00060")
        await pilot.press("end")
        await shows(pilot, "−y−z")


async def test_the_table_gives_standard_errors_units_and_what_is_not_determined() -> None:
    source = fakes.FakeSource(RESULT)
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, "31.4 mg")
        await pilot.press("t")
        await shows(
            pilot,
            "bias_x",
            "0.10000 ± 0.00040 (repeats ± 0.00060)",
            "m/s²",
            "not determined",
            "M · (reading − b)",
        )
        await pilot.press("question_mark")
        await shows(pilot, "help: parameters", "bias: the reading when there is nothing")
        await pilot.press("escape", "escape")
        await until(pilot, lambda: "not determined" not in seen(pilot))


async def test_the_validation_begins_by_itself_after_the_countdown() -> None:
    source = fakes.FakeSource(RESULT)
    app = WizardApp(all_good(source), AppSettings(countdown=0.1), VIRTUAL)
    async with app.run_test(size=USUAL) as pilot:
        await until(pilot, lambda: ("validate", "") in source.commands)
        await shows(pilot, "▸VALIDATE")


def asked(text: str) -> list[str]:
    """The keys that the page tells the operator to press; the footer has no colons."""
    return re.findall(r"(?:^|\s)([a-z]): ", text, re.MULTILINE)


def worse_than_none() -> FitReport:
    """A fit whose accelerometer is not usable."""
    found = fakes.report()
    worse = replace(found.sensors["accelerometer"], rms_held_out=0.5)
    return replace(found, sensors={**found.sensors, "accelerometer": worse})


@pytest.mark.parametrize(
    ("found", "gyroscope", "ended", "keys", "words"),
    [
        (fakes.report(), Verdict.COMPLETE, False, ["v", "s"], "v: validate with a few new poses"),
        (fakes.report(), Verdict.COMPLETE, True, ["s"], "The recording has ended. s: save"),
        (fakes.report(True), Verdict.COMPLETE, False, ["s"], "s: save"),
        (fakes.report(), Verdict.UNEXPLAINED, False, ["f"], "f: find out more"),
        (worse_than_none(), Verdict.UNEXPLAINED, False, ["b"], "b: back, to measure more"),
        (worse_than_none(), Verdict.COMPLETE, True, [], "The recording has ended: record again"),
    ],
)
async def test_a_result_has_one_instruction(
    found: FitReport, gyroscope: Verdict, ended: bool, keys: list[str], words: str
) -> None:
    """That of its worst sensor; a good one has two ways to the file."""
    source = fakes.FakeSource(RESULT)
    source.finished = ended
    services = replace(
        fakes.services(source),
        fit=lambda _collected, _snapshot: found,
        diagnose=lambda _benches: fakes.diagnoses(gyroscope),
    )
    app = WizardApp(services, AppSettings(countdown=60.0), VIRTUAL)
    async with app.run_test(size=LARGE) as pilot:
        await until(pilot, lambda: bool(app.state.grades))
        await pilot.press("home")
        assert asked(await shows(pilot, f" {words}")) == keys


@pytest.mark.parametrize(
    ("validated", "words"),
    [(True, "The calibration is saved. q: quit"), (False, "v: validate with a few new poses")],
)
async def test_a_result_that_is_in_the_file_is_not_asked_to_be_saved(
    validated: bool, words: str
) -> None:
    source = fakes.FakeSource(replace(RESULT, step=StepKind.SAVE))
    services = replace(all_good(source), fit=lambda _collected, _snapshot: fakes.report(validated))
    app = WizardApp(services, None, VIRTUAL)
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "✓ calibration.json")
        await until(pilot, lambda: bool(app.state.grades))
        source.say(RESULT)
        text = await shows(pilot, "▸RESULT", words)
        assert len(asked(text)) == 1


async def test_a_device_that_is_unplugged_at_the_result_is_told_and_waited_for() -> None:
    source = fakes.FakeSource(RESULT)
    app = WizardApp(all_good(source), AppSettings(countdown=0.1), VIRTUAL)
    source.stream = replace(source.stream, connected=False)
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "▲ not connected: validation needs the device   s: save without")
        await pilot.pause(1.0)
        assert source.commands == []
        source.stream = replace(source.stream, connected=True)
        source.say(source.status)
        await until(pilot, lambda: ("validate", "") in source.commands)


async def test_any_key_stops_the_countdown() -> None:
    source = fakes.FakeSource(RESULT)
    async with WizardApp(all_good(source), None, VIRTUAL).run_test(size=USUAL) as pilot:
        await shows(pilot, "begins by itself in")
        await pilot.press("down")
        await until(pilot, lambda: "by itself" not in seen(pilot))
        await pilot.press("s")
        await shows(pilot, "calibration.json")


async def test_no_countdown_orders_a_step_after_the_one_that_was_chosen() -> None:
    class Slow(fakes.FakeSource):
        """Its procedure has not moved on yet."""

        def command(self, name: str, argument: str = "") -> None:
            self.commands.append((name, argument))

    source = Slow(RESULT)
    async with WizardApp(all_good(source), None, VIRTUAL).run_test(size=USUAL) as pilot:
        await shows(pilot, "begins by itself in")
        await pilot.press("s")
        await until(pilot, lambda: "by itself" not in seen(pilot))
    assert source.commands == [("save", "")]


async def test_what_is_measured_after_a_fit_is_fitted_again() -> None:
    fits: list[object] = []
    source = fakes.FakeSource(RESULT)
    services = fakes.services(source)

    def counted(collected: Collected, snapshot: Snapshot) -> FitReport:
        fits.append(collected)
        return services.fit(collected, snapshot)

    async with WizardApp(replace(services, fit=counted), None, VIRTUAL).run_test() as pilot:
        await shows(pilot, "31.4 mg")
        source.say(replace(RESULT, step=StepKind.VALIDATE))
        await shows(pilot, "▸VALIDATE")
        source.say(RESULT)
        await shows(pilot, "31.4 mg")
        assert len(fits) == 1
        source.say(fakes.rotations_status())
        await shows(pilot, "▸ROTATIONS")
        source.say(RESULT)
        await until(pilot, lambda: len(fits) == 2)


async def test_an_undo_that_finds_nothing_leaves_the_result_where_it_is() -> None:
    source = fakes.FakeSource(RESULT)
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, "31.4 mg")
        await pilot.press("u")
        await until(pilot, lambda: ("undo", "") in source.commands)
        source.say(replace(RESULT, elapsed=601.0))
        await pilot.resize_terminal(*LARGE)
        await shows(pilot, "31.4 mg")


async def test_saving_shows_the_place_and_quit_after_returns_it(tmp_path: Path) -> None:
    source = fakes.FakeSource(replace(RESULT, step=StepKind.SAVE))
    path = tmp_path / "calibration.json"
    app = WizardApp(fakes.services(source, path), AppSettings(quit_after=True), VIRTUAL)
    async with app.run_test(size=USUAL) as pilot:
        await until(pilot, lambda: not app.is_running)
    assert app.return_value is not None
    assert app.return_value.path == path


async def test_only_the_key_in_the_footer_leaves_the_saved_page() -> None:
    app = app_with(fakes.FakeSource(replace(RESULT, step=StepKind.SAVE)))
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "✓ calibration.json", "q quit")
        await pilot.press("enter")
        await pilot.pause()
        assert app.is_running
        await pilot.press("q")
        await until(pilot, lambda: not app.is_running)


def refuse(_collected: object, _snapshot: object) -> FitReport:
    """A fit that the data do not carry."""
    raise DataError("4 holds do not determine a fit; hold at least 6 poses")


async def test_data_that_determine_no_fit_are_explained_and_more_can_be_measured() -> None:
    source = fakes.FakeSource(RESULT)
    services = replace(fakes.services(source), fit=refuse)
    async with WizardApp(services, None, VIRTUAL).run_test(size=USUAL) as pilot:
        text = await shows(
            pilot, "▲ 4 holds do not determine a fit", "Go back to measure more", "b back", "s end"
        )
        assert "find missing" not in text, "there is nothing to look into"
        assert "v: validate" not in text
        await pilot.press("b")
        await until(pilot, lambda: ("back", "") in source.commands)


async def test_where_there_is_nothing_to_save_no_key_is_offered_that_needs_a_fit() -> None:
    source = fakes.FakeSource(replace(RESULT, step=StepKind.SAVE))
    services = replace(fakes.services(source), fit=refuse)
    async with WizardApp(services, None, VIRTUAL).run_test(size=USUAL) as pilot:
        text = await shows(pilot, "not saved: 4 holds do not determine a fit", "b back", "–Result")
        assert "s save" not in text
        assert "find what is missing" not in text
        assert "parameters" not in text
        await pilot.press("f", "t")
        await pilot.press("b")
        await until(pilot, lambda: ("back", "") in source.commands)


async def test_a_save_that_fails_is_not_hidden_by_one_that_did_not() -> None:
    source = fakes.FakeSource(replace(RESULT, step=StepKind.SAVE))
    services = fakes.services(source, Path("a.json"))
    app = WizardApp(services, None, VIRTUAL)
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "✓ ", "a.json")

        def full(*_: object) -> Saved:
            raise UsageError("the disk is full; make room")

        app.state.services = replace(services, save=full)
        screen = app.screen
        assert isinstance(screen, SaveScreen)
        screen.save()
        text = await shows(pilot, "not saved: the disk is full", "t table", "s save")
        assert "a.json" not in text


async def test_where_no_sensor_is_usable_one_key_leads_on_and_none_saves() -> None:
    source = fakes.FakeSource(replace(RESULT, step=StepKind.SAVE))

    def refused(*_: object) -> Saved:
        raise DataError("no sensor has a usable calibration")

    found = fakes.report()
    worse = {name: replace(fit, rms_held_out=500.0) for name, fit in found.sensors.items()}
    report = replace(found, sensors=worse)
    services = replace(fakes.services(source), fit=lambda *_: report, save=refused)
    app = WizardApp(services, None, VIRTUAL)
    async with app.run_test(size=USUAL) as pilot:
        text = await shows(pilot, "not saved: no sensor has", "▸ b: back, to measure more")
        assert "s save" not in text


@pytest.mark.parametrize("size", [USUAL, LARGE])
async def test_a_sensor_that_is_not_in_the_file_is_named_beside_saved(
    size: tuple[int, int], tmp_path: Path
) -> None:
    """Its calibration is worse than none; the file is really written."""
    bad = worse_than_none()
    writer = WizardServices(WizardOptions(save=tmp_path / "a.json", sessions=tmp_path))
    source = fakes.FakeSource(replace(RESULT, step=StepKind.SAVE))
    services = replace(
        fakes.services(source),
        fit=lambda _collected, _snapshot: bad,
        save=lambda fitted, _benches, place: writer.save(fitted, None, place),
    )
    app = WizardApp(services, None, VIRTUAL)
    async with app.run_test(size=size) as pilot:
        await shows(pilot, "✓ ", "▲ The accelerometer is not in this file")
        assert "The gyroscope is not" not in seen(pilot)
        assert app.screen.query_one(BigText).text == "SAVED"
    assert set(load(tmp_path / "a.json").sensors) == {"gyroscope"}


async def test_a_file_that_is_being_written_is_not_called_saved() -> None:
    """Nor is the file before it, which has another model."""
    source, ready = fakes.FakeSource(replace(RESULT, step=StepKind.SAVE)), threading.Event()
    services = fakes.services(source, Path("a.json"))
    app = WizardApp(services, None, VIRTUAL)
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "✓ ", "a.json")
        screen = app.screen
        assert isinstance(screen, SaveScreen)
        assert screen.query_one(BigText).text == "SAVED"

        def save(fitted: FitReport, benches: Benches | None, place: Path | None) -> Saved:
            assert ready.wait(PATIENCE)
            return services.save(fitted, benches, place)

        app.state.services = replace(services, save=save)
        screen.save()
        text = await shows(pilot, "Writing the calibration")
        assert "a.json" not in text
        assert screen.query_one(BigText).text == "SAVING"
        ready.set()
        await shows(pilot, "✓ ", "a.json")
        assert screen.query_one(BigText).text == "SAVED"


def test_the_error_on_new_poses_stands_beside_the_fitted_one() -> None:
    rows = printed(fit_summary(fakes.report(True), {}, {})).splitlines()
    head = next(row for row in rows if "held out" in row)
    sensor = next(row for row in rows if row.startswith("accelerometer |a|"))
    assert "new poses" in head
    assert "0.191 mg" in sensor
    assert any("residuals of the new poses  0.10  −0.31  0.12  −0.16 mg" in row for row in rows)


@pytest.mark.parametrize("width", [76, 150])
def test_no_row_of_the_summary_is_wider_than_the_page(width: int) -> None:
    report, found = fakes.report(), fakes.diagnoses()
    for row in printed(fit_summary(report, found, graded(report, found)), width).splitlines():
        assert len(row) <= width
        assert "…" not in row


async def test_the_saved_calibration_is_written_for_another_program_by_one_key() -> None:
    source = fakes.FakeSource(replace(RESULT, step=StepKind.SAVE))
    async with app_with(source).run_test(size=USUAL) as pilot:
        await shows(pilot, "x export")
        await pilot.press("x")
        await shows(pilot, "export for", "ArduPilot")
        await pilot.press("enter")
        await shows(pilot, "written: a.yaml", "0.102 mg", "cannot hold: the gyroscope")
        await pilot.press("escape")
        await shows(pilot, "x export")


async def test_a_result_is_saved_first_when_it_is_exported() -> None:
    app = app_with(fakes.FakeSource(RESULT))
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "x export")
        await pilot.press("x")
        await shows(pilot, "export for", "ArduPilot")
        assert app.state.saved is None
        await pilot.press("enter")
        await shows(pilot, "written: a.yaml")
        assert app.state.saved is not None


async def test_a_second_key_waits_until_the_first_file_is_written() -> None:
    begun, ready = list[int](), threading.Event()
    services = fakes.services(fakes.FakeSource(RESULT))

    def save(fitted: FitReport, benches: Benches | None, place: Path | None) -> Saved:
        begun.append(1)
        assert ready.wait(PATIENCE)
        return services.save(fitted, benches, place)

    app = WizardApp(replace(services, save=save), None, VIRTUAL)
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "x export")
        await pilot.press("x")
        await shows(pilot, "export for")
        await pilot.press("enter")
        await until(pilot, lambda: bool(begun))
        await pilot.press("enter")
        await shows(pilot, "Writing the file")
        assert len(begun) == 1
        ready.set()
        await shows(pilot, "written: a.yaml")
