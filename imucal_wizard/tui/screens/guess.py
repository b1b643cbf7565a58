"""Predict, then look: the guess is committed to before the answer is shown."""

from dataclasses import dataclass
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen

from imucal_wizard.core.quantities import quantity
from imucal_wizard.diagnose.bench import NOTHING, Entry
from imucal_wizard.tui.bench.panels import size_text, title_of
from imucal_wizard.tui.bench.snapshot import BenchSnapshot
from imucal_wizard.tui.text import Line, line, wrapped
from imucal_wizard.tui.widgets.lines import Lines
from imucal_wizard.tui.widgets.questions import Question, QuestionList

_WHY = {
    "✓": "That is what the data say.",
    "≈": "Yours looks nearly the same in these data, so this counts as right.",
    "✗": "Look at both lessons (l): where do their pictures differ?",
}
FALLS, STAYS = "falls", "does not fall"
ANY = "cannot say"


@dataclass(frozen=True)
class Prediction:
    """What somebody committed to.

    Attributes:
        term: which effect.
        parameter: which of its parameters is the largest, or ``cannot say``.
        sign: ``+`` or ``−``, or ``cannot say``.
        held_out: whether the held-out error falls when it is added.
    """

    term: str
    parameter: str = ANY
    sign: str = ANY
    held_out: str = FALLS


class GuessScreen(ModalScreen[str | None]):
    """Asks for axis, sign and what will happen; then judges.

    Its result is the term to add, ``""`` to add nothing, None when no guess was made.

    Args:
        snapshot: what is on the bench.
        entry: the suspect guessed.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "leave", "back", tooltip="goes back, adds nothing"),
        Binding("enter", "add(True)", "add my guess", key_display="enter"),
        Binding("d", "add(False)", "add what the data say"),
        Binding("q", "app.quit", "quit", tooltip="leaves the program"),
    ]

    def __init__(self, snapshot: BenchSnapshot, entry: Entry) -> None:
        super().__init__()
        self._snapshot = snapshot
        self._entry = entry
        self._guess: Prediction | None = None

    def compose(self) -> ComposeResult:
        """The questions, then the answers in the same place."""
        with Vertical(classes="box guess") as box:
            box.border_title = f"predict: {self._entry.term}"
            yield Lines(id="asked")
            yield QuestionList(id="guess")
            yield Lines(id="told")

    def on_mount(self) -> None:
        """Ask."""
        words = "Commit before you look. ↑↓ question, ←→ answer, enter commits, esc goes back."
        self.query_one("#asked", Lines).show([*wrapped(words, 70, "quiet"), line("")])
        when = "on poses not seen, when it is added"
        questions = [Question("will the error", (FALLS, STAYS), FALLS, when)]
        if self._entry.term == NOTHING:
            questions = [Question("sure?", ("yes", "no"), "yes")]
        if self._entry.effect is not None:
            names = parameters_of(self._snapshot, self._entry)
            questions.insert(0, Question("largest on", names, ANY))
            questions.insert(1, Question("its sign", ("+", "−", ANY), ANY))
        choices = self.query_one("#guess", QuestionList)
        choices.ask(questions)
        choices.focus()

    def on_question_list_done(self) -> None:
        """The guess is made: show what the data say."""
        answers = {c.label: c.answer for c in self.query_one("#guess", QuestionList).choices}
        self._guess = Prediction(
            self._entry.term,
            answers.get("largest on", ANY),
            answers.get("its sign", ANY),
            answers.get("will the error", FALLS),
        )
        self.query_one("#guess", QuestionList).display = False
        rows = reveal_rows(self._snapshot, self._guess, 70)
        best = best_of(self._snapshot)
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
        entry = self._entry if mine else best_of(self._snapshot)
        if self._guess is not None and entry.addable:
            self.dismiss(entry.term)

    def action_leave(self) -> None:
        """Without adding anything."""
        self.dismiss(None if self._guess is None else "")


def parameters_of(snapshot: BenchSnapshot, entry: Entry) -> tuple[str, ...]:
    """The parameters one may choose from."""
    if entry.effect is None:
        return (ANY,)
    return (*(one.name for one in entry.effect.parameters(snapshot.sensor)), ANY)


def entry_of(snapshot: BenchSnapshot, term: str) -> Entry:
    """The entry of a term; one that says nothing for what is no suspect."""
    return next((entry for entry in snapshot.entries if entry.term == term), Entry(term))


def reveal_rows(snapshot: BenchSnapshot, guess: Prediction, width: int) -> list[Line]:
    """The guess beside what the data say, line by line with ✓ and ✗."""
    guessed, best = entry_of(snapshot, guess.term), best_of(snapshot)
    sign = _sign(snapshot, guessed, best)
    rows = [
        _judged(sign, f"you: {guess.term}", f"the data: {title_of(best)}"),
        *wrapped(f"  {_WHY[sign]}", width, "quiet", indent="  "),
    ]
    trial = None if guessed.suspect is None else guessed.suspect.trial
    candidate = None if guessed.suspect is None else guessed.suspect.candidate
    if trial is not None and candidate is not None:
        k = 0 if guessed.suspect is None else guessed.suspect.largest
        name, pole = candidate.names[k], "+" if trial.size[k] > 0 else "−"
        if guess.parameter != ANY:
            rows.append(_judged(_mark(guess.parameter == name), f"you: {guess.parameter}",
                                f"the data: {name} stands out"))  # fmt: skip
        if guess.sign != ANY:
            rows.append(_judged(_mark(guess.sign == pole), f"you: {guess.sign}",
                                f"the data: {size_text(guessed)}"))  # fmt: skip
    now, then = snapshot.fit.rms_held_out, guessed.rms_held_out
    if now is not None and then is not None:
        falls = STAYS if guessed.rises else FALLS
        unit = snapshot.fit.unit
        told = f"predicted: {quantity(now, unit)} → {quantity(then, unit)}"
        rows.append(_judged(_mark(guess.held_out == falls), f"you: it {guess.held_out}", told))
    rows.append(line(""))
    if guessed.lacking:
        rows += wrapped(f"{guess.term} cannot be seen here: {guessed.lacking}.", width, "warn")
    return rows


def best_of(snapshot: BenchSnapshot) -> Entry:
    """What the data say: the likeliest suspect, or that nothing is missing."""
    complete = snapshot.diagnosis.settled
    return Entry(NOTHING) if complete or not snapshot.entries else snapshot.entries[0]


def _sign(snapshot: BenchSnapshot, guessed: Entry, best: Entry) -> str:
    """``✓`` the likeliest, ``≈`` one that these data cannot tell from it, ``✗`` another."""
    if guessed.term == best.term:
        return "✓"
    named = {term for members in snapshot.findings.opinion.terms for term in members}
    like = () if best.suspect is None else best.suspect.like
    return "≈" if guessed.term in {*named, *like} else "✗"


def _judged(sign: str, yours: str, theirs: str) -> Line:
    style = {"✓": "good", "≈": "accent"}.get(sign, "warn")
    return ((f"{sign} ", style), (f"{yours:<28} ", "strong"), (theirs, ""))


def _mark(right: bool) -> str:
    return "✓" if right else "✗"
