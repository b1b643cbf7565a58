"""Predict, then look: the guess is committed to before the answer is shown."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen

from imucal_wizard.tui.bench.entries import NOTHING, Entry
from imucal_wizard.tui.bench.guess import (
    ANY,
    FALLS,
    STAYS,
    Guess,
    best_of,
    parameters_of,
    reveal_rows,
)
from imucal_wizard.tui.bench.sight import Sight
from imucal_wizard.tui.text import line, wrapped
from imucal_wizard.tui.widgets.choices import Choice, Choices
from imucal_wizard.tui.widgets.lines import Lines


class GuessScreen(ModalScreen[str | None]):
    """Asks for axis, sign and what will happen; then judges.

    Its result is the term to add, ``""`` to add nothing, None when no guess was made.

    Args:
        sight: what is on the bench.
        entry: the suspect guessed.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "leave", "back"),
        Binding("enter", "add(True)", "add my guess"),
        Binding("d", "add(False)", "add what the data say"),
        Binding("q", "app.leave", "quit"),
    ]

    def __init__(self, sight: Sight, entry: Entry) -> None:
        super().__init__()
        self._sight = sight
        self._entry = entry
        self._guess: Guess | None = None

    def compose(self) -> ComposeResult:
        """The questions, then the answers in the same place."""
        with Vertical(classes="box guess") as box:
            box.border_title = f"predict: {self._entry.term}"
            yield Lines(id="asked")
            yield Choices(id="guess")
            yield Lines(id="told")

    def on_mount(self) -> None:
        """Ask."""
        words = "Commit before you look. ↑↓ question, ←→ answer, enter commits, esc goes back."
        self.query_one("#asked", Lines).show([*wrapped(words, 70, "quiet"), line("")])
        when = "on poses not seen, when it is added"
        questions = [Choice("will the error", (FALLS, STAYS), FALLS, when)]
        if self._entry.term == NOTHING:
            questions = [Choice("sure?", ("yes", "no"), "yes")]
        if self._entry.effect is not None:
            names = parameters_of(self._sight, self._entry)
            questions.insert(0, Choice("largest on", names, ANY))
            questions.insert(1, Choice("its sign", ("+", "−", ANY), ANY))
        choices = self.query_one("#guess", Choices)
        choices.ask(questions)
        choices.focus()

    def on_choices_done(self) -> None:
        """The guess is made: show what the data say."""
        answers = {c.label: c.answer for c in self.query_one("#guess", Choices).choices}
        self._guess = Guess(
            self._entry.term,
            answers.get("largest on", ANY),
            answers.get("its sign", ANY),
            answers.get("will the error", FALLS),
        )
        self.query_one("#guess", Choices).display = False
        rows = reveal_rows(self._sight, self._guess, 70)
        best = best_of(self._sight)
        keys = [("enter", f"adds {self._entry.term}")] if self._entry.addable else []
        if best.term != self._entry.term and best.addable:
            keys.append(("d", f"adds what the data say, {best.term}"))
        rows += [
            ((f"{key:<6}", "key"), (told, "")) for key, told in (*keys, ("esc", "adds nothing"))
        ]
        self.query_one("#asked", Lines).show([line("Your guess, and what the data say:", "strong")])
        self.query_one("#told", Lines).show([line(""), *rows])
        self.set_focus(None)

    def action_add(self, mine: bool) -> None:
        """Add the guess, or what the data say."""
        entry = self._entry if mine else best_of(self._sight)
        if self._guess is not None and entry.addable:
            self.dismiss(entry.term)

    def action_leave(self) -> None:
        """Without adding anything."""
        self.dismiss(None if self._guess is None else "")
