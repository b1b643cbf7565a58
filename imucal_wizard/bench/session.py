"""The bench: one sensor's data, a stack of terms, and the questions that can be asked of them."""

from collections.abc import Sequence
from dataclasses import dataclass

from imucal_wizard.bench.evidence import make_jury
from imucal_wizard.bench.floors import Rounding
from imucal_wizard.bench.from_fit import misfit_of
from imucal_wizard.bench.ladder import Rung, confirmed, rung
from imucal_wizard.bench.misfit import Misfit
from imucal_wizard.bench.settling import settled
from imucal_wizard.bench.suspects import Suspect, rank
from imucal_wizard.bench.verdict import Opinion, judge
from imucal_wizard.bench.wandering import with_wander
from imucal_wizard.effects.catalogue import effects_for
from imucal_wizard.effects.effect import Effect
from imucal_wizard.errors import DataError, UsageError
from imucal_wizard.solver.extended.fit import Measured, fit_with, whole_base
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.solver.extended.terms import Term
from imucal_wizard.solver.extended.turn_data import TurnData


@dataclass(frozen=True, eq=False)
class Findings:
    """What the bench says of the present model.

    Attributes:
        fit: the present fit.
        misfit: what it leaves.
        suspects: every effect against that, the likeliest first.
        opinion: what the evidence carries.
    """

    fit: Extended
    misfit: Misfit
    suspects: tuple[Suspect, ...]
    opinion: Opinion


class Bench:
    """Models of one sensor, from one measurement.

    Args:
        sensor: ``accelerometer``, ``gyroscope`` or ``magnetometer``.
        measured: everything known of it.
        base: terms of the base model; any of them may be left out to climb the whole ladder; all
            of them when not given.
        own: effects of the user's own.
        rounding: of the readings, where they are known.

    Raises:
        DataError: the data do not carry the base model.
    """

    def __init__(
        self,
        sensor: str,
        measured: Measured,
        base: Sequence[str] | None = None,
        own: Sequence[Effect] = (),
        rounding: Rounding | None = None,
    ) -> None:
        self.sensor = sensor
        self.measured = measured
        self.whole = whole_base(measured)
        known = measured.circumstances
        self.catalogue = tuple(one.suited(known) for one in effects_for(sensor, own))
        self.rounding = rounding
        self._fits: list[Extended] = [fit_with(measured, (), base)]
        self.ladder: list[Rung] = [rung(self._fits[0], rounding=rounding)]
        self._findings: Findings | None = None

    @property
    def fit(self) -> Extended:
        """The present fit."""
        return self._fits[-1]

    def look(self) -> Findings:
        """Suspects and verdict for the present model; computed once per model."""
        if self._findings is None:
            missing = [effect for effect in self.catalogue if effect.name not in self.fit.model]
            shown = [effect for effect in missing if self.lacking(effect) is None]
            misfit = misfit_of(self.fit.linear, self.sensor, self.measured.circumstances, shown)
            jury = make_jury(misfit)
            weighed = jury.weigh(misfit.residual)
            suspects = rank(misfit, jury, weighed)
            p = min((suspect.p for suspect in suspects), default=1.0)
            opinion = judge(misfit, jury, weighed, p)
            self._findings = Findings(self.fit, misfit, suspects, opinion)
        return self._findings

    def lacking(self, effect: Effect) -> str | None:
        """What these data lack to show an effect at all; None where nothing is lacking."""
        measured = self.measured
        rows = measured.everything() if isinstance(measured, TurnData) else measured.circumstances
        return effect.lacking(self.sensor, rows)

    def offer(self, effect: Effect) -> None:
        """Let an effect of the user's own be a suspect, too."""
        self.catalogue = (*self.catalogue, effect)
        self._findings = None

    def add(self, name: str, variant: float | None = None, near: float | None = None) -> Rung:
        """Add an effect to the model, or put back a part of the base.

        Args:
            name: of the effect or the part of the base.
            variant: its setting; None for the one that the data settle on.
            near: of the settings tried, the one to settle near; None for the likeliest.

        Raises:
            UsageError: there is no such effect, or it is in the model already.
            DataError: the data do not carry it.
        """
        if name in self.fit.model:
            raise UsageError(f"{name} is in the model already")
        if name in self.whole:
            base = tuple(term for term in self.whole if term in (*self.fit.base, name))
            return self._climb(fit_with(self.measured, self.fit.terms, base), name)
        effect = next((one for one in self.catalogue if one.name == name), None)
        if effect is None:
            known = ", ".join(one.name for one in self.catalogue)
            raise UsageError(f"the {self.sensor} has no effect {name!r}; choose one of {known}")
        lacking = self.lacking(effect)
        if lacking is not None:
            raise DataError(f"{name} cannot be added: {lacking}")
        return self._climb(self._with(effect, variant, near), name)

    def remove(self, name: str) -> Rung:
        """Take a term out of the model, an effect or a part of the base.

        Raises:
            UsageError: it is not in the model.
        """
        if name not in self.fit.model:
            raise UsageError(f"{name} is not in the model: {', '.join(self.fit.model)}")
        terms = tuple(term for term in self.fit.terms if term.name != name)
        base = tuple(term for term in self.fit.base if term != name)
        return self._climb(fit_with(self.measured, terms, base), None)

    def retrace(self, before: "Bench") -> None:
        """Climb the same ladder as another bench has, on the data of this one.

        Effects that these data cannot show are left out, and rungs that they do not carry.
        """
        for effect in before.catalogue:
            if all(effect.name != one.name for one in self.catalogue):
                self.offer(effect)
        for fit, rung_before in zip(before._fits[1:], before.ladder[1:], strict=True):
            terms = tuple(term for term in fit.terms if self.lacking(term.effect) is None)
            if (*fit.base, *(term.name for term in terms)) == self.fit.model:
                continue
            try:
                again = fit_with(self.measured, terms, fit.base)
            except DataError:
                continue
            self._climb(again, rung_before.added)

    def undo(self) -> bool:
        """Go back to the model before; False at the first one."""
        if len(self._fits) == 1:
            return False
        self._fits.pop()
        self.ladder.pop()
        self._findings = None
        return True

    def confirmed(self, steps: int = 1) -> bool:
        """Whether data held out agree that the newest rung is better than the one ``steps`` below.

        The effects of one explanation are judged together: each alone may well make things worse.
        """
        if len(self.ladder) <= steps:
            return False
        kinds = {effect.name: effect.kind for effect in self.catalogue}
        added = [one.added for one in self.ladder[-steps:] if one.added is not None]
        of_time = any(kinds.get(name) == "time" for name in added)
        return confirmed(self.ladder[-1 - steps], self.ladder[-1], of_time)

    def likeliest_variant(self, name: str) -> float | None:
        """The likeliest setting of an effect for what the present model leaves."""
        candidates = (suspect.candidate for suspect in self.look().suspects if suspect.term == name)
        return next((c.variant for c in candidates if c is not None), None)

    def _with(self, effect: Effect, variant: float | None, near: float | None) -> Extended:
        """The fit with one more effect; a setting that was not given is settled by the data."""

        def fit(term: Term) -> Extended:
            return fit_with(self.measured, (*self.fit.terms, term), self.fit.base)

        settings = effect.variants(self.measured.circumstances)
        if variant is not None or settings == (None,):
            return fit(Term(effect, variant))
        begin = self.likeliest_variant(effect.name) if near is None else near
        return settled(fit, Term(effect, begin), settings)

    def _climb(self, fit: Extended, added: str | None) -> Rung:
        left = misfit_of(fit.linear, self.sensor, self.measured.circumstances, ())
        fit = with_wander(fit, left)
        self._fits.append(fit)
        self.ladder.append(rung(fit, added, self.rounding))
        self._findings = None
        return self.ladder[-1]
