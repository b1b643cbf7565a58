"""All methods on one recording, side by side: both papers' and our own."""

from collections.abc import Callable, Sequence
from typing import ClassVar

from textual import work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll

from imucal_wizard.errors import ImucalError
from imucal_wizard.fitting.methods import MethodRow
from imucal_wizard.method_table import BEST, method_table
from imucal_wizard.tui.screens.live_screen import LiveScreen
from imucal_wizard.tui.text import Line, line, wrapped
from imucal_wizard.tui.threads import in_thread
from imucal_wizard.tui.widgets.key_footer import Keys
from imucal_wizard.tui.widgets.lines import Lines


class ComparisonScreen(LiveScreen):
    """Above the result; the fits run in a thread.

    Args:
        make: fits by every method; called in a thread.
        step: the step of the machine below.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("question_mark", "app.explain('methods')", "help"),
        Binding("escape,enter,c,b", "close", "back"),
    ]
    keys: ClassVar[Keys] = (
        ("c", "back to the result"),
        ("↑↓", "scroll"),
        ("?", "help"),
        ("q", "quit"),
    )

    def __init__(self, make: Callable[[], Sequence[MethodRow]], step: str) -> None:
        super().__init__()
        self.step = step
        self._make = make
        self._methods: Sequence[MethodRow] | None = None
        self._problem = ""

    def body(self) -> ComposeResult:
        """A page that scrolls."""
        with VerticalScroll(classes="page"):
            yield Lines(id="methods")

    def begin(self) -> None:
        """Fit at once."""
        super().begin()
        self.query_one(VerticalScroll).focus()
        self.compare()

    @work(exclusive=True)
    async def compare(self) -> None:
        """Every method, in a thread."""
        try:
            self._methods = await in_thread(self._make)
        except ImucalError as error:
            self._problem = str(error)
        self.redraw()

    def redraw(self) -> None:
        """Lay the table out for the width there is."""
        super().redraw()
        self.query_one("#methods", Lines).show(self._rows(max(60, self.app.size.width - 4)))

    def _rows(self, width: int) -> list[Line]:
        if self._problem:
            return wrapped(f"▲ {self._problem}", width, "bad", indent="  ")
        if self._methods is None:
            return [line("Fitting by every method …", "accent")]
        return [line(text, _style(text)) for text in method_table(self._methods, width).split("\n")]

    def action_close(self) -> None:
        """Back to what is below."""
        self.end(self.step)


def _style(text: str) -> str:
    """A sensor's name, the best of its methods, a method; all else is said more quietly."""
    if text[:6].isupper():
        return "strong"
    if text.startswith(BEST):
        return "good"
    return "" if "%" in text or "no result" in text else "quiet"
