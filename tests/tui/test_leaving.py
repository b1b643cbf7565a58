"""A screen that is left while something is computed for it."""

import asyncio
import threading
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest
from textual.screen import Screen

from imucal_wizard.core.errors import DataError
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.tui.run import BenchApp
from imucal_wizard.tui.screens.bench import BenchScreen
from imucal_wizard.tui.screens.help import HelpScreen
from imucal_wizard.tui.screens.page import PageScreen
from imucal_wizard.tui.text import line
from tests.tui.waiting import until
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


async def test_work_that_ends_while_its_screen_is_left_asks_for_no_part_of_it() -> None:
    """Whichever of the screen's parts are gone by then."""
    late = [threading.Event() for _ in range(TURNS)]
    left = iter(late)

    def make() -> Benches:
        next(left).wait(PATIENCE)
        raise DataError("nothing to look at")

    app = BenchApp(make)
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
    app = BenchApp(never)
    async with app.run_test(size=(80, 24)) as pilot:
        screen = make(app.screen)
        await app.push_screen(screen)
        app.pop_screen()
        await pilot.resize_terminal(120, 40)
    assert app.return_code in (None, 0)


@pytest.mark.parametrize("turns", range(6))
async def test_an_app_that_ends_while_a_screen_is_being_made_is_no_fault(turns: int) -> None:
    """However many of the screen's parts are there by then."""
    app = BenchApp(never)
    async with app.run_test(size=(80, 24)):
        app.push_screen(BenchScreen(never))
        for _ in range(turns):
            await asyncio.sleep(0)  # one turn of the event loop
        app.exit()
    assert app.return_code in (None, 0)
