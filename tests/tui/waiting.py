"""Waiting for what should be seen on a screen; reading what is seen."""

import asyncio
import time
from collections.abc import Callable
from typing import Any

from textual.pilot import Pilot

from tests.waiting import PATIENCE


def seen(pilot: Pilot[Any]) -> str:
    """The characters of the screen, row by row."""
    app = pilot.app
    width, height = app.size
    rows = app.screen._compositor.render_strips()
    return "\n".join(strip.text.rstrip() for strip in rows[:height] if strip.cell_length <= width)


async def until(pilot: Pilot[Any], true: Callable[[], bool]) -> None:
    """Wait until something is true; what is on the screen is shown when it never is."""
    deadline = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < deadline, f"never came true; the screen says\n{seen(pilot)}"
        await asyncio.sleep(0.04)  # the app goes on between two looks, each of which draws a screen


async def shows(pilot: Pilot[Any], *texts: str) -> str:
    """Wait until all these texts are on the screen; the whole screen then."""
    screen = ""

    def shown() -> bool:
        nonlocal screen
        screen = seen(pilot)
        return all(text in screen for text in texts)

    await until(pilot, shown)
    return screen
