"""What a test does on the bench before it comes to its point."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from textual.pilot import Pilot

from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.tui.run import BenchApp
from imucal_wizard.tui.services import Saved
from tests.tui.waiting import shows


def nowhere(_place: Path | None) -> Saved:
    """Where a test saves that writes no file."""
    return Saved(Path("calibration.json"))


def app_with(benches: Benches, save: Callable[[Path | None], Saved] = nowhere) -> BenchApp:
    """The bench alone."""
    return BenchApp(lambda: benches, save)


async def ranked(pilot: Pilot[Any]) -> None:
    """The bench is open, and the bent characteristic stands first."""
    await shows(pilot, "▸ second-order")


async def open_from_wizard(pilot: Pilot[Any]) -> None:
    """Open it from the result."""
    await shows(pilot, "f find missing")
    await pilot.press("f")


async def add_the_first(pilot: Pilot[Any]) -> None:
    """Add the first suspect; nothing is missing then."""
    await ranked(pilot)
    await pilot.press("enter")
    await shows(pilot, "model is complete")
