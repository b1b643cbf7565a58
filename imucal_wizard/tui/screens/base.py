"""The base of the live screens: header, footer, message for small terminals."""

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.message import Message
from textual.screen import Screen

from imucal_wizard.core.description import Description
from imucal_wizard.core.errors import ImucalError
from imucal_wizard.guide.kinds import TITLES, StepKind
from imucal_wizard.tui.state import WizardState
from imucal_wizard.tui.text import Line, Span, clock, width_of, wrapped
from imucal_wizard.tui.threads import being_left
from imucal_wizard.tui.widgets.footer import KeyFooter
from imucal_wizard.tui.widgets.lines import Lines

if TYPE_CHECKING:  # numpy waits until after the first paint
    from imucal_wizard.run.snapshot import Snapshot

MIN_SIZE = (80, 24)
"""Columns and rows that the screens need."""
WIDE, TALL = 130, 38
"""Columns and rows from which the screens show more."""
HORIZONTAL = [(0, "-too-narrow"), (MIN_SIZE[0], "-normal"), (WIDE, "-wide")]
VERTICAL = [(0, "-too-short"), (MIN_SIZE[1], "-usual"), (TALL, "-tall")]
"""Class of a screen for each size; the style sheet knows them."""

OF_A_CALIBRATION = TITLES.keys() - {StepKind.RECHECK, StepKind.VERDICT}
OF_A_RECHECK = {StepKind.SOURCE, StepKind.SETTLE, StepKind.RECHECK, StepKind.VERDICT}
"""Steps of the two procedures."""
_TITLE = "imucal-wizard"
_OVER = "✓–"


class TooSmall(Lines):
    """The message that replaces the screen in a small terminal."""

    def on_mount(self) -> None:
        """Show the present size and the size needed."""
        self.draw(self._words)

    def _words(self, width: int, _height: int) -> list[Line]:
        columns, rows = self.app.size
        text = (
            f"This terminal has {columns}×{rows} characters. Make it at least "
            f"{MIN_SIZE[0]}×{MIN_SIZE[1]}, or use a smaller font. The program keeps running."
        )
        return wrapped(text, width - 4, "strong")


class Failed(Message):
    """A screen cannot continue.

    Attributes:
        error: why.
        always: end the app even if an operator could choose another source.
    """

    def __init__(self, error: ImucalError, *, always: bool = False) -> None:
        super().__init__()
        self.error = error
        self.always = always


class StepOver(Message):
    """The procedure has entered another step.

    Attributes:
        step: the new step.
    """

    def __init__(self, step: str) -> None:
        super().__init__()
        self.step = step


class LiveScreen(Screen[None]):
    """A screen with header, body and footer that shows each new snapshot.

    Args:
        state: the wizard's state.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("question_mark", "app.explain", "help", tooltip="explains this screen"),
        Binding("m", "app.mute", "sound", tooltip="switches the sounds off or on"),
        Binding(
            "q", "app.quit", "quit",
            tooltip="quits; the session can be resumed",
        ),
    ]  # fmt: skip
    step: str = StepKind.SOURCE
    """The step of the procedure that this screen shows."""
    above: ClassVar[bool] = False
    """It lies above the screen of a step, which goes to another step when this one is closed."""

    def __init__(self, state: WizardState) -> None:
        super().__init__()
        self.state = state
        self._ended = False

    def compose(self) -> ComposeResult:
        """Header, body, footer, and the message for small terminals."""
        yield Lines(id="header")
        yield from self.body()
        yield KeyFooter()
        yield TooSmall()

    def body(self) -> ComposeResult:
        """The widgets between header and footer."""
        yield from ()

    def on_mount(self) -> None:
        """Show the newest snapshot."""
        if being_left(self):  # the app ends while the screen opens: not all widgets are there
            return
        if self.state.snapshot is not None:
            self.take(self.state.snapshot)
        else:
            self.show_steps()

    def lines(self, name: str) -> Lines:
        """A widget of this screen by its id."""
        return self.query_one(f"#{name}", Lines)

    def take(self, snapshot: "Snapshot") -> None:
        """Show a snapshot; end if the procedure has entered another step."""
        status = snapshot.status
        if status.step != self.step:
            self.end(status.step)
            return
        skipped = {str(step) for step, _ in status.skipped}
        if self.without_result:
            skipped.add(StepKind.RESULT)
        absent: set[str] = {StepKind.FIELD} if snapshot.stream.magnetometer is None else set()
        absent |= {kind for kind in TITLES if kind not in (status.steps or OF_A_CALIBRATION)}
        self._head(status.elapsed, sorted(skipped), sorted(absent), status.poses)

    def show_steps(self) -> None:
        """Show the steps of a procedure that has not begun."""
        absent = {StepKind.FIELD, *(kind for kind in TITLES if kind not in self.steps_to_come)}
        self._head(0.0, (), sorted(absent), 18)

    @property
    def without_result(self) -> bool:
        """Whether the procedure has gone on although the data determine no calibration."""
        return False

    @property
    def steps_to_come(self) -> Collection[str]:
        """The steps that are shown until a source states its own."""
        return OF_A_CALIBRATION

    def _head(
        self, elapsed: float, skipped: Sequence[str], absent: Sequence[str], poses: int
    ) -> None:
        steps, time = step_spans(self.step, skipped, absent, poses), clock(elapsed)
        self.lines("header").draw(lambda width, _: [header_row(steps, time, width)], (*steps, time))

    def action_describe(self) -> None:
        """Ask for device, place and operator; samples go on arriving."""
        from imucal_wizard.tui.screens.describe import DescriptionScreen

        def use(description: Description | None) -> None:
            if description is not None:
                self.state.describe(description)
                self.described()

        self.app.push_screen(DescriptionScreen(self.state.services.description), use)

    def described(self) -> None:
        """Show another description of the device."""

    def end(self, step: str) -> None:
        """Request the screen of another step, once; a screen above that of a step closes."""
        if self._ended:
            return
        self._ended = True
        if self.above:
            self.dismiss()
        else:
            self.post_message(StepOver(step))

    def action_close(self) -> None:
        """Return to the screen below."""
        self.end(self.step)


def step_spans(
    step: str, skipped: Collection[str], absent: Collection[str], poses: int
) -> list[Span]:
    """The steps: ``✓`` done, ``▸`` and capitals present, ``–`` skipped, no sign to come.

    Args:
        step: the present step.
        skipped: steps that were skipped.
        absent: steps that this stream or procedure does not have.
        poses: number of poses that the pose step needs.
    """
    named = {**TITLES, StepKind.POSES: f"{poses} poses"}
    aside = (
        StepKind.RESULT if step == StepKind.MORE else StepKind.MORE
    )  # one takes the other's place
    absent = {*absent, aside} - {step}
    shown = [kind for kind in named if kind not in absent]
    now = shown.index(step)
    spans: list[Span] = []
    for i, kind in enumerate(shown):
        if i == now:
            spans.append((f"▸{named[kind].upper()} ", "accent"))
        elif kind in skipped:
            spans.append((f"–{named[kind]} ", "quiet"))
        else:
            sign = "✓" if i < now else " "
            spans.append((f"{sign}{named[kind]} ", "quiet" if i > now else ""))
    return spans


def header_row(steps: Sequence[Span], time: str, width: int) -> Line:
    """The steps and the time in one row.

    If not all fit, the first steps are shortened: those done to their sign, the others by their
    leading space.
    """
    spans, room = list(steps), width - len(time) - 2
    for i, (text, style) in enumerate(spans):
        if width_of(tuple(spans)) <= room:
            break
        spans[i] = (text[0] if text[0] in _OVER else text.lstrip(" "), style)
    if width_of(tuple(spans)) + len(_TITLE) + 2 <= room:
        spans.insert(0, (f" {_TITLE} ", "quiet"))
    return (*spans, (" " * (room + 1 - width_of(tuple(spans))) + time, "quiet"))
