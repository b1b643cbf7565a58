"""One recording through the bench: what was hidden, what it says, and how the error falls."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.hidden.scenarios import Sizes
from benchmarks.hidden_field.recording import CONSUMER, record
from benchmarks.hidden_field.scenarios import FAMILY, Scenario
from benchmarks.hidden_field.sessions import Plan, session_of
from imucal_wizard.bench.chance import Chances
from imucal_wizard.bench.detectable import detectable
from imucal_wizard.bench.evidence import make_jury
from imucal_wizard.bench.from_fit import misfit_of
from imucal_wizard.bench.misfit import Misfit
from imucal_wizard.bench.suspects import noise_of, rank
from imucal_wizard.bench.verdict import Opinion, judge
from imucal_wizard.bench.wandering import with_wander
from imucal_wizard.devices.virtual.hidden import Hidden
from imucal_wizard.effects.catalogue import effect, effects_for
from imucal_wizard.effects.effect import MAGNETOMETER
from imucal_wizard.errors import DataError
from imucal_wizard.solver.extended.field_data import FieldData
from imucal_wizard.solver.extended.fit import fit_with
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.solver.extended.terms import Term


@dataclass(frozen=True)
class Trialled:
    """What came of one recording.

    Attributes:
        hidden: the effects.
        families: theirs, sorted.
        opinion: what the program says; None where it refuses the recording.
        before: error held out of the base model, µT.
        after: the same with the hidden effects added (the first suspect where there are none), µT.
        sure: for a single effect, (size − truth) / standard error of its parameter, once added.
    """

    hidden: tuple[Hidden, ...]
    families: tuple[str, ...]
    opinion: Opinion
    before: float
    after: float
    sure: float | None


@dataclass(frozen=True)
class Quiet:
    """A session with nothing hidden: what it shows, and how well noise alone does.

    Attributes:
        sizes: detectable size of each parameter of each effect.
        chances: simulations of noise alone.
    """

    sizes: Sizes
    chances: Chances


def quiet(plan: Plan, seed: int) -> Quiet:
    """The session of a seed with nothing hidden."""
    data = record(session_of(plan, seed), CONSUMER, (), np.random.default_rng([seed, 0]))
    misfit = left_over(data, fit_with(data))
    jury = make_jury(misfit, pairs=False)
    weighed, chances = jury.weigh(misfit.residual), Chances(jury)
    threshold, noise = chances.threshold(weighed.noise), noise_of(weighed)
    sizes = {
        one.term: detectable(jury, one, threshold, noise, weighed.wander)
        for one in misfit.candidates
    }
    return Quiet(sizes, chances)


def try_out(plan: Plan, scenario: Scenario, known: Quiet, seed: int) -> Trialled | None:
    """Hide, record, judge, add; None where the program refuses the recording."""
    hidden = scenario.draw(np.random.default_rng([seed, 1]), known.sizes)
    rng = np.random.default_rng([seed, 0])
    try:
        data = record(session_of(plan, seed), scenario.colour, hidden, rng, scenario.extra)
        plain = fit_with(data)
    except DataError:
        return None
    misfit = left_over(data, plain)
    jury = make_jury(misfit)
    weighed = jury.weigh(misfit.residual)
    suspects = rank(misfit, jury, weighed, known.chances)
    opinion = judge(misfit, jury, weighed, suspects[0].p)
    names = [one.term for one in hidden] or [
        next(one.term for one in suspects if one.candidate is not None)
    ]
    fit = fit_with(data, [Term(effect(name)) for name in names])
    return Trialled(
        hidden=hidden,
        families=tuple(sorted({FAMILY[one.term] for one in hidden})),
        opinion=opinion,
        before=_known(plain.rms_held_out),
        after=_known(fit.rms_held_out),
        sure=_sure(with_wander(fit, left_over(data, fit)), hidden),
    )


def left_over(data: FieldData, fit: Extended) -> Misfit:
    """What a fit leaves, with every effect that is not in it."""
    suspects = [
        one
        for one in effects_for(MAGNETOMETER)
        if one.name not in fit.model and one.lacking(MAGNETOMETER, data.circumstances) is None
    ]
    return misfit_of(fit.linear, MAGNETOMETER, data.circumstances, suspects)


def _sure(fit: Extended, hidden: Sequence[Hidden]) -> float | None:
    """How far the size that was fitted is from the truth, in its own standard errors."""
    if len(hidden) != 1:
        return None
    axis = hidden[0].axes[0]
    return float((fit.sizes[0][axis] - hidden[0].size) / fit.errors[0][axis])


def _known(rms: float | None) -> float:
    return np.nan if rms is None else rms
