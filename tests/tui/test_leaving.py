"""Screens that are left: while something is computed for them, and with something unsaved."""

import asyncio
import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from textual.events import Key
from textual.screen import Screen
from textual.widgets import Input

from imucal_wizard.core.errors import DataError, PlaceError
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.state import Status
from imucal_wizard.tui.app import WizardApp
from imucal_wizard.tui.options import AppSettings
from imucal_wizard.tui.run import BenchApp
from imucal_wizard.tui.screens.bench import BenchScreen
from imucal_wizard.tui.screens.help import HelpScreen
from imucal_wizard.tui.screens.page import PageScreen
from imucal_wizard.tui.services import Saved
from imucal_wizard.tui.text import line
from tests.tui import fakes
from tests.tui.bench_steps import nowhere
from tests.tui.terminals import USUAL, VIRTUAL
from tests.tui.waiting import shows, until
from tests.waiting import PATIENCE

TURNS = 30
"""Turns of the event loop in which a screen's parts go one by one, and then the screen."""


def never() -> Benches:
    """A recording that carries no bench."""
    raise DataError("nothing to look at")


def at_work(screen: Screen[Any]) -> bool:
    """Something is being computed for it."""
    return any(worker.node is screen for worker in screen.app.workers)


def idle(screen: Screen[Any]) -> bool:
    """Nothing is."""
    return not at_work(screen)


async def test_a_key_that_arrives_while_the_app_ends_is_no_fault() -> None:
    app = WizardApp(fakes.services(fakes.FakeSource()), None, None)
    async with app.run_test(size=USUAL):
        pass
    await app.on_event(Key("enter", "\r"))
    assert not app.screen_stack


async def test_work_that_ends_while_its_screen_is_left_asks_for_no_part_of_it() -> None:
    """Whichever of the screen's parts are gone by then."""
    late = [threading.Event() for _ in range(TURNS)]
    left = iter(late)

    def make() -> Benches:
        next(left).wait(PATIENCE)
        raise DataError("nothing to look at")

    app = BenchApp(make, nowhere)
    async with app.run_test(size=(80, 24)) as pilot:
        first = app.screen
        for turns, work in enumerate(late):
            screen = first if turns == 0 else BenchScreen(make)
            if screen is not first:
                await app.push_screen(screen)
            await until(pilot, partial(at_work, screen))
            app.pop_screen()
            for _ in range(turns):
                await asyncio.sleep(0)  # one turn of the event loop
            work.set()
            await until(pilot, partial(idle, screen))
    assert app.return_code in (None, 0)


@pytest.mark.parametrize(("connected", "lost"), [(True, False), (False, True)])
async def test_a_port_that_is_lost_is_remembered_for_the_last_words(
    connected: bool, lost: bool
) -> None:
    source = fakes.FakeSource(stream=replace(fakes.STREAM, connected=connected))
    app = WizardApp(fakes.services(source), None, VIRTUAL)
    async with app.run_test(size=USUAL) as pilot:
        await until(pilot, lambda: app.state.snapshot is not None)
        await pilot.press("q")
    assert app.state.port_lost is lost


@pytest.mark.parametrize(
    "make",
    [
        lambda below: HelpScreen("poses", below),
        lambda _: PageScreen("page", lambda width, _height: [line("text" * width)]),
        lambda _: BenchScreen(never),
    ],
)
async def test_a_terminal_that_changes_its_size_while_a_screen_is_left_is_no_fault(
    make: Callable[[Screen[Any]], HelpScreen | PageScreen | BenchScreen],
) -> None:
    app = BenchApp(never, nowhere)
    async with app.run_test(size=(80, 24)) as pilot:
        screen = make(app.screen)
        await app.push_screen(screen)
        app.pop_screen()
        await pilot.resize_terminal(120, 40)
    assert app.return_code in (None, 0)


@pytest.mark.parametrize("turns", range(6))
async def test_an_app_that_ends_while_a_screen_is_being_made_is_no_fault(turns: int) -> None:
    """However many of the screen's parts are there by then."""
    app = BenchApp(never, nowhere)
    async with app.run_test(size=(80, 24)):
        app.push_screen(BenchScreen(never))
        for _ in range(turns):
            await asyncio.sleep(0)  # one turn of the event loop
        app.exit()
    assert app.return_code in (None, 0)


async def test_a_result_that_cannot_be_written_is_written_to_another_place(tmp_path: Path) -> None:
    taken, place = tmp_path / "taken.json", tmp_path / "other.json"
    taken.touch()
    plain = fakes.services(fakes.FakeSource(Status(step=StepKind.SAVE, holds=24)))

    def save(fitted: FitReport, benches: Benches | None, given: Path | None) -> Saved:
        if given is None:
            raise PlaceError("a.json cannot be written: the disk is full", taken)
        return plain.save(fitted, benches, given)

    app = WizardApp(replace(plain, save=save), None, VIRTUAL)
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "the disk is full", "taken.json")
        await pilot.press("enter")
        await shows(pilot, "exists already")
        await pilot.press("escape")
        await shows(pilot, "not saved: a.json")
        await pilot.press("q")
        await shows(pilot, "This model is not saved: the calibration.")
        await pilot.press("s")
        await shows(pilot, "enter writes it")
        app.screen.query_one(Input).value = str(place)
        await pilot.press("enter")
        await until(pilot, lambda: app.return_value is not None)
    assert app.unkept is None
    assert app.return_value is not None
    assert app.return_value.path == place


@pytest.mark.parametrize("attended", [True, False])
async def test_a_session_whose_disk_has_failed_goes_on_elsewhere(attended: bool) -> None:
    stream = replace(fakes.STREAM, unwritten="no longer being saved", problem="The disk is full.")
    source, place = fakes.FakeSource(Status(step=StepKind.POSES, holds=24)), Path("other.imucal")
    plain, moved = fakes.services(source), list[Path]()
    services = replace(plain, session_elsewhere=lambda: place, moved=moved.append)
    app = WizardApp(services, AppSettings(quit_after=not attended), VIRTUAL)
    async with app.run_test(size=USUAL) as pilot:
        await until(pilot, lambda: app.state.snapshot is not None)
        source.stream, source.finished = stream, True
        source.say(source.status)
        if attended:
            await shows(pilot, "The disk is full.", str(place))
            await pilot.press("enter")
        await until(pilot, lambda: app.state.source is None)
    assert ("rescue", str(place)) in source.commands
    assert moved == [place]
    assert app.state.result is not None  # what was measured is fitted, to be printed
    assert app.unkept is not None
    assert app.unkept.other == place
