"""A prediction, which is committed to before the answer is shown."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen

from imucal_wizard.diagnose.bench import NOTHING_MISSING, Entry
from imucal_wizard.teach.prediction import (
    ANY,
    FALLS,
    STAYS,
    Agreement,
    Prediction,
    judge_prediction,
    likeliest,
)
from imucal_wizard.tui.bench.snapshot import BenchSnapshot
from imucal_wizard.tui.text import Line, line, wrapped
from imucal_wizard.tui.widgets.footer import KeyFooter
from imucal_wizard.tui.widgets.lines import Lines
from imucal_wizard.tui.widgets.questions import Question, QuestionList

_WHY = {
    Agreement.RIGHT: "The data agree.",
    Agreement.ALIKE: "Its pattern here is nearly that of the likeliest effect: it counts as right.",
    Agreement.WRONG: "Compare both lessons (l): where do their plots differ?",
}
_STYLES = {Agreement.RIGHT: "good", Agreement.ALIKE: "accent", Agreement.WRONG: "warn"}


_HELD_OUT = "held-out error"


class GuessScreen(ModalScreen[str | None]):
    """Asks for the axis, the sign and the effect on the held-out error; then compares.

    Its result is the term to add, ``""`` to add nothing, None without a guess.

    Args:
        snapshot: of the bench.
        entry: the guessed suspect.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "leave", "back", tooltip="goes back, adds nothing"),
        Binding("enter", "add(True)", "add my guess", key_display="enter"),
        Binding("d", "add(False)", "add the likeliest suspect"),
        Binding("q", "app.quit", "quit", tooltip="leaves the program"),
    ]

    def __init__(self, snapshot: BenchSnapshot, entry: Entry) -> None:
        super().__init__()
        self._snapshot = snapshot
        self._entry = entry
        self._guess: Prediction | None = None

    def compose(self) -> ComposeResult:
        """The questions, and later the answers in their place."""
        with Vertical(classes="box guess") as box:
            box.border_title = f"predict: {self._entry.term}"
            yield Lines(id="asked")
            yield QuestionList(id="guess")
            yield Lines(id="answers")
        yield KeyFooter()

    def on_mount(self) -> None:
        """Ask the questions."""
        words = "Commit before you see the evidence."
        self.query_one("#asked", Lines).show([*wrapped(words, 70, "quiet"), line("")])
        questions = [Question(_HELD_OUT, (FALLS, STAYS), FALLS, "when it is added")]
        if self._entry.term == NOTHING_MISSING:
            questions = [Question("sure?", ("yes", "no"), "yes")]
        if self._entry.effect is not None:
            names = parameters_of(self._snapshot, self._entry)
            questions.insert(0, Question("largest on", names, ANY))
            questions.insert(1, Question("its sign", ("+", "−", ANY), ANY))
        choices = self.query_one("#guess", QuestionList)
        choices.ask(questions)
        choices.focus()

    def on_question_list_done(self) -> None:
        """Show the evidence after the guess."""
        answers = {c.label: c.answer for c in self.query_one("#guess", QuestionList).choices}
        self._guess = Prediction(
            self._entry.term,
            answers.get("largest on", ANY),
            answers.get("its sign", ANY),
            answers.get(_HELD_OUT, FALLS),
        )
        self.query_one("#guess", QuestionList).display = False
        rows = reveal_rows(self._snapshot, self._guess, 70)
        self.query_one("#asked", Lines).show([line("Your guess, and what the data say:", "strong")])
        self.query_one("#answers", Lines).show([line(""), *rows])
        self.set_focus(None)
        self.refresh_bindings()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Enable adding after the guess, for a term that can be added."""
        if action != "add":
            return True
        best = likeliest(self._snapshot.diagnosis, self._snapshot.entries)
        entry = self._entry if parameters[0] else best
        other = bool(parameters[0]) or best.term != self._entry.term
        return self._guess is not None and entry.addable and other

    def action_add(self, mine: bool) -> None:
        """Add the guess, or the likeliest suspect."""
        entry = self._entry if mine else likeliest(self._snapshot.diagnosis, self._snapshot.entries)
        if self._guess is not None and entry.addable:
            self.dismiss(entry.term)

    def action_leave(self) -> None:
        """Close without adding a term."""
        self.dismiss(None if self._guess is None else "")


def parameters_of(snapshot: BenchSnapshot, entry: Entry) -> tuple[str, ...]:
    """The parameters to choose from."""
    if entry.effect is None:
        return (ANY,)
    return (*(one.name for one in entry.effect.parameters(snapshot.sensor)), ANY)


def reveal_rows(snapshot: BenchSnapshot, prediction: Prediction, width: int) -> list[Line]:
    """The prediction beside the evidence, a row for each answer."""
    judged = judge_prediction(snapshot.diagnosis, prediction, snapshot.entries)
    rows: list[Line] = []
    for one in judged:
        predicted = f"you: {one.predicted}"
        style = _STYLES[one.agreement]
        rows.append(
            ((f"{one.agreement} ", style), (f"{predicted:<28} ", "strong"), (one.found, ""))
        )
        if one is judged[0]:
            rows += wrapped(f"  {_WHY[one.agreement]}", width, "quiet", indent="  ")
    rows.append(line(""))
    lacking = next((one.lacking for one in snapshot.entries if one.term == prediction.term), "")
    if lacking:
        rows += wrapped(f"{prediction.term} cannot be seen here: {lacking}.", width, "warn")
    return rows
