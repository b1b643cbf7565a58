"""Which column is what, in which unit: for streams that do not say it."""

from collections.abc import Callable
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen

from imucal_wizard.acquire.decode.base import Column
from imucal_wizard.acquire.setup import AUTO, StreamSetup
from imucal_wizard.core.quantities import fixed, unit_sign
from imucal_wizard.core.units import ACCELERATION, COUNT, CURRENT, FIELD, RATE, THROTTLE, TIME
from imucal_wizard.run.snapshot import StreamStatus
from imucal_wizard.tui.text import line, wrapped
from imucal_wizard.tui.widgets.footer import KeyFooter
from imucal_wizard.tui.widgets.lines import Lines
from imucal_wizard.tui.widgets.questions import Question, QuestionList

SKIP = "not used"
_LOOK = 0.2
"""Seconds between two looks whether the stream has answered by itself."""
CHANNELS = (
    "t", "ax", "ay", "az", "gx", "gy", "gz", "mx", "my", "mz", "temp", "current", "throttle",
    "counter",
)  # fmt: skip
_ASKED = "agmt"
"""First letters of the channels whose unit is asked for."""
_UNITS: dict[str, tuple[str, ...]] = {
    "a": (*ACCELERATION, COUNT),
    "g": (*RATE, COUNT),
    "m": (*FIELD, COUNT),
    "t": tuple(TIME),
}
_LABELS = {
    "a": "acceleration unit",
    "g": "rate unit",
    "m": "field unit",
    "t": "time unit",
}
_HINTS = {
    "a": "at rest 9.81 m/s², 1 g or 1000 mg",
    "g": "see the sketch or data sheet",
    "m": "the Earth's is 22 to 67 µT",
    "t": "",
}
_USUAL = {"current": next(iter(CURRENT)), "throttle": next(iter(THROTTLE))}
"""Unit of a column that stands beside the sensors and does not say it."""
_LARGE = 1000.0
"""Numbers from here on are shown without decimals."""


class ColumnsScreen(ModalScreen[StreamSetup | None]):
    """Questions about columns and units; the result is the setup to read the stream with.

    Args:
        newest: gives the newest state of the stream.
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

    def compose(self) -> ComposeResult:
        """The newest line, the questions, what is still wrong."""
        with VerticalScroll(classes="box page-box") as box:
            box.border_title = "which column is what?"
            yield Lines(id="raw")
            yield QuestionList(id="columns")
            yield Lines(id="wrong")
        yield KeyFooter()

    def on_mount(self) -> None:
        """Ask, beginning with what is not known."""
        self._show(self._stream.line)
        choices = questions(self._stream)
        unknown = [i for i, choice in enumerate(choices) if choice.answer not in choice.options]
        place = self.query_one(QuestionList)
        first = unknown[0] if unknown and "columns" not in self._stream.needs else 0
        place.ask(choices, first)
        place.focus()
        self.set_interval(_LOOK, self._look)

    def _look(self) -> None:
        """Show what arrives: turning the device tells which column is which.

        Go away when the stream has said by itself what was asked: its header has come.
        """
        stream = self._newest()
        if self._stream.needs and self.is_current and stream.samples and not stream.needs:
            self.dismiss(None)
        elif len(stream.columns) == len(self._stream.columns):
            self._show(stream.line)
            notes = [newest(stream, place) for place in range(len(stream.columns))]
            self.query_one(QuestionList).note(notes)

    def _show(self, text: str) -> None:
        self.query_one("#raw", Lines).draw(
            lambda width, _: [
                *wrapped(f"newest line: {text}"[: 2 * width], width, "quiet"), line(""),
            ]
        )  # fmt: skip

    @on(QuestionList.Done)
    def _use(self) -> None:
        choices = self.query_one(QuestionList).choices
        wrong = complaint(self._stream, choices)
        if wrong:
            self.query_one("#wrong", Lines).draw(
                lambda width, _: [line(""), *wrapped(f"▲ {wrong}", width, "bad")]
            )
        else:
            self.dismiss(setup_from(self._stream, choices))


def questions(stream: StreamStatus) -> list[Question]:
    """One question per column, then one per unit."""
    choices = []
    for i, column in enumerate(stream.columns):
        label = column.name or f"column {i + 1}"
        answer = column.channel or SKIP
        choices.append(Question(label, (*CHANNELS, SKIP), answer, newest(stream, i)))
    return choices + [_unit_question(stream, letter) for letter in _ASKED]


def newest(stream: StreamStatus, place: int) -> str:
    """What stands in a column of the newest line."""
    value = stream.values[place] if place < len(stream.values) else float("nan")
    return f"now {fixed(value, 3 if abs(value) < _LARGE else 0)}"


def _unit_question(stream: StreamStatus, letter: str) -> Question:
    found = [column.unit for column in stream.columns if _letter(column.channel) == letter]
    answer = next((unit for unit in found if unit), "")
    if letter == "t" and not answer:
        answer = "s"
    return Question(_LABELS[letter], _UNITS[letter], answer, unit_sign(_HINTS[letter]))


def complaint(stream: StreamStatus, choices: list[Question]) -> str:
    """What is still missing or given twice, in words; "" when all is well."""
    channels = [choice.answer for choice in choices[: len(stream.columns)]]
    used = [channel for channel in channels if channel in CHANNELS]
    twice = sorted({channel for channel in used if used.count(channel) > 1})
    if twice:
        return f"{', '.join(twice)} is given twice; a channel has one column"
    missing = [channel for channel in ("ax", "ay", "az") if channel not in used]
    if missing:
        return f"the accelerometer lacks {', '.join(missing)}: say which column that is"
    for sensor, axes in (("gyroscope", ("gx", "gy", "gz")), ("magnetometer", ("mx", "my", "mz"))):
        if 0 < sum(channel in used for channel in axes) < len(axes):
            return f"the {sensor} needs all of {', '.join(axes)}, or none"
    for letter, choice in zip(_ASKED, choices[len(stream.columns) :], strict=True):
        needed = any(_letter(channel) == letter for channel in used)
        if needed and choice.answer not in choice.options:
            return f"choose the {choice.label}"
    return ""


def setup_from(stream: StreamStatus, choices: list[Question]) -> StreamSetup:
    """The setup that says what was answered."""
    n = len(stream.columns)
    units = {letter: choice.answer for letter, choice in zip(_ASKED, choices[n:], strict=True)}
    columns = []
    for column, choice in zip(stream.columns, choices[:n], strict=True):
        channel = choice.answer if choice.answer in CHANNELS else ""
        kept = column.unit if channel == column.channel else ""
        unit = units.get(_letter(channel), kept or _USUAL.get(channel, ""))
        columns.append(Column(channel, unit if channel else "", column.name))
    used = {_letter(column.channel) for column in columns}
    return StreamSetup(
        format=stream.format or AUTO,
        columns=tuple(columns),
        accelerometer_unit=units["a"] if "a" in used else "",
        gyroscope_unit=units["g"] if "g" in used else "",
        magnetometer_unit=units["m"] if "m" in used else "",
    )


def _letter(channel: str) -> str:
    """Which question about a unit a channel is answered by; "" for none."""
    return channel[:1] if channel == "t" or channel[1:] in ("x", "y", "z") else ""
