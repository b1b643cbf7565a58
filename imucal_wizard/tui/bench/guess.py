"""Predict, then look: a guess that is committed to, and what the data say of it."""

from dataclasses import dataclass

from imucal_wizard.bench.verdict import Verdict
from imucal_wizard.tui.bench.entries import NOTHING, Entry
from imucal_wizard.tui.bench.sight import Sight
from imucal_wizard.tui.bench.suspect_rows import size_text, title_of
from imucal_wizard.tui.report_rows import shown
from imucal_wizard.tui.text import Line, line, wrapped

_WHY = {
    "✓": "That is what the data say.",
    "≈": "Yours looks nearly the same in these data, so this counts as right.",
    "✗": "Look at both lessons (l): where do their pictures differ?",
}
FALLS, STAYS = "falls", "does not fall"
ANY = "cannot say"


@dataclass(frozen=True)
class Guess:
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


def parameters_of(sight: Sight, entry: Entry) -> tuple[str, ...]:
    """The parameters one may choose from."""
    if entry.effect is None:
        return (ANY,)
    return (*(one.name for one in entry.effect.parameters(sight.sensor)), ANY)


def entry_of(sight: Sight, term: str) -> Entry:
    """The entry of a term; one that says nothing for what is no suspect."""
    return next((entry for entry in sight.entries if entry.term == term), Entry(term))


def reveal_rows(sight: Sight, guess: Guess, width: int) -> list[Line]:
    """The guess beside what the data say, line by line with ✓ and ✗."""
    guessed, best = entry_of(sight, guess.term), best_of(sight)
    sign = _sign(sight, guessed, best)
    rows = [
        _judged(sign, f"you: {guess.term}", f"the data: {title_of(best)}"),
        *wrapped(f"  {_WHY[sign]}", width, "quiet", indent="  "),
    ]
    trial = None if guessed.suspect is None else guessed.suspect.trial
    candidate = None if guessed.suspect is None else guessed.suspect.candidate
    if trial is not None and candidate is not None:
        k = guessed.largest
        name, pole = candidate.names[k], "+" if trial.size[k] > 0 else "−"
        if guess.parameter != ANY:
            rows.append(_judged(_mark(guess.parameter == name), f"you: {guess.parameter}",
                                f"the data: {name} stands out"))  # fmt: skip
        if guess.sign != ANY:
            rows.append(_judged(_mark(guess.sign == pole), f"you: {guess.sign}",
                                f"the data: {size_text(guessed)}"))  # fmt: skip
    now, then = sight.fit.rms_held_out, guessed.rms_held_out
    if now is not None and then is not None:
        falls = FALLS if then < now else STAYS
        unit = sight.fit.fit.unit
        told = f"predicted: {shown(now, unit)} → {shown(then, unit)}"
        rows.append(_judged(_mark(guess.held_out == falls), f"you: it {guess.held_out}", told))
    rows.append(line(""))
    if guessed.lacking:
        rows += wrapped(f"{guess.term} cannot be seen here: {guessed.lacking}.", width, "warn")
    return rows


def best_of(sight: Sight) -> Entry:
    """What the data say: the likeliest suspect, or that nothing is missing."""
    complete = sight.said.verdict is Verdict.COMPLETE and not sight.missing_base
    return Entry(NOTHING) if complete or not sight.entries else sight.entries[0]


def _sign(sight: Sight, guessed: Entry, best: Entry) -> str:
    """``✓`` the likeliest, ``≈`` one that these data cannot tell from it, ``✗`` another."""
    if guessed.term == best.term:
        return "✓"
    named = {term for members in sight.findings.opinion.terms for term in members}
    like = () if best.suspect is None else best.suspect.like
    return "≈" if guessed.term in {*named, *like} else "✗"


def _judged(sign: str, yours: str, theirs: str) -> Line:
    style = {"✓": "good", "≈": "accent"}.get(sign, "warn")
    return ((f"{sign} ", style), (f"{yours:<28} ", "strong"), (theirs, ""))


def _mark(right: bool) -> str:
    return "✓" if right else "✗"
