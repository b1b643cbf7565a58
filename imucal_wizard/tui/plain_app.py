"""What the apps have in common: two keys to leave by, and one line for what nobody foresaw."""

import sys
from typing import ClassVar, Generic, TypeVar

from rich.text import Text
from textual.app import App
from textual.binding import Binding, BindingType

from imucal_wizard.faults import kept, told

Result = TypeVar("Result")


class PlainApp(App[Result], Generic[Result]):
    """An app with the style of this program; its ``action_leave`` ends it."""

    CSS_PATH = "wizard.tcss"
    ENABLE_COMMAND_PALETTE = False
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+q", "leave", "quit", show=False, priority=True),
        Binding("ctrl+c", "leave", "quit", show=False, priority=True),
    ]

    def action_leave(self) -> None:
        """Leave."""
        self.exit()

    def _fatal_error(self) -> None:
        """An unforeseen fault: its traceback goes to a file, one line to the user.

        Textual calls this; without it, it would print the traceback with all values in it.
        """
        error = self._exception or sys.exception() or RuntimeError("unknown")
        error = getattr(error, "error", error)  # a worker's failure wraps what was raised in it
        self.panic(Text(told(error, kept(error))))
