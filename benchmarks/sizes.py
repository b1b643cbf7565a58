"""Whether the sizes that are reported are right: ``python -m benchmarks.sizes``.

In a session with nothing hidden the program says from which size it would see an effect (95 of 100
recordings, at one false alarm in a hundred of sensors that lack nothing) and from which it would
name the family (90 of 100). The effect is hidden in another recording of the same device by the
same procedure (new poses, a new order, new noise; of the accelerometer another device with the same
noise) by the simulator, which shares no formula with the fit; the program judges, and halving
intervals, the size from which it sees (some suspect has p ≤ 0.01) or names is found between two
tries, the first at the size reported.
A normal distribution is fitted to these sizes, in units of those reported. Where it reaches 95 or
90 per cent is the size that is found; the table has reported over found with its 90 % interval,
uniform priors on the middle and on the logarithm of the width of the distribution, and in how many
sessions the program saw and named at the size reported itself. The last line counts the rows whose
ratio is within 20 %.

    --sensor       accelerometer (hold means, as in ``hidden_effects``), gyroscope (raw recordings
                   through the whole program) or magnetometer (as in ``hidden_magnetometer``)
    --design       18 or 26+12 poses
    --recordings   sessions of each effect
    --seed         of the first; other seeds give other recordings
    --same-poses   the other recording has the same poses at the same times and temperatures, so
                   that only the noise is new; not for the gyroscope
    --only         part of an effect's name; --colour of the accelerometer's noise
"""

import argparse
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
from scipy.special import ndtr

from benchmarks.complete import interval
from benchmarks.hidden.designs import PLANS, drawn_schedule
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
from imucal_wizard.diagnose.significance import SEEN_P, Chances
from imucal_wizard.diagnose.suspects import rank
from imucal_wizard.diagnose.verdict import judge_misfit
from imucal_wizard.estimate.fit import fit
from imucal_wizard.model.catalogue import effect, effects_for
from imucal_wizard.model.effect import ACCELEROMETER, GYROSCOPE, MAGNETOMETER, SENSORS
from imucal_wizard.simulate.hidden import Hidden

SEEN, NAMED = "seen", "named"
DEVIATES = {SEEN: 1.645, NAMED: 1.282}
"""Normal deviates of the shares of recordings that the sizes are reported for."""
STEP = 1.5
"""Factor from the size reported to the second size tried."""
TRIES = 3
"""Sizes tried in a session, at each of the two sizes reported."""
RIGHT_SIZE = 1.2
"""Reported over found, or found over reported, up to which a size is right."""
GRADE = "consumer"
"""Of the gyroscope."""


@dataclass(frozen=True)
class Asked:
    """What is to be studied.

    Attributes:
        sensor: name of the sensor.
        design: poses of a session.
        colour: of the accelerometer's noise.
        same_poses: whether the recording with the effect has the poses, times and temperatures of
            the session whose sizes are told.
    """

    sensor: str
    design: str
    colour: str
    same_poses: bool = False


@dataclass(frozen=True)
class ReportedSizes:
    """The sizes that the program tells of one effect, (p,), and the setting that they are for."""

    seen: FloatArray
    named: FloatArray
    setting: float | None


@dataclass(frozen=True)
class Threshold:
    """From which size an effect is seen or named in one session, in units of the size reported.

    Attributes:
        what: ``seen`` or ``named``.
        low: largest size tried at which it is not; 0 without any.
        high: smallest size tried at which it is; infinite without any.
        wrong: whether another family was named at any size tried.
    """

    what: str
    low: float
    high: float
    wrong: bool = False


@cache
def _chances(asked: Asked) -> Chances:
    return chances_of(PLANS[asked.design], COLOURS[asked.colour])


def _field_plan(asked: Asked) -> sessions.Plan:
    return sessions.REPEATED if asked.design == "26+12" else sessions.STANDARD


def _poses(asked: Asked) -> str:
    return "26+repeats" if asked.design == "26+12" else "18"


def reported_sizes(asked: Asked, term: str, seed: int) -> ReportedSizes | None:
    """What the program tells of the session with nothing hidden."""
    if asked.sensor == ACCELEROMETER:
        sizes = Nameable(PLANS[asked.design], COLOURS[asked.colour], _chances(asked), [seed])
        known = sizes.usual(term)
        return ReportedSizes(sizes.detectable(term), sizes[term], known.variant) if known else None
    if asked.sensor == MAGNETOMETER:
        quiet = field_trials.quiet(_field_plan(asked), seed)
        return ReportedSizes(quiet.detectable[term], quiet.sizes[term], None)
    bench = benches_of(seed, GRADE, (), _poses(asked)).bench(GYROSCOPE)
    suspects = () if bench is None else bench.look().suspects
    one = next((one for one in suspects if one.term == term), None)
    return ReportedSizes(one.detectable, one.nameable, None) if one else None


def said(asked: Asked, hidden: Hidden, setting: float | None, seed: int) -> tuple[bool, list[str]]:
    """Whether a misfit is seen in another recording, with an effect, and the families named.

    Args:
        asked: what is studied.
        hidden: the effect.
        setting: of the effect.
        seed: of the session with nothing hidden, whose device it is.
    """
    other = int(np.random.default_rng([seed, 2]).integers(2**31))
    if asked.sensor == GYROSCOPE:
        benches = benches_of(other, GRADE, (hidden,), _poses(asked), device=seed)
        bench = benches.bench(GYROSCOPE)
        if bench is None:
            return False, []
        found = bench.look()
        return found.p <= SEEN_P, list(found.opinion.families)
    if asked.sensor == ACCELEROMETER:
        plan, colour, rng = (
            PLANS[asked.design],
            COLOURS[asked.colour],
            np.random.default_rng([other]),
        )
        # the session of the sizes told has drawn its schedule before all else
        told = drawn_schedule(plan, np.random.default_rng([seed])) if asked.same_poses else None
        recorded = record(plan, colour, (hidden,), rng, setting=setting, schedule=told)
        misfit = left_over(measured_of(recorded))
        return _judged(misfit, _chances(asked))
    field_plan = _field_plan(asked)
    session = sessions.session_of(field_plan, seed)
    if not asked.same_poses:
        session = replace(sessions.session_of(field_plan, other), model=session.model)
    rng = np.random.default_rng([other, 0])
    data = of_field.record(session, of_field.CONSUMER, (hidden,), rng)
    misfit = field_trials.left_over(data, fit(data))
    return _judged(misfit, field_trials.quiet(field_plan, seed).chances)


def _judged(misfit: WhitenedResiduals, chances: Chances) -> tuple[bool, list[str]]:
    hypotheses = hypothesis_set(misfit)
    posterior = hypotheses.posterior(misfit.residual)
    suspects = rank(misfit, hypotheses, posterior, chances)
    return suspects[0].p <= SEEN_P, list(judge_misfit(misfit, hypotheses, posterior).families)


def thresholds(asked: Asked, term: str, seed: int, number: int) -> list[Threshold]:
    """From which size an effect is seen in one session, and from which its family is named.

    Args:
        asked: what is studied.
        term: the effect.
        seed: of the study.
        number: of this session.
    """
    own = int(np.random.default_rng([seed, number, *map(ord, asked.sensor + term)]).integers(2**31))
    sizes = reported_sizes(asked, term, own)
    if sizes is None:
        return []
    family = effect(term).family or term
    typical = np.array([one.typical for one in effect(term).parameters(asked.sensor)])
    made = []
    for what, each in ((SEEN, sizes.seen), (NAMED, sizes.named)):
        usual = np.where(each < LARGEST * typical, each, np.inf)
        if not np.isfinite(usual).any():
            continue
        wrong: list[bool] = []

        def met(
            factor: float,
            what: str = what,
            usual: FloatArray = usual,
            wrong: list[bool] = wrong,
        ) -> bool:
            rng = np.random.default_rng([own, 1])
            hidden = hidden_in(asked.sensor, term, factor, usual, rng)
            seen, families = said(asked, hidden, sizes.setting, own)
            wrong.append(bool({*families} - {family}))
            return seen if what == SEEN else families == [family]

        made.append(Threshold(what, *enclosed(met), any(wrong)))
    return made


def enclosed(met: Callable[[float], bool]) -> tuple[float, float]:
    """The largest factor tried at which a rule is not met, and the smallest at which it is.

    The first one tried is 1. Zero where it is met at all of them, infinite where at none.
    """
    low, high, factor = 0.0, np.inf, 1.0
    for _ in range(TRIES):
        if met(factor):
            high = factor
        else:
            low = factor
        inside = low > 0.0 and high < np.inf
        factor = float(np.sqrt(low * high)) if inside else low * STEP or high / STEP
    return low, high


def reported_over_found(each: Sequence[Threshold], deviate: float) -> tuple[float, float, float]:
    """Size reported over the size found: the median and the ends of its 90 % interval."""
    low, high = np.array([one.low for one in each]), np.array([one.high for one in each])
    middle, width = np.meshgrid(np.linspace(0.1, 3.0, 146), np.geomspace(0.03, 0.8, 40))
    ends = [(one[:, None, None] - middle) / width for one in (low, high)]
    share = ndtr(ends[1]) - ndtr(ends[0])
    likely = np.log(np.maximum(share, 1e-12)).sum(axis=0)
    weight = np.exp(likely - likely.max()).ravel()
    found = (middle + deviate * width).ravel()
    order = np.argsort(found)
    total = np.cumsum(weight[order])
    sizes = [float(found[order][np.searchsorted(total, q * total[-1])]) for q in (0.5, 0.95, 0.05)]
    return 1.0 / sizes[0], 1.0 / sizes[1], 1.0 / sizes[2]


def terms_of(sensor: str) -> list[str]:
    """The effects that can be hidden."""
    return [one.name for one in effects_for(sensor) if one.name not in {*NEVER, ALIGNED}]


def line(name: str, each: Sequence[Threshold]) -> tuple[str, int, int]:
    """One row of the table, how many of its sizes are right, and how many it has."""
    row, right, count = f"{name:<26}", 0, 0
    for what, deviate in DEVIATES.items():
        own = [one for one in each if one.what == what]
        if not own:
            row += f"{what + ' at no size':>31}"
            continue
        ratio, low, high = reported_over_found(own, deviate)
        met = sum(one.low < 1.0 for one in own)
        row += f"{f'{ratio:.2f} [{low:.2f}, {high:.2f}]':>22}{f'{met}/{len(own)}':>9}"
        right, count = right + (1.0 / RIGHT_SIZE <= ratio <= RIGHT_SIZE), count + 1
    return f"{row}{sum(one.wrong for one in each):6d}", right, count


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
    parser.add_argument("--same-poses", action="store_true")
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    if given.same_poses and given.sensor == GYROSCOPE:
        parser.error("the hand that turns a gyroscope and its noise have one seed")
    asked = Asked(given.sensor, given.design, given.colour, given.same_poses)
    print(machine())
    where = "the same poses and temperatures" if asked.same_poses else "other poses"
    print(f"{asked.sensor}, {asked.design} poses, found in recordings with {where}:")
    print("size told over size found [90 %], at that told")
    print(f"{'hidden':<26}{'seen':>22}{'':>9}{'named':>22}{'':>9}{'wrong':>6}")
    every: list[Threshold] = []
    right = count = 0
    with ProcessPoolExecutor(given.jobs) as pool:
        for term in terms_of(asked.sensor):
            if given.only and not any(word in term for word in given.only):
                continue
            work = partial(thresholds, asked, term, given.seed)
            own = [one for some in pool.map(work, range(given.recordings)) for one in some]
            if not own:
                continue
            every += own
            row, *counts = line(term, own)
            right, count = right + counts[0], count + counts[1]
            print(row, flush=True)
    print(line("all", every)[0])
    low, high = interval(right, count)
    print(f"within 20 %: {right} of {count} sizes [{low:.0f}, {high:.0f}] %")


if __name__ == "__main__":
    main()
