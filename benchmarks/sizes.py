"""Whether the sizes that are reported are right: ``python -m benchmarks.sizes``.

In a session with nothing hidden the program tells from which size it sees an effect (some suspect
has p ≤ 0.01) in 95 of 100 sessions like this one, and from which it names the family in 90 of 100.
Each of several devices has several sessions, with the same poses at the same times and
temperatures and with new noise. The size that is found is the 95th or 90th centile of the sizes
from which the program sees or names the effect, hidden by the simulator, in these sessions; the
devices are put together in units of the median size that is told of each. What the program says at
other sizes than the one hidden follows from the misfits without the effect and with it, which are
linear in the size. The noise of all devices is alike. Scales and biases are new in each session of
the accelerometer, and those of the device in each session of the gyroscope, whose recordings also
have the same hand: its poses, rotations, placement errors and wobble.

The table has, for each effect, the median of told over found with its 90 % interval, the share of
tellings within 20 % of the size found, told over found of the middle 80 % of the tellings (the
scatter from one session to the next), and the share of tellings whose own 90 % interval contains
the size found. The last column counts the sessions in which another family was named at any size
that was tried.

A 95th centile needs many sessions. The upper end of its interval by order statistics is the largest
of 60 sizes, and 48 sizes have no upper end. Of an accelerometer's drift on 18 poses, one
session in twenty needs 1.1 times the size told, and one in a hundred 1.7 times: told over found of
48 of 240 such sessions is 0.73 to 1.09 in nine draws of ten, and 0.89 of all.

    --sensor       accelerometer (hold means, as in ``hidden_effects``), gyroscope (raw recordings
                   through the whole program) or magnetometer (as in ``hidden_magnetometer``)
    --design       18 or 26+12 poses
    --devices      number of devices; --recordings sessions of each
    --any-poses    the poses are drawn anew in each session, and the size found is that of all of
                   them
    --seed         of the study; other seeds give other sessions
    --only         part of an effect's name
    --colour       of the accelerometer's noise; --noise the size of it over that of the colour, or
                   of the noise of a device with a gyroscope over that of a consumer's
"""

import argparse
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from benchmarks.hidden.designs import PLANS, drawn_schedule
from benchmarks.hidden.fitted import left_over, measured_of
from benchmarks.hidden.noise import COLOURS
from benchmarks.hidden.recording import record
from benchmarks.hidden.scenarios import LARGEST
from benchmarks.hidden.whole import NEVER, benches_of
from benchmarks.hidden_field import recording as of_field
from benchmarks.hidden_field import sessions
from benchmarks.hidden_field import trialled as field_trials
from benchmarks.hidden_field.scenarios import ALIGNED
from benchmarks.measure import Wanted, machine
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
from imucal_wizard.simulate.sensor import SensorModel

SEEN, NAMED = "seen", "named"
SHARES = {SEEN: 0.95, NAMED: 0.90}
"""Of recordings, that the sizes are reported for."""
RIGHT_SIZE = 1.2
"""Reported over found, or found over reported, up to which a size is right."""
REACH = 6.0
"""Largest size looked at, over the one told of the device, and the smallest under it."""
HALVINGS = 7
"""Of the range of sizes between these two: to 2 %."""

Over = Callable[[Callable[..., Any], Iterable[Any]], Iterable[Any]]
"""Calls a function for each of several values."""


@dataclass(frozen=True)
class Asked:
    """What is to be studied.

    Attributes:
        sensor: name of the sensor.
        design: poses of a session.
        colour: of the accelerometer's noise.
        noise: size of this noise over that of the colour; for the gyroscope, size of the noise of
            the whole device over that of a consumer's.
        same_poses: whether all sessions of a device have the same poses, times and temperatures,
            and the same hand.
    """

    sensor: str
    design: str
    colour: str = "consumer"
    noise: float = 1.0
    same_poses: bool = True


@dataclass(frozen=True)
class Told:
    """What the program tells of one effect in one session.

    Attributes:
        sizes: the size of each parameter that is seen, and named, shape (p,).
        setting: of the effect, that these sizes are for.
        uncertainty: ends of the 90 % interval of both sizes, over the sizes, shape (2, p).
    """

    sizes: dict[str, FloatArray]
    setting: float | None
    uncertainty: FloatArray


Seeds = tuple[int, int]
"""Of a device with its poses, and of the noise of a session."""


@dataclass(frozen=True)
class Session:
    """One session, mostly with nothing hidden.

    Attributes:
        seeds: of the device, and of the session.
        left: what the fit leaves, whitened, shape (n,).
        told: what the program tells of each effect.
    """

    seeds: Seeds
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
    asked: Asked, seeds: Seeds, hidden: Sequence[Hidden] = (), setting: float | None = None
) -> WhitenedResiduals | None:
    """What the fit of a session leaves; None where there is none.

    Args:
        asked: what is studied.
        seeds: of the device, and of the session.
        hidden: the effects.
        setting: of the effects, s.
    """
    if asked.sensor == GYROSCOPE:
        poses = "26+repeats" if asked.design == "26+12" else "18"
        own = int(np.random.default_rng(seeds).integers(2**31))
        model = SensorModel.drawn(seeds[0]).with_noise(asked.noise)
        hand = seeds[0] if asked.same_poses else own
        bench = benches_of(own, model, hidden, poses, hand).bench(GYROSCOPE)
        return None if bench is None else bench.look().misfit
    rng, of_poses = np.random.default_rng(seeds), seeds[0] if asked.same_poses else sum(seeds)
    if asked.sensor == ACCELEROMETER:
        plan, colour = PLANS[asked.design], COLOURS[asked.colour].scaled(asked.noise)
        schedule = drawn_schedule(plan, np.random.default_rng(of_poses))
        recorded = record(plan, colour, hidden, rng, setting=setting, schedule=schedule)
        return left_over(measured_of(recorded))
    field_plan = sessions.REPEATED if asked.design == "26+12" else sessions.STANDARD
    session = sessions.session_of(field_plan, of_poses)
    data = of_field.record(session, of_field.CONSUMER, hidden, rng)
    return field_trials.left_over(data, fit(data))


def session_told(
    asked: Asked,
    terms: Sequence[str],
    seeds: Seeds,
    hidden: Sequence[Hidden] = (),
    setting: float | None = None,
) -> Session | None:
    """What the program tells of some effects in a session; see ``misfit_of``."""
    misfit = misfit_of(asked, seeds, hidden, setting)
    if misfit is None:
        return None
    hypotheses = hypothesis_set(misfit)
    suspects = rank(misfit, hypotheses, hypotheses.posterior(misfit.residual))
    told = {
        one.term: Told(
            {SEEN: one.detectable, NAMED: one.nameable}, one.sized.variant, one.uncertainty
        )
        for one in suspects
        if one.term in terms and one.sized is not None
    }
    return Session(seeds, misfit.residual, told)


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
    rng = np.random.default_rng([*session.seeds, *map(ord, term)])
    shown = np.flatnonzero(np.isfinite(usual[SEEN]))
    place, sign = int(rng.choice(shown)), float(rng.choice((-1.0, 1.0)))
    axes = tuple("xyz".index(letter) for letter in parameters[place].name)
    size = max(float(each[place]) for each in usual.values() if np.isfinite(each[place]))
    hidden = [Hidden(asked.sensor, term, sign * size, axes)]
    misfit = misfit_of(asked, session.seeds, hidden, setting)
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

    sizes = {}
    for what, met in ((SEEN, seen), (NAMED, named)):
        told = float(usual[what][place])
        sizes[what] = size * least_factor(met, told / size if np.isfinite(told) else 1.0)
    return Least(place, sizes, any(wrong))


def least_factor(met: Callable[[float], bool], near: float) -> float:
    """The factor from which on a rule is met, within ``REACH`` times what it is told to be."""
    low, high = -1.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if met(near * REACH**middle) else (middle, high)
    return float(near * REACH ** (0.5 * (low + high)))


@dataclass(frozen=True, eq=False)
class Compared:
    """Told and found of n sessions, in units of the usual size of the device and parameter.

    Attributes:
        what: ``seen`` or ``named``.
        told: of p parameters, NaN where they do not show, shape (n, p).
        found: the least size of the parameter that was hidden, shape (n,).
        uncertainty: ends of the intervals told, over what is told, shape (n, 2, p).
    """

    what: str
    told: FloatArray
    found: FloatArray
    uncertainty: FloatArray

    @cached_property
    def size_found(self) -> float:
        """The centile of the sizes from which an effect is seen or named."""
        from scipy.stats.mstats import hdquantiles  # takes long to import

        return float(hdquantiles(self.found, SHARES[self.what])[0])

    @cached_property
    def ratios(self) -> FloatArray:
        """Told over found, of each telling."""
        return np.asarray(self.told[~np.isnan(self.told)] / self.size_found)

    @property
    def inside(self) -> float:
        """Share of the tellings whose interval contains the size found."""
        with np.errstate(invalid="ignore"):  # where a parameter does not show
            ends = self.told[:, None] * self.uncertainty
            inside = (ends[:, 0] <= self.size_found) & (ends[:, 1] >= self.size_found)
        return float(inside[~np.isnan(self.told)].mean())

    @cached_property
    def interval(self) -> tuple[float, float, float]:
        """The median of told over found, and the ends of its 90 % interval.

        The ends of both, by order statistics, are put together like those of independent errors.
        There is no upper end of the 95th centile in fewer than 59 sessions, and of the 90th in
        fewer than 29: the lower end is then 0.
        """
        told = np.nanmedian(self.told, axis=1)
        ratio = float(np.median(self.ratios))
        fewer, more = _log_ends(told, 0.5, float(np.median(told)))
        smaller, larger = _log_ends(self.found, SHARES[self.what], self.size_found)
        low, high = np.exp([-np.hypot(fewer, larger), np.hypot(more, smaller)])
        return ratio, ratio * float(low), ratio * float(high)

    @property
    def may_be_right(self) -> bool:
        """Whether the median is within 20 %, as far as these sessions tell."""
        _, low, high = self.interval
        return low < RIGHT_SIZE and high > 1.0 / RIGHT_SIZE


def _log_ends(values: FloatArray, share: float, middle: float) -> tuple[float, float]:
    """How far the ends of a centile's 90 % interval lie below and above it, in logarithms."""
    from scipy.stats import quantile_test  # takes long to import

    found = quantile_test(values, q=middle, p=share).confidence_interval(0.9)
    # too few values for an end are told by NaN
    ends = np.nan_to_num([middle / found.low, found.high / middle], nan=np.inf)
    below, above = np.log(np.maximum(ends, 1.0))
    return float(below), float(above)


def of_device(
    asked: Asked, term: str, every: Sequence[Session], over: Over
) -> Iterator[tuple[dict[str, FloatArray], Told, Least]]:
    """The usual sizes of one effect on a device, and what is told and found in each session."""
    every = [one for one in every if term in one.told]
    told = [one.told[term] for one in every]
    usual = usual_sizes(term, asked.sensor, told)
    if not np.isfinite(usual.get(SEEN, np.inf)).any():
        return
    settings = [one.setting for one in told if one.setting is not None]
    setting = float(np.median(settings)) if settings else None
    work = partial(least_sizes, asked, term, usual, setting)
    for one, least in zip(told, over(work, every), strict=True):
        if least is not None:
            yield usual, one, least


def study(
    asked: Asked, terms: Sequence[str], seeds: Sequence[Seeds], over: Over = map
) -> Iterator[tuple[str, list[Compared], int]]:
    """Of each effect what is told and found, and in how many sessions another one was named.

    Args:
        asked: what is studied.
        terms: the effects.
        seeds: of the devices and sessions.
        over: calls a function for each of several values, as ``map`` does.
    """
    every = [one for one in over(partial(session_told, asked, terms), seeds) if one is not None]
    groups: dict[int, list[Session]] = defaultdict(list)
    for session in every:
        groups[session.seeds[0] if asked.same_poses else 0].append(session)
    for term in terms:
        found = [one for group in groups.values() for one in of_device(asked, term, group, over)]
        each = []
        for what in SHARES:
            unit = [np.where(np.isfinite(usual[what]), usual[what], np.nan) for usual, *_ in found]
            told = [one.sizes[what] / own for own, (_, one, _) in zip(unit, found, strict=True)]
            least = [
                one.sizes[what] / own[one.place] for own, (*_, one) in zip(unit, found, strict=True)
            ]
            shown = np.isfinite(least)
            if shown.sum() > 1:  # one size has no centile
                ends = np.array([one.uncertainty for _, one, _ in found])[shown]
                each.append(Compared(what, np.array(told)[shown], np.array(least)[shown], ends))
        if each:
            yield term, each, sum(least.wrong for *_, least in found)


def terms_of(sensor: str) -> list[str]:
    """The effects that can be hidden."""
    return [one.name for one in effects_for(sensor) if one.name not in {*NEVER, ALIGNED}]


def seeds_of(asked: Asked, seed: int, devices: int, sessions_of_each: int) -> list[Seeds]:
    """Seeds of the devices and sessions of a study."""
    rng = np.random.default_rng([seed, *map(ord, asked.sensor + asked.design)])
    drawn = [int(one) for one in rng.integers(2**30, size=devices)]
    return [(one, number) for one in drawn for number in range(sessions_of_each)]


def line(name: str, each: Sequence[Compared], wrong: int) -> str:
    """One row of the table."""
    row = f"{name:<18}"
    for what in SHARES:
        one = next((one for one in each if one.what == what), None)
        if one is None:
            row += f"{'at no size':>44}"
            continue
        ratio, low, high = one.interval
        ratios = one.ratios
        near = 100.0 * np.mean((ratios < RIGHT_SIZE) & (ratios > 1.0 / RIGHT_SIZE))
        ends = np.quantile(ratios, (0.1, 0.9))
        row += f"{f'{ratio:.2f} [{low:.2f}, {high:.2f}]':>19}{near:5.0f} %"
        row += f"{f'{ends[0]:.2f}–{ends[1]:.2f}':>11}{100.0 * one.inside:5.0f} %"
    return f"{row}{wrong:6d}"


def main() -> None:
    """Print the table of one sensor and design."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sensor", default=ACCELEROMETER, choices=SENSORS)
    parser.add_argument("--design", default="26+12", choices=("18", "26+12"))
    parser.add_argument("--colour", default="consumer", choices=sorted(COLOURS))
    parser.add_argument("--noise", type=float, default=1.0, help="over that of the colour")
    parser.add_argument("--devices", type=int, default=8)
    parser.add_argument("--recordings", type=int, default=15)
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--only", action="append", default=[], help="part of an effect's name")
    parser.add_argument("--any-poses", action="store_true")
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    same_poses = not given.any_poses
    asked = Asked(given.sensor, given.design, given.colour, given.noise, same_poses)
    words = given.only or [""]
    terms = [term for term in terms_of(asked.sensor) if any(word in term for word in words)]
    print(machine())
    poses = "the same" if same_poses else "new"
    noise = "" if asked.noise == 1.0 else f", noise of {asked.colour} times {asked.noise:g}"
    print(f"{asked.sensor}, {asked.design} poses, {poses} in each session of a device{noise}:")
    print(f"{given.devices} devices, {given.recordings} sessions of each, seed {given.seed}")
    columns = f"{'right':>7}{'80 %':>11}{'inside':>7}"
    print(f"{'hidden':<18}{'seen told/found':>19}{columns}{'named told/found':>19}{columns} wrong")
    wanted = Wanted()
    with ProcessPoolExecutor(given.jobs) as pool:
        seeds = seeds_of(asked, given.seed, given.devices, given.recordings)
        for term, each, wrong in study(asked, terms, seeds, pool.map):
            for one in each:
                median, low, high = one.interval
                if not 1.0 / RIGHT_SIZE < median < RIGHT_SIZE:
                    near = low < RIGHT_SIZE and high > 1.0 / RIGHT_SIZE
                    chance = ", within its interval" if near else ""
                    wanted.missed.append(f"{term} {one.what} ({median:.2f}{chance})")
            print(line(term, each, wrong), flush=True)
    print(wanted)


if __name__ == "__main__":
    main()
