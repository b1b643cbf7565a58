"""Before a step is skipped: what that costs."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen

from imucal_wizard.tui.text import line, wrapped
from imucal_wizard.tui.widgets.lines import Lines


class SkipScreen(ModalScreen[bool]):
    """States the consequence; the same key again skips.

    Args:
        title: name of the step.
        consequence: what it means for the result.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("s,enter", "dismiss(True)", "skip"),
        Binding("escape,b,u", "dismiss(False)", "stay"),
        Binding("question_mark", "app.explain", "help"),
        Binding("q", "app.leave", "quit"),
    ]

    def __init__(self, title: str, consequence: str) -> None:
        super().__init__()
        self._title = title
        self._consequence = consequence

    def compose(self) -> ComposeResult:
        """A few words."""
        with Vertical(classes="box small") as box:
            box.border_title = f"skip {self._title}?"
            box.border_subtitle = "s skip it   esc stay   ? help"
            yield Lines()

    def on_mount(self) -> None:
        """Say it."""
        rows = wrapped(f"▲ {self._consequence}", 56, "warn", indent="  ")
        rows += [line(""), *wrapped("b goes back to it at any time; nothing is lost.", 56)]
        self.query_one(Lines).show(rows)
