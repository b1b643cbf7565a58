"""Waiting for what should be seen on a screen; reading what is seen."""

import asyncio
import time
from collections.abc import Callable
from typing import Any

from textual.pilot import Pilot

from tests.waiting import PATIENCE

PAUSES = 0.04, 0.2
"""Seconds between two looks at an app: at first, and when it has taken long."""
UNSEEN = 0.5
"""Seconds after which a screen is read again that has not asked to be drawn."""


class Updates:
    """How often any screen has asked to be drawn; counted where no terminal draws it."""

    count = 0


def seen(pilot: Pilot[Any]) -> str:
    """The characters of the screen, row by row."""
    app = pilot.app
    width, height = app.size
    rows = app.screen._compositor.render_strips()
    return "\n".join(strip.text.rstrip() for strip in rows[:height] if strip.cell_length <= width)


async def until(pilot: Pilot[Any], true: Callable[[], bool]) -> None:
    """Wait until something is true; what is on the screen is shown when it never is."""
    deadline, pause = time.monotonic() + PATIENCE, PAUSES[0]
    while not true():
        assert time.monotonic() < deadline, f"never came true; the screen says\n{seen(pilot)}"
        await asyncio.sleep(pause)  # the app goes on between two looks
        pause = min(1.15 * pause, PAUSES[1])


async def shows(pilot: Pilot[Any], *texts: str) -> str:
    """Wait until all these texts are on the screen; the whole screen then."""
    screen, drawn, again = "", -1, 0.0

    def shown() -> bool:
        nonlocal screen, drawn, again
        if Updates.count != drawn or time.monotonic() > again:  # a look draws the whole screen
            drawn, again = Updates.count, time.monotonic() + UNSEEN
            screen = seen(pilot)
        return all(text in screen for text in texts)

    await until(pilot, shown)
    return screen
