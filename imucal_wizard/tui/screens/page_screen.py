"""A page of text above another screen."""

from collections.abc import Callable
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen

from imucal_wizard.tui.leaving import being_left
from imucal_wizard.tui.text import Line
from imucal_wizard.tui.widgets.lines import Lines

WIDEST = 110


class PageScreen(ModalScreen[bool]):
    """A page that scrolls.

    Args:
        title: what it is about.
        rows: makes the rows for a width.
        close: one more key that closes it, the one that opened it.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,enter,space", "dismiss", "close"),
        Binding("q", "app.leave", "quit"),
    ]

    def __init__(self, title: str, rows: Callable[[int], list[Line]], close: str = "") -> None:
        super().__init__()
        self._title = title
        self._make = rows
        self._close = close

    def compose(self) -> ComposeResult:
        """One scrolling page."""
        with VerticalScroll(classes="box wide") as box:
            box.border_title = self._title
            box.border_subtitle = "esc closes, ↑↓ scroll"
            yield Lines()

    def on_mount(self) -> None:
        """The key that opened it closes it, too."""
        if self._close:
            self._bindings.bind(self._close, "dismiss", "close")

    def on_resize(self) -> None:
        """Lay out for the width there is."""
        if being_left(self):
            return
        self.query_one(Lines).show(self._make(max(60, min(WIDEST, self.app.size.width - 8))))
