"""A screen that is laid out for the size of the terminal, and says when that is too small."""

from typing import ClassVar, Generic, TypeVar

from textual.app import ComposeResult
from textual.screen import Screen
from textual.widgets import Static

from imucal_wizard.tui.leaving import being_left

Result = TypeVar("Result")

SMALLEST = (80, 24)
"""Columns and rows the screens are made for."""
WIDE, TALL = 130, 38
"""Columns and rows from which there is room for more."""


class SizedScreen(Screen[Result], Generic[Result]):
    """Has a class for each size in the style sheet; lays itself out again when the size changes."""

    HORIZONTAL_BREAKPOINTS = [  # noqa: RUF012 (Textual declares it without ClassVar)
        (0, "-too-narrow"),
        (SMALLEST[0], "-normal"),
        (WIDE, "-wide"),
    ]
    VERTICAL_BREAKPOINTS = [  # noqa: RUF012 (Textual declares it without ClassVar)
        (0, "-too-short"),
        (SMALLEST[1], "-usual"),
        (TALL, "-tall"),
    ]
    meanwhile: ClassVar[str] = ""
    """What to say of the work while the terminal is too small to show it."""

    def too_small(self) -> ComposeResult:
        """The word that a terminal which is too small shows instead of all else."""
        yield Static(id="too-small", markup=False)

    def on_mount(self) -> None:
        """Begin, unless the screen is left before it was ever shown."""
        if not being_left(self):
            self.begin()

    def begin(self) -> None:
        """Show what there is to show; a screen that has work to do sets about it here."""
        self.redraw()

    def redraw(self) -> None:
        """Show everything for the size there is."""

    def on_resize(self) -> None:
        """Rows and columns decide how much is shown."""
        if being_left(self):
            return
        columns, rows = self.app.size
        self.query_one("#too-small", Static).update(
            f"This terminal has {columns}×{rows} characters. Make it at least "
            f"{SMALLEST[0]}×{SMALLEST[1]}, or the letters smaller.{self.meanwhile}"
        )
        self.call_after_refresh(self.redraw_if_there)

    def redraw_if_there(self) -> None:
        """The same, unless the screen is being left meanwhile."""
        if not being_left(self):
            self.redraw()
