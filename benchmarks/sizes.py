"""Whether the sizes that are told are right: ``python -m benchmarks.sizes``.

In a session with nothing hidden the program says from which size it would see an effect (95 of 100
recordings, at one false alarm in a hundred of sensors that lack nothing) and from which it would
name the family (90 of 100). Other effects of the same term are hidden in that very session, at 0.5
to 1.5 times each of the two sizes, by the simulator, which shares no formula with the fit; the
program judges, and the share of recordings in which it sees (some suspect has p ≤ 0.01) or names is
fitted with a normal distribution over the size. Where that reaches 95 or 90 per cent is the size
that is found; the table has said over found with its 90 % interval, uniform priors on the middle
and on the logarithm of the width of the distribution.

    --sensor       accelerometer (hold means, as in ``hidden_effects``), gyroscope (raw recordings
                   through the whole program) or magnetometer (as in ``hidden_magnetometer``)
    --design       18 or 26+12 poses
    --recordings   of each effect and kind of size
    --seed         of the first; other seeds give other recordings
    --only         part of an effect's name; --colour of the accelerometer's noise
"""

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
from scipy.special import log_ndtr

from benchmarks.hidden.designs import PLANS
from benchmarks.hidden.fitted import left_over, measured_of
from benchmarks.hidden.noise import COLOURS
from benchmarks.hidden.recording import record
from benchmarks.hidden.scenarios import LARGEST
from benchmarks.hidden.trialled import Nameable, chances_of
from benchmarks.hidden.whole import NEVER, benches_of, hidden_in
from benchmarks.hidden_field import recording as of_field
from benchmarks.hidden_field import sessions
from benchmarks.hidden_field import trialled as field_trials
from benchmarks.hidden_field.scenarios import ALIGNED
from benchmarks.measure import machine
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose.posterior import hypothesis_set
from imucal_wizard.diagnose.residuals import WhitenedResiduals
from imucal_wizard.diagnose.significance import Chances
from imucal_wizard.diagnose.suspects import rank
from imucal_wizard.diagnose.verdict import judge_misfit
from imucal_wizard.estimate.fit import fit
from imucal_wizard.model.catalogue import effect, effects_for
from imucal_wizard.model.effect import ACCELEROMETER, GYROSCOPE, MAGNETOMETER, SENSORS
from imucal_wizard.simulate.hidden import Hidden

SEEN, NAMED = "seen", "named"
DEVIATES = {SEEN: 1.645, NAMED: 1.282}
"""Normal deviates of the shares of recordings that the sizes are told for."""
FACTORS = (0.5, 1.5)
"""Sizes hidden, in units of the size told."""
GRADE = "consumer"
"""Of the gyroscope."""


@dataclass(frozen=True)
class Asked:
    """What is to be studied: sensor, poses, and colour of the accelerometer's noise."""

    sensor: str
    design: str
    colour: str


@dataclass(frozen=True)
class Told:
    """The sizes that the program tells of one effect, (p,), and the setting that they are for."""

    seen: FloatArray
    named: FloatArray
    setting: float | None


@dataclass(frozen=True)
class Trial:
    """One recording with an effect.

    Attributes:
        what: ``seen`` or ``named``.
        factor: its size over the size told.
        so: whether it was seen or named.
        wrong: whether another family was named.
    """

    what: str
    factor: float
    so: bool
    wrong: bool


@cache
def _chances(asked: Asked) -> Chances:
    return chances_of(PLANS[asked.design], COLOURS[asked.colour])


def _field_plan(asked: Asked) -> sessions.Plan:
    return sessions.REPEATED if asked.design == "26+12" else sessions.STANDARD


def _poses(asked: Asked) -> str:
    return "26+repeats" if asked.design == "26+12" else "18"


def told(asked: Asked, term: str, seed: int) -> Told | None:
    """What the program tells of the session with nothing hidden."""
    if asked.sensor == ACCELEROMETER:
        sizes = Nameable(PLANS[asked.design], COLOURS[asked.colour], _chances(asked), [seed])
        known = sizes.usual(term)
        return Told(sizes.detectable(term), sizes[term], known.variant) if known else None
    if asked.sensor == MAGNETOMETER:
        quiet = field_trials.quiet(_field_plan(asked), seed)
        return Told(quiet.detectable[term], quiet.sizes[term], None)
    bench = benches_of(seed, GRADE, (), _poses(asked)).bench(GYROSCOPE)
    suspects = () if bench is None else bench.look().suspects
    one = next((one for one in suspects if one.term == term), None)
    return Told(one.detectable, one.nameable, None) if one else None


def said(asked: Asked, hidden: Hidden, setting: float | None, seed: int) -> tuple[bool, list[str]]:
    """Whether a misfit is seen in the session with an effect, and the families named."""
    if asked.sensor == GYROSCOPE:
        bench = benches_of(seed, GRADE, (hidden,), _poses(asked)).bench(GYROSCOPE)
        if bench is None:
            return False, []
        found = bench.look()
        return found.p <= 0.01, list(found.opinion.families)
    if asked.sensor == ACCELEROMETER:
        plan, colour, rng = (
            PLANS[asked.design],
            COLOURS[asked.colour],
            np.random.default_rng([seed]),
        )
        misfit = left_over(measured_of(record(plan, colour, (hidden,), rng, setting=setting)))
        return _judged(misfit, _chances(asked))
    field_plan = _field_plan(asked)
    session, rng = sessions.session_of(field_plan, seed), np.random.default_rng([seed, 0])
    data = of_field.record(session, of_field.CONSUMER, (hidden,), rng)
    misfit = field_trials.left_over(data, fit(data))
    return _judged(misfit, field_trials.quiet(field_plan, seed).chances)


def _judged(misfit: WhitenedResiduals, chances: Chances) -> tuple[bool, list[str]]:
    hypotheses = hypothesis_set(misfit)
    posterior = hypotheses.posterior(misfit.residual)
    suspects = rank(misfit, hypotheses, posterior, chances)
    return suspects[0].p <= 0.01, list(judge_misfit(misfit, hypotheses, posterior).families)


def trials(asked: Asked, term: str, seed: int, number: int, factor: float) -> list[Trial]:
    """The recordings of one session: near the size seen, and near the size named.

    Args:
        asked: what is studied.
        term: the effect.
        seed: of the study.
        number: of this session.
        factor: sizes hidden over the sizes told.
    """
    own = int(np.random.default_rng([seed, number, *map(ord, asked.sensor + term)]).integers(2**31))
    rng = np.random.default_rng([own, 1])
    sizes = told(asked, term, own)
    if sizes is None:
        return []
    family = effect(term).family or term
    typical = np.array([one.typical for one in effect(term).parameters(asked.sensor)])
    made = []
    for what, each in ((SEEN, sizes.seen), (NAMED, sizes.named)):
        usual = np.where(each < LARGEST * typical, each, np.inf)
        if not np.isfinite(usual).any():
            continue
        hidden = hidden_in(asked.sensor, term, factor, usual, rng)
        seen, families = said(asked, hidden, sizes.setting, own)
        so = seen if what == SEEN else families == [family]
        made.append(Trial(what, factor, so, bool({*families} - {family})))
    return made


def told_over_found(each: Sequence[Trial], deviate: float) -> tuple[float, float, float]:
    """Size told over the size found: the median and the ends of its 90 % interval."""
    factor, so = np.array([one.factor for one in each]), np.array([one.so for one in each])
    middle, width = np.meshgrid(np.linspace(0.1, 3.0, 291), np.geomspace(0.03, 0.8, 60))
    at = (factor[:, None, None] - middle) / width
    likely = np.where(so[:, None, None], log_ndtr(at), log_ndtr(-at)).sum(axis=0)
    weight = np.exp(likely - likely.max()).ravel()
    found = (middle + deviate * width).ravel()
    order = np.argsort(found)
    total = np.cumsum(weight[order])
    ends = [float(found[order][np.searchsorted(total, q * total[-1])]) for q in (0.5, 0.95, 0.05)]
    return 1.0 / ends[0], 1.0 / ends[1], 1.0 / ends[2]


def terms_of(sensor: str) -> list[str]:
    """The effects that can be hidden."""
    return [one.name for one in effects_for(sensor) if one.name not in {*NEVER, ALIGNED}]


def line(name: str, each: Sequence[Trial]) -> str:
    """One row of the table."""
    row = f"{name:<28}"
    for what, deviate in DEVIATES.items():
        own = [one for one in each if one.what == what]
        if not own:
            row += f"{what + ' at no size':>26}"
            continue
        ratio, low, high = told_over_found(own, deviate)
        row += f"{f'{ratio:.2f} [{low:.2f}, {high:.2f}]':>22}{len(own):4d}"
    return f"{row}{sum(one.wrong for one in each):7d}"


def main() -> None:
    """Print the table of one sensor and design."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sensor", default=ACCELEROMETER, choices=SENSORS)
    parser.add_argument("--design", default="26+12", choices=("18", "26+12"))
    parser.add_argument("--colour", default="consumer", choices=sorted(COLOURS))
    parser.add_argument("--recordings", type=int, default=40)
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--only", action="append", default=[], help="part of an effect's name")
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    asked = Asked(given.sensor, given.design, given.colour)
    print(machine())
    print(f"{asked.sensor}, {asked.design} poses: size told over size found [90 %], recordings")
    print(f"{'hidden':<28}{'seen':>22}{'n':>4}{'named':>22}{'n':>4}{'wrong':>7}")
    every: list[Trial] = []
    with ProcessPoolExecutor(given.jobs) as pool:
        for term in terms_of(asked.sensor):
            if given.only and not any(word in term for word in given.only):
                continue
            work = partial(trials, asked, term, given.seed)
            numbers = range(given.recordings)
            factors = np.linspace(*FACTORS, given.recordings)
            own = [one for some in pool.map(work, numbers, factors) for one in some]
            every += own
            print(line(term, own), flush=True)
    print(line("all", every))


if __name__ == "__main__":
    main()
