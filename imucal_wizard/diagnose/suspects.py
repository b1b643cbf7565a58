"""The suspects: each effect of the catalogue, its evidence, and a trial of adding it.

What adding does is tried with the estimator itself, by one step from where the present fit has
arrived (``estimate.fit.with_effects``): the same variance components, priors and errors held out.
Of a likely effect that is too large for one step, the fit goes on to where it arrives.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.detectability import USUAL_SIZES, Detectability
from imucal_wizard.diagnose.hypotheses import DISTURBED, visible
from imucal_wizard.diagnose.posterior import HypothesisSet, Posterior
from imucal_wizard.diagnose.profile_likelihood import (
    MIN_MOMENT_DIFFERENCE,
    settle,
    unlikeliness,
)
from imucal_wizard.diagnose.residuals import Candidate, WhitenedResiduals, candidate_at
from imucal_wizard.diagnose.significance import Chances, log_odds, members
from imucal_wizard.estimate.distributions import EXACT_FREEDOM, exceeded
from imucal_wizard.estimate.experiment import Experiment
from imucal_wizard.estimate.fit import Minimum, with_split
from imucal_wizard.estimate.held_out import (
    errors_held_out,
    items_of,
    rms_fitted,
    rms_in_noise,
)
from imucal_wizard.estimate.split import Split
from imucal_wizard.model.terms import Term, Terms

MIN_SIZE_IN_ERRORS = 3.0
"""A size is named from so many standard errors on."""


FAR_SUSPECTS = 3
"""Suspects of a large misfit that are fitted to the end, which takes as long as adding each."""
MAX_LINEAR = 4.0
"""What is left, rms in units of the noise, up to which what the linear model neglects, the squares
of the errors, is below the noise."""


@dataclass(frozen=True, eq=False)
class EffectTrial:
    """Effects tried.

    Attributes:
        candidates: the effects, each with its setting.
        found: the fit with them.
        noise: covariance of the independent rows, wandering bias included, shape (n, n).
    """

    candidates: tuple[Candidate, ...]
    found: Minimum[Experiment]
    noise: FloatArray

    @property
    def _own(self) -> slice:
        """Places of the sizes of these effects among the parameters."""
        last = self.found.sizes.stop
        return slice(last - sum(len(one.names) for one in self.candidates), last)

    @property
    def size(self) -> FloatArray:
        """Of each parameter, shown unit, shape (p,)."""
        return self.found.system.value[self._own]

    @cached_property
    def covariance(self) -> FloatArray:
        """Of the sizes, shape (p, p)."""
        found, own = self.found, self._own
        pull, prior = found.pull()[own], found.balance.covariance[own]
        by_all = pull @ self.noise @ pull.T + prior @ found.balance.prior @ prior.T
        terms = [Term(one.effect, one.variant) for one in self.candidates]
        return Terms(found.experiment.sensor, terms).within_gauge(by_all)

    @property
    def standard_error(self) -> FloatArray:
        """Of each size, shape (p,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def clear(self) -> bool:
        """Whether any size stands out from its standard error, or all of them together.

        Of a sum of sizes, no part may stand out alone.
        """
        size, count = self.size, len(self.size)
        if (np.abs(size) >= MIN_SIZE_IN_ERRORS * self.standard_error).any():
            return True
        square = float(size @ np.linalg.pinv(self.covariance, hermitian=True) @ size)
        least = exceeded(MIN_SIZE_IN_ERRORS**2, 1.0, EXACT_FREEDOM)
        return exceeded(square / count, float(count), EXACT_FREEDOM) < least

    @cached_property
    def rms_fitted(self) -> float:
        """Error with them, in the sensor's error unit."""
        return rms_fitted(self.found)

    @cached_property
    def rms_held_out(self) -> float | None:
        """Error with them when each group is left out; None when a group cannot be."""
        out = self._held_out
        return None if out is None else items_of(self.found).rms(out)

    @property
    def held_out_in_noise(self) -> float | None:
        """The same of all rows that judge a model, each in units of its measured noise."""
        out = self._held_out
        return None if out is None else rms_in_noise(self.found, out)

    @cached_property
    def _held_out(self) -> FloatArray | None:
        return errors_held_out(self.found)


def try_effects(
    misfit: WhitenedResiduals, candidates: Sequence[Candidate], noise: FloatArray
) -> EffectTrial:
    """Add effects to the model that leaves a misfit; with none, the model as it is.

    Args:
        misfit: what the present model leaves.
        candidates: the effects to add together.
        noise: see ``EffectTrial``.
    """
    return EffectTrial(tuple(candidates), misfit.with_effects(candidates), noise)


MIN_CORRELATION_ALIKE = 0.9
"""Correlation of two effects' visible patterns above which they look the same here."""

MIN_ODDS_SETTLED = 5.0
"""Log odds from which on the data determine the setting of a suspect. A choice, 150 to 1: with
smaller odds the likeliest setting may be that of the noise; with larger ones the setting of a weak
effect is left at the usual one."""


@dataclass(frozen=True, eq=False)
class Suspect:
    """One effect against what is left.

    Attributes:
        term: name of the effect, or ``disturbed``.
        likeliest: of the settings tried, the one that explains most; None for a disturbed hold.
        log_odds: logarithm of its marginal likelihood against noise alone.
        misfit: what is left.
        noise: covariance of the rows, see ``EffectTrial``.
        like: terms with nearly the same pattern here; a large size may separate them all the same.
        detectability: the sizes that show in such data, and what noise alone makes of suspects.
        hold: the hold or rotation accused, see ``ResidualTable.item``, of a disturbed one.
        split: what another sensor shows of a model with it.
        far: the misfit is too large for one step, and this is one of the likeliest suspects: what
            adding it does is told where the fit arrives.
    """

    term: str
    likeliest: Candidate | None
    log_odds: float
    misfit: WhitenedResiduals
    noise: FloatArray
    like: tuple[str, ...]
    detectability: Detectability
    hold: int | None = None
    split: Split | None = None
    far: bool = False

    @cached_property
    def trial(self) -> EffectTrial | None:
        """What adding it would do, with the setting that adding it settles on.

        None for a disturbed hold.
        """
        tried = self._tried
        if tried is None or self.split is None:
            return tried
        return replace(tried, found=with_split(tried.found, self.split))

    @property
    def _tried(self) -> EffectTrial | None:
        first = self.likeliest
        if first is None:
            return None
        begin, known = first.variant, [c for c in self.misfit.candidates if c.term == self.term]
        # weak evidence does not tell the moment of a step
        moment = first.effect.sudden and self.log_odds >= MIN_ODDS_SETTLED
        if begin is None or not (first.effect.graded or moment):
            return self._with(first)
        tried: dict[float, EffectTrial] = {}
        scale, setting = (float, float) if moment else (np.log, np.exp)

        def unlikely(at: float) -> float:
            at = round(at, 3) if moment else at
            if at not in tried:
                tried[at] = self._with(candidate_at(self.misfit, first.effect, float(setting(at))))
            return unlikeliness(tried[at].found)

        grid = sorted({float(scale(one.variant)) for one in known if one.variant is not None})
        begin = float(scale(begin))
        settle(unlikely, grid, begin, *(MIN_MOMENT_DIFFERENCE,) * moment)
        return tried[min(tried, key=unlikely)]

    def _with(self, candidate: Candidate) -> EffectTrial:
        """The model with the effect at a setting: by one step, or where the fit arrives."""
        trial = try_effects(self.misfit, (candidate,), self.noise)
        if self.far:
            with suppress(DataError):  # a fit that does not converge tells nothing better
                return replace(trial, found=self.misfit.fitted_with((candidate,)))
        return trial

    @property
    def candidate(self) -> Candidate | None:
        """The effect with the setting that adding it settles on; None for a disturbed hold."""
        return None if self.trial is None else self.trial.candidates[0]

    @cached_property
    def p(self) -> float:
        """Share of simulations of noise alone in which any suspect reaches these odds."""
        return self.detectability.p(self.term, self.log_odds)

    @cached_property
    def sized(self) -> Candidate | None:
        """The setting that the sizes are for: the middle one tried, if the data determine none.

        None for a disturbed hold, and for a free curve, whose coefficients are no sizes.
        """
        if self.likeliest is not None and self.likeliest.effect.free:
            return None
        settled = self.log_odds >= MIN_ODDS_SETTLED or self.likeliest is None
        return self.candidate if settled else usual_setting(self.misfit, self.term)

    @cached_property
    def detectable(self) -> FloatArray:
        """Size of each parameter alone from which these data show a misfit, shown unit, (p,).

        Infinite where the data are blind; empty where no sizes are given.
        """
        return np.zeros(0) if self.sized is None else self.detectability.seen(self.sized)

    @cached_property
    def nameable(self) -> FloatArray:
        """The same from which the family of the effect is named, (p,)."""
        if self.sized is None:
            return np.zeros(0)
        return np.maximum(self.detectability.named(self.sized), self.detectable)

    @cached_property
    def uncertainty(self) -> FloatArray:
        """Ends of the 90 % interval of both sizes of each parameter, over the sizes, (2, p)."""
        return np.ones((2, 0)) if self.sized is None else self.detectability.uncertainty(self.sized)

    @property
    def detectable_on_any_axis(self) -> float:
        """From which size a misfit is seen, whichever parameter it is of; infinite without any."""
        return self._on_any_axis(self.detectable)

    @property
    def nameable_on_any_axis(self) -> float:
        """The same from which the family is named."""
        return self._on_any_axis(self.nameable)

    @property
    def detectable_interval(self) -> tuple[float, float] | None:
        """The 90 % interval of ``detectable_on_any_axis``; None where that is infinite."""
        return self._interval(self.detectable)

    @property
    def nameable_interval(self) -> tuple[float, float] | None:
        """The 90 % interval of ``nameable_on_any_axis``; None where that is infinite."""
        return self._interval(self.nameable)

    def _on_any_axis(self, sizes: FloatArray) -> float:
        place = self._least_shown(sizes)
        return np.inf if place is None else float(sizes[place])

    def _interval(self, sizes: FloatArray) -> tuple[float, float] | None:
        place = self._least_shown(sizes)
        if place is None:
            return None
        low, high = (sizes[place] * self.uncertainty[:, place]).tolist()
        return low, high

    def _least_shown(self, sizes: FloatArray) -> int | None:
        """Place of the largest of the sizes of the parameters that show at sizes to be expected.

        Of all that show at any size where there are no such parameters; None where there are none.
        """
        if self.sized is None:
            return None
        shown = np.isfinite(sizes)
        usual = shown & (self.detectable < USUAL_SIZES * self.sized.typical)
        shown = usual if usual.any() else shown
        return int(np.argmax(np.where(shown, sizes, -1.0))) if shown.any() else None

    @property
    def hardly_shown(self) -> tuple[str, ...]:
        """Parameters that show above the given sizes only, or at no size; none if all are so."""
        if self.sized is None:
            return ()
        least = self.detectable_on_any_axis
        return tuple(
            name
            for name, size in zip(self.sized.names, self.detectable, strict=True)
            if size > least
        )

    @property
    def never_named(self) -> tuple[str, ...]:
        """Parameters that show at the given sizes, but whose family is named at no size.

        None if all are so: that is said instead of a size.
        """
        if self.sized is None or not np.isfinite(self.nameable).any():
            return ()
        least = self.detectable_on_any_axis
        sizes = zip(self.sized.names, self.detectable, self.nameable, strict=True)
        return tuple(name for name, seen, named in sizes if seen <= least and np.isinf(named))

    @property
    def largest(self) -> int:
        """Place of the parameter that stands out most from its standard error."""
        return 0 if self.trial is None else largest(self.trial.size, self.trial.standard_error)


def largest(sizes: FloatArray, errors: FloatArray) -> int:
    """Place of the size that stands out most from its standard error, shapes (p,)."""
    safe = np.where(errors > 0.0, errors, np.inf)
    certain = np.nan_to_num(np.abs(sizes) / safe)
    return int(np.argmax(certain if certain.any() else np.abs(sizes)))


def rank(
    misfit: WhitenedResiduals,
    hypotheses: HypothesisSet,
    posterior: Posterior,
    chances: Chances | None = None,
) -> tuple[Suspect, ...]:
    """All suspects, the likeliest first.

    Args:
        misfit: what is left.
        hypotheses: the explanations of this design.
        posterior: their probabilities.
        chances: simulations of this design, when some were made already.
    """
    known = Detectability(misfit, hypotheses, posterior, chances or Chances(hypotheses))
    noise = expected_covariance(misfit, hypotheses, posterior)
    alike = _alike(misfit, hypotheses)
    found = []
    for term, places in members(hypotheses).items():
        odds = float(log_odds(posterior.evidence, hypotheses, places))
        best = hypotheses.single[max(places, key=lambda place: posterior.evidence[place])]
        if term == DISTURBED:
            hold = None if best.variant is None else int(best.variant)
            found.append(Suspect(term, None, odds, misfit, noise, (), known, hold))
            continue
        candidate = next(
            c for c in misfit.candidates if c.term == term and c.variant == best.variant
        )
        found.append(Suspect(term, candidate, odds, misfit, noise, alike[term], known))
    found.sort(key=lambda suspect: -suspect.log_odds)
    if misfit.lack_of_fit().ratio > MAX_LINEAR:
        likely = [one for one in found[:FAR_SUSPECTS] if one.log_odds >= MIN_ODDS_SETTLED]
        found[: len(likely)] = [replace(one, far=True) for one in likely]
    return tuple(found)


def expected_covariance(
    misfit: WhitenedResiduals, hypotheses: HypothesisSet, posterior: Posterior
) -> FloatArray:
    """Covariance of the independent rows by the expected noise and wandering bias, (n, n)."""
    noise = np.eye(len(misfit)) + hypotheses.frame.walked(posterior.wander)
    for _ in range(2):
        noise = misfit.independent.rows(misfit.measured(noise)).T
    return np.asarray(posterior.expected_noise**2 * noise)


def usual_setting(misfit: WhitenedResiduals, term: str) -> Candidate:
    """An effect with the middle one of the settings that are tried."""
    settings = [one for one in misfit.candidates if one.term == term]
    return settings[(len(settings) - 1) // 2]


def _alike(misfit: WhitenedResiduals, hypotheses: HypothesisSet) -> dict[str, tuple[str, ...]]:
    """Terms one of whose visible patterns is nearly one of this term's, for every term."""
    terms = list(dict.fromkeys(one.term for one in misfit.candidates))
    if not terms:
        return {}
    number = np.concatenate(
        [np.full(len(one.names), terms.index(one.term)) for one in misfit.candidates]
    )
    columns = np.concatenate([one.columns for one in misfit.candidates], axis=1)
    patterns = visible(columns, hypotheses.frame)
    length = np.linalg.norm(patterns, axis=0)
    seen = length > 0.0
    unit, number = patterns[:, seen] / length[seen], number[seen]
    near = np.argwhere(np.abs(unit.T @ unit) > MIN_CORRELATION_ALIKE)
    found = np.zeros((len(terms), len(terms)), np.bool_)
    found[number[near[:, 0]], number[near[:, 1]]] = True
    np.fill_diagonal(found, False)
    return {
        a: tuple(b for b, same in zip(terms, row, strict=True) if same)
        for a, row in zip(terms, found, strict=True)
    }
