"""One recording through the program: what was hidden, what it says, and how the error falls."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from benchmarks.hidden.designs import Plan
from benchmarks.hidden.fitted import left_over, measured_of
from benchmarks.hidden.noise import MILLI_G, Colour
from benchmarks.hidden.recording import Recorded, record
from benchmarks.hidden.scenarios import FAMILY, Scenario
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose.detectability import Detectability
from imucal_wizard.diagnose.posterior import hypothesis_set
from imucal_wizard.diagnose.profile_likelihood import most_likely_setting
from imucal_wizard.diagnose.random_walk import with_random_walk
from imucal_wizard.diagnose.residuals import Candidate, WhitenedResiduals, candidate_at
from imucal_wizard.diagnose.significance import Chances
from imucal_wizard.diagnose.suspects import (
    Suspect,
    expected_covariance,
    rank,
    try_effects,
    usual_setting,
)
from imucal_wizard.diagnose.verdict import Opinion, judge_misfit
from imucal_wizard.estimate.accelerometer import AccelerometerExperiment
from imucal_wizard.estimate.distributions import quantile
from imucal_wizard.estimate.fit import fit, refined_minimum
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.effect import ACCELEROMETER
from imucal_wizard.model.terms import Term
from imucal_wizard.simulate.hidden import Hidden

Seed = Sequence[int]


@dataclass(frozen=True)
class Trialled:
    """What came of one recording.

    Attributes:
        hidden: the effects.
        families: theirs, sorted.
        opinion: what the program says.
        p: chance that noise alone makes any suspect look as good.
        before: error held out without any effect, mg.
        linear: the same with the hidden effects added (the first suspect where there are none), as
            foretold by the linear model, mg.
        after: the same by fitting again, mg; NaN where that fit does not converge.
        sure: for a single effect, (size − truth) of its parameter, once added, in units of the
            interval that is to hold the truth 95 times in 100 (Student, as ``SensorFit`` says);
            None where that fit does not converge.
    """

    hidden: tuple[Hidden, ...]
    families: tuple[str, ...]
    opinion: Opinion
    p: float
    before: float
    linear: float
    after: float
    sure: float | None


class Nameable(dict[str, FloatArray]):
    """Sizes that the program itself calls nameable in a session, if that has no effect at all.

    Of a step and a warm-up these are the sizes for the moment and the time constant that they have.

    Args:
        plan: of the session.
        colour: of its noise.
        chances: simulations of noise alone.
        seed: of the session.
    """

    def __init__(self, plan: Plan, colour: Colour, chances: Chances, seed: Seed) -> None:
        super().__init__()
        self._plan, self._colour, self._chances, self._seed = plan, colour, chances, seed

    @cached_property
    def _plain(self) -> tuple[Recorded, WhitenedResiduals, Detectability]:
        recorded = record(self._plan, self._colour, (), np.random.default_rng(self._seed))
        misfit = left_over(measured_of(recorded))
        hypotheses = hypothesis_set(misfit, pairs=False)
        posterior = hypotheses.posterior(misfit.residual)
        sizes = Detectability(misfit, hypotheses, posterior, self._chances)
        return recorded, misfit, sizes

    def __missing__(self, term: str) -> FloatArray:
        recorded, misfit, sizes = self._plain
        candidate, known = usual_setting(misfit, term), effect(term)
        if candidate.variant is not None:
            setting = recorded.step if known.sudden else recorded.settling
            candidate = candidate_at(misfit, known, setting)
        self[term] = sizes.named(candidate)
        return self[term]


@lru_cache(maxsize=64)
def _nameable(plan: Plan, colour: Colour, chances: Chances, seed: tuple[int, ...]) -> Nameable:
    """Many scenarios are tried in the same session."""
    return Nameable(plan, colour, chances, seed)


def chances_of(plan: Plan, colour: Colour) -> Chances:
    """Chance on a session of this plan."""
    misfit = left_over(measured_of(record(plan, colour, (), np.random.default_rng(1))))
    return Chances(hypothesis_set(misfit, pairs=False))


def try_out(
    plan: Plan, colour: Colour, scenario: Scenario, chances: Chances, seed: Seed
) -> Trialled:
    """Hide, record, judge, add."""
    sizes = _nameable(plan, colour, chances, tuple(seed))
    hidden = scenario.draw(np.random.default_rng([*seed, 1]), sizes)
    noise = scenario.colour(colour)
    rng = np.random.default_rng(seed)
    measured = measured_of(record(plan, noise, hidden, rng, scenario.extra))
    plain = fit(measured)
    misfit = left_over(measured, plain)
    hypotheses = hypothesis_set(misfit)
    posterior = hypotheses.posterior(misfit.residual)
    suspects = rank(misfit, hypotheses, posterior, chances)
    opinion = judge_misfit(misfit, hypotheses, posterior)
    chosen = _chosen(suspects, hidden)
    scatter = expected_covariance(misfit, hypotheses, posterior)
    added = _with(measured, chosen)
    return Trialled(
        hidden=hidden,
        families=tuple(sorted({FAMILY[one.term] for one in hidden})),
        opinion=opinion,
        p=suspects[0].p,
        before=_milli(plain.rms_held_out),
        linear=_milli(try_effects(misfit, chosen, scatter).rms_held_out),
        after=_milli(None if added is None else added.rms_held_out),
        sure=None if added is None else _sure(added, measured, hidden),
    )


def _with(measured: AccelerometerExperiment, chosen: Sequence[Candidate]) -> SensorFit | None:
    """The fit with effects; the setting of a single one is settled as the bench does.

    None where it does not converge: the program refuses the effects and keeps its verdict.
    """
    terms = [Term(effect(one.term), one.variant) for one in chosen]
    try:
        if len(terms) > 1:
            return fit(measured, terms)
        variants = terms[0].effect.variants(measured.circumstances)
        return most_likely_setting(
            lambda term: refined_minimum(measured, [term], None), terms[0], variants
        )
    except DataError:
        return None


def _chosen(suspects: Sequence[Suspect], hidden: Sequence[Hidden]) -> tuple[Candidate, ...]:
    """The suspects that are hidden; the first one where nothing is."""
    named = {one.term for one in hidden}
    found = [one.candidate for one in suspects if one.candidate is not None]
    return tuple(one for one in found if one.term in named) or (found[0],)


def _sure(
    added: SensorFit, measured: AccelerometerExperiment, hidden: Sequence[Hidden]
) -> float | None:
    """How far the size that was fitted is from the truth, in units of its own interval."""
    if len(hidden) != 1:
        return None
    fit = with_random_walk(added, left_over(measured, added))
    reach = quantile(0.95, max(fit.degrees_of_freedom, 1))
    letters = "".join("xyz"[axis] for axis in hidden[0].axes)
    names = [one.name for one in effect(hidden[0].term).parameters(ACCELEROMETER)]
    place = names.index(letters)
    return float((fit.sizes[0][place] - hidden[0].size) / (reach * fit.size_errors[0][place]))


def _milli(rms: float | None) -> float:
    return np.nan if rms is None else rms / MILLI_G
