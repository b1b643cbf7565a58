"""What all screens have in common that follow the stream."""

from typing import TYPE_CHECKING, ClassVar, cast

from textual.app import ComposeResult
from textual.binding import Binding, BindingType

from imucal_wizard.tui.screens.sized_screen import SizedScreen
from imucal_wizard.tui.widgets.key_footer import KeyFooter, Keys
from imucal_wizard.tui.widgets.step_header import STEPS, StepHeader

if TYPE_CHECKING:  # numpy waits until after the first paint
    from imucal_wizard.live.snapshot import Snapshot
    from imucal_wizard.tui.app import WizardApp

_AFTER_RESULT = ("validate", "save")
"""Here the result has been seen, or there is none."""


class LiveScreen(SizedScreen[str]):
    """A header with the steps, a footer with the keys, and a snapshot 20 times a second.

    Its result is the step of the machine that comes next.
    """

    meanwhile = " Measuring goes on meanwhile."
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("question_mark", "app.explain", "help"),
        Binding("m", "app.mute", "sound"),
        Binding("q", "app.leave", "quit"),
    ]
    step: str = "source"
    """The step of the machine this screen is about."""
    keys: ClassVar[Keys] = (("?", "help"), ("m", "sound"), ("q", "quit"))
    """What the footer shows."""

    def __init__(self) -> None:
        super().__init__()
        self._ended = False

    @property
    def wizard(self) -> "WizardApp":
        """The app, as what it is."""
        return cast("WizardApp", self.app)

    def compose(self) -> ComposeResult:
        """Header, body, footer, and a word for terminals that are too small."""
        yield StepHeader()
        yield from self.body()
        yield KeyFooter()
        yield from self.too_small()

    def body(self) -> ComposeResult:
        """What is between header and footer."""
        yield from ()

    def redraw(self) -> None:
        """Show everything for the size there is."""
        self.footer()
        if self.wizard.snapshot is not None:
            self.take(self.wizard.snapshot)
        else:
            self.query_one(StepHeader).tell(self.step, absent=("field",))

    def end(self, step: str) -> None:
        """Leave this screen once; the wizard shows the one of ``step`` next."""
        if not self._ended:
            self._ended = True
            self.dismiss(step)

    def footer(self) -> None:
        """Show the keys."""
        self.query_one(KeyFooter).offer(self.keys)

    def take(self, snapshot: "Snapshot") -> None:
        """Show a snapshot; end when the machine has gone to another step."""
        status = snapshot.status
        if status.step != self.step:
            self.end(status.step)
            return
        skipped = {str(step) for step, _ in status.skipped}
        if self.wizard.report is None and status.step in _AFTER_RESULT:
            skipped.add("result")
        absent = {"field"} if snapshot.stream.magnetometer is None else set()
        if status.steps:
            absent |= {kind for kind, _ in STEPS if kind not in status.steps}
        self.query_one(StepHeader).tell(
            str(self.step), status.elapsed, skipped, absent=absent, poses=status.poses
        )
