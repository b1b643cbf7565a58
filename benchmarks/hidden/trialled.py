"""One recording through the program: what was hidden, what it says, and how the error falls."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.hidden.designs import Plan
from benchmarks.hidden.fitted import left_over, measured_of
from benchmarks.hidden.noise import MILLI_G, Colour
from benchmarks.hidden.recording import record
from benchmarks.hidden.scenarios import FAMILY, Scenario
from imucal_wizard.bench.chance import Chances
from imucal_wizard.bench.detectable import detectable
from imucal_wizard.bench.evidence import Jury, Weighed, make_jury
from imucal_wizard.bench.misfit import Misfit
from imucal_wizard.bench.suspects import Suspect, noise_of, rank
from imucal_wizard.bench.trial import try_effect
from imucal_wizard.bench.verdict import Opinion, judge
from imucal_wizard.devices.virtual.hidden import Hidden
from imucal_wizard.effects.catalogue import effect
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.extended.fit import fit_with
from imucal_wizard.solver.extended.hold_data import HoldData
from imucal_wizard.solver.extended.terms import Term

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
        sure: for a single effect, (size − truth) / standard error of its parameter.
    """

    hidden: tuple[Hidden, ...]
    families: tuple[str, ...]
    opinion: Opinion
    before: float
    linear: float
    after: float
    sure: float | None


class Sizes(dict[str, FloatArray]):
    """Detectable sizes in one session without any effect, as the program itself finds them."""

    def __init__(self, misfit: Misfit, jury: Jury, weighed: Weighed, chances: Chances) -> None:
        super().__init__()
        self._misfit, self._jury, self._weighed = misfit, jury, weighed
        self._threshold = chances.threshold(weighed.noise)

    def __missing__(self, term: str) -> FloatArray:
        found = [one for one in self._misfit.candidates if one.term == term]
        weighed = self._weighed
        middle = found[len(found) // 2]
        self[term] = detectable(
            self._jury, middle, self._threshold, noise_of(weighed), weighed.wander
        )
        return self[term]


def chances_of(plan: Plan, colour: Colour) -> Chances:
    """Chance on a typical session of this plan."""
    misfit = left_over(measured_of(record(plan, colour, (), np.random.default_rng(1))))
    return Chances(make_jury(misfit, pairs=False))


def try_out(
    plan: Plan, colour: Colour, scenario: Scenario, chances: Chances, seed: Seed
) -> Trialled:
    """Hide, record, judge, add."""
    plain = left_over(measured_of(record(plan, colour, (), np.random.default_rng(seed))))
    jury = make_jury(plain, pairs=False)
    sizes = Sizes(plain, jury, jury.weigh(plain.residual), chances)
    hidden = scenario.draw(np.random.default_rng([*seed, 1]), sizes)
    noise = scenario.colour(colour)
    rng = np.random.default_rng(seed)
    measured = measured_of(record(plan, noise, hidden, rng, scenario.extra))
    misfit = left_over(measured)
    jury = make_jury(misfit)
    weighed = jury.weigh(misfit.residual)
    suspects = rank(misfit, jury, weighed, chances)
    opinion = judge(misfit, jury, weighed, suspects[0].p)
    families = tuple(sorted({FAMILY[one.term] for one in hidden}))
    return Trialled(
        hidden, families, opinion, *_added(measured, misfit, suspects, hidden, opinion.noise)
    )


def _added(
    measured: HoldData,
    misfit: Misfit,
    suspects: Sequence[Suspect],
    hidden: Sequence[Hidden],
    noise: float,
) -> tuple[float, float, float, float | None]:
    named = {one.term for one in hidden}
    found = [one.candidate for one in suspects if one.candidate is not None]
    chosen = tuple(one for one in found if one.term in named) or (found[0],)
    linear = try_effect(misfit, chosen, noise).rms_held_out
    first = next(one for one in suspects if one.candidate is chosen[0])
    terms = [Term(effect(one.term), one.variant) for one in chosen]
    fit = fit_with(measured, terms)
    before = fit_with(measured).rms_held_out
    sure = None
    if len(hidden) == 1 and len(hidden[0].axes) == 1 and first.trial is not None:
        axis = hidden[0].axes[0]
        sure = float((first.trial.size[axis] - hidden[0].size) / first.trial.standard_error[axis])
    return _milli(before), _milli(linear), _milli(fit.rms_held_out), sure


def _milli(rms: float | None) -> float:
    return np.nan if rms is None else rms / MILLI_G
