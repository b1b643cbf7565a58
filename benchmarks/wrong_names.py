"""Names given to what they do not describe: ``python -m benchmarks.wrong_names``.

Twenty-one kinds of structure, of which some are no effect of the catalogue, some are effects that
others imitate, and some are exact aliases of others at 1 g. Accelerometers are those of
``benchmarks.hidden``, gyroscopes those of ``benchmarks.gyroscope_bound``; neither shares a formula
with the program. Devices differ: 0.1 to 10 times the usual noise, 12 to 20 bits, 25 to 1,600
samples per second; sessions have 18 poses or 26 and 12 repeats (a gyroscope: 18 or 26 poses, all
with 12 more rotations). What bias, scale and angles cannot take up of a structure has an rms of 3
to 8 times the noise of a hold's mean, or of a closure.

Two answers are counted for each recording: that to the base model (``bench``) and that at the end
(``bench --auto``). A name is wrong if it is given by one of them (``missing``, named members of a
family, or added to the model) and what is true is not among the members listed with it. An exact
alias that is listed as an alternative is not wrong. ``probable`` counts wrong names in "probably
this, not yet certain", which are no names.

    --recordings   of each kind
    --seed         seeds below 10 were looked at while effects and limits were chosen
    --only         part of a kind's name
"""

import argparse
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks.gyroscope_bound import RATE, Session, WrongRate, fitted
from benchmarks.gyroscope_bound import Device as TurnedDevice
from benchmarks.hidden import strangers
from benchmarks.hidden.designs import PLANS
from benchmarks.hidden.fitted import measured_of
from benchmarks.hidden.noise import CONSUMER
from benchmarks.hidden.recording import Device, Extra, record
from benchmarks.hidden.strangers import Visible
from benchmarks.measure import Wanted, interval, machine
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose.bench import Bench, BenchFindings
from imucal_wizard.diagnose.survey import add_by_itself
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.model.effect import ACCELEROMETER, GYROSCOPE
from tests.estimate.truth import EIGHTEEN, TWENTY_SIX

TIMES = 3.0, 8.0
"""Rms of what is visible of a structure, in units of the noise of a hold's mean or of a closure."""
USUAL_NOISE = 0.12
"""Of a hold's mean of the consumer sensor with its flicker noise, mg."""
MAX_OF_KIND, MAX_OF_ALL = 5.0, 1.0
"""Wrong names that are allowed."""


@dataclass(frozen=True)
class Delayed(WrongRate):
    """One axis that answers late."""

    axis: int
    seconds: float

    def error(self, time: FloatArray, rate: FloatArray, up: FloatArray) -> FloatArray:
        """The rate of a moment before, less that of now."""
        del up
        error = np.zeros_like(rate)
        if len(time) > 1:
            course = CubicSpline(time, rate[:, self.axis])
            before = course(np.maximum(time - self.seconds, time[0]))
            error[:, self.axis] = before - rate[:, self.axis]
        return error


@dataclass(frozen=True)
class Cubed(WrongRate):
    """One axis feels the third power of the force along one axis."""

    out: int
    felt: int
    size: float

    def error(self, time: FloatArray, rate: FloatArray, up: FloatArray) -> FloatArray:
        """In rest and in motion."""
        del time
        error = np.zeros_like(rate)
        error[:, self.out] = self.size * up[:, self.felt] ** 3
        return error


@dataclass(frozen=True)
class Anisoelastic(WrongRate):
    """One axis feels the product of two components of the force."""

    out: int
    without: int
    size: float

    def error(self, time: FloatArray, rate: FloatArray, up: FloatArray) -> FloatArray:
        """In rest and in motion."""
        del time
        error = np.zeros_like(rate)
        error[:, self.out] = self.size * np.delete(up, self.without, axis=1).prod(axis=1)
        return error


@dataclass(frozen=True)
class Jumping(WrongRate):
    """One axis whose error jumps where its rate passes a value."""

    axis: int
    level: float
    size: float

    def error(self, time: FloatArray, rate: FloatArray, up: FloatArray) -> FloatArray:
        """At rest, too, where the level is below zero."""
        del time, up
        error = np.zeros_like(rate)
        error[:, self.axis] = self.size * (rate[:, self.axis] > self.level)
        return error


@dataclass(frozen=True)
class FasterClock(WrongRate):
    """A clock whose rate changes evenly: all axes by the same share."""

    per_second: float

    def error(self, time: FloatArray, rate: FloatArray, up: FloatArray) -> FloatArray:
        """More of the rate the later it is."""
        del up
        return np.asarray(self.per_second * time[:, None] * rate)


@dataclass(frozen=True)
class OtherAxes(WrongRate):
    """Axes that change: once, or evenly over a stretch of the session.

    Attributes:
        change: what each axis then feels more of the rate about each other one, shape (3, 3).
        begin: of the change, s.
        lasts: how long it takes, s; 0 for at once.
    """

    change: FloatArray
    begin: float
    lasts: float

    def error(self, time: FloatArray, rate: FloatArray, up: FloatArray) -> FloatArray:
        """The part of the change that has happened."""
        del up
        share = np.clip((time - self.begin) / max(self.lasts, 1e-6), 0.0, 1.0)
        return np.asarray(share[:, None] * (rate @ self.change.T))


@dataclass(frozen=True)
class Kind:
    """One row of the table.

    Attributes:
        true: effects with which the structure is rightly named; none for structure that no effect
            makes.
        made: the structure of an accelerometer by its size, mg.
        turned: that of a gyroscope, from chance, its visible share of the noise, its noise at rest
            (rad/s), its noise of a closure (rad) and the session's length (s).
    """

    true: tuple[str, ...]
    made: Callable[[float], Extra] | None = None
    turned: Callable[[np.random.Generator, float, float, float, float], WrongRate] | None = None


def _delayed(rng: np.random.Generator, *_: float) -> WrongRate:
    return Delayed(int(rng.integers(3)), 1.5e-3)


def _cubed(rng: np.random.Generator, times: float, rest: float, *_: float) -> WrongRate:
    # an axis has so much of its third power left beside bias and the first: √(4/175)
    size = times * rest / np.sqrt(4.0 / 175.0)
    return Cubed(int(rng.integers(3)), int(rng.integers(3)), size * rng.choice((-1.0, 1.0)))


def _products(rng: np.random.Generator, times: float, rest: float, *_: float) -> WrongRate:
    size = times * rest * np.sqrt(15.0)  # the rms of a product over the sphere is 1/√15
    return Anisoelastic(int(rng.integers(3)), int(rng.integers(3)), size * rng.choice((-1.0, 1.0)))


def _clock(
    rng: np.random.Generator, times: float, rest: float, closure: float, seconds: float
) -> WrongRate:
    del rest
    usual = np.radians(110.0) * seconds / np.sqrt(12.0)  # rms angle, and time from the middle
    return FasterClock(times * closure / usual * rng.choice((-1.0, 1.0)))


def _jumping(
    rng: np.random.Generator, times: float, rest: float, closure: float, *_: float
) -> WrongRate:
    del rest
    # bias, scale and angles leave an rms of 0.13 rad of a jump by 1 rad/s in these rotations
    size = times * closure / 0.13
    level = np.radians(rng.uniform(-100.0, 100.0))
    return Jumping(int(rng.integers(3)), float(level), float(size * rng.choice((-1.0, 1.0))))


def _tilting(
    rng: np.random.Generator,
    times: float,
    rest: float,
    closure: float,
    seconds: float,
    *,
    lasts: float = 0.0,
    whole: bool = False,
) -> WrongRate:
    del rest
    # of a tilt by 1 rad, rotations by 110° about one axis of three show so much, half of it late
    size = times * closure / (0.5 * np.radians(110.0) / np.sqrt(3.0))
    change = np.zeros((3, 3))
    axis, other = rng.choice(3, 2, replace=False)
    change[axis, other] = rng.choice((-1.0, 1.0))
    if whole:
        change = rng.standard_normal((3, 3)) / np.sqrt(6.0)
    begin = rng.uniform(0.25, 0.75) * seconds if not lasts else 0.0
    return OtherAxes(size * change, float(begin), lasts * seconds)


SLOW_BIAS = ("bias-temperature", "warm-up", "bias-drift")
KINDS: dict[str, Kind] = {
    "scale that steps": Kind(("scale-step",), strangers.ScaleStep),
    "axis that tilts once": Kind((), strangers.AxisTilts),
    "axis that tilts with temperature": Kind((), strangers.AxisWarms),
    "two bumped holds": Kind((), strangers.TwoBumped),
    "stiction": Kind(("hysteresis",), strangers.Stiction),
    "gyroscope axis late by 1.5 ms": Kind(("axis-delay",), turned=_delayed),
    "gyroscope feels g cubed": Kind((), turned=_cubed),
    "clock that changes": Kind(("clock",), turned=_clock),
    "cubic cross term": Kind(("cubic-cross",), strangers.CubicCross),
    "dead zone": Kind(("dead-zone",), strangers.DeadZone),
    "thermal lag": Kind(("thermal-lag", *SLOW_BIAS), strangers.ThermalLag),
    "ripple": Kind((), strangers.AnyRipple),
    "placement scatter": Kind((), strangers.Scatter),
    "bias that swings": Kind((), strangers.Swing),
    "anisoelastic gyroscope": Kind(("anisoelastic",), turned=_products),
    "gyroscope jumps over its rate": Kind((), turned=_jumping),
    "gyroscope axis that tilts once": Kind((), turned=_tilting),
    "gyroscope axis that tilts slowly": Kind((), turned=partial(_tilting, lasts=1.0)),
    "gyroscope whose axes change once": Kind((), turned=partial(_tilting, whole=True)),
    "long wave": Kind((), partial(strangers.AnyRipple, omega=(3.5, 5.0))),
    "field of degree 5": Kind((), strangers.Field),
    "knee at 0.3 to 0.7 g": Kind((), strangers.Knee),
    "axis that feels another's size": Kind((), strangers.Across),
    "scale that feels another's size": Kind((), partial(strangers.Across, gain=True)),
}


@dataclass(frozen=True)
class Answer:
    """What is said of one recording.

    Attributes:
        verdict: of the model at the end.
        names: families named, each by the members listed, of the base model and at the end.
        wrong: those without what is true.
        probable: likely members that are not certain, where what is true is not among them.
    """

    verdict: Verdict
    names: tuple[tuple[str, ...], ...]
    wrong: tuple[tuple[str, ...], ...]
    probable: tuple[str, ...]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--recordings", type=int, default=40)
    parser.add_argument("--seed", type=int, default=10)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", action="append", default=[])
    asked = parser.parse_args()
    print(machine())
    with ProcessPoolExecutor(asked.jobs) as pool:
        for row in table(pool, asked.recordings, asked.seed, asked.only):
            print(row, flush=True)


def table(pool: Executor, recordings: int, seed: int, only: Sequence[str] = ()) -> Iterator[str]:
    """The lines of the table.

    Args:
        pool: where the recordings are made.
        recordings: of each kind.
        seed: of all.
        only: parts of the names of the kinds to look at; all of them where none are given.
    """
    yield f"\n{recordings} recordings of each kind, seed {seed}; 95 % intervals"
    yield f"  {'hidden':<32}{'wrong names':>12}  {'interval':<16}{'right':>6}{'probable':>9}"
    every: list[Answer] = []
    wanted = Wanted()
    for name in KINDS:
        if only and not any(word in name for word in only):
            continue
        found = list(pool.map(partial(answered, name, seed), range(recordings)))
        every += found
        yield from _row(name, found)
        wrong = sum(bool(one.wrong) for one in found)
        wanted.share(name, wrong, len(found), 0.0, MAX_OF_KIND)
    yield next(_row("all kinds", every))
    wrong = sum(bool(one.wrong) for one in every)
    wanted.share("all kinds together", wrong, len(every), 0.0, MAX_OF_ALL)
    yield str(wanted)


def _row(name: str, found: Sequence[Answer]) -> Iterator[str]:
    wrong, of = sum(bool(one.wrong) for one in found), len(found)
    right = sum(bool(one.names) and not one.wrong for one in found)
    likely = sum(bool(one.probable) and not one.wrong for one in found)
    low, high = interval(wrong, of)
    share, within = f"{wrong} of {of}", f"[{low:.1f}, {high:.1f}] %"
    yield f"  {name:<32}{share:>12}  {within:<16}{right:>6}{likely:>9}"
    said = Counter(" or ".join(names) for one in found for names in one.wrong)
    verdicts = Counter(str(one.verdict) for one in found)
    yield f"      {', '.join(f'{n} {word}' for word, n in verdicts.most_common())}"
    if said:
        yield f"      wrong: {', '.join(f'{n} {word}' for word, n in said.most_common())}"


def answered(name: str, seed: int, number: int) -> Answer:
    """One recording of one device."""
    rng = np.random.default_rng([seed, number, sum(map(ord, name))])
    kind = KINDS[name]
    bench = _still(kind, number, rng) if kind.turned is None else _turned(kind, number, rng)
    first = bench.look()
    last = add_by_itself(bench)
    names = {*_named(first), *_named(last), *((term,) for term in bench.fit.model[3:])}
    said = tuple(sorted(names - _listed_elsewhere(names)))
    wrong = tuple(one for one in said if not set(one) & set(kind.true))
    likely = last.opinion.probable
    probable = () if set(likely) & set(kind.true) else likely
    verdict = bench.look().opinion.verdict
    return Answer(verdict, said, wrong, probable)


def _named(findings: BenchFindings) -> tuple[tuple[str, ...], ...]:
    return tuple(tuple(sorted(members)) for members in findings.opinion.terms)


def _listed_elsewhere(names: set[tuple[str, ...]]) -> set[tuple[str, ...]]:
    """Single terms that were added as the plainest member of a family that is listed."""
    wider = [set(one) for one in names if len(one) > 1]
    return {one for one in names if len(one) == 1 and any(one[0] in more for more in wider)}


def _still(kind: Kind, number: int, rng: np.random.Generator) -> Bench:
    """An accelerometer's bench."""
    factor = float(np.exp(rng.uniform(*np.log((0.1, 10.0)))))
    device = Device(float(np.exp(rng.uniform(*np.log((25.0, 1600.0))))), int(rng.integers(12, 21)))
    noise = replace(CONSUMER, density=factor * CONSUMER.density, floor=factor * CONSUMER.floor)
    size = float(rng.uniform(*TIMES)) * factor * USUAL_NOISE
    plan = PLANS[("18", "26+12")[number % 2]]
    if kind.made is None:
        raise ValueError("this structure is a gyroscope's")
    extra = Visible(kind.made, size, size)
    return Bench(ACCELEROMETER, measured_of(record(plan, noise, (), rng, extra, device)))


def _turned(kind: Kind, number: int, rng: np.random.Generator) -> Bench:
    """A gyroscope's bench; the accelerometer beside it lacks nothing."""
    factor = float(np.exp(rng.uniform(*np.log((0.3, 3.0)))))
    rate = 0.03 * factor
    samples, force = int(rng.integers(100, 300)), float(rng.uniform(0.3, 2.0))
    poses = (EIGHTEEN, TWENTY_SIX)[number % 2]
    device = TurnedDevice("", poses, 12, samples, force, (rate, rate, rate))
    session = Session(device, int(rng.integers(2**31)))
    rest = np.radians(rate) / np.sqrt(samples)
    closure = np.hypot(
        np.sqrt(2.0 / samples) * 1e-3 * force, np.radians(rate) * 2.0 / np.sqrt(RATE)
    )
    seconds = len(session.motions) * (samples / RATE + 5.0)
    if kind.turned is None:
        raise ValueError("this structure is an accelerometer's")
    wrong = kind.turned(rng, float(rng.uniform(*TIMES)), rest, float(closure), seconds)
    found = fitted(*session.recorded(rng, wrong))
    if found.experiment is None:
        raise SystemExit("a simulated gyroscope has no rows")
    return Bench(GYROSCOPE, found.experiment, first=found)


if __name__ == "__main__":
    main()
