"""The bench: one sensor's data, a stack of terms, and the questions that can be asked of them.

The ladder lists the models tried so far with their errors. A term is confirmed only if data that
the fit has not seen agree: other directions or rotations for an effect of orientation, the later
part of the session for an effect of time.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from copy import copy
from dataclasses import replace
from functools import cached_property, partial

from imucal_wizard.core.errors import DataError, UsageError
from imucal_wizard.core.readings import distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.could_be import HiddenEffect, could_be, most_hidden
from imucal_wizard.diagnose.floors import Floors, Rounding, floors_of
from imucal_wizard.diagnose.free_curves import offered_curves, try_curves
from imucal_wizard.diagnose.hypotheses import DISTURBED
from imucal_wizard.diagnose.posterior import HypothesisSet, Posterior, explained
from imucal_wizard.diagnose.profile_likelihood import (
    most_likely_moment,
    most_likely_setting,
    unlikeliness,
)
from imucal_wizard.diagnose.random_walk import with_random_walk
from imucal_wizard.diagnose.referee import Hearing, Referee, Testimony
from imucal_wizard.diagnose.residuals import (
    Candidate,
    WhitenedResiduals,
    whitened_residuals,
    whitened_rows,
)
from imucal_wizard.diagnose.suspects import MAX_LINEAR, MIN_ODDS_SETTLED, Suspect, rank
from imucal_wizard.diagnose.unknown_structure import CHANGING_AXES, USUAL_MISFIT
from imucal_wizard.diagnose.verdict import Opinion, Terms, Verdict, judge_misfit, unconfirmed
from imucal_wizard.estimate.experiment import Experiment
from imucal_wizard.estimate.fit import (
    VALLEY,
    Minimum,
    fit,
    refined_minimum,
    report,
    residual_table,
    with_effects,
)
from imucal_wizard.estimate.lack_of_fit import MAX_REPEATABILITY
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.catalogue import effects_for, free_curves_for
from imucal_wizard.model.effect import Effect
from imucal_wizard.model.rows.table import ResidualTable
from imucal_wizard.model.terms import Term
from imucal_wizard.model.terms import Terms as Effects
from imucal_wizard.model.unknown_shape import UnknownShape

MAX_REFITS = 3
"""Explanations tried as the point at which a misfit is made linear."""
MAX_HELD_OUT_OF_CURVE = 2.0
"""Error held out, in units of the noise, above which a free curve of the model is only a guess
between the poses, because it can follow any data. A choice: larger, and such a guess completes a
model; smaller, and a right curve is refused where few poses are left out."""


@dataclass(frozen=True)
class Rung:
    """One model and its errors, in the sensor's unit.

    Attributes:
        model: names of its terms, base first.
        added: the term that was added to the model below it, or None.
        rms_fitted: error on the data fitted.
        rms_held_out: error on directions or rotations left out; None where none can be.
        held_out_in_noise: the same of all rows that judge a model, each in units of its noise.
        rms_late: error of the later part of the session under a fit of the earlier one, or None.
        late_in_noise: the same of all rows that judge a model, each in units of its noise.
        late_by_noise: whether it is no larger than measured noise makes it.
        floor: rms held out that measured noise alone would make of a complete model; None where
            nothing can be left out.
        floor_fitted: the same of the fitted rms.
        floors: what noise within holds, rounding and repeats make of one row.
        confirmed: whether data held out agree that the added term is real; None where nothing was
            added or nothing can be held out.
    """

    model: tuple[str, ...]
    added: str | None
    rms_fitted: float
    rms_held_out: float | None
    held_out_in_noise: float | None
    rms_late: float | None
    late_in_noise: float | None
    late_by_noise: bool
    floor: float | None
    floor_fitted: float | None
    floors: Floors
    confirmed: bool | None = None


def rung(extended: SensorFit, added: str | None = None, rounding: Rounding | None = None) -> Rung:
    """The rung of a fit.

    Args:
        extended: the fit.
        added: what was added to the model below it.
        rounding: of its readings, where they are known.
    """
    return Rung(
        model=extended.model,
        added=added,
        rms_fitted=extended.rms_fitted,
        rms_held_out=extended.rms_held_out,
        held_out_in_noise=extended.held_out_in_noise,
        rms_late=extended.rms_late,
        late_in_noise=extended.late_in_noise,
        late_by_noise=extended.late_by_noise,
        floor=extended.floor,
        floor_fitted=extended.floor_fitted,
        floors=floors_of(extended, rounding),
    )


def confirmed(below: Rung, above: Rung, of_time: bool) -> bool:
    """Whether data held out agree that the upper rung is better.

    Args:
        below: the model without the effect.
        above: the model with it.
        of_time: the effect follows time or temperature, so that early data must predict late ones:
            better than without the effect, or as well as the noise permits; false of a step.
    """
    predicts = [falls(below.held_out_in_noise, above.held_out_in_noise)]
    if of_time:
        late = falls(below.late_in_noise, above.late_in_noise)
        predicts.append(late if late is None else late or above.late_by_noise)
    known = [one for one in predicts if one is not None]
    return bool(known) and all(known)


LOWER = 0.97
"""An error held out is called lower from this share of the one before on. A choice: nearer to 1,
effects are confirmed that lower it by chance; further from 1, weak effects are refused."""
MIN_FALL_TEXT = f"{100.0 * (1.0 - LOWER):.0f} %"
"""The same in words: how far an error must fall."""


def falls(before: float | None, after: float | None) -> bool | None:
    """Whether an error becomes clearly smaller; None where one of the two is not known."""
    return None if before is None or after is None else after < LOWER * before


@dataclass(frozen=True, eq=False)
class BenchFindings:
    """What the bench says of the present model.

    Attributes:
        fit: the present fit.
        misfit: what it leaves.
        suspects: every effect against that, the likeliest first.
        opinion: what the evidence carries.
        hypotheses: everything that may explain the misfit.
        posterior: their probabilities.
        together: the fit with all effects that are named, where there are several: each alone takes
            up some of the others. None where one or none is named.
    """

    fit: SensorFit
    misfit: WhitenedResiduals
    suspects: tuple[Suspect, ...]
    opinion: Opinion
    hypotheses: HypothesisSet
    posterior: Posterior
    together: SensorFit | None = None

    @property
    def axes_change(self) -> float:
        """Probability that the axes or scales change in the session in a way without a name."""
        pairs = zip(self.hypotheses.single, self.posterior.single.tolist(), strict=True)
        return float(sum(share for one, share in pairs if one.parameter == CHANGING_AXES))

    @cached_property
    def could_be(self) -> float | None:
        """See ``could_be.could_be``; None where nothing shows the noise."""
        if self.fit.met_exactly:
            return None
        return could_be(self.fit, self.misfit, self.hypotheses, self.posterior)

    @cached_property
    def most_hidden(self) -> HiddenEffect | None:
        """See ``could_be.most_hidden``; None where it makes less than the error could be."""
        one = most_hidden(self.fit, self.misfit, self.hypotheses, self.posterior)
        return one if one and self.could_be is not None and one.error > self.could_be else None

    @cached_property
    def rejected_by_reference(self) -> bool:
        """Whether only rows that rest on the accelerometer's model speak against this one."""
        rows = self.misfit.table.needs_reference
        if self.opinion.verdict is Verdict.COMPLETE or not rows.any():
            return False
        others = self.misfit.without(rows)
        return judge_misfit(others, *explained(others)).verdict is Verdict.COMPLETE

    @property
    def p(self) -> float:
        """Chance that noise alone makes any suspect look as good as the likeliest one here."""
        return self.suspects[0].p if self.suspects else 1.0


@dataclass(frozen=True)
class Found:
    """A term that was added because the evidence carries it and data held out confirm it.

    Attributes:
        term: its name.
        reason: why it was added, in words.
        decided_by: the data that decided it.
        like: other effects that explain these data as well.
    """

    term: str
    reason: str
    decided_by: str
    like: Terms = ()


@dataclass(frozen=True)
class ModelChange:
    """A change of a model, by the names of its terms.

    Attributes:
        added: the term that was added, or None.
        base: the base terms since then.
        terms: the effects since then, each with its setting.
    """

    added: str | None
    base: tuple[str, ...]
    terms: tuple[tuple[str, float | None], ...]


class Bench:
    """Models of one sensor, from one measurement.

    Args:
        sensor: ``accelerometer``, ``gyroscope`` or ``magnetometer``.
        measured: everything known of it.
        base: terms of the base model; any of them may be left out to climb the whole ladder; all
            of them when not given.
        own: effects of the user's own.
        rounding: of the readings, where they are known.
        first: the fit without effects, where it is known.

    Raises:
        DataError: the data do not determine the base model.
    """

    def __init__(
        self,
        sensor: str,
        measured: Experiment,
        base: Sequence[str] | None = None,
        own: Sequence[Effect] = (),
        rounding: Rounding | None = None,
        first: SensorFit | None = None,
    ) -> None:
        self.sensor = sensor
        self.measured = measured
        self.whole = measured.base_terms
        known = measured.circumstances
        self.catalogue = tuple(one.suited(known) for one in effects_for(sensor, own))
        self.curves = tuple(one.suited(known) for one in free_curves_for(sensor))
        self.rounding, self._own = rounding, {one.name for one in own}
        self._fits: list[SensorFit] = [fit(measured, (), base) if first is None else first]
        self.ladder: list[Rung] = [rung(self._fits[0], rounding=rounding)]
        self._findings: BenchFindings | None = None
        self._found: list[Found] = []
        self._refused: dict[str, str] = {}
        self._opinions: dict[frozenset[str], Opinion] = {}
        self.referee: Callable[[], Referee | None] | None = None

    def copied(self) -> "Bench":
        """Another bench with the same model, on which something can be tried.

        Both keep why an effect cannot be fitted, and what was thought of each model.
        """
        other = copy(self)
        other._fits, other.ladder = [*self._fits], [*self.ladder]
        other._found = [*self._found]
        return other

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The catalogue, and the free curves."""
        return (*self.catalogue, *self.curves)

    @property
    def found(self) -> tuple[Found, ...]:
        """Terms of the present model that were added by the evidence, in order."""
        return tuple(one for one in self._found if one.term in self.fit.model)

    @property
    def refused(self) -> tuple[str, ...]:
        """Why terms that were to be added are not in the model, in words."""
        return tuple(why for name, why in self._refused.items() if name not in self.fit.model)

    def keep(self, found: Sequence[Found]) -> None:
        """Keep why the newest terms were added."""
        self._found += found

    @property
    def fit(self) -> SensorFit:
        """The present fit."""
        return self._fits[-1]

    def fit_of(self, model: Sequence[str]) -> SensorFit | None:
        """The fit of a rung by its terms in any order; None where no rung has them."""
        return next((one for one in self._fits if {*one.model} == {*model}), None)

    @property
    def rows(self) -> ResidualTable:
        """The residual table of the present fit."""
        assert self.fit.rows is not None, "a bench's fit has rows"  # noqa: S101 (narrows the type)
        return self.fit.rows

    @property
    def undetermined(self) -> str:
        """Why the data do not determine the base model that was asked for; "" when they do."""
        return self.measured.directions(self.fit.base).reason or self.fit.not_held_out

    def look(self) -> BenchFindings:
        """Suspects and verdict for the present model; computed once per model."""
        if self._findings is None:
            known = self.fit.model
            missing = [
                one for one in self.catalogue if one.name not in known and not self.allows_for(one)
            ]
            shown = [effect for effect in missing if self.lacking(effect) is None]
            misfit = whitened_residuals(self.fit, shown)
            hypotheses, posterior = explained(misfit)
            suspects = rank(misfit, hypotheses, posterior)
            settled = _with_setting(misfit, suspects)
            if settled is not misfit:
                misfit = settled
                hypotheses, posterior = explained(misfit)
                suspects = rank(misfit, hypotheses, posterior)
            hearing = None if self.referee is None else partial(self._hearing, suspects, {})
            lack = misfit.lack_of_fit()
            opinion = judge_misfit(misfit, hypotheses, posterior, hearing, lack)
            # one effect that leaves only noise cannot have given a name to its own square; of a
            # misfit far above the noise, what it leaves is small, but far above the noise as well
            noise_is_left = opinion.one_effect and lack.ratio <= USUAL_MISFIT
            if lack.ratio > MAX_LINEAR and not noise_is_left:
                judged = self._at_the_likeliest(misfit, hypotheses, posterior, shown)
                opinion = judge_misfit(*judged, hearing, lack)
            suspects = _with_splits(suspects, opinion.heard)
            opinion = self._if_between_poses(self._if_confirmed(opinion, suspects))
            self._findings = self.with_curves(
                BenchFindings(self.fit, misfit, suspects, opinion, hypotheses, posterior)
            )
            self._opinions[frozenset(self.fit.model)] = self._findings.opinion
        return self._findings

    def opinion_without(self, name: str) -> Opinion | None:
        """What is thought of the model without one of its terms; None where it cannot be fitted."""
        model = frozenset(self.fit.model) - {name}
        if model not in self._opinions:
            without = self.copied()
            with suppress(DataError):
                without.remove(name)
                without.look()
        return self._opinions.get(model)

    def _at_the_likeliest(
        self,
        misfit: WhitenedResiduals,
        hypotheses: HypothesisSet,
        posterior: Posterior,
        shown: Sequence[Effect],
    ) -> tuple[WhitenedResiduals, HypothesisSet, Posterior]:
        """The misfit made linear where the likeliest explanation by effects puts the parameters.

        The slopes of the present fit are those of a model without the effects. An effect many times
        larger than the noise leaves its square there, which would be given a name of its own.
        The move is kept only if it makes the data more likely. Otherwise structure without a name
        is the likelier cause: its patterns are linear here, and no longer at the parameters of the
        effect.
        """
        tried: list[Terms] = []
        while misfit.lack_of_fit().ratio > MAX_LINEAR and len(tried) < MAX_REFITS:
            found = hypotheses.likeliest_effects(posterior)
            names = tuple(term for term, _ in found)
            if not names or names in tried:
                break
            tried.append(names)
            known = {one.name: one for one in shown}
            terms = [Term(known[name], variant) for name, variant in found]
            try:
                # what is left of the way is linear
                there = refined_minimum(
                    self.measured, (*self.fit.terms, *terms), self.fit.base, VALLEY
                )
            except DataError:
                break
            moved = whitened_rows(there, residual_table(there), shown, names)
            # squares that the linear model neglects look like noise: they only add to it
            wander = hypotheses.frame.largest_wander(posterior.noise)
            judged = explained(moved, wander)
            if judged[1].log_evidence < posterior.log_evidence:
                break
            misfit, (hypotheses, posterior) = moved, judged
        return misfit, hypotheses, posterior

    def with_curves(self, found: BenchFindings) -> BenchFindings:
        """The findings with the free curves that explain what no effect does, first of all."""
        nameless = found.opinion.verdict in (Verdict.UNEXPLAINED, Verdict.NOT_REPEATABLE)
        if not nameless or self.fit.base != self.whole or self.undetermined:
            return found
        offered = offered_curves(
            self.fit, found.misfit, found.hypotheses, found.posterior, self._shown_curves()
        )
        others = tuple(one for one in found.suspects if one not in offered)
        return replace(found, suspects=(*offered, *others))

    def _shown_curves(self) -> list[UnknownShape]:
        """The free curves that are not in the model and that these data may show."""
        missing = [one for one in self.curves if one.name not in self.fit.model]
        return [one for one in missing if self.lacking(one) is None]

    def _if_between_poses(self, opinion: Opinion) -> Opinion:
        """The opinion; a free curve that misses the poses left out does not complete a model."""
        held_out, floor = self.fit.rms_held_out, self.fit.floor
        free = any(term.effect.free for term in self.fit.terms)
        if not free or held_out is None or floor is None or opinion.verdict is not Verdict.COMPLETE:
            return opinion
        guessed = held_out > MAX_HELD_OUT_OF_CURVE * floor
        return replace(opinion, verdict=Verdict.UNEXPLAINED) if guessed else opinion

    def heard_of_each(self) -> Hearing | None:
        """What the gyroscope says of each effect that may be missing, alone; None without one."""
        suspects = self.look().suspects
        each = tuple((one.term,) for one in suspects if one.candidate is not None)
        return self._hearing(suspects, {}, each) if each else None

    def _hearing(
        self,
        suspects: tuple[Suspect, ...],
        said: dict[Terms, Testimony | None],
        explanations: tuple[Terms, ...],
    ) -> Hearing | None:
        """What the gyroscope says of explanations, each added to the model.

        Args:
            suspects: the effects with their settings.
            said: what it has said already.
            explanations: of which it is asked.
        """
        referee = None if self.referee is None else self.referee()
        if referee is None:
            return None
        known = {one.term: one.candidate for one in suspects if one.candidate is not None}
        for names in explanations:
            if names not in said:
                added = [known[one] for one in names if one in known]
                whole = len(added) == len(names)
                said[names] = self._said(referee, added) if whole else None
        heard = {names: one for names in explanations if (one := said[names]) is not None}
        return Hearing(self._now(referee), heard) if heard else None

    def _now(self, referee: Referee) -> Testimony:
        """What the gyroscope says of the present model, as of all others: by its own rows alone."""
        found = self.fit.minimum
        if found is None or not len(found.system.away):
            return referee.now
        return referee.hear(refined_minimum(self.measured, self.fit.terms, self.fit.base))

    def _said(self, referee: Referee, added: Sequence[Candidate]) -> Testimony | None:
        """What the gyroscope says of the model with these effects; None where nothing."""
        # a reference that stays wrong with the right effect speaks against it
        if any(one.effect.hides for one in added):
            return None
        terms = [Term(one.effect, one.variant) for one in added]
        try:
            found = self._with_terms(terms, referee)
        except DataError:
            return None
        return referee.hear(found)

    def plainest(self, families: Sequence[Terms]) -> Terms:
        """The plainest member of each family, by the order of the catalogue."""
        order = [effect.name for effect in self.catalogue]
        return tuple(min(members, key=order.index) for members in families)

    def _if_confirmed(self, opinion: Opinion, suspects: tuple[Suspect, ...]) -> Opinion:
        """The opinion; what is named alone is only probable where data held out are against it.

        Not even that if it leaves much of their error, or adding it brings no clear size. What
        takes up the residuals and leaves far more than noise of those held out has the place of
        something else.
        """
        now, chosen = self.fit.rms_held_out, self.plainest(opinion.terms)
        likely = chosen or opinion.probable[:1]
        if now is None or len(likely) != 1:
            return opinion
        trial = next((one.trial for one in suspects if one.term == likely[0]), None)
        then = None if trial is None else trial.rms_held_out
        if trial is None or then is None:
            return opinion
        not_predicted = share_not_predicted(now, then, self.fit.floor)
        if not trial.clear or not_predicted > MAX_SHARE_NOT_PREDICTED:
            opinion = replace(opinion, probable=())
        below, above = self.fit.held_out_in_noise, trial.held_out_in_noise
        unchanged = below is None or above is None or above >= MIN_SHARE_UNCHANGED * below
        fitted = self.fit.rms_fitted, trial.rms_fitted, self.fit.floor_fitted
        against = share_not_predicted(*fitted) <= MAX_SHARE_NOT_PREDICTED < not_predicted
        # of a weak effect noise makes as much of what was held out
        against &= above is not None and above > MAX_REPEATABILITY
        return unconfirmed(opinion) if chosen and (unchanged or against) else opinion

    def lacking(self, effect: Effect) -> str | None:
        """What these data lack to show an effect at all; None where nothing is lacking."""
        lacking = effect.lacking(self.sensor, self.measured.everything())
        if lacking is None and effect.name in self._own:
            settings = effect.variants(self.measured.circumstances)
            try:  # a formula may have no value where the present fit puts the input
                self.rows.design_columns([Term(effect, one) for one in settings])
            except DataError as error:
                return str(error)
        return lacking

    def allows_for(self, effect: Effect) -> bool:
        """Whether every fit of these rows has the parameters of this effect."""
        names = Effects(self.sensor, (Term(effect),)).names
        return effect.name not in self.fit.model and set(names) <= set(self.rows.names)

    def offer(self, effect: Effect) -> None:
        """Let an effect of the user's own be a suspect, too."""
        self.catalogue = (*self.catalogue, effect.suited(self.measured.circumstances))
        self._own.add(effect.name)
        self._findings, self._opinions = None, {}

    def add(self, name: str, variant: float | None = None, near: float | None = None) -> Rung:
        """Add an effect to the model, or put back a part of the base.

        Args:
            name: of the effect or the part of the base.
            variant: its setting; None for the one that the data settle on.
            near: of the settings tried, the one to settle near; None for the likeliest.

        Raises:
            UsageError: there is no such effect, or it is in the model already.
            DataError: the data do not determine it.
        """
        if name in self.fit.model:
            raise UsageError(f"{name} is in the model already")
        effect = next((one for one in self.effects if one.name == name), None)
        if effect is None and name not in self.whole:
            known = ", ".join(one.name for one in self.catalogue)
            raise UsageError(f"the {self.sensor} has no effect {name!r}; choose one of {known}")
        lacking = None if effect is None else self.lacking(effect)
        if lacking is not None:
            raise DataError(f"{name} cannot be added: {lacking}")
        try:
            if effect is not None:
                return self._climb(self._with(effect, variant, near), name)
            base = tuple(term for term in self.whole if term in (*self.fit.base, name))
            return self._climb(fit(self.measured, self.fit.terms, base), name)
        except DataError as error:
            self._refused[name] = str(error)
            raise

    def remove(self, name: str) -> Rung:
        """Take a term out of the model, an effect or a part of the base.

        Raises:
            UsageError: it is not in the model, or no fit of these rows has found it.
        """
        if name not in self.fit.model:
            raise UsageError(f"{name} is not in the model: {', '.join(self.fit.model)}")
        if name not in (*self.fit.base, *(term.name for term in self.fit.terms)):
            raise UsageError(f"{name} is found beside the model and cannot be taken out of it")
        terms = tuple(term for term in self.fit.terms if term.name != name)
        base = tuple(term for term in self.fit.base if term != name)
        return self._climb(fit(self.measured, terms, base), None)

    @property
    def changes(self) -> tuple[ModelChange, ...]:
        """The changes that led to the present model."""
        return tuple(
            ModelChange(
                above.added, one.base, tuple((term.name, term.variant) for term in one.terms)
            )
            for above, one in zip(self.ladder[1:], self._fits[1:], strict=True)
        )

    def retrace(self, changes: Sequence[ModelChange], own: Sequence[Effect] = ()) -> None:
        """Change the model as another bench was changed, on the data of this one.

        Effects that these data cannot show, and models that they do not determine, are left out;
        ``refused`` says why.

        Args:
            changes: those of the other bench.
            own: effects that it offered; those that are known here are left out.
        """
        for effect in own:
            if all(effect.name != one.name for one in self.effects):
                self.offer(effect)
        lacking = {one.name: self.lacking(one) for one in self.effects}
        known = {one.name: one for one in self.effects if lacking[one.name] is None}
        for change in changes:
            added = change.added or ""
            why = lacking.get(added)
            if why is not None:
                self._refused[added] = f"{added} cannot be added: {why}"
            terms = [Term(known[name], variant) for name, variant in change.terms if name in known]
            if (*change.base, *(term.name for term in terms)) == self.fit.model:
                continue
            try:
                again = fit(self.measured, terms, change.base)
            except DataError as error:
                if added:
                    self._refused[added] = str(error)
                continue
            self._climb(again, change.added)

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
        # a free curve says nothing of times that were not measured, and no data foresee a step
        slow = {one.name for one in self.catalogue if one.kind == "time" and not one.sudden}
        of_time = any(one.added in slow for one in self.ladder[-steps:])
        return confirmed(self.ladder[-1 - steps], self.ladder[-1], of_time)

    def likeliest_variant(self, name: str) -> float | None:
        """The likeliest setting of an effect for what the present model leaves."""
        found = self.look()
        suspects = [one for one in found.suspects if one.term == name]
        curves = [one for one in self._shown_curves() if one.name == name and not suspects]
        if curves:
            suspects += try_curves(self.fit, found.misfit, found.hypotheses, curves).suspects
        candidates = (one.candidate for one in suspects)
        return next((c.variant for c in candidates if c is not None), None)

    def _with(self, effect: Effect, variant: float | None, near: float | None) -> SensorFit:
        """The fit with one more effect; a setting that was not given is settled by the data."""

        def with_term(term: Term) -> Minimum[Experiment]:
            return refined_minimum(self.measured, (*self.fit.terms, term), self.fit.base)

        settings = effect.variants(self.measured.circumstances)
        if variant is not None or settings == (None,):
            return report(with_term(Term(effect, variant)))
        begin = self.likeliest_variant(effect.name) if near is None else near
        if effect.sudden:
            referee = None if self.referee is None else self.referee()
            return report(self._with_terms((Term(effect, begin),), referee))
        return most_likely_setting(with_term, Term(effect, begin), settings)

    def _with_terms(self, added: Sequence[Term], referee: Referee | None) -> Minimum[Experiment]:
        """The fit with more effects; a step takes place at its likeliest moment beside the others.

        That is settled by the rows, and by those of the gyroscope that rest on them.

        Args:
            added: the effects.
            referee: the gyroscope, where it may judge.
        """
        step = next((one for one in added if one.effect.sudden and one.variant is not None), None)
        others = [one for one in added if one is not step]

        def with_step(*at: Term) -> Minimum[Experiment]:
            return refined_minimum(self.measured, (*self.fit.terms, *others, *at), self.fit.base)

        if step is None:
            return with_step()
        where = self.measured.circumstances
        moments = [one for one in step.effect.variants(where) if one is not None]

        def unlikely(found: Minimum[Experiment]) -> float:
            return 0.0 if referee is None else -2.0 * referee.log_evidence(found)

        looked = moments[0] if step.variant is None else step.variant
        begin = min(moments, key=lambda at: abs(at - looked))
        if others:  # beside which it was not looked for
            begin = min(
                moments, key=lambda at: self._unlikely([*others, replace(step, variant=at)])
            )
        times = distinct(where.time).tolist()
        begun = replace(step, variant=begin)
        return most_likely_moment(
            with_step, begun, moments, times, None if referee is None else unlikely
        )

    def _unlikely(self, added: Sequence[Term]) -> float:
        """See ``unlikeliness``, with more effects by one step from the present fit."""
        found = self.fit.minimum
        assert found is not None, "a bench's fit has a minimum"  # noqa: S101 (narrows the type)
        columns = found.independent.rows(self.rows.design_columns(added))
        return unlikeliness(with_effects(found, added, columns))

    def _split(self, found: SensorFit) -> SensorFit:
        """The fit with what the gyroscope shows of what its own rows leave open of its effects."""
        reference, minimum = found.reference, found.minimum
        if reference is None or not reference.decided or self.referee is None or minimum is None:
            return found
        referee = self.referee()
        split = None if referee is None else referee.hear(minimum).split
        if split is None:
            return found
        return report(refined_minimum(self.measured, found.terms, found.base, split=split))

    def _climb(self, found: SensorFit, added: str | None) -> Rung:
        found = self._split(found)
        left = whitened_residuals(found, ())
        wider = with_random_walk(found, left)
        self._fits.append(wider)
        self.ladder.append(rung(wider, added, self.rounding))
        self._refused.pop(added or "", None)
        if added is not None and wider.rms_held_out is not None:
            self.ladder[-1] = replace(self.ladder[-1], confirmed=self.confirmed())
        self._findings = None
        return self.ladder[-1]


def _with_setting(misfit: WhitenedResiduals, suspects: tuple[Suspect, ...]) -> WhitenedResiduals:
    """The misfit with the setting that the likeliest suspect settles on among the candidates.

    What lies between two settings tried would look like another effect beside it.
    """
    first = suspects[0] if suspects else None
    if first is None or first.likeliest is None:
        return misfit
    if not (first.likeliest.effect.graded or first.likeliest.effect.sudden):
        return misfit
    if first.log_odds < MIN_ODDS_SETTLED or first.candidate is None:
        return misfit
    tried = {one.variant for one in misfit.candidates if one.term == first.term}
    if first.candidate.variant in tried:
        return misfit
    return replace(misfit, candidates=(*misfit.candidates, first.candidate))


def _with_splits(suspects: tuple[Suspect, ...], heard: Hearing | None) -> tuple[Suspect, ...]:
    """The suspects with what the gyroscope has said of how their sums are split."""
    said = {} if heard is None else heard.with_terms
    return tuple(
        one if (own := said.get((one.term,))) is None else replace(one, split=own.split)
        for one in suspects
    )


NOTHING_MISSING = "nothing is missing"
"""What one may guess, too."""
MAX_SHARE_NOT_PREDICTED = 0.25
"""Share of the squares held out, beyond those of noise, that a probable effect, a curve with a
shape or an effect that fits may leave: what predicts less may have any other cause. A choice, half
of the error: larger, and effects are called probable that predict little; smaller, and few are."""


def share_not_predicted(now: float, then: float, floor: float | None) -> float:
    """Share of the squares held out, beyond those of noise, that a term leaves.

    Args:
        now: error held out without it.
        then: with it.
        floor: by noise alone, where it is known.
    """
    noise = (floor or 0.0) ** 2
    left = max(then**2 - noise, 0.0)
    return left / max(now**2 - noise, left) if left else 0.0


MIN_SHARE_UNCHANGED = 0.999
"""Of the present error held out; above it, adding a term has changed nothing."""


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
        now: the present error on what the fit has not seen, or None.
        closures: the gyroscope's error held out against gravity without it and with it, rad; None
            where the gyroscope was not asked.
    """

    term: str
    effect: Effect | None = None
    suspect: Suspect | None = None
    rms_fitted: float | None = None
    rms_held_out: float | None = None
    lacking: str = ""
    now: float | None = None
    closures: tuple[float, float] | None = None

    @property
    def falls(self) -> bool:
        """Whether the error held out would be clearly lower."""
        return falls(self.now, self.rms_held_out) is True

    @property
    def rises(self) -> bool:
        """Whether the error held out would be higher."""
        known = self.rms_held_out is not None and self.now is not None
        return known and (self.rms_held_out or 0.0) > (self.now or 0.0)

    @property
    def addable(self) -> bool:
        """Whether it can be added to the model."""
        return not self.lacking and self.term not in (DISTURBED, NOTHING_MISSING)


def entries_of(bench: Bench, findings: BenchFindings) -> tuple[Entry, ...]:
    """Parts of the base that are left out, the suspects by rank, what cannot be tested."""
    known = {effect.name: effect for effect in bench.effects}
    present = findings.fit
    now = present.rms_held_out
    made = [_base_entry(bench, present, one) for one in bench.whole if one not in present.base]
    made += [
        Entry(
            one.term,
            known.get(one.term),
            one,
            None if one.trial is None else one.trial.rms_fitted,
            None if one.trial is None else one.trial.rms_held_out,
            now=now,
            closures=findings.opinion.closures((one.term,)),
        )
        for one in findings.suspects
    ]
    tested = {suspect.term for suspect in findings.suspects} | set(present.model)
    for effect in bench.catalogue:
        if effect.name not in tested:
            lacking = bench.lacking(effect)
            if bench.allows_for(effect):
                lacking = "every fit of these data allows for it"
            lacking = lacking or "these data do not show it"
            made.append(Entry(effect.name, effect, lacking=lacking, now=now))
    return tuple(made)


def _base_entry(bench: Bench, present: SensorFit, term: str) -> Entry:
    """A part of the base is fitted to see what it does: there is no question what it is."""
    base = tuple(part for part in bench.whole if part in (*present.base, term))
    now = present.rms_held_out
    try:
        tried = fit(bench.measured, present.terms, base)
    except DataError as error:
        return Entry(term, lacking=str(error), now=now)
    return Entry(term, rms_fitted=tried.rms_fitted, rms_held_out=tried.rms_held_out, now=now)
