"""The result: what was found, how good it is, what is missing."""

import math
import time
from typing import ClassVar

from textual import work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.events import Key

from imucal_wizard.errors import ImucalError
from imucal_wizard.tui.bench.kept_rows import kept_rows
from imucal_wizard.tui.report_rows import summary_rows
from imucal_wizard.tui.screens.report_screen import ReportScreen
from imucal_wizard.tui.text import Line, line, wrapped
from imucal_wizard.tui.threads import in_thread
from imucal_wizard.tui.widgets.key_footer import KeyFooter, Keys
from imucal_wizard.tui.widgets.lines import Lines

UNFITTED: Keys = (("b", "back"), ("s", "leave it at that"), ("?", "help"), ("q", "quit"))
"""Keys where the fit failed."""


class ResultScreen(ReportScreen):
    """Fits in a thread, shows the report; validation follows by a key or by itself."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("v", "order('validate')", "validate"),
        Binding("s", "order('save')", "save"),
        Binding("u", "order('undo')", "undo"),
        Binding("b", "order('back')", "back"),
    ]
    step = "result"
    keys: ClassVar[Keys] = (
        ("v", "validate"),
        ("s", "save"),
        ("f", "find missing"),
        ("h", "north"),
        ("c", "compare"),
        ("b", "back"),
        ("t", "table"),
        ("↑↓", "scroll"),
        ("?", "help"),
        ("q", "quit"),
    )

    def __init__(self) -> None:
        super().__init__()
        self._problem = ""
        """Why there is no fit."""
        self._deadline: float | None = None

    def body(self) -> ComposeResult:
        """A page that scrolls, and a row that says what happens next."""
        with VerticalScroll(classes="page"):
            yield Lines(id="report")
        yield Lines(id="next")

    def begin(self) -> None:
        """Fit at once."""
        super().begin()
        self.query_one(VerticalScroll).focus()
        if self.wizard.report is None and not self._problem:
            self.fit()

    @work(exclusive=True)
    async def fit(self) -> None:
        """Fit what was collected, in a thread."""
        source, snapshot = self.wizard.source, self.wizard.snapshot
        if source is None or snapshot is None:
            return
        try:
            self.wizard.report = await in_thread(
                lambda: self.wizard.services.fit(source.collected(), snapshot)
            )
        except ImucalError as error:
            self._problem = str(error)
            self.wizard.fail(error)
        else:
            self._begin()
        self.redraw()

    def _begin(self) -> None:
        """Fitted: back to the bench that has asked for more, or on by itself in a while."""
        if self.wizard.kept.again:
            self.wizard.kept.again = False
            self.wizard.action_bench()
            return
        self._deadline = time.monotonic() + self.wizard.settings.countdown
        self.set_interval(0.5, self._count_down)

    def on_key(self, event: Key) -> None:
        """Any key stops the countdown."""
        if event.key not in ("v", "s"):
            self._deadline = None
            self._tell_next()

    def action_order(self, name: str) -> None:
        """Hand a command to the machine."""
        self.wizard.order(name)

    def footer(self) -> None:
        """Show the keys; without a fit there is nothing to look into."""
        self.query_one(KeyFooter).offer(UNFITTED if self._problem else self.offered(self.keys))

    def redraw(self) -> None:
        """Lay the report out for the width there is."""
        super().redraw()
        width = max(60, self.app.size.width - 4)
        self.query_one("#report", Lines).show(self._rows(width))
        self._tell_next()

    def _rows(self, width: int) -> list[Line]:
        if self._problem:
            way = "b goes back to measure more; nothing is lost."
            if self._over:
                way = "The recording has ended here: make another one, with these rests in it."
            return [
                *wrapped(f"▲ {self._problem}", width, "bad", indent="  "),
                line(""),
                *wrapped(way, width),
            ]
        if self.wizard.report is None:
            status = self.wizard.snapshot.status if self.wizard.snapshot else None
            count = f"{status.holds} holds and {status.rotations} rotations" if status else ""
            return [line(""), line(f"Fitting {count} …", "accent")]
        kept = kept_rows(self.wizard.kept.benches, width)
        return [*kept, *summary_rows(self.wizard.report, width)]

    def _count_down(self) -> None:
        if self._deadline is None or self.app.screen is not self:
            return
        if time.monotonic() >= self._deadline:
            self._deadline = None
            self.wizard.order("save" if self._over else "validate")
        self._tell_next()

    @property
    def _over(self) -> bool:
        """Whether no new pose can come."""
        return self.wizard.snapshot is not None and self.wizard.snapshot.finished

    def _tell_next(self) -> None:
        if self._problem:
            self.footer()
            self.query_one("#next", Lines).show([])
            return
        text = "v: a few new poses that the fit has not seen   s: save without"
        if self._over:
            text = "s: save; the recording has ended"
        if self._deadline is not None:
            left = max(0, math.ceil(self._deadline - time.monotonic()))
            what = "saving" if self._over else "validation with a few new poses"
            text = f"{what} begins by itself in {left} s; any key stops that"
        self.query_one("#next", Lines).show([line(f" {text}", "accent")])
