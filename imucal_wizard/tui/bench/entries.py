"""One row per thing that may be missing: parts of the base, effects, a disturbed hold."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imucal_wizard.bench.session import Bench, Findings
from imucal_wizard.bench.suspects import Suspect
from imucal_wizard.effects.effect import Effect
from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.extended.fit import fit_with

NOTHING = "nothing is missing"
"""What one may guess, too."""


@dataclass(frozen=True, eq=False)
class Entry:
    """What may be missing, and what adding it would do.

    Attributes:
        term: name of the effect, of a part of the base, or ``disturbed``.
        effect: the effect; None for a part of the base and a disturbed hold.
        suspect: what the bench found of it; None for a part of the base and what cannot be tested.
        rms_fitted: error with it, or None.
        rms_held_out: error with it on what the fit has not seen, or None.
        lacking: what the data lack to show it; "" where nothing is lacking.
    """

    term: str
    effect: Effect | None = None
    suspect: Suspect | None = None
    rms_fitted: float | None = None
    rms_held_out: float | None = None
    lacking: str = ""

    @property
    def addable(self) -> bool:
        """Whether it can be added to the model."""
        return not self.lacking and self.term not in ("disturbed", NOTHING)

    @property
    def largest(self) -> int:
        """Place of the parameter that stands out most from its standard error."""
        if self.suspect is None or self.suspect.trial is None:
            return 0
        return largest(self.suspect.trial.size, self.suspect.trial.standard_error)


def largest(sizes: FloatArray, errors: FloatArray) -> int:
    """Place of the size that stands out most from its standard error, shapes (p,)."""
    safe = np.where(errors > 0.0, errors, np.inf)
    certain = np.nan_to_num(np.abs(sizes) / safe)
    return int(np.argmax(certain if certain.any() else np.abs(sizes)))


def entries_of(bench: Bench, findings: Findings) -> tuple[Entry, ...]:
    """Parts of the base that are left out, the suspects by rank, what cannot be tested."""
    known = {effect.name: effect for effect in bench.catalogue}
    made = [_base_entry(bench, term) for term in bench.whole if term not in bench.fit.base]
    made += [_entry(suspect, known) for suspect in findings.suspects]
    tested = {suspect.term for suspect in findings.suspects} | set(bench.fit.model)
    made += [_untested(bench, effect) for effect in bench.catalogue if effect.name not in tested]
    return tuple(made)


def by_name(entries: Sequence[Entry]) -> tuple[Entry, ...]:
    """In an order that tells nothing, and that nothing may be missing."""
    return (*sorted(entries, key=lambda entry: entry.term), Entry(NOTHING))


def _entry(suspect: Suspect, known: dict[str, Effect]) -> Entry:
    trial = suspect.trial
    if trial is None:
        return Entry(suspect.term, known.get(suspect.term), suspect)
    return Entry(suspect.term, known[suspect.term], suspect, trial.rms_fitted, trial.rms_held_out)


def _base_entry(bench: Bench, term: str) -> Entry:
    """A part of the base is tried for good: there is no question what it is."""
    base = tuple(part for part in bench.whole if part in (*bench.fit.base, term))
    try:
        tried = fit_with(bench.measured, bench.fit.terms, base)
    except DataError as error:
        return Entry(term, lacking=str(error))
    return Entry(term, rms_fitted=tried.rms_fitted, rms_held_out=tried.rms_held_out)


def _untested(bench: Bench, effect: Effect) -> Entry:
    lacking = bench.lacking(effect) or "these data do not show it"
    return Entry(effect.name, effect, lacking=lacking)
