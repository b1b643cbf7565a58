"""The verdict of a recheck: GO or NO-GO in large letters, and the numbers behind it."""

from typing import TYPE_CHECKING, ClassVar

from textual import work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll

from imucal_wizard.core.errors import ImucalError
from imucal_wizard.core.quantities import quantity
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.report.recheck_text import change_text, checked_text, seen_text
from imucal_wizard.tui.screens.base import Failed, LiveScreen
from imucal_wizard.tui.state import WizardState
from imucal_wizard.tui.text import Line, bar, line, wrapped
from imucal_wizard.tui.threads import being_left, in_thread
from imucal_wizard.tui.widgets.big_text import BigText
from imucal_wizard.tui.widgets.lines import Lines

if TYPE_CHECKING:
    from imucal_wizard.diagnose.recheck import Recheck
    from imucal_wizard.report.calibration_file import Calibration

_STYLES = {"go": "good", "no-go": "bad", "insufficient": "warn", "reported": ""}


_UNTIL_HERE = (
    "This verdict is of the poses held before it. If anything has changed since, start a new "
    "recheck."
)


class VerdictScreen(LiveScreen):
    """Judges in a thread, and shows the verdict."""

    CSS_PATH = "steps.tcss"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("b", "measure", "measure more", tooltip="goes back to take further poses"),
        Binding("enter", "app.quit", "leave", key_display="enter", tooltip="leaves the program"),
    ]
    step = StepKind.VERDICT

    def __init__(self, state: WizardState) -> None:
        super().__init__(state)
        self._problem = ""
        self._found: tuple[Recheck, Calibration] | None = None

    def body(self) -> ComposeResult:
        """The verdict in large letters, and a page that scrolls."""
        yield BigText(id="instruction")
        with VerticalScroll(classes="page"):
            yield Lines(id="news")

    def on_mount(self) -> None:
        """Judge at once."""
        super().on_mount()
        if not being_left(self):
            self.query_one(VerticalScroll).focus()
            self.query_one(BigText).say("ONE MOMENT", "warn")
            self.judge()

    @work(exclusive=True)
    async def judge(self) -> None:
        """Judge what was measured, in a thread."""
        try:
            self._found = await in_thread(self.state.recheck)
        except ImucalError as error:
            self._problem = str(error)
            self.state.sounds.verdict(good=False)
            self.post_message(Failed(error))
        if being_left(self):
            return
        word, style = "NOT JUDGED", "bad"
        if self._found is not None:
            found = self._found[0]
            word, style = found.verdict.word, _STYLES[found.verdict]
            self.state.sounds.verdict(good=found.verdict == "go")
        self.query_one(BigText).say(word, style)
        self.lines("news").draw(lambda width, _: self._rows(width))
        if self.state.settings.quit_after and not self._problem:
            await self.run_action("app.quit")

    def action_measure(self) -> None:
        """Go back to the poses."""
        self.state.order("back")

    def _rows(self, width: int) -> list[Line]:
        if self._found is None:
            return wrapped(f"▲ {self._problem}", width, "bad", indent="  ")
        found, calibration = self._found
        date = calibration.date[:10]
        rows: list[Line] = [*wrapped(checked_text(found, calibration), width, "quiet"), line("")]
        for name, one in found.sensors.items():
            error, limit = (quantity(value, one.unit) for value in (one.error, one.limit))
            share = 0.0 if one.error is None else one.error / one.limit
            verdict = one.verdict.word, _STYLES[one.verdict]
            numbers = f"  {error}, limit {limit}  {bar(share, 14)}"
            rows.append(((f"{name:15}", "strong"), verdict, (numbers, "")))
            rows += [
                line(f"  {moved.parameter} {change_text(moved)} since {date}", "warn")
                for moved in one.moved
            ]
            rows += [line(f"  {text}", "quiet") for text in seen_text(one)]
        rows += [line(""), *wrapped(found.says, width), line("")]
        return [*rows, *wrapped(_UNTIL_HERE, width, "quiet")]
