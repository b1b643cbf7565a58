"""Export of the saved calibration for another program."""

import asyncio
from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar, cast

from textual import on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical, VerticalScroll
from textual.content import Content
from textual.screen import ModalScreen
from textual.widgets import OptionList
from textual.widgets.option_list import Option

from imucal_wizard.core.errors import ImucalError
from imucal_wizard.report.exports import ExportTarget
from imucal_wizard.tui.state import WizardState
from imucal_wizard.tui.text import wrapped
from imucal_wizard.tui.widgets.footer import KeyFooter
from imucal_wizard.tui.widgets.lines import Lines

if TYPE_CHECKING:  # the app imports this module while its first screen is shown
    from imucal_wizard.tui.app import BaseApp


_STYLES = {"about": "quiet", "lost": "warn", "file": "good", "worse": "bad"}
"""Of the kinds of lines; the others are plain."""


class ExportScreen(ModalScreen[None]):
    """Writes the file beside the calibration; shows its error and what it cannot hold.

    A result that is not saved yet is saved first, so that every export has its calibration.

    Args:
        state: the wizard's state, with a fit.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,x", "dismiss", "close", tooltip="goes back to the calibration"),
        Binding("question_mark", "app.explain('save')", "help", tooltip="explains this screen"),
        Binding("q", "app.quit", "quit", tooltip="leaves the program"),
    ]

    def __init__(self, state: WizardState) -> None:
        super().__init__()
        self._state = state
        self._targets: Sequence[ExportTarget] = state.services.targets()

    def compose(self) -> ComposeResult:
        """The targets, and below them the outcome."""
        with Vertical(classes="box") as box:
            box.border_title = "export for …   ↑↓ and enter"
            options = [Content(one.title).stylize("bold") for one in self._targets]
            yield OptionList(*(Option(one) for one in options), markup=False)
            with VerticalScroll():
                yield Lines(id="exported")
        yield KeyFooter()

    @on(OptionList.OptionSelected)
    def _chosen(self, event: OptionList.OptionSelected) -> None:
        self._write(self._targets[event.option_index])

    @work
    async def _write(self, target: ExportTarget) -> None:
        self._show([("Writing the file …", "accent")])
        try:
            if self._state.saved is None:
                await cast("BaseApp", self.app).save_model()
            done = await asyncio.to_thread(self._state.export, target.name)
        except ImucalError as error:
            self._show([(f"▲ {error}", "warn")])
        else:
            rows = sorted(done.lines(), key=lambda row: row[0] != "file")
            self._show([(text, _STYLES.get(kind, "")) for kind, text in rows])

    def _show(self, rows: Sequence[tuple[str, str]]) -> None:
        self.query_one("#exported", Lines).draw(
            lambda width, _: [row for text, style in rows for row in wrapped(text, width, style)]
        )
