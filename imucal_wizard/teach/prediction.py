"""A prediction of what the model lacks, judged by the evidence of the bench."""

from collections.abc import Sequence
from enum import StrEnum

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.quantities import quantity
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.bench import MIN_FALL_TEXT, NOTHING_MISSING, Entry, entries_of, falls
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.report.bench_text import suspect_name, suspect_size
from imucal_wizard.teach.guess import split_guess

ANY = "cannot say"
FALLS, STAYS = "falls", "does not fall"


class Agreement(StrEnum):
    """Whether an answer agrees with the data."""

    RIGHT = "✓"
    ALIKE = "≈"
    """These data cannot separate it from the right answer."""
    WRONG = "✗"


@dataclass(frozen=True)
class Prediction:
    """An answer that was committed to before the evidence was shown.

    Attributes:
        term: the effect.
        parameter: its largest parameter, or ``cannot say``.
        sign: ``+`` or ``−``, or ``cannot say``.
        held_out: whether adding the effect lowers the held-out error; "" if not asked.
    """

    term: str
    parameter: str = ANY
    sign: str = ANY
    held_out: str = FALLS


@dataclass(frozen=True)
class JudgedAnswer:
    """One part of a prediction beside the evidence.

    Attributes:
        agreement: of both.
        predicted: the answer.
        found: the evidence.
    """

    agreement: Agreement
    predicted: str
    found: str

    @property
    def text(self) -> str:
        """One line of text."""
        return f"{self.agreement} {f'you: {self.predicted}':<28} {self.found}"


def parse_prediction(text: str) -> tuple[str, Prediction]:
    """Read ``[SENSOR/]TERM[:PARAMETER[:SIGN]]``; returns the sensor and the prediction.

    Raises:
        UsageError: the text has another form.
    """
    sensor, term, parameter, sign = split_guess(text)
    return sensor, Prediction(term, parameter or ANY, sign or ANY, "")


def likeliest(diagnosis: Diagnosis, entries: Sequence[Entry]) -> Entry:
    """The likeliest entry; "nothing is missing" if the model is complete."""
    return Entry(NOTHING_MISSING) if diagnosis.settled or not entries else entries[0]


def judge_prediction(
    diagnosis: Diagnosis, prediction: Prediction, entries: Sequence[Entry] | None = None
) -> tuple[JudgedAnswer, ...]:
    """Compare a prediction with the evidence, the effect first.

    Args:
        diagnosis: of a sensor with a bench.
        prediction: what was committed to.
        entries: of the bench, if they are known already.

    Raises:
        UsageError: the sensor has no effect of this name.
    """
    bench, findings = diagnosis.bench, diagnosis.findings
    if bench is None or findings is None:
        raise UsageError(f"the {diagnosis.sensor} has no evidence to judge a guess by")
    entries = entries_of(bench, findings) if entries is None else entries
    best = likeliest(diagnosis, entries)
    known = (Entry(NOTHING_MISSING), *entries, *map(Entry, bench.fit.model))
    guessed = next((one for one in known if one.term == prediction.term), None)
    if guessed is None:
        there = ", ".join(one.term for one in entries)
        raise UsageError(f"there is no {prediction.term} to guess; choose one of {there}")
    alike = {term for members in findings.opinion.terms for term in members}
    alike |= set() if best.suspect is None else set(best.suspect.like)
    agreement = Agreement.ALIKE if guessed.term in alike else Agreement.WRONG
    agreement = Agreement.RIGHT if guessed.term == best.term else agreement
    judged = [JudgedAnswer(agreement, guessed.term, f"the data: {suspect_name(best)}")]

    def judge(answer: str, right: str, found: str) -> None:
        agreement = Agreement.RIGHT if answer == right else Agreement.WRONG
        judged.append(JudgedAnswer(agreement, answer, found))

    suspect = guessed.suspect
    names = () if suspect is None or suspect.candidate is None else suspect.candidate.names
    if names and prediction.parameter not in (ANY, *names):
        raise UsageError(
            f"{guessed.term} has no parameter {prediction.parameter!r}; it has {', '.join(names)}"
        )
    missing = best.term != NOTHING_MISSING
    if missing and names and suspect is not None and suspect.trial is not None:
        name = names[suspect.largest]
        if prediction.parameter != ANY:
            judge(prediction.parameter, name, f"the data: {name} stands out")
        if prediction.sign != ANY:
            positive = suspect.trial.size[suspect.largest] > 0
            judge(
                prediction.sign,
                "+" if positive else "−",
                f"the data: {suspect_size(guessed, bench.sensor)}",
            )
    now, then, unit = findings.fit.rms_held_out, guessed.rms_held_out, bench.fit.unit
    if prediction.held_out and now is not None and then is not None:
        found, fall = f"with it: {quantity(now, unit)} → {quantity(then, unit)}", falls(now, then)
        found += "" if fall or then >= now else f", no more than {MIN_FALL_TEXT}"
        judge(f"it {prediction.held_out}", f"it {FALLS if fall else STAYS}", found)
    return tuple(judged)
