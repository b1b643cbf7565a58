"""A table above another screen."""

from collections.abc import Callable

from imucal_wizard.tui.screens.page_screen import PageScreen
from imucal_wizard.tui.text import Line


class TableScreen(PageScreen):
    """All parameters with their standard errors and units.

    Args:
        rows: makes the rows for a width.
    """

    def __init__(self, rows: Callable[[int], list[Line]]) -> None:
        super().__init__("parameters ± one standard error", rows, "t")
