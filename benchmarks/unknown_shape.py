"""How well a free curve finds what no effect makes: ``python -m benchmarks.unknown_shape``.

A virtual accelerometer (the simulator of ``benchmarks.hidden``, which shares no formula with the
program) is held in the poses of a plan. In some recordings nothing is hidden, in others an effect
of the catalogue of usual size, in others a shape that no effect makes: a bump, a missing code, a
ripple or a narrow dead zone of one axis' characteristic, or a bias of one axis that swings in time.
The program fits, adds what it finds by itself, and judges. Told are, with 95 % intervals (Clopper
and Pearson):

- how often a free curve is offered;
- of the offered ones, how often the first is of the right axis and over the right influence;
- what adding it does to the true error: rms of |a| − g in fresh directions and at fresh moments of
  the session, without noise, before and after.

    --recordings   of each row
    --seed         the limits of ``diagnose.free_curves`` were looked at with seeds 1 and 2; the
                   stored table is of seed 11
"""

import argparse
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from benchmarks.complete import interval
from benchmarks.hidden.designs import PLANS, Schedule
from benchmarks.hidden.fitted import measured_of
from benchmarks.hidden.noise import CONSUMER, Colour
from benchmarks.hidden.recording import Extra, Recorded, record
from benchmarks.hidden.scenarios import EFFECTS
from benchmarks.measure import machine
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.survey import add_by_itself
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.effect import ACCELEROMETER, MILLI_G, Circumstances
from imucal_wizard.model.terms import Terms, corrected
from imucal_wizard.model.unknown_shape import NAME
from imucal_wizard.simulate.hidden import Hidden

Shape = Callable[[FloatArray, np.random.Generator], FloatArray]
SIZES = 0.4, 6.0
"""Of a shape, mg: 3 to 50 times the noise of a hold's mean."""
FRESH = 200
"""Directions in which the true error is told."""


def _bump(at: FloatArray, rng: np.random.Generator) -> FloatArray:
    return np.exp(-0.5 * ((at - rng.uniform(-0.9, 0.9)) / rng.uniform(0.1, 0.2)) ** 2)


def _missing_code(at: FloatArray, rng: np.random.Generator) -> FloatArray:
    return np.where(at > rng.uniform(-0.9, 0.9), 1.0, 0.0)


def _ripple(at: FloatArray, rng: np.random.Generator) -> FloatArray:
    return np.sin(rng.uniform(5.0, 9.0) * at + rng.uniform(0.0, 2.0 * np.pi))


def _dead_zone(at: FloatArray, rng: np.random.Generator) -> FloatArray:
    return -np.clip(at / rng.uniform(0.02, 0.15), -1.0, 1.0)


def _swing(share: FloatArray, rng: np.random.Generator) -> FloatArray:
    return np.sin(2.0 * np.pi * (rng.uniform(1.5, 4.0) * share + rng.random()))


SHAPES: dict[str, tuple[str, Shape]] = {
    "bump": ("", _bump),
    "missing code": ("", _missing_code),
    "ripple": ("", _ripple),
    "dead zone about 0 g": ("", _dead_zone),
    "bias that swings in time": ("-time", _swing),
}
"""By name: what the name of the right curve ends with, and the shape."""
HONEST = {
    "nothing, usual flicker noise": CONSUMER,
    "nothing, white noise": replace(CONSUMER, name="white", floor=0.0),
    "nothing, four times the flicker": replace(CONSUMER, name="4x", floor=0.12),
    "nothing, bias wanders by 0.3 mg/√min": replace(CONSUMER, name="walk", walk=0.3),
    "nothing, placing scatters by 0.3 mg": replace(CONSUMER, name="scatter", scatter=0.3),
}


@dataclass(frozen=True)
class OnAxis(Extra):
    """A shape on one axis, the same whenever it is asked for."""

    name: str
    size: float
    axis: int
    seed: int

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """Over the axis' force, or over the session."""
        del rng
        ending, shape = SHAPES[self.name]
        at = schedule.up[:, self.axis]
        if ending:
            at = schedule.middle / 400.0
        found = np.zeros_like(schedule.up)
        found[:, self.axis] = self.size * shape(at, np.random.default_rng(self.seed))
        return found


@dataclass(frozen=True)
class Judged:
    """What came of one recording.

    Attributes:
        verdict: of the model without the curve.
        offered: names of the curves offered, the likeliest first.
        right: the name of the right one, or "".
        before: true error in fresh directions without the curve, mg.
        after: with the first one, mg; None where none is offered.
    """

    verdict: Verdict
    offered: tuple[str, ...]
    right: str
    before: float
    after: float | None


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--recordings", type=int, default=40)
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--plan", action="append", choices=sorted(PLANS))
    asked = parser.parse_args()
    print(machine())
    with ProcessPoolExecutor(asked.jobs) as pool:
        for plan in asked.plan or ["18", "26+12"]:
            for row in table(pool, plan, asked.recordings, asked.seed):
                print(row, flush=True)


def table(pool: Executor, plan: str, recordings: int, seed: int) -> Iterator[str]:
    """The lines of one plan."""

    def each(what: str, colour: Colour = CONSUMER) -> list[Judged]:
        return list(pool.map(partial(judged, plan, colour, what, seed), range(recordings)))

    yield f"\n{plan} poses, {recordings} recordings of each row, seed {seed}"
    head = f"  {'':<38}{'curve offered':<26}{'right axis and influence':<27}"
    yield f"{head}true error, after / before"
    for group, rows in (
        ("nothing hidden", [each("", colour) for colour in HONEST.values()]),
        ("an effect of the catalogue", [each(term) for term in EFFECTS]),
        ("a shape that no effect makes", [each(name) for name in SHAPES]),
    ):
        names = {"nothing hidden": HONEST, "an effect of the catalogue": EFFECTS}.get(group, SHAPES)
        for name, found in zip(names, rows, strict=True):
            yield _row(name, found)
        yield _row(f"all with {group}", [one for found in rows for one in found])


def judged(plan: str, colour: Colour, what: str, seed: int, number: int) -> Judged:
    """One recording; ``what`` is an effect, a shape, or "" for nothing."""
    rng = np.random.default_rng([seed, number, sum(map(ord, f"{plan} {colour.name} {what}"))])
    axis, extra, right = int(rng.integers(3)), None, ""
    hidden: tuple[Hidden, ...] = ()
    if what in SHAPES:
        size = float(np.exp(rng.uniform(*np.log(SIZES))))
        extra = OnAxis(what, size, axis, int(rng.integers(2**31)))
        right = f"{NAME}/{'xyz'[axis]}{SHAPES[what][0]}"
    elif what:
        hidden = (_usual(what, axis, rng),)
    made = record(PLANS[plan], colour, hidden, rng, extra)
    bench = Bench(ACCELEROMETER, measured_of(made))
    add_by_itself(bench)
    found = bench.look()
    offered = tuple(one.term for one in found.suspects if one.term.startswith(NAME))
    before = after = true_error(bench, made, extra, rng)
    if offered:
        again = np.random.default_rng(rng.integers(2**31))
        state = again.bit_generator.state
        before = true_error(bench, made, extra, again)
        bench.add(offered[0])
        again.bit_generator.state = state
        after = true_error(bench, made, extra, again)
    return Judged(found.opinion.verdict, offered, right, before, after if offered else None)


def _usual(term: str, axis: int, rng: np.random.Generator) -> Hidden:
    """An effect of 0.5 to 3 times its typical size."""
    parameters = effect(term).parameters(ACCELEROMETER)
    chosen = parameters[axis if len(parameters) == 3 else int(rng.integers(len(parameters)))]
    size = chosen.typical * float(np.exp(rng.uniform(*np.log((0.5, 3.0)))))
    axes = tuple("xyz".index(letter) for letter in chosen.name)
    return Hidden(ACCELEROMETER, term, size * float(rng.choice((-1.0, 1.0))), axes)


def true_error(
    bench: Bench, made: Recorded, extra: Extra | None, rng: np.random.Generator
) -> float:
    """Rms of |a| − g in fresh directions and at fresh moments, without noise, mg.

    Only of what the program sees as a shape: effects that are hidden are in the readings, too.
    """
    up = rng.standard_normal((FRESH, 3))
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    like = rng.integers(0, len(made.schedule.up), FRESH)
    old = made.schedule
    fresh = Schedule(
        up,
        old.start[like],
        old.end[like],
        old.temperature[like],
        old.vibration[like],
        old.shaken[like],
    )
    readings = made.true_readings(fresh)
    if extra is not None:
        # the sensor's matrix, from its readings of unit vectors
        unit = replace(fresh, **{name: value[:4] for name, value in vars(fresh).items()})
        ends = made.true_readings(replace(unit, up=np.vstack([np.zeros((1, 3)), np.eye(3)])))
        matrix = (ends[1:] - ends[0]) / STANDARD_GRAVITY
        readings = readings + MILLI_G * extra.error(fresh, rng) @ matrix
    known, fit = bench.measured.circumstances, bench.fit
    where = Circumstances(
        force=STANDARD_GRAVITY * up,
        rate=np.zeros_like(up),
        temperature=fresh.temperature,
        time=fresh.middle,
        previous=STANDARD_GRAVITY * np.roll(up, 1, axis=0),
        vibration=fresh.vibration * STANDARD_GRAVITY**2,
        gravity=known.gravity,
        reference_temperature=known.reference_temperature,
        reference_time=known.reference_time,
    )
    sizes = np.concatenate([np.zeros(0), *fit.sizes])
    terms = Terms(ACCELEROMETER, fit.terms)
    found = corrected((fit.matrix, fit.bias), terms, sizes, readings, where)
    error = np.linalg.norm(found, axis=1) - known.gravity
    return float(np.sqrt(np.mean(error**2))) / MILLI_G


def _row(name: str, found: list[Judged]) -> str:
    offered = [one for one in found if one.offered]
    right = [one for one in offered if one.offered[0] == one.right]
    share = f"{len(offered)} of {len(found)} {_interval(len(offered), len(found))}"
    true = error = ""
    if offered and any(one.right for one in found):
        true = f"{len(right)} of {len(offered)} {_interval(len(right), len(offered))}"
    ratios = [one.after / one.before for one in offered if one.after is not None]
    if ratios:
        worse = sum(ratio > 1.0 for ratio in ratios)
        error = f"median {np.median(ratios):.2f}, larger in {worse} of {len(ratios)}"
    return f"  {name:<38}{share:<26}{true:<27}{error}".rstrip()


def _interval(good: int, of: int) -> str:
    low, high = interval(good, of)
    return f"[{low:.1f}, {high:.1f}] %"


if __name__ == "__main__":
    main()
