"""How often a model is called complete that is not: ``python -m benchmarks.complete``.

A virtual accelerometer (the simulator of ``benchmarks.hidden``, which shares no formula with the
program) has the noise of many devices: 0.1 to 10 times the usual noise, 12 to 20 bits, 25 to 1,600
samples per second. In some recordings nothing is hidden, in the others a structure that no effect
of the catalogue makes, of 2 to 100 times the noise of a hold's mean. The program fits, adds what it
finds, and judges. Two shares are printed with their 95 % intervals (Clopper and Pearson):

- of the honest recordings, those that are called complete. Where slow noise is above what the
  holds and their repeats measure, another verdict is as right, by the definition of ``complete``:
  of these rows those that claim an effect or a disturbed hold are counted as wrong;
- of the recordings in which the structure's part that the model at the end cannot absorb has an
  rms over the holds of more than three times the noise of a hold's mean, those called complete.

    --recordings   of each row
    --seed         looked at while the test was made: 1, 3, 40, 41, 43 and 4401; the stored
                   tables are of 2611 and 2614
"""

import argparse
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from benchmarks.hidden import strangers
from benchmarks.hidden.designs import PLANS
from benchmarks.hidden.fitted import measured_of
from benchmarks.hidden.noise import CONSUMER, Colour
from benchmarks.hidden.recording import Device, Extra, Recorded, record
from benchmarks.measure import Wanted, interval, machine
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.residuals import whitened_residuals
from imucal_wizard.diagnose.survey import add_by_itself
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.effect import ACCELEROMETER

STRUCTURES: dict[str, Callable[[float], Extra]] = {
    "bias that swings": strangers.Swing,
    "ripple": strangers.AnyRipple,
    "smooth field": strangers.Field,
    "placement scatter": strangers.Scatter,
    "stiction": strangers.Stiction,
    "bump": strangers.Bump,
    "missing code": strangers.Jump,
    "step of scale": strangers.ScaleStep,
    "one moved hold": strangers.Disturbed,
}
SIZES = 2.0, 100.0
"""Of a structure, in units of the noise of a hold's mean."""
HOLD_NOISE = 0.043
"""Noise of a mean of six seconds of the usual white noise, mg."""
LARGE = 3.0
"""Structure above so many times the noise of a hold's mean must not be called complete."""
HONEST = {
    "white noise": replace(CONSUMER, name="white", floor=0.0),
    "usual flicker noise": CONSUMER,
    "twice the usual flicker noise": replace(CONSUMER, name="2x", floor=0.06),
    "four times the usual flicker noise": replace(CONSUMER, name="4x", floor=0.12),
}
MEASURED = {"18": ("white noise",), "26+12": ("white noise", "usual flicker noise")}
"""The noise that holds or their repeats measure, so that the model is to be complete."""
CLAIMS_NOTHING = Verdict.COMPLETE, Verdict.UNEXPLAINED, Verdict.NOT_REPEATABLE


@dataclass(frozen=True)
class Judged:
    """What came of one recording.

    Attributes:
        verdict: of the model at the end.
        structure: what the model cannot absorb of the structure, rms over the holds, in units of
            the true noise of a hold's mean.
    """

    verdict: Verdict
    structure: float


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--recordings", type=int, default=60)
    parser.add_argument("--seed", type=int, default=2614)
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
    yield f"\n{plan} poses, {recordings} recordings of each row, seed {seed}"
    yield f"{'nothing hidden':<36}{'complete':>10}  {'95 % interval':<18} other verdicts"
    wanted = Wanted()
    for name, colour in HONEST.items():
        found = list(pool.map(partial(judged, plan, colour, None, seed), range(recordings)))
        yield _row(name, found)
        if name in MEASURED.get(plan, ()):
            wanted.share(f"{name} complete", _complete(found), len(found), 95.0)
        else:
            silent = sum(one.verdict in CLAIMS_NOTHING for one in found)
            wanted.share(f"{name} without a claim", silent, len(found), 95.0)
    yield f"{'structure above 3 times the noise':<36}{'complete':>10}  {'95 % interval':<18}"
    large: list[Judged] = []
    for name in STRUCTURES:
        found = list(pool.map(partial(judged, plan, CONSUMER, name, seed), range(recordings)))
        own = [one for one in found if one.structure > LARGE]
        large += own
        yield _row(name, own)
    yield _row("all structures", large)
    wanted.share("structures called complete", _complete(large), len(large), 0.0, 1.0)
    yield str(wanted)


def judged(plan: str, colour: Colour, structure: str | None, seed: int, number: int) -> Judged:
    """One recording of one device."""
    name = f"{plan} {colour.name} {structure}"
    rng = np.random.default_rng([seed, number, sum(map(ord, name))])
    factor = float(np.exp(rng.uniform(*np.log((0.1, 10.0)))))
    device = Device(float(np.exp(rng.uniform(*np.log((25.0, 1600.0))))), int(rng.integers(12, 21)))
    own = replace(colour, density=factor * colour.density, floor=factor * colour.floor)
    extra = None
    if structure is not None:
        size = float(np.exp(rng.uniform(*np.log(SIZES))))
        extra = STRUCTURES[structure](size * factor * HOLD_NOISE)
    made = record(PLANS[plan], own, (), rng, extra, device)
    bench = Bench(ACCELEROMETER, measured_of(made))
    add_by_itself(bench)
    return Judged(bench.look().opinion.verdict, _structure(bench.fit, made))


def _structure(fit: SensorFit, made: Recorded) -> float:
    """What the model cannot absorb of the structure, over the true noise of a hold's mean."""
    misfit = whitened_residuals(fit, ())
    up = made.schedule.up
    along = np.asarray((made.foreign * up).sum(axis=1)) / misfit.sigma
    left, values, _ = np.linalg.svd(misfit.base, full_matrices=False)
    inner = left[:, values > 1e-9 * values[0]]
    outside = (along - inner @ (inner.T @ along)) * misfit.sigma
    noise = (made.noise * up).sum(axis=1)
    return _rms(outside) / _rms(noise)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _complete(found: list[Judged]) -> int:
    return sum(one.verdict is Verdict.COMPLETE for one in found)


def _row(name: str, found: list[Judged]) -> str:
    count = Counter(one.verdict for one in found)
    good, of = count[Verdict.COMPLETE], len(found)
    low, high = interval(good, of)
    others = ", ".join(f"{n} {v}" for v, n in count.most_common() if v is not Verdict.COMPLETE)
    share = f"{good} of {of}"
    return f"  {name:<34}{share:>10}  {f'[{low:.1f}, {high:.1f}] %':<18} {others}"


if __name__ == "__main__":
    main()
