"""Questions about columns and units, for streams that do not name them."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen

from imucal_wizard.acquire.decode.vocabulary import quantity_of
from imucal_wizard.acquire.setup import StreamSetup, chosen_setup
from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.quantities import fixed
from imucal_wizard.core.units import COUNT, UNIT_FACTORS
from imucal_wizard.run.snapshot import StreamStatus
from imucal_wizard.tui.panels.preview import interrupted
from imucal_wizard.tui.text import line, wrapped
from imucal_wizard.tui.widgets.footer import KeyFooter
from imucal_wizard.tui.widgets.lines import Lines
from imucal_wizard.tui.widgets.questions import Question, QuestionList

SKIP = "not used"
_LOOK = 0.2
"""Seconds between two looks at the stream."""
CHANNELS = (
    "t", "ax", "ay", "az", "gx", "gy", "gz", "mx", "my", "mz", "temp", "current", "throttle",
    "counter",
)  # fmt: skip
_UNIT_HINTS = {
    "accelerometer": "at rest 9.81 m/s², 1 g or 1000 mg",
    "gyroscope": "see the sketch or data sheet",
    "magnetometer": "the Earth's field is 22 to 67 µT",
    "time": "",
}
"""Hint of the question about each unit."""
_LARGE = 1000.0
"""Numbers from here on are shown without decimals."""


class ColumnsScreen(ModalScreen[StreamSetup | None]):
    """Asks for columns and units; the result is the setup of the stream.

    Args:
        newest: returns the newest state of the stream.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "dismiss", "cancel", tooltip="leaves the columns as they are"),
        Binding("question_mark", "app.explain('columns')", "help", tooltip="explains the units"),
        Binding("q", "app.quit", "quit", tooltip="leaves the program"),
    ]

    def __init__(self, newest: Callable[[], StreamStatus]) -> None:
        super().__init__()
        self._newest = newest
        self._stream = newest()
        self._refused: list[str] = []

    def compose(self) -> ComposeResult:
        """The newest line, the questions, the error."""
        with VerticalScroll(classes="box page-box") as box:
            box.border_title = "which column is what?"
            yield Lines(id="raw")
            yield QuestionList(id="columns")
            yield Lines(id="wrong")
        yield KeyFooter()

    def on_mount(self) -> None:
        """Ask, beginning with the first unknown answer."""
        self._show(self._stream)
        choices = questions(self._stream)
        unknown = [i for i, choice in enumerate(choices) if choice.open]
        place = self.query_one(QuestionList)
        first = unknown[0] if unknown and "columns" not in self._stream.needs else 0
        place.ask(choices, first)
        place.focus()
        self.set_interval(_LOOK, self._look)

    def _look(self) -> None:
        """Show the newest values, so that turning the device shows which column is which.

        Ask for the units of the sensors that have columns. Close when the stream's header has
        answered the questions. Remove an error message once the answers change.
        """
        stream = self._newest()
        if self._stream.needs and self.is_current and stream.samples and not stream.needs:
            self.dismiss(None)
        elif len(stream.columns) == len(self._stream.columns):
            self._show(stream)
            asked, count = self.query_one(QuestionList), len(stream.columns)
            columns = [
                replace(one, note=newest(stream, place))
                for place, one in enumerate(asked.choices[:count])
            ]
            asked.change(_with_units(columns, asked.choices[count:]))
            if self._refused and self._refused != _answers(asked):
                self._refuse("")

    def _show(self, stream: StreamStatus) -> None:
        """The newest line, or why none arrives."""
        if interrupted(stream):
            text, style = f"▲ {stream.problem}", "bad"
        else:
            text, style = f"newest line: {stream.line}", "quiet"
        self.query_one("#raw", Lines).draw(
            lambda width, _: [*wrapped(text[: 3 * width], width, style, indent="  "), line("")]
        )

    def _refuse(self, wrong: str) -> None:
        """Show why the answers cannot be used; "" if they were changed."""
        self._refused = _answers(self.query_one(QuestionList)) if wrong else []
        self.query_one("#wrong", Lines).draw(
            lambda width, _: [line(""), *wrapped(f"▲ {wrong}", width, "bad")] if wrong else []
        )

    @on(QuestionList.Done)
    def _use(self) -> None:
        stream, answers = self._stream, _answers(self.query_one(QuestionList))
        count = len(stream.columns)
        channels = ["" if answer == SKIP else answer for answer in answers[:count]]
        chosen = dict(zip(_UNIT_HINTS, answers[count:], strict=True))
        try:
            self.dismiss(chosen_setup(stream.format, stream.columns, channels, chosen))
        except UsageError as error:
            self._refuse(str(error))


def _answers(asked: QuestionList) -> list[str]:
    """The answers given; "" for a question without one."""
    return [one.answer if one.answer in one.options else "" for one in asked.choices]


def questions(stream: StreamStatus) -> list[Question]:
    """One question per column, then one per unit."""
    choices = []
    for i, column in enumerate(stream.columns):
        label = column.name or f"column {i + 1}"
        answer = column.channel or SKIP
        choices.append(Question(label, (*CHANNELS, SKIP), answer, newest(stream, i)))
    return _with_units(choices, [_unit_question(stream, one) for one in _UNIT_HINTS])


def _with_units(columns: Sequence[Question], units: Sequence[Question]) -> list[Question]:
    """The questions; a unit is needed if a column is of its quantity."""
    there = {quantity_of(one.answer) for one in columns}
    asked = zip(_UNIT_HINTS, units, strict=True)
    return [*columns, *(replace(one, needed=quantity in there) for quantity, one in asked)]


def newest(stream: StreamStatus, place: int) -> str:
    """The number of a column in the newest line; "" while no lines arrive."""
    if interrupted(stream):
        return ""
    value = stream.values[place] if place < len(stream.values) else float("nan")
    return f"now {fixed(value, 3 if abs(value) < _LARGE else 0)}"


def _unit_question(stream: StreamStatus, quantity: str) -> Question:
    known = tuple(UNIT_FACTORS[quantity]) + ((COUNT,) if quantity != "time" else ())
    found = (one.unit for one in stream.columns if quantity_of(one.channel) == quantity)
    answer = next((unit for unit in found if unit), "s" if quantity == "time" else "")
    return Question(f"{quantity} unit", known, answer, _UNIT_HINTS[quantity])
