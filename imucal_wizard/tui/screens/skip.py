"""The question before a step is skipped."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen

from imucal_wizard.tui.text import line, wrapped
from imucal_wizard.tui.widgets.footer import KeyFooter
from imucal_wizard.tui.widgets.lines import Lines


class SkipScreen(ModalScreen[bool]):
    """States the consequence of skipping; the same key again skips.

    Args:
        title: name of the step.
        consequence: for the result.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("s,enter", "dismiss(True)", "skip it", tooltip="skips the step"),
        Binding("escape,b,u", "dismiss(False)", "stay", tooltip="goes on with the step"),
        Binding("question_mark", "app.explain", "help", tooltip="explains the step"),
        Binding("q", "app.quit", "quit", show=False, tooltip="leaves the program"),
    ]
    goes_with_step = True

    def __init__(self, title: str, consequence: str) -> None:
        super().__init__()
        self._title = title
        self._consequence = consequence

    def compose(self) -> ComposeResult:
        """The consequence."""
        with Vertical(classes="box small") as box:
            box.border_title = f"skip {self._title}?"
            words = Lines()
            words.draw(
                lambda width, _: [
                    *wrapped(f"▲ {self._consequence}", width, "warn", indent="  "),
                    line(""),
                    *wrapped("You can return to it at any time; nothing is lost.", width),
                ]
            )
            yield words
        yield KeyFooter()
