"""All methods side by side on the present measurements."""

from collections.abc import Sequence
from typing import ClassVar

from textual import work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll

from imucal_wizard.core.errors import ImucalError
from imucal_wizard.estimate.comparison import MethodRow
from imucal_wizard.report.tables import BEST, method_table
from imucal_wizard.tui.screens.base import LiveScreen
from imucal_wizard.tui.state import WizardState
from imucal_wizard.tui.text import Line, line, wrapped
from imucal_wizard.tui.threads import in_thread
from imucal_wizard.tui.widgets.lines import Lines


class MethodsScreen(LiveScreen):
    """Lies above the result; the fits run in a thread.

    Args:
        state: the wizard's state.
        step: the step of the screen below.
    """

    above = True
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("m", "app.mute", "sound", show=False, tooltip="switches the sounds off or on"),
        Binding("question_mark", "app.explain('methods')", "help", tooltip="explains this screen"),
        Binding(
            "c,escape,enter,b", "close", "back to the result", tooltip="goes back to the result"
        ),
    ]  # fmt: skip

    def __init__(self, state: WizardState, step: str) -> None:
        super().__init__(state)
        self.step = step
        self._methods: Sequence[MethodRow] | None = None
        self._problem = ""

    def body(self) -> ComposeResult:
        """A page that scrolls."""
        with VerticalScroll(classes="page"):
            yield Lines(id="methods")

    def on_mount(self) -> None:
        """Start the fits."""
        super().on_mount()
        self.query_one(VerticalScroll).focus()
        self.lines("methods").draw(self._rows)
        self.compare()

    @work(exclusive=True)
    async def compare(self) -> None:
        """Fit by every method in a thread."""
        try:
            self._methods = await in_thread(self.state.compare)
        except ImucalError as error:
            self._problem = str(error)
        self.lines("methods").draw(self._rows)

    def _rows(self, width: int, _height: int) -> list[Line]:
        if self._problem:
            return wrapped(f"▲ {self._problem}", width, "bad", indent="  ")
        if self._methods is None:
            return [line("Fitting by every method …", "accent")]
        return [line(text, _style(text)) for text in method_table(self._methods, width).split("\n")]


def _style(text: str) -> str:
    """The style of a row: sensor, best method, other method, remark."""
    if text[:6].isupper():
        return "strong"
    if text.startswith(BEST):
        return "good"
    return "" if "%" in text or "no result" in text else "quiet"
