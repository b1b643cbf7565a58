"""A list of questions, each with a few answers to choose from."""

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

from textual.binding import Binding, BindingType
from textual.message import Message

from imucal_wizard.core.records import dataclass
from imucal_wizard.tui.text import Line
from imucal_wizard.tui.widgets.lines import Lines


@dataclass(frozen=True)
class Question:
    """One question.

    Attributes:
        label: the question.
        options: the possible answers.
        answer: the present answer; unanswered if it is not among the options.
        note: a hint.
        needed: whether an answer is needed.
    """

    label: str
    options: tuple[str, ...]
    answer: str = ""
    note: str = ""
    needed: bool = True

    @property
    def open(self) -> bool:
        """Whether an answer is needed and missing."""
        return self.needed and self.answer not in self.options

    def turned(self, by: int) -> "Question":
        """The question with the next or previous answer."""
        here = (
            self.options.index(self.answer) if self.answer in self.options else -1 if by > 0 else 0
        )
        return replace(self, answer=self.options[(here + by) % len(self.options)])


class QuestionList(Lines):
    """Up and down select the question, left and right the answer."""

    can_focus = True
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "move(-1)", "question", key_display="↑↓", tooltip="another question"),
        Binding("down", "move(1)", show=False),
        Binding("left", "turn(-1)", "answer", key_display="←→", tooltip="another answer"),
        Binding("right,space", "turn(1)", show=False),
        Binding("enter", "done", "use", key_display="enter", tooltip="uses the answers"),
    ]

    class Done(Message):
        """The answers are to be used."""

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002 (Textual's own name for it)
        super().__init__(id=id)
        self.choices: list[Question] = []
        self._here = 0

    def ask(self, choices: Sequence[Question], here: int = 0) -> None:
        """Ask these questions, beginning at one of them."""
        self.choices = list(choices)
        self._here = here
        self._draw()

    def change(self, choices: Sequence[Question]) -> None:
        """Show these questions in place of the present ones, which are as many."""
        self.choices = list(choices)
        self._draw()

    def action_move(self, by: int) -> None:
        """Select another question."""
        self._here = (self._here + by) % max(1, len(self.choices))
        self._draw()

    def action_turn(self, by: int) -> None:
        """Select another answer."""
        self.choices[self._here] = self.choices[self._here].turned(by)
        self._draw()

    def action_done(self) -> None:
        """Use the answers."""
        self.post_message(self.Done())

    def _draw(self) -> None:
        self.show([_row(choice, i == self._here) for i, choice in enumerate(self.choices)])


def _row(choice: Question, here: bool) -> Line:
    none = "▲ choose" if choice.open else "–"
    answer = choice.answer if choice.answer in choice.options else none
    style = "accent" if here else "warn" if choice.open else "strong"
    return (
        ("▸ " if here else "  ", "accent"),
        (f"{choice.label:<20.20} ", "strong" if here else ""),
        ("◂ " if here else "  ", "accent"),
        (f"{answer:^12}", style),
        (" ▸  " if here else "    ", "accent"),
        (choice.note, "quiet"),
    )
