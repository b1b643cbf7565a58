"""What the screens are tried on: terminals, a source, and their rows as plain text."""

import io
from collections.abc import Iterable

from rich.console import Console, RenderableType

from imucal_wizard.tui.app import WizardApp
from imucal_wizard.tui.options import AppSettings
from imucal_wizard.tui.sources import SourceChoice, SourceKind
from imucal_wizard.tui.text import Line
from tests.tui.fakes import FakeSource, services

USUAL = (80, 24)
LARGE = (160, 50)
"""Columns and rows."""
VIRTUAL = SourceChoice(SourceKind.VIRTUAL, title="virtual IMU")


def app_with(source: FakeSource, settings: AppSettings | None = None) -> WizardApp:
    """The wizard, on a source that says what it is told to say."""
    return WizardApp(services(source), settings, VIRTUAL)


def plain(row: Line) -> str:
    """A row without its styles."""
    return "".join(text for text, _ in row)


def lines(rows: Iterable[Line]) -> list[str]:
    """Rows without their styles."""
    return [plain(row) for row in rows]


def page(rows: Iterable[Line]) -> str:
    """The same as one text."""
    return "\n".join(lines(rows))


def printed(renderable: RenderableType, width: int = 76) -> str:
    """What Rich shows of something at a width, without styles."""
    console = Console(width=width, record=True, file=io.StringIO())
    console.print(renderable)
    return console.export_text()
