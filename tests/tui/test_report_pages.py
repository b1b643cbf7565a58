"""What the magnetometer adds to the result: its rows, the heading, all methods side by side."""

import math
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Group

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.notices import Notice, NoticeKind, not_calibrated
from imucal_wizard.core.quantities import value_and_error
from imucal_wizard.core.readings import Readings
from imucal_wizard.estimate.comparison import MethodRow, method_rows
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.estimate.second_stage.heading import compass_of
from imucal_wizard.estimate.second_stage.live_heading import LiveHeading, live_heading
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.state import Status
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.terms import Term
from imucal_wizard.run.snapshot import Snapshot, StreamStatus
from imucal_wizard.tui.app import WizardApp
from imucal_wizard.tui.drawing import rose
from imucal_wizard.tui.panels.report import fit_summary, magnetic_parts, parameter_table
from imucal_wizard.tui.screens.heading import course_rows, effects_of
from imucal_wizard.tui.widgets.big_text import BigText
from tests.tui import fakes
from tests.tui.terminals import LARGE, USUAL, VIRTUAL, app_with, page, printed
from tests.tui.waiting import seen, shows, until

RESULT = Status(step=StepKind.RESULT, elapsed=600.0, holds=40, rotations=32)


def in_hold(readings: Readings, report: FitReport, index: int) -> StreamStatus:
    """The stream while the device lies in one of the holds."""
    hold = report.holds[index]
    assert readings.magnetometer is not None
    field = readings.magnetometer.between(hold.start, hold.end).values.mean(axis=0)
    ax, ay, az = (float(value) for value in hold.accelerometer)
    mx, my, mz = (float(value) for value in field)
    return replace(fakes.STREAM, accelerometer=(ax, ay, az), magnetometer=(mx, my, mz))


def with_report(source: fakes.FakeSource, report: FitReport) -> fakes.FakeServices:
    """Services whose fit is this one."""
    return replace(fakes.services(source), fit=lambda _collected, _snapshot: report)


@pytest.fixture(scope="module")
def methods(aligned: FitReport, turned: Readings) -> list[MethodRow]:
    """All methods on the recording with three sensors."""
    return list(method_rows(aligned, "rad/s", turned.magnetometer, None))


def heading_of(report: FitReport, stream: StreamStatus) -> LiveHeading:
    """The heading by the newest readings of a stream."""
    compass = compass_of(report)
    assert compass is not None
    assert stream.accelerometer is not None
    assert stream.magnetometer is not None
    return live_heading(report, compass, stream.accelerometer, stream.magnetometer)


def level_hold(report: FitReport) -> int:
    """A hold with a heading that the calibration moves by more than 20°."""
    assert report.second_stage is not None
    found = report.second_stage.headings
    off = np.abs(np.angle(np.exp(1j * (found.after - found.before))))
    return int(found.hold[np.flatnonzero(off > math.radians(20.0))[0]])


def test_hard_and_soft_iron_stand_with_their_standard_errors(aligned: FitReport) -> None:
    text = printed(Group(*magnetic_parts(aligned)))
    for parameter in aligned.sensors["magnetometer"].parameters:
        if parameter.name.startswith("soft_iron"):
            assert parameter.standard_error is not None
            value, error = value_and_error(parameter.value, parameter.standard_error)
            assert f"{parameter.name[-2:]} {value} ±{error}" in text
    assert "±" in text
    assert "µT" in text
    assert max(map(len, text.splitlines())) <= 76


def test_iron_known_to_six_decimals_leaves_a_blank_between_columns(aligned: FitReport) -> None:
    """In 76 columns, with a minus before every entry."""
    fit = aligned.sensors["magnetometer"]
    fine = [
        replace(one, value=-abs(one.value), standard_error=2.4e-5)
        for one in fit.parameters
        if one.name.startswith("soft_iron")
    ]
    sensors = {**aligned.sensors, "magnetometer": replace(fit, parameters=tuple(fine))}
    text = printed(Group(*magnetic_parts(replace(aligned, sensors=sensors, second_stage=None))))
    assert max(map(len, text.splitlines())) <= 76
    (first,) = [row for row in text.splitlines() if row.startswith("soft")]
    assert re.fullmatch(r"soft +xx −\S+ ±\S+ +xy −\S+ ±\S+ +xz −\S+ ±\S+ *", first)


def test_a_magnetometer_without_result_is_named_at_the_top(aligned: FitReport) -> None:
    """Nobody scrolls past the plots to what is not there."""
    why = not_calibrated("magnetometer", "the device does not turn")
    sensors = {name: fit for name, fit in aligned.sensors.items() if name != "magnetometer"}
    report = replace(
        aligned, sensors=sensors, magnetic=None, second_stage=None, warnings=("steel passed", why)
    )
    text = printed(fit_summary(report, {}, {}))
    assert " ".join(text.split()).count(why) == 1
    assert text.index(why[:40]) < text.index("held out") < text.index("steel passed")


def test_the_second_stage_is_told_with_dip_clock_closure_and_heading(aligned: FitReport) -> None:
    text = printed(Group(*magnetic_parts(aligned)))
    for word in ("SECOND STAGE", "dip 66.", "clock is +3", "closure about the vertical", "heading"):
        assert word in text


def test_parameters_stand_as_in_the_text_of_fit(aligned: FitReport) -> None:
    """The effects in the formula; an error that is not known; what a method does not fit."""
    fit = aligned.sensors["accelerometer"]
    first, *others = fit.parameters
    angles = [replace(one, value=0.0, carried=False) for one in others if "theta" in one.name]
    fit = replace(
        fit,
        method="six-position",
        parameters=(replace(first, standard_error=None), *angles),
        terms=(Term(effect("second-order")),),
    )
    report = replace(aligned, sensors={"accelerometer": fit})
    text = printed(parameter_table(report), 100)
    assert "corrected = M · (reading − b) − effects (second-order)" in text
    assert "± not known m/s²" in text
    assert text.count("▲ nominal: the six-position method does not fit it") == 3
    assert "not determined" not in text


def test_a_result_without_a_magnetometer_has_no_rows_of_iron() -> None:
    assert list(magnetic_parts(fakes.report())) == []


def test_in_a_hold_the_live_heading_is_that_of_the_report(
    turned: Readings, aligned: FitReport
) -> None:
    index = level_hold(aligned)
    assert aligned.second_stage is not None
    now = heading_of(aligned, in_hold(turned, aligned, index))
    found = aligned.second_stage.headings
    place = int(np.flatnonzero(found.hold == index)[0])
    assert abs(now.after - math.degrees(found.after[place]) % 360.0) < 0.5
    assert abs(now.dip - 66.0) < 0.5
    text = page(course_rows(now, aligned, 76))
    assert text.count("✓") == 2
    assert re.search(r"the heading changes by [+−]\d+\.\d°", text)
    assert "▲" not in text
    # 0.4 µT in a level field of 43.7 µT · cos 66° = 17.8 µT
    assert "noise of one reading ±1.3°" in text


def test_iron_nearby_is_told_by_the_size_of_the_field(turned: Readings, aligned: FitReport) -> None:
    stream = in_hold(turned, aligned, level_hold(aligned))
    assert stream.magnetometer is not None
    x, y, z = stream.magnetometer
    now = heading_of(aligned, replace(stream, magnetometer=(x + 60.0, y, z)))
    assert "▲ iron is near it" in page(course_rows(now, aligned, 76))


def test_what_the_live_heading_is_not_corrected_for_is_told_in_place_of_iron(
    turned: Readings, aligned: FitReport
) -> None:
    assert effects_of(aligned, "magnetometer") == ""
    fit = replace(aligned.sensors["magnetometer"], terms=(Term(effect("current")),))
    report = replace(aligned, sensors={"magnetometer": fit})
    assert effects_of(report, "accelerometer", "magnetometer") == "current"
    assert effects_of(report, "accelerometer") == ""
    stream = in_hold(turned, aligned, level_hold(aligned))
    assert stream.magnetometer is not None
    x, y, z = stream.magnetometer
    now = heading_of(aligned, replace(stream, magnetometer=(x + 60.0, y, z)))
    text = page(course_rows(now, aligned, 76, "current", "current"))
    assert "not corrected for current" in text
    assert "when calibrated ▲ current; else iron is near it" in text
    # an effect of the accelerometer changes no size of the field
    text = page(course_rows(now, aligned, 76, "asymmetry"))
    assert "not corrected for asymmetry" in text
    assert "when calibrated ▲ iron is near it" in text


def test_near_the_vertical_a_text_replaces_the_heading(
    turned: Readings, aligned: FitReport
) -> None:
    stream = in_hold(turned, aligned, 0)
    now = heading_of(aligned, replace(stream, accelerometer=(9.9, 0.1, 0.2)))
    assert math.isnan(now.after)
    assert "no heading: x is upright" in page(course_rows(now, aligned, 76))


@pytest.mark.parametrize(("heading", "row", "column"), [(0, 1, 19), (90, 5, 26), (270, 5, 11)])
def test_the_needle_points_where_the_device_heads(heading: float, row: int, column: int) -> None:
    card, empty = rose(float(heading), 38, 12), rose(None, 38, 12)
    changed = {
        (y, x)
        for y, pair in enumerate(zip(card, empty, strict=True))
        for x, (a, b) in enumerate(zip(*pair, strict=True))
        if a != b
    }
    assert changed
    assert min(abs(y - row) + abs(x - column) for y, x in changed) <= 1
    assert all(len(line) == 38 for line in card)


@pytest.mark.parametrize("size", [USUAL, LARGE])
async def test_one_key_shows_the_heading_and_it_follows_the_device(
    size: tuple[int, int], turned: Readings, aligned: FitReport
) -> None:
    index = level_hold(aligned)
    source = fakes.FakeSource(RESULT, in_hold(turned, aligned, index))
    app = WizardApp(with_report(source, aligned), None, VIRTUAL)
    async with app.run_test(size=size) as pilot:
        await shows(pilot, "limit 2.0 mg", "h north")
        await pilot.press("h")
        await shows(
            pilot, "before calibration", "after calibration", "when calibrated ✓", "±",
            "from the calibration", "h back to the result",
        )  # fmt: skip
        first = app.screen.query_one("#heading-after", BigText).text
        assert first != app.screen.query_one("#heading-before", BigText).text
        source.stream = in_hold(turned, aligned, (index + 1) % 40)
        source.say(RESULT)
        await until(pilot, lambda: app.screen.query_one("#heading-after", BigText).text != first)
        await pilot.press("question_mark")
        await shows(pilot, "help: heading", "magnetic north")
        await pilot.press("escape", "h")
        await shows(pilot, "limit 2.0 mg")
        assert "begins by itself" not in seen(pilot)


async def test_readings_that_are_no_news_are_called_so(
    turned: Readings, aligned: FitReport
) -> None:
    source = fakes.FakeSource(RESULT, in_hold(turned, aligned, 0))
    app = WizardApp(with_report(source, aligned), None, VIRTUAL)
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "limit 2.0 mg")
        await pilot.press("h")
        await shows(pilot, "after calibration")
        source.stream = replace(source.stream, problem="the port is lost: plug it in again")
        source.say(RESULT)
        await shows(pilot, "▲ the port is lost", "from the calibration")
        source.finished = True
        source.say(RESULT)
        await shows(pilot, "The recording has ended: this is its last reading", "error left is")


async def test_the_heading_goes_when_its_step_is_over(turned: Readings, aligned: FitReport) -> None:
    source = fakes.FakeSource(RESULT, in_hold(turned, aligned, 0))
    app = WizardApp(with_report(source, aligned), None, VIRTUAL)
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "limit 2.0 mg")
        await pilot.press("h")
        await shows(pilot, "after calibration")
        source.say(replace(fakes.rotations_status(), step=StepKind.ROTATIONS))
        await shows(pilot, "▸ROTATIONS")


async def test_without_a_magnetometer_the_key_says_what_it_takes() -> None:
    source = fakes.FakeSource(RESULT)
    async with app_with(source).run_test(size=USUAL) as pilot:
        assert "h north" not in await shows(pilot, "limit 2.0 mg", "c compare")
        await pilot.press("question_mark")
        await shows(pilot, "help: result")
        await pilot.press("end")
        await shows(pilot, "says what the heading needs")
        await pilot.press("escape")
        await pilot.press("h")
        await shows(pilot, "no heading without a calibrated magnetometer", "circles")
        await pilot.press("h")
        await shows(pilot, "limit 2.0 mg")


async def test_sensors_that_are_not_aligned_have_no_heading(
    turned: Readings, aligned: FitReport
) -> None:
    text = "the magnetometer stays in its own frame: 3 still positions are too few"
    why = Notice(text, NoticeKind.NOT_ALIGNED, "magnetometer")
    report = replace(aligned, second_stage=None, warnings=(why,))
    source = fakes.FakeSource(RESULT, in_hold(turned, aligned, 0))
    app = WizardApp(with_report(source, report), None, VIRTUAL)
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "limit 2.0 mg")
        await pilot.press("h")
        await shows(pilot, "not aligned with the device yet", "3 still positions")


@pytest.mark.parametrize("size", [USUAL, LARGE])
async def test_one_key_shows_all_methods_of_all_sensors_on_one_screen(
    size: tuple[int, int], aligned: FitReport, methods: list[MethodRow]
) -> None:
    source = fakes.FakeSource(RESULT)
    services = replace(with_report(source, aligned), compare=lambda *_: methods)
    app = WizardApp(services, None, VIRTUAL)
    async with app.run_test(size=size) as pilot:
        await shows(pilot, "limit 2.0 mg")
        await pilot.press("c")
        text = await shows(
            pilot, "ACCELEROMETER", "least_squares", "newton (Q)", "six-position (Q)", "fitted",
            "held out", "M off by    b off by", "GYROSCOPE", "dynamic (Q)", "vector + field",
            "MAGNETOMETER", "orthogonal", "two-step (N)", "numeric (N)", "c back to the result",
        )  # fmt: skip
        assert max(map(len, text.splitlines())) <= size[0]
        assert "vector + field (N)" not in text  # of no paper
        await pilot.press("end")
        await shows(pilot, "Niespodziany", "bias of the first method")
        await pilot.press("c")
        await shows(pilot, "limit 2.0 mg")


async def test_methods_that_cannot_be_compared_are_no_fault_of_the_screen() -> None:
    def compare(
        _found: FitReport, _collected: Collected, _snapshot: Snapshot
    ) -> Sequence[MethodRow]:
        raise DataError("nothing to compare: hold the device still")

    source = fakes.FakeSource(RESULT)
    services = replace(fakes.services(source), compare=compare)
    async with WizardApp(services, None, VIRTUAL).run_test(size=USUAL) as pilot:
        await shows(pilot, "limit 2.0 mg")
        await pilot.press("c")
        await shows(pilot, "▲ nothing to compare: hold the device still")
