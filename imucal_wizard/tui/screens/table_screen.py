"""A table above another screen."""

from collections.abc import Callable
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen

from imucal_wizard.tui.text import Line
from imucal_wizard.tui.widgets.lines import Lines


class TableScreen(ModalScreen[None]):
    """All parameters with their standard errors and units.

    Args:
        rows: makes the rows for a width.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,t,enter", "dismiss", "close"),
        Binding("q", "app.leave", "quit"),
    ]

    def __init__(self, rows: Callable[[int], list[Line]]) -> None:
        super().__init__()
        self._make = rows

    def compose(self) -> ComposeResult:
        """One scrolling table."""
        with VerticalScroll(classes="box wide") as box:
            box.border_title = "parameters ± one standard error"
            box.border_subtitle = "esc closes, ↑↓ scroll"
            yield Lines()

    def on_resize(self) -> None:
        """Lay out for the width there is."""
        self.query_one(Lines).show(self._make(max(60, min(110, self.app.size.width - 6))))
