"""The verdict in full and what to measure next; one key begins to measure it."""

from typing import ClassVar

from textual.binding import Binding, BindingType

from imucal_wizard.tui.screens.page_screen import PageScreen


class NextScreen(PageScreen):
    """Ends with True when these are to be measured now."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("m", "dismiss(True)", "measure these now")]
