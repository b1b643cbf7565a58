"""Whether the sizes that are reported are right: ``python -m benchmarks.sizes``.

From each session with nothing hidden the program tells the size of an effect at which a misfit
is seen (some suspect has p ≤ 0.01) in 95 of 100 other recordings of such a device by the same
procedure, and the size at which the family is named in 90 of 100. The size that is found is the
95th or 90th centile, over all sessions of the study, of the size from which the program sees or
names the effect, hidden by the simulator. Sessions differ in device, poses, their order, and noise;
the devices differ in their errors, not in their noise. What the program says at other sizes than
the one hidden follows from the misfits without the effect and with it, which are linear in it.

The table has, for each effect, the median of told over found with its 90 % interval (bootstrap over
the sessions), the share of tellings within 20 % of the size found, and told over found of the
middle 80 % of the tellings: the scatter from one recording to the next. The last column counts the
sessions in which another family was named at any size that was tried.

    --sensor       accelerometer (hold means, as in ``hidden_effects``), gyroscope (raw recordings
                   through the whole program) or magnetometer (as in ``hidden_magnetometer``)
    --design       18 or 26+12 poses
    --recordings   sessions
    --seed         of the study; other seeds give other sessions
    --only         part of an effect's name; --colour of the accelerometer's noise
"""

import argparse
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from benchmarks.complete import interval
from benchmarks.hidden.designs import PLANS
from benchmarks.hidden.fitted import left_over, measured_of
from benchmarks.hidden.noise import COLOURS
from benchmarks.hidden.recording import record
from benchmarks.hidden.scenarios import LARGEST
from benchmarks.hidden.whole import NEVER, benches_of
from benchmarks.hidden_field import recording as of_field
from benchmarks.hidden_field import sessions
from benchmarks.hidden_field import trialled as field_trials
from benchmarks.hidden_field.scenarios import ALIGNED
from benchmarks.measure import machine
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose.posterior import hypothesis_set
from imucal_wizard.diagnose.residuals import WhitenedResiduals
from imucal_wizard.diagnose.significance import SEEN_P, Chances, log_odds, members
from imucal_wizard.diagnose.suspects import rank
from imucal_wizard.diagnose.verdict import judge_misfit
from imucal_wizard.estimate.fit import fit
from imucal_wizard.model.catalogue import effect, effects_for
from imucal_wizard.model.effect import ACCELEROMETER, GYROSCOPE, SENSORS
from imucal_wizard.simulate.hidden import Hidden

SEEN, NAMED = "seen", "named"
SHARES = {SEEN: 0.95, NAMED: 0.90}
"""Of recordings, that the sizes are reported for."""
RIGHT_SIZE = 1.2
"""Reported over found, or found over reported, up to which a size is right."""
REACH = 6.0
"""Largest size looked at, over the one hidden, and the smallest under it."""
HALVINGS = 7
"""Of the range of sizes between these two: to 2 %."""
RESAMPLES = 400
"""Of the sessions."""
GRADE = "consumer"
"""Of the gyroscope."""

Over = Callable[[Callable[..., Any], Iterable[Any]], Iterable[Any]]
"""Calls a function for each of several values."""


@dataclass(frozen=True)
class Asked:
    """What is to be studied.

    Attributes:
        sensor: name of the sensor.
        design: poses of a session.
        colour: of the accelerometer's noise.
    """

    sensor: str
    design: str
    colour: str = "consumer"


@dataclass(frozen=True)
class Told:
    """What the program tells of one effect in one session.

    Attributes:
        sizes: the size of each parameter that is seen, and named, shape (p,).
        setting: of the effect, that these sizes are for.
    """

    sizes: dict[str, FloatArray]
    setting: float | None


@dataclass(frozen=True)
class Session:
    """One session with nothing hidden.

    Attributes:
        seed: of the session.
        left: what the fit leaves, whitened, shape (n,).
        told: what the program tells of each effect.
    """

    seed: int
    left: FloatArray
    told: dict[str, Told]


@dataclass(frozen=True)
class Least:
    """The size from which an effect is seen or named in one session.

    Attributes:
        place: of the parameter that was hidden.
        sizes: of this parameter.
        wrong: whether another family was named at any size that was tried.
    """

    place: int
    sizes: dict[str, float]
    wrong: bool


def misfit_of(
    asked: Asked, seed: int, hidden: Sequence[Hidden] = (), setting: float | None = None
) -> WhitenedResiduals | None:
    """What the fit of a session leaves; None where there is none.

    Args:
        asked: what is studied.
        seed: of the session: device, poses and noise.
        hidden: the effects.
        setting: of the effects, s.
    """
    if asked.sensor == GYROSCOPE:
        poses = "26+repeats" if asked.design == "26+12" else "18"
        bench = benches_of(seed, GRADE, hidden, poses).bench(GYROSCOPE)
        return None if bench is None else bench.look().misfit
    if asked.sensor == ACCELEROMETER:
        plan, colour = PLANS[asked.design], COLOURS[asked.colour]
        rng = np.random.default_rng([seed])
        return left_over(measured_of(record(plan, colour, hidden, rng, setting=setting)))
    session = sessions.session_of(
        sessions.REPEATED if asked.design == "26+12" else sessions.STANDARD, seed
    )
    rng = np.random.default_rng([seed, 0])
    data = of_field.record(session, of_field.CONSUMER, hidden, rng)
    return field_trials.left_over(data, fit(data))


def session_told(asked: Asked, terms: Sequence[str], seed: int) -> Session | None:
    """What the program tells of a session with nothing hidden."""
    misfit = misfit_of(asked, seed)
    if misfit is None:
        return None
    hypotheses = hypothesis_set(misfit)
    suspects = rank(misfit, hypotheses, hypotheses.posterior(misfit.residual))
    told = {
        one.term: Told({SEEN: one.detectable, NAMED: one.nameable}, one.sized.variant)
        for one in suspects
        if one.term in terms and one.sized is not None
    }
    return Session(seed, misfit.residual, told)


def usual_sizes(term: str, sensor: str, every: Sequence[Told]) -> dict[str, FloatArray]:
    """The median of what is told; infinite where no effect so large is to be expected."""
    largest = LARGEST * np.array([one.typical for one in effect(term).parameters(sensor)])
    found = {what: np.median([one.sizes[what] for one in every], axis=0) for what in SHARES}
    return {what: np.where(each < largest, each, np.inf) for what, each in found.items()}


def least_sizes(
    asked: Asked,
    term: str,
    usual: dict[str, FloatArray],
    setting: float | None,
    session: Session,
) -> Least | None:
    """From which size an effect is seen in a session, and from which its family is named.

    Args:
        asked: what is studied.
        term: the effect.
        usual: sizes of about which it is to be hidden.
        setting: of the effect, s.
        session: the session.
    """
    parameters = effect(term).parameters(asked.sensor)
    rng = np.random.default_rng([session.seed, *map(ord, term)])
    shown = np.flatnonzero(np.isfinite(usual[SEEN]))
    place, sign = int(rng.choice(shown)), float(rng.choice((-1.0, 1.0)))
    axes = tuple("xyz".index(letter) for letter in parameters[place].name)
    size = max(float(each[place]) for each in usual.values() if np.isfinite(each[place]))
    misfit = misfit_of(
        asked, session.seed, [Hidden(asked.sensor, term, sign * size, axes)], setting
    )
    if misfit is None or len(misfit) != len(session.left):
        return None
    moved = misfit.residual - session.left
    hypotheses = hypothesis_set(misfit)
    chances, suspects = Chances(hypotheses), members(hypotheses)
    family, wrong = effect(term).family or term, []

    def seen(factor: float) -> bool:
        posterior = hypotheses.posterior(session.left + factor * moved)
        odds = (log_odds(posterior.evidence, hypotheses, each) for each in suspects.values())
        return chances.p(float(max(odds)), posterior.noise) <= SEEN_P

    def named(factor: float) -> bool:
        left = replace(misfit, residual=session.left + factor * moved)
        families = judge_misfit(left, hypotheses, hypotheses.posterior(left.residual)).families
        wrong.append(bool({*families} - {family}))
        return families == (family,)

    sizes = {what: size * least_factor(met) for what, met in ((SEEN, seen), (NAMED, named))}
    return Least(place, sizes, any(wrong))


def least_factor(met: Callable[[float], bool]) -> float:
    """The factor from which on a rule is met, at most ``REACH`` and at least its inverse."""
    low, high = -1.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if met(REACH**middle) else (middle, high)
    return float(REACH ** (0.5 * (low + high)))


@dataclass(frozen=True, eq=False)
class Compared:
    """Told and found of n sessions, in units of the usual size of the parameter.

    Attributes:
        what: ``seen`` or ``named``.
        told: of p parameters, shape (n, p).
        found: the least size of the parameter that was hidden, shape (n,).
    """

    what: str
    told: FloatArray
    found: FloatArray

    def ratios(self, own: FloatArray | slice = slice(None)) -> FloatArray:
        """Told over found, of each telling of some sessions."""
        from scipy.stats.mstats import hdquantiles  # takes long to import

        return self.told[own].ravel() / float(hdquantiles(self.found[own], SHARES[self.what])[0])

    @cached_property
    def interval(self) -> tuple[float, float, float]:
        """The median of told over found, and the ends of its 90 % interval."""
        rng = np.random.default_rng(0)
        drawn = rng.integers(len(self.found), size=(RESAMPLES, len(self.found)))
        resampled = [float(np.median(self.ratios(own))) for own in drawn]
        low, high = np.quantile(resampled, (0.05, 0.95))
        return float(np.median(self.ratios())), float(low), float(high)

    @property
    def may_be_right(self) -> bool:
        """Whether the median is within 20 %, as far as these sessions tell."""
        _, low, high = self.interval
        return low < RIGHT_SIZE and high > 1.0 / RIGHT_SIZE


def compared(
    usual: dict[str, FloatArray], told: Sequence[Told], least: Sequence[Least]
) -> list[Compared]:
    """Told and found of one effect.

    Args:
        usual: sizes of each parameter.
        told: what each session tells.
        least: what was found in it.
    """
    made = []
    for what, sizes in usual.items():
        shown = np.isfinite(sizes)
        own = np.array([shown[one.place] for one in least])
        if not own.any():
            continue
        every = np.array([one.sizes[what][shown] for one in told])[own] / sizes[shown]
        found = np.array([one.sizes[what] / sizes[one.place] for one in least])[own]
        made.append(Compared(what, every, found))
    return made


def study(
    asked: Asked, terms: Sequence[str], seeds: Sequence[int], over: Over = map
) -> Iterator[tuple[str, list[Compared], int]]:
    """Of each effect what is told and found, and in how many sessions another one was named.

    Args:
        asked: what is studied.
        terms: the effects.
        seeds: of the sessions.
        over: calls a function for each of several values, as ``map`` does.
    """
    every = [one for one in over(partial(session_told, asked, terms), seeds) if one is not None]
    for term in terms:
        sessions_with = [one for one in every if term in one.told]
        if not sessions_with:
            continue
        told = [one.told[term] for one in sessions_with]
        usual = usual_sizes(term, asked.sensor, told)
        if not np.isfinite(usual[SEEN]).any():
            continue
        settings = [one.setting for one in told if one.setting is not None]
        setting = float(np.median(settings)) if settings else None
        work = partial(least_sizes, asked, term, usual, setting)
        both = [
            (one, least)
            for one, least in zip(told, over(work, sessions_with), strict=True)
            if least is not None
        ]
        told, found = [one for one, _ in both], [least for _, least in both]
        yield term, compared(usual, told, found), sum(least.wrong for least in found)


def terms_of(sensor: str) -> list[str]:
    """The effects that can be hidden."""
    return [one.name for one in effects_for(sensor) if one.name not in {*NEVER, ALIGNED}]


def seeds_of(asked: Asked, seed: int, count: int) -> list[int]:
    """Seeds of the sessions of a study."""
    rng = np.random.default_rng([seed, *map(ord, asked.sensor + asked.design)])
    return [int(one) for one in rng.integers(2**31, size=count)]


def line(name: str, each: Sequence[Compared], wrong: int) -> str:
    """One row of the table."""
    row = f"{name:<20}"
    for what in SHARES:
        one = next((one for one in each if one.what == what), None)
        if one is None:
            row += f"{'at no size':>36}"
            continue
        ratio, low, high = one.interval
        ratios = one.ratios()
        near = 100.0 * np.mean((ratios < RIGHT_SIZE) & (ratios > 1.0 / RIGHT_SIZE))
        ends = np.quantile(ratios, (0.1, 0.9))
        row += f"{f'{ratio:.2f} [{low:.2f}, {high:.2f}]':>19}{near:5.0f} %"
        row += f"{f'{ends[0]:.2f}–{ends[1]:.2f}':>11}"
    return f"{row}{wrong:6d}"


def main() -> None:
    """Print the table of one sensor and design."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sensor", default=ACCELEROMETER, choices=SENSORS)
    parser.add_argument("--design", default="26+12", choices=("18", "26+12"))
    parser.add_argument("--colour", default="consumer", choices=sorted(COLOURS))
    parser.add_argument("--recordings", type=int, default=60)
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--only", action="append", default=[], help="part of an effect's name")
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    asked = Asked(given.sensor, given.design, given.colour)
    words = given.only or [""]
    terms = [term for term in terms_of(asked.sensor) if any(word in term for word in words)]
    print(machine())
    print(f"{asked.sensor}, {asked.design} poses, {given.recordings} sessions, seed {given.seed}")
    head = f"{'told/found [90 %]':>19}{'right':>7}{'middle 80 %':>11}"
    print(f"{'hidden':<20}{head.replace('told', 'seen: told')}{head}{'wrong':>6}")
    right: list[bool] = []
    with ProcessPoolExecutor(given.jobs) as pool:
        seeds = seeds_of(asked, given.seed, given.recordings)
        for term, each, wrong in study(asked, terms, seeds, pool.map):
            right += [1.0 / RIGHT_SIZE < one.interval[0] < RIGHT_SIZE for one in each]
            print(line(term, each, wrong), flush=True)
    low, high = interval(sum(right), len(right))
    print(f"medians within 20 %: {sum(right)} of {len(right)} [{low:.0f}, {high:.0f}] %")


if __name__ == "__main__":
    main()
