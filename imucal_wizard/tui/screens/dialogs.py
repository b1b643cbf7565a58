"""Short questions above a screen: before a step is skipped, a model given up, a place changed."""

from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input

from imucal_wizard.tui.text import Line, line, wrapped
from imucal_wizard.tui.widgets.footer import KeyFooter
from imucal_wizard.tui.widgets.lines import Lines


class Dialog(ModalScreen[str]):
    """A box with a consequence and a hint; a subclass adds the keys. Its result is "" to stay.

    Args:
        title: the question.
        consequence: of the first answer.
        hint: more about it.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,b", "dismiss('')", "stay", tooltip="goes on as before"),
    ]

    def __init__(self, title: str, consequence: str, hint: str) -> None:
        super().__init__()
        self._title = title
        self._consequence = consequence
        self._hint = hint

    def compose(self) -> ComposeResult:
        """The consequence and the hint."""
        with Vertical(classes="box small") as box:
            box.border_title = self._title
            yield Lines(id="dialog")
        yield KeyFooter()

    def on_mount(self) -> None:
        """Show the text."""
        self.query_one("#dialog", Lines).draw(lambda width, _: self.rows(width))

    def rows(self, width: int) -> list[Line]:
        """The text for a width."""
        return [
            *wrapped(f"▲ {self._consequence}", width, "warn", indent="  "),
            line(""),
            *wrapped(self._hint, width),
        ]


class StepDialog(Dialog):
    """States the consequence of a command for a step; a subclass lets Enter give it.

    The key that opened the dialog does not confirm it: it may be pressed twice by mistake.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("u", "dismiss('')", "stay", show=False),
        Binding("question_mark", "app.explain", "help", tooltip="explains the step"),
        Binding("q", "app.quit", "quit", show=False, tooltip="leaves the program"),
    ]
    goes_with_step = True


class SkipDialog(StepDialog):
    """States the consequence of skipping a step; Enter skips it: ``skip``.

    Args:
        title: name of the step.
        consequence: for the result.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(
            "enter", "dismiss('skip')", "skip it", key_display="enter", tooltip="skips the step"
        ),
    ]

    def __init__(self, title: str, consequence: str) -> None:
        hint = "You can return to it at any time; nothing is lost."
        super().__init__(f"skip {title}?", consequence, hint)


class RepeatDialog(StepDialog):
    """States what repeating a step takes back; Enter repeats it: ``repeat``.

    Args:
        title: name of the step.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(
            "enter", "dismiss('repeat')", "repeat it", key_display="enter",
            tooltip="takes back all that the step has measured",
        ),
    ]  # fmt: skip

    def __init__(self, title: str) -> None:
        consequence = "All that this step has measured is taken back and cannot be restored."
        hint = "To take back only the last hold, rotation or circle, press esc, then u."
        super().__init__(f"repeat {title}?", consequence, hint)


class LeaveDialog(Dialog):
    """Asks what becomes of a model that is in no file: ``save`` or ``give up``.

    No key that leaves other screens answers it: a key that repeats itself would give the model up.

    Args:
        model: what was built, in words.
        problem: why it could not be saved a moment ago, or "".
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(
            "s", "dismiss('save')", "save it and leave", tooltip="saves the model, then leaves"
        ),
        Binding("d", "dismiss('give up')", "leave without saving", tooltip="discards the model"),
    ]

    def __init__(self, model: str, problem: str = "") -> None:
        hint = "s saves it and leaves; d leaves without saving; esc goes back."
        consequence = f"not saved: {problem}" if problem else f"This model is not saved: {model}."
        super().__init__("leave without saving?", consequence, hint)


class PlaceDialog(Dialog):
    """Asks where to write what could not be written; the result is the place, or "".

    Args:
        title: what is to be written.
        problem: why it could not be written.
        place: a place that is proposed, or None.
        other: what escape does.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "dismiss('')", "back", tooltip="does not write it"),
    ]

    def __init__(self, title: str, problem: str, place: Path | None, other: str) -> None:
        hint = f"enter writes it to the file below; esc {other}."
        super().__init__(title, problem, hint)
        self._place = place

    def compose(self) -> ComposeResult:
        """The problem, and an input field for the place."""
        with Vertical(classes="box small") as box:
            box.border_title = self._title
            yield Lines(id="dialog")
            yield Input("" if self._place is None else str(self._place), placeholder="folder/file")
        yield KeyFooter()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Take the place that was typed; an empty one is none."""
        if event.value.strip():
            self.dismiss(event.value.strip())


class WaitDialog(Dialog):
    """Shown until a model is fitted or its file written, before the app is left; else ``leave``."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("d", "dismiss('leave')", "leave at once", tooltip="does not wait for the model"),
    ]

    def __init__(self) -> None:
        consequence = "A model is being fitted or written; the program ends when that is done."
        super().__init__(
            "leaving …", consequence, "esc stays; d leaves at once, without the model."
        )
