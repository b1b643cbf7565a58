"""The magnetometer on the bench's screen: pictures, lesson, adding, and what to measure next."""

from dataclasses import replace
from typing import Any

import pytest
from textual.pilot import Pilot

from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.views import most_telling, opening_view
from imucal_wizard.tui.bench.snapshot import bench_snapshot
from tests.diagnose.recordings import tumbled
from tests.tui.bench_steps import app_with
from tests.tui.conftest import fresh, looked_at
from tests.tui.terminals import LARGE, USUAL
from tests.tui.waiting import seen, shows


@pytest.fixture(scope="module")
def ranked() -> Benches:
    """A board whose current is felt on x, with every sensor as it is shown."""
    made = tumbled("magnetometer/current:0.3:x")
    benches = Benches(made.report, made.readings)
    every = [bench for sensor in benches.sensors if (bench := benches.bench(sensor)) is not None]
    return looked_at(benches, *every)


@pytest.fixture
def drawing(ranked: Benches) -> Benches:
    """The same board, with the base model."""
    return fresh(ranked)


async def to_the_field(pilot: Pilot[Any]) -> None:
    """From the accelerometer over the gyroscope to the magnetometer."""
    await shows(pilot, "BENCH  accelerometer", "model is complete", "g gyroscope, …")
    await pilot.press("g")
    await shows(pilot, "BENCH  gyroscope", "The model is complete", "g magnetometer, …")
    await pilot.press("g")
    await shows(pilot, "BENCH  magnetometer", "▸ current", "g accelerometer, …")


async def test_the_magnetometer_is_one_key_away_and_its_error_falls(drawing: Benches) -> None:
    async with app_with(drawing).run_test(size=USUAL) as pilot:
        await to_the_field(pilot)
        await shows(pilot, "current, A", "━ current")  # what explains most of the misfit
        await shows(pilot, "µT/A")
        await pilot.press("enter")
        await shows(pilot, "BENCH  magnetometer", "The model is complete")
        await pilot.press("3")
        await shows(pilot, "▸LADDER", "+ current", "µT", "noise alone")
    bench = drawing.bench("magnetometer")
    assert bench is not None
    before, known = (rung.rms_held_out or 0.0 for rung in bench.ladder)
    assert known < 0.5 * before


def test_the_bench_opens_on_what_the_missing_effect_depends_on(drawing: Benches) -> None:
    """The misfit may run along the temperature too, because both change with time."""
    bench = drawing.bench("magnetometer")
    assert bench is not None
    snapshot = bench_snapshot(drawing, bench)
    views = [
        replace(view, y=view.x - view.x.mean()) if "temperature" in view.x_label else view
        for view in snapshot.views
    ]
    assert "temperature" in views[most_telling(views)].x_label
    opened = views[opening_view(snapshot.diagnosis, views, snapshot.catalogue)]
    assert opened.x_label == "current, A"


async def test_the_error_is_drawn_against_the_current_and_a_point_says_where_the_field_was(
    drawing: Benches,
) -> None:
    async with app_with(drawing).run_test(size=LARGE) as pilot:
        await to_the_field(pilot)
        for _ in range(4):  # the first picture may be of the dip
            await pilot.press("right")
            await pilot.pause()
            if "◆ field along" in seen(pilot):
                break
            await pilot.press("a")
        for _ in range(20):
            if "current, A" in seen(pilot):
                break
            await pilot.press("shift+tab")
            await pilot.pause()
        await shows(pilot, "current, A")
        await pilot.press("right")
        await shows(pilot, "◆ field along", "read", "µT")
        await pilot.press("t")
        await shows(pilot, "magnetometer x")
        await pilot.press("end")
        await shows(pilot, "the samples in this direction were averaged")


async def test_model_and_lesson_speak_of_the_field(drawing: Benches) -> None:
    async with app_with(drawing).run_test(size=LARGE) as pilot:
        await to_the_field(pilot)
        await pilot.press("l")
        await shows(pilot, "FIELD OF THE BOARD'S OWN CURRENT", "coefficient × current", "your data")
        await pilot.press("end")
        await shows(pilot, "the heading wrong by")
        await pilot.press("escape", "2")
        await shows(pilot, "m = W·(y − b)", "soft-iron", "6 numbers, the largest")


async def test_the_bench_says_where_to_measure_circles(
    drawing: Benches,
) -> None:
    async with app_with(drawing).run_test(size=LARGE) as pilot:
        await to_the_field(pilot)
        await pilot.press("n")
        await shows(pilot, "a whole circle about the vertical with the +x face on top")
