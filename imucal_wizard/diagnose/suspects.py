"""The suspects: every effect of the catalogue against what is left, and what adding it would do.

What adding does is tried with the estimator itself, by one step from where the present fit has
arrived (``estimate.fit.with_effects``): the same variance components, priors and errors held out.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.expected_log_odds import MIN_VISIBLE_SHARE, detectable
from imucal_wizard.diagnose.hypotheses import DISTURBED
from imucal_wizard.diagnose.posterior import HypothesisSet, Posterior
from imucal_wizard.diagnose.profile_likelihood import settle, unlikeliness
from imucal_wizard.diagnose.residuals import Candidate, WhitenedResiduals, candidate_at
from imucal_wizard.diagnose.significance import Chances, log_odds, members
from imucal_wizard.estimate.experiment import Experiment
from imucal_wizard.estimate.fit import Minimum, rms_fitted, rms_held_out, with_effects
from imucal_wizard.model.terms import Term


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
    def standard_error(self) -> FloatArray:
        """Of each size, shape (p,)."""
        found, own = self.found, self._own
        pull, prior = found.pull()[own], found.balance.covariance[own]
        variance = ((pull @ self.noise) * pull).sum(axis=1)
        variance += (prior**2 * found.balance.precision).sum(axis=1)
        return np.asarray(np.sqrt(variance))

    @cached_property
    def rms_fitted(self) -> float:
        """Error with them, in the sensor's error unit."""
        return rms_fitted(self.found)

    @cached_property
    def rms_held_out(self) -> float | None:
        """Error with them when each group is left out; None when a group cannot be."""
        return rms_held_out(self.found)


def try_effects(
    misfit: WhitenedResiduals, candidates: Sequence[Candidate], noise: FloatArray
) -> EffectTrial:
    """Add effects to the model that leaves a misfit; with none, the model as it is.

    Args:
        misfit: what the present model leaves.
        candidates: the effects to add together.
        noise: see ``EffectTrial``.
    """
    terms = [Term(one.effect, one.variant) for one in candidates]
    columns = np.column_stack([np.zeros((len(misfit), 0)), *(one.columns for one in candidates)])
    # an effect of size s leaves what adding s to the model takes away
    columns = -misfit.independent.rows(misfit.measured(columns))
    return EffectTrial(tuple(candidates), with_effects(misfit.minimum, terms, columns), noise)


MIN_CORRELATION_ALIKE = 0.9
"""Correlation of two effects' visible patterns above which they look the same here."""


class Significance:
    """What noise alone makes of suspects, computed when it is first asked for.

    Args:
        hypotheses: the explanations of this design.
        posterior: their probabilities.
        chances: simulations of noise alone on this design.
    """

    def __init__(self, hypotheses: HypothesisSet, posterior: Posterior, chances: Chances) -> None:
        self._hypotheses, self._posterior, self._chances = hypotheses, posterior, chances

    def p(self, log_odds: float) -> float:
        """Chance that noise alone makes any suspect look as good."""
        return self._chances.p(log_odds, self._posterior.noise)

    @cached_property
    def threshold(self) -> float:
        """Log odds that noise alone reaches once in a hundred recordings."""
        return self._chances.threshold(self._posterior.noise)

    def detectable(self, candidate: Candidate) -> FloatArray:
        """Smallest size of each parameter alone that these data would show, shape (p,)."""
        posterior = self._posterior
        return detectable(
            self._hypotheses, candidate, self.threshold, expected_noise(posterior), posterior.wander
        )


@dataclass(frozen=True, eq=False)
class Suspect:
    """One effect against what is left.

    Attributes:
        term: name of the effect, or ``disturbed``.
        likeliest: of the settings tried, the one that explains most; None for a disturbed hold.
        log_odds: logarithm of its marginal likelihood against noise alone.
        misfit: what is left.
        noise: covariance of the rows, see ``EffectTrial``.
        like: terms that look the same here.
        significance: what noise alone makes of suspects.
        hold: index of the hold accused, for a disturbed one.
    """

    term: str
    likeliest: Candidate | None
    log_odds: float
    misfit: WhitenedResiduals
    noise: FloatArray
    like: tuple[str, ...]
    significance: Significance
    hold: int | None = None

    @cached_property
    def trial(self) -> EffectTrial | None:
        """What adding it would do, with the setting that adding it settles on.

        None for a disturbed hold.
        """
        first = self.likeliest
        if first is None:
            return None
        begin, known = first.variant, [c for c in self.misfit.candidates if c.term == self.term]
        if begin is None or not first.effect.graded:
            return try_effects(self.misfit, (first,), self.noise)
        tried: dict[float, EffectTrial] = {}

        def unlikely(at: float) -> float:
            if at not in tried:
                candidate = candidate_at(self.misfit.fit, first.effect, float(np.exp(at)))
                tried[at] = try_effects(self.misfit, (candidate,), self.noise)
            return unlikeliness(tried[at].found)

        grid = sorted({float(np.log(one.variant)) for one in known if one.variant is not None})
        settle(unlikely, grid, float(np.log(begin)))
        return tried[min(tried, key=unlikely)]

    @property
    def candidate(self) -> Candidate | None:
        """The effect with the setting that adding it settles on; None for a disturbed hold."""
        return None if self.trial is None else self.trial.candidates[0]

    @cached_property
    def p(self) -> float:
        """Share of simulations of noise alone in which any suspect reaches these odds."""
        return self.significance.p(self.log_odds)

    @cached_property
    def detectable(self) -> FloatArray:
        """Smallest size of each parameter alone that these data would show, shown unit, (p,).

        Infinite where the data are blind; empty for a disturbed hold.
        """
        if self.likeliest is None:
            return np.zeros(0)
        return self.significance.detectable(self.likeliest)

    @property
    def detectable_on_any_axis(self) -> float:
        """The same for the worst of those parameters that show at all; infinite without any."""
        seen = self.detectable[np.isfinite(self.detectable)]
        return float(seen.max()) if len(seen) else np.inf

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
    significance = Significance(hypotheses, posterior, chances or Chances(hypotheses))
    noise = expected_covariance(misfit, hypotheses, posterior)
    alike = _alike(misfit, hypotheses)
    found = []
    for term, places in members(hypotheses).items():
        odds = float(log_odds(posterior.evidence, hypotheses, places))
        best = hypotheses.single[max(places, key=lambda place: posterior.evidence[place])]
        if term == DISTURBED:
            hold = None if best.variant is None else int(best.variant)
            found.append(Suspect(term, None, odds, misfit, noise, (), significance, hold))
            continue
        candidate = next(
            c for c in misfit.candidates if c.term == term and c.variant == best.variant
        )
        found.append(Suspect(term, candidate, odds, misfit, noise, alike[term], significance))
    return tuple(sorted(found, key=lambda suspect: -suspect.log_odds))


def expected_noise(posterior: Posterior) -> float:
    """Expected noise over all explanations."""
    return float(posterior.single @ posterior.sigma + posterior.paired @ posterior.sigma_paired)


def expected_covariance(
    misfit: WhitenedResiduals, hypotheses: HypothesisSet, posterior: Posterior
) -> FloatArray:
    """Covariance of the independent rows by the expected noise and wandering bias, (n, n)."""
    noise = np.eye(len(misfit)) + hypotheses.frame.walked(posterior.wander)
    for _ in range(2):
        noise = misfit.independent.rows(misfit.measured(noise)).T
    return np.asarray(expected_noise(posterior) ** 2 * noise)


def _alike(misfit: WhitenedResiduals, hypotheses: HypothesisSet) -> dict[str, tuple[str, ...]]:
    """Terms one of whose visible patterns is nearly one of this term's, for every term."""
    terms = list(dict.fromkeys(one.term for one in misfit.candidates))
    if not terms:
        return {}
    number = np.concatenate(
        [np.full(len(one.names), terms.index(one.term)) for one in misfit.candidates]
    )
    patterns = hypotheses.frame.across.T @ np.concatenate(
        [c.columns for c in misfit.candidates], axis=1
    )
    whole = np.concatenate([np.linalg.norm(c.columns, axis=0) for c in misfit.candidates])
    length = np.linalg.norm(patterns, axis=0)
    seen = length > MIN_VISIBLE_SHARE * np.maximum(whole, 1e-300)
    unit, number = patterns[:, seen] / length[seen], number[seen]
    near = np.argwhere(np.abs(unit.T @ unit) > MIN_CORRELATION_ALIKE)
    found = np.zeros((len(terms), len(terms)), np.bool_)
    found[number[near[:, 0]], number[near[:, 1]]] = True
    np.fill_diagonal(found, False)
    return {
        a: tuple(b for b, same in zip(terms, row, strict=True) if same)
        for a, row in zip(terms, found, strict=True)
    }
