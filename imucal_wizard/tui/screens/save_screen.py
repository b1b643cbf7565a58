"""The last step: the calibration is written, and the place shown."""

import asyncio
from typing import ClassVar

from textual import work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll

from imucal_wizard.errors import ImucalError
from imucal_wizard.tui.bench.kept_rows import kept_models, kept_rows
from imucal_wizard.tui.leaving import being_left
from imucal_wizard.tui.report_rows import summary_rows
from imucal_wizard.tui.screens.report_screen import ReportScreen
from imucal_wizard.tui.text import line, wrapped
from imucal_wizard.tui.threads import in_thread
from imucal_wizard.tui.widgets.big_text import BigText
from imucal_wizard.tui.widgets.key_footer import KeyFooter, Keys
from imucal_wizard.tui.widgets.lines import Lines

UNSAVED: Keys = (("q", "leave"), ("b", "measure more"), ("?", "help"))
"""Keys where there is nothing to save."""
_CHANGED = "▲ The bench has another model now than this file: s saves that."


class SaveScreen(ReportScreen):
    """Fits again with the validation, saves, says where."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("s", "save_again", "save with the bench's model"),
        Binding("b", "back", "back"),
        Binding("enter", "app.leave", "leave"),
    ]
    step = "save"
    keys: ClassVar[Keys] = (
        ("q", "leave"),
        ("f", "find missing"),
        ("h", "north"),
        ("c", "compare"),
        ("t", "parameters"),
        ("b", "back"),
        ("↑↓", "scroll"),
        ("?", "help"),
    )

    def __init__(self) -> None:
        super().__init__()
        self._begun = False
        self._problem = ""
        """Why nothing is saved."""
        self._models: dict[str, tuple[str, ...]] = {}

    def body(self) -> ComposeResult:
        """A word that is read from afar, the place, and the result once more."""
        yield BigText(id="instruction")
        with VerticalScroll(classes="page"):
            yield Lines(id="report")

    def begin(self) -> None:
        """Save at once."""
        super().begin()
        self.query_one(VerticalScroll).focus()
        if not self._begun:
            self._begun = True
            self.save()

    @work(exclusive=True)
    async def save(self) -> None:
        """Fit once more, so that the validation is in it, and write the file, in a thread."""
        app = self.wizard
        source, snapshot = app.source, app.snapshot
        if source is None or snapshot is None:
            return
        try:
            app.report = await in_thread(lambda: app.services.fit(source.collected(), snapshot))
            benches = await in_thread(lambda: app.kept.newest(app.report))
            app.saved = await asyncio.to_thread(app.services.save, app.report, benches)
        except ImucalError as error:
            app.fail(error)
            self._problem = str(error)
            self._say("NOT SAVED", "bad")
            return
        if being_left(self):
            return
        self._problem, self._models = "", kept_models(benches)
        self._say("SAVED", "good")
        if app.settings.quit_after:
            app.action_leave()

    @property
    def _changed(self) -> bool:
        """The bench has another model than the file."""
        return (
            self.wizard.saved is not None and kept_models(self.wizard.kept.benches) != self._models
        )

    def footer(self) -> None:
        """Show the keys; without a fit there is nothing to look into."""
        lacking = self._problem and self.wizard.report is None
        self.query_one(KeyFooter).offer(UNSAVED if lacking else self.offered(self.keys))

    def action_save_again(self) -> None:
        """Write a file with the model of the bench."""
        if self._changed:
            self.save()

    def action_back(self) -> None:
        """Measure more; the file stays, a later save gets a name of its own."""
        self.wizard.order("back")

    def _say(self, word: str, style: str) -> None:
        self.query_one(BigText).say(word, style)
        self.redraw()

    def redraw(self) -> None:
        """Lay the report out for the width there is."""
        super().redraw()
        width = max(60, self.app.size.width - 4)
        rows = [line("Writing the calibration …", "accent")]
        if self._problem:
            rows = wrapped(f"▲ not saved: {self._problem}", width, "bad", indent="  ")
        elif self.wizard.saved is not None:
            rows = wrapped(f"✓ {self.wizard.saved.path}", width, "good", indent="  ")
            if self._changed:
                rows += wrapped(_CHANGED, width, "warn", indent="  ")
        if self.wizard.report is not None:
            rows += kept_rows(self.wizard.kept.benches, width)
            rows += [line(""), *summary_rows(self.wizard.report, width)]
        self.query_one("#report", Lines).show(rows)
