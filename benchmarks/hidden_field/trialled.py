"""One recording through the bench: what was hidden, what it says, and how the error falls."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from benchmarks.hidden.scenarios import Sizes
from benchmarks.hidden_field.recording import CONSUMER, record
from benchmarks.hidden_field.scenarios import FAMILY, Scenario
from benchmarks.hidden_field.sessions import Plan, session_of
from imucal_wizard.core.errors import DataError
from imucal_wizard.diagnose.detectability import Detectability
from imucal_wizard.diagnose.posterior import hypothesis_set
from imucal_wizard.diagnose.random_walk import with_random_walk
from imucal_wizard.diagnose.residuals import WhitenedResiduals, whitened_residuals
from imucal_wizard.diagnose.significance import Chances
from imucal_wizard.diagnose.suspects import rank
from imucal_wizard.diagnose.verdict import Opinion, judge_misfit
from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.magnetometer.experiment import MagnetometerExperiment
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.catalogue import effect, effects_for
from imucal_wizard.model.effect import MAGNETOMETER
from imucal_wizard.model.terms import Term
from imucal_wizard.simulate.hidden import Hidden


@dataclass(frozen=True)
class Trialled:
    """What came of one recording.

    Attributes:
        hidden: the effects.
        families: theirs, sorted.
        opinion: what the program says; None where it refuses the recording.
        p: chance that noise alone makes any suspect look as good.
        before: error held out of the base model, µT.
        after: the same with the hidden effects added (the first suspect where there are none), µT.
        sure: for a single effect, (size − truth) / standard error of its parameter, once added.
    """

    hidden: tuple[Hidden, ...]
    families: tuple[str, ...]
    opinion: Opinion
    p: float
    before: float
    after: float
    sure: float | None


@dataclass(frozen=True)
class Quiet:
    """A session with nothing hidden: what it shows, and how well noise alone does.

    Attributes:
        sizes: nameable size of each parameter of each effect.
        chances: simulations of noise alone.
    """

    sizes: Sizes
    chances: Chances


@lru_cache(maxsize=4)
def quiet(plan: Plan, seed: int) -> Quiet:
    """The session of a seed with nothing hidden."""
    data = record(session_of(plan, seed), CONSUMER, (), np.random.default_rng([seed, 0]))
    misfit = left_over(data, fit(data))
    hypotheses = hypothesis_set(misfit, pairs=False)
    posterior, chances = hypotheses.posterior(misfit.residual), Chances(hypotheses)
    known = Detectability(misfit, hypotheses, posterior, chances)
    named = {one.term: known.named(one) for one in misfit.candidates}
    return Quiet(named, chances)


def try_out(plan: Plan, scenario: Scenario, known: Quiet, seed: int) -> Trialled | None:
    """Hide, record, judge, add; None where the program refuses the recording."""
    hidden = scenario.draw(np.random.default_rng([seed, 1]), known.sizes)
    rng = np.random.default_rng([seed, 0])
    try:
        data = record(session_of(plan, seed), scenario.colour, hidden, rng, scenario.extra)
        plain = fit(data)
    except DataError:
        return None
    misfit = left_over(data, plain)
    hypotheses = hypothesis_set(misfit)
    posterior = hypotheses.posterior(misfit.residual)
    suspects = rank(misfit, hypotheses, posterior, known.chances)
    opinion = judge_misfit(misfit, hypotheses, posterior)
    names = [one.term for one in hidden] or [
        next(one.term for one in suspects if one.candidate is not None)
    ]
    added = None
    with suppress(DataError):  # else the program refuses the effects and keeps its verdict
        added = fit(data, [Term(effect(name)) for name in names])
    return Trialled(
        hidden=hidden,
        families=tuple(sorted({FAMILY[one.term] for one in hidden})),
        opinion=opinion,
        p=suspects[0].p,
        before=_known(plain.rms_held_out),
        after=_known(None if added is None else added.rms_held_out),
        sure=None if added is None else _sure(added, data, hidden),
    )


def left_over(data: MagnetometerExperiment, found: SensorFit) -> WhitenedResiduals:
    """What a fit leaves, with every effect that is not in it."""
    suspects = [
        one
        for one in effects_for(MAGNETOMETER)
        if one.name not in found.model and one.lacking(MAGNETOMETER, data.circumstances) is None
    ]
    return whitened_residuals(found, suspects)


def _sure(added: SensorFit, data: MagnetometerExperiment, hidden: Sequence[Hidden]) -> float | None:
    """How far the size that was fitted is from the truth, in its own standard errors."""
    if len(hidden) != 1:
        return None
    fit = with_random_walk(added, left_over(data, added))
    axis = hidden[0].axes[0]
    return float((fit.sizes[0][axis] - hidden[0].size) / fit.size_errors[0][axis])


def _known(rms: float | None) -> float:
    return np.nan if rms is None else rms
