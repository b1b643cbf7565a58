"""One recording through the program: what was hidden, what it says, and how the error falls."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from benchmarks.hidden.designs import Plan
from benchmarks.hidden.fitted import left_over, measured_of
from benchmarks.hidden.noise import MILLI_G, Colour
from benchmarks.hidden.recording import record
from benchmarks.hidden.scenarios import FAMILY, Scenario
from imucal_wizard.bench.chance import Chances
from imucal_wizard.bench.detectable import detectable
from imucal_wizard.bench.evidence import Jury, Weighed, make_jury
from imucal_wizard.bench.misfit import Candidate, Misfit
from imucal_wizard.bench.settling import settled
from imucal_wizard.bench.suspects import Suspect, noise_of, rank
from imucal_wizard.bench.trial import try_effect
from imucal_wizard.bench.verdict import Opinion, judge
from imucal_wizard.bench.wandering import with_wander
from imucal_wizard.devices.virtual.hidden import Hidden
from imucal_wizard.effects.catalogue import effect
from imucal_wizard.effects.effect import ACCELEROMETER
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.extended.fit import fit_with
from imucal_wizard.solver.extended.hold_data import HoldData
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.solver.extended.terms import Term
from imucal_wizard.solver.student import quantile

Seed = Sequence[int]


@dataclass(frozen=True)
class Trialled:
    """What came of one recording.

    Attributes:
        hidden: the effects.
        families: theirs, sorted.
        opinion: what the program says.
        before: error held out without any effect, mg.
        linear: the same with the hidden effects added (the first suspect where there are none), as
            foretold by the linear model, mg.
        after: the same by fitting again, mg.
        sure: for a single effect, (size − truth) of its parameter, once added, in units of the
            interval that is to hold the truth 95 times in 100 (Student, as ``SensorFit`` says).
    """

    hidden: tuple[Hidden, ...]
    families: tuple[str, ...]
    opinion: Opinion
    before: float
    linear: float
    after: float
    sure: float | None


class Detectable(dict[str, FloatArray]):
    """Sizes that the program itself calls detectable in a session, if that has no effect at all.

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
    def _plain(self) -> tuple[Misfit, Jury, Weighed]:
        rng = np.random.default_rng(self._seed)
        misfit = left_over(measured_of(record(self._plan, self._colour, (), rng)))
        jury = make_jury(misfit, pairs=False)
        return misfit, jury, jury.weigh(misfit.residual)

    def __missing__(self, term: str) -> FloatArray:
        misfit, jury, weighed = self._plain
        found = [one for one in misfit.candidates if one.term == term]
        threshold, noise = self._chances.threshold(weighed.noise), noise_of(weighed)
        middle = found[len(found) // 2]
        self[term] = detectable(jury, middle, threshold, noise, weighed.wander)
        return self[term]


def chances_of(plan: Plan, colour: Colour) -> Chances:
    """Chance on a session of this plan."""
    misfit = left_over(measured_of(record(plan, colour, (), np.random.default_rng(1))))
    return Chances(make_jury(misfit, pairs=False))


def try_out(
    plan: Plan, colour: Colour, scenario: Scenario, chances: Chances, seed: Seed
) -> Trialled:
    """Hide, record, judge, add."""
    sizes = Detectable(plan, colour, chances, seed)
    hidden = scenario.draw(np.random.default_rng([*seed, 1]), sizes)
    noise = scenario.colour(colour)
    rng = np.random.default_rng(seed)
    measured = measured_of(record(plan, noise, hidden, rng, scenario.extra))
    plain = fit_with(measured)
    misfit = left_over(measured, plain)
    jury = make_jury(misfit)
    weighed = jury.weigh(misfit.residual)
    suspects = rank(misfit, jury, weighed, chances)
    opinion = judge(misfit, jury, weighed, suspects[0].p)
    chosen = _chosen(suspects, hidden)
    fit = _with(measured, chosen)
    return Trialled(
        hidden=hidden,
        families=tuple(sorted({FAMILY[one.term] for one in hidden})),
        opinion=opinion,
        before=_milli(plain.rms_held_out),
        linear=_milli(try_effect(misfit, chosen, opinion.noise).rms_held_out),
        after=_milli(fit.rms_held_out),
        sure=_sure(with_wander(fit, left_over(measured, fit)), hidden),
    )


def _with(measured: HoldData, chosen: Sequence[Candidate]) -> Extended:
    """The fit with effects; the setting of a single one is settled as the bench does."""
    terms = [Term(effect(one.term), one.variant) for one in chosen]
    if len(terms) > 1:
        return fit_with(measured, terms)
    variants = terms[0].effect.variants(measured.circumstances)
    return settled(lambda term: fit_with(measured, [term]), terms[0], variants)


def _chosen(suspects: Sequence[Suspect], hidden: Sequence[Hidden]) -> tuple[Candidate, ...]:
    """The suspects that are hidden; the first one where nothing is."""
    named = {one.term for one in hidden}
    found = [one.candidate for one in suspects if one.candidate is not None]
    return tuple(one for one in found if one.term in named) or (found[0],)


def _sure(fit: Extended, hidden: Sequence[Hidden]) -> float | None:
    """How far the size that was fitted is from the truth, in units of its own interval."""
    if len(hidden) != 1:
        return None
    reach = quantile(0.95, max(fit.fit.degrees_of_freedom, 1))
    letters = "".join("xyz"[axis] for axis in hidden[0].axes)
    names = [one.name for one in effect(hidden[0].term).parameters(ACCELEROMETER)]
    place = names.index(letters)
    return float((fit.sizes[0][place] - hidden[0].size) / (reach * fit.errors[0][place]))


def _milli(rms: float | None) -> float:
    return np.nan if rms is None else rms / MILLI_G
