"""A table above another screen."""

from collections.abc import Callable
from typing import ClassVar

from textual.binding import Binding, BindingType

from imucal_wizard.tui.screens.page_screen import PageScreen
from imucal_wizard.tui.text import Line


class TableScreen(PageScreen):
    """All parameters with their standard errors and units.

    Args:
        rows: makes the rows for a width.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("question_mark", "app.explain('parameters')", "help"),
    ]

    def __init__(self, rows: Callable[[int], list[Line]]) -> None:
        super().__init__("parameters ± one standard error (? says what they are)", rows, "t")
