"""What the gyroscope decides between the accelerometer's aliases: ``python -m benchmarks.referee``.

Recordings of the virtual IMU with six rotations about each axis have one effect of the
accelerometer hidden in them that 1 g hardly splits from its family, or structure that the
catalogue does not have; in half of them the gyroscope has an effect too, or one of its axes is
late. Each is judged twice: by the accelerometer alone, and with the gyroscope as referee. Counted
is how often one single effect is named, and how often that is the wrong one.

An effect is named instead of its family from a probability of 95 % on. Of the names that the
gyroscope decides (alone, the accelerometer gives none), as many may be wrong as their probabilities
say, which are printed beside them, and at most 5 %; none where nothing in the catalogue is hidden.

    --recordings   of each row
    --seed         of the first one
"""

import argparse
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.measure import Wanted, interval, machine
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.readings import FloatArray, Readings
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.verdict import Opinion, Verdict
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.simulate.recording import simulate_recording

MILLI_G = 1e-3 * STANDARD_GRAVITY
KINDS: dict[str, str | None] = {
    "nothing": None,
    "second-order": "second-order:{:.2f}:{}",
    "asymmetry": "asymmetry:{:.2f}:{}",
    "third-order": "third-order:{:.2f}:{}",
    "odd-quadratic": "odd-quadratic:{:.2f}:{}",
    "cross-product": "cross-product:{:.2f}:xyz",
    "not in the catalogue": None,
}
SIZES = 0.4, 6.0
"""Between which the size of the hidden effect lies, evenly in its logarithm, mg/g and so on."""
OF_GYROSCOPE = (
    "gyroscope/g-sensitivity:0.05:xy",
    "gyroscope/second-order:10:x",
    "gyroscope/cross-product:1:xyz",
    "gyroscope/bias-drift:0.02:z",
)
MAX_WRONG = 5.0
"""Names that may be wrong where the probability is 95 % or more, per cent."""
DELAY = 2e-3
"""By how much an axis of the gyroscope is late, s."""


def _square_of_another(f: FloatArray) -> FloatArray:
    return np.stack([f[:, 1] ** 2, 0.0 * f[:, 0], 0.0 * f[:, 0]], axis=1)


def _ripple(f: FloatArray) -> FloatArray:
    return np.stack([0.0 * f[:, 0], np.sin(7.0 * f[:, 1] + 1.0), 0.0 * f[:, 0]], axis=1)


def _fifth_order(f: FloatArray) -> FloatArray:
    return np.stack([0.0 * f[:, 0], 0.0 * f[:, 0], f[:, 2] ** 5], axis=1)


def _even_of_another(f: FloatArray) -> FloatArray:
    return np.stack([np.abs(f[:, 2]), 0.0 * f[:, 0], 0.0 * f[:, 0]], axis=1)


FOREIGN: tuple[Callable[[FloatArray], FloatArray], ...] = (
    _square_of_another,
    _ripple,
    _fifth_order,
    _even_of_another,
)
"""Errors of the accelerometer, g per size, from the force in g, shape (n, 3)."""


@dataclass(frozen=True)
class Judged:
    """One recording.

    Attributes:
        kind: what is hidden.
        of_gyroscope: something is wrong with the gyroscope too.
        alone: the name given by the accelerometer alone, "" for none.
        refereed: the same with the gyroscope's rotations.
        verdicts: both verdicts.
        right: the likeliest explanation of those listed is the true one, alone and refereed.
        doubt: probability, by the program, that another member of a family named is the right one.
    """

    kind: str
    of_gyroscope: bool
    alone: str
    refereed: str
    verdicts: tuple[Verdict, Verdict]
    right: tuple[bool, bool]
    doubt: float


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--recordings", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    print(machine())
    print(f"{asked.recordings} recordings of each row, seed {asked.seed}\n")
    todo = [(kind, number) for kind in KINDS for number in range(asked.recordings)]
    with ProcessPoolExecutor(asked.jobs) as pool:
        found = list(pool.map(partial(judged, asked.seed), *zip(*todo, strict=True)))
    for row in table(found):
        print(row)


def table(found: Sequence[Judged]) -> Iterator[str]:
    """The lines of the table."""
    yield f"{'':<34}{'one name, alone':<24}{'with the gyroscope':<24}wrong with it"
    yield f"{'hidden':<22}{'gyroscope':<12}{'right':>8}{'wrong':>8}{'right':>16}{'wrong':>8}"
    for kind in KINDS:
        for spoilt in (False, True):
            own = [one for one in found if one.kind == kind and one.of_gyroscope is spoilt]
            counts = [
                sum(bool(name) and (name == kind) is right for name in names)
                for names in ([one.alone for one in own], [one.refereed for one in own])
                for right in (True, False)
            ]
            low, high = interval(counts[3], len(own))
            yield (
                f"{kind:<22}{'wrong too' if spoilt else 'good':<12}{counts[0]:>8}{counts[1]:>8}"
                f"{counts[2]:>16}{counts[3]:>8}   of {len(own)}, [{low:.1f}, {high:.1f}] %"
            )
    wrong = [one for one in found if one.refereed and one.refereed != one.kind]
    fresh = [one for one in wrong if one.alone != one.refereed]
    lost = [one for one in found if one.alone == one.kind and one.refereed != one.kind]
    low, high = interval(len(fresh), len(found))
    yield (
        f"\nwrong names that the gyroscope brought: {len(fresh)} of {len(found)}, "
        f"[{low:.1f}, {high:.1f}] %; right names that it took away: {len(lost)}"
    )
    known = [one for one in found if KINDS[one.kind] is not None]
    for k, by in enumerate(("alone", "with the gyroscope")):
        first = sum(one.right[k] for one in known)
        yield f"the true effect is the likeliest, {by}: {first} of {len(known)}"
    decided = [one for one in known if one.refereed and not one.alone]
    of_them = [one for one in decided if one.refereed != one.kind]
    yield (
        f"names that the gyroscope decided: {len(decided)}, of them wrong {len(of_them)}, by their "
        f"probabilities {sum(one.doubt for one in decided):.2f}"
    )
    wanted, foreign = Wanted(), [one for one in found if KINDS[one.kind] is None]
    wanted.share("wrong names that it decided", len(of_them), len(decided), 0.0, MAX_WRONG)
    brought = sum(one in foreign for one in fresh)
    wanted.share("names that it brought to no effect", brought, len(foreign), 0.0, 0.0)
    yield str(wanted)


def judged(seed: int, kind: str, number: int) -> Judged:
    """Hide, record, judge twice."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind), number])
    size = float(np.exp(rng.uniform(*np.log(SIZES))))
    axis, poses = "xyz"[rng.integers(3)], str(rng.choice(("18", "26+repeats")))
    text, spoilt = KINDS[kind], number % 2 == 1
    hidden = [] if text is None else [text.format(size, axis)]
    late = spoilt and bool(rng.integers(4) == 0)
    if spoilt and not late:
        hidden.append(str(rng.choice(OF_GYROSCOPE)))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "recording.csv"
        simulate_recording(path, hidden=hidden, poses=poses, seed=int(rng.integers(10**6)))
        readings = read_files([path])
    if kind == "not in the catalogue":
        readings = _foreign(readings, FOREIGN[rng.integers(len(FOREIGN))], size)
    if late:
        readings = _late(readings, int(rng.integers(3)))
    report = fit_readings(readings)
    bench = Benches(report, readings).accelerometer
    refereed = bench.look().opinion
    bench = Benches(report, readings).accelerometer
    bench.referee = None
    alone = bench.look().opinion
    return Judged(
        kind=kind,
        of_gyroscope=spoilt,
        alone=_name(alone),
        refereed=_name(refereed),
        verdicts=(alone.verdict, refereed.verdict),
        right=(_likeliest(alone) == (kind,), _likeliest(refereed) == (kind,)),
        doubt=1.0 - float(np.prod(list(refereed.shares.values()))),
    )


def _name(opinion: Opinion) -> str:
    """The one effect that is named, "" where none is or several may be meant."""
    if opinion.verdict is not Verdict.MISSING:
        return ""
    return "+".join(term for members in opinion.terms for term in members)


def _likeliest(opinion: Opinion) -> tuple[str, ...]:
    return opinion.explanations[0] if opinion.explanations else ()


def _foreign(
    readings: Readings, error: Callable[[FloatArray], FloatArray], size: float
) -> Readings:
    series = readings.accelerometer
    values = series.values + size * MILLI_G * error(series.values / STANDARD_GRAVITY)
    return replace(readings, accelerometer=replace(series, values=values))


def _late(readings: Readings, axis: int) -> Readings:
    series = readings.gyroscope
    assert series is not None, "the virtual IMU has one"  # noqa: S101 (narrows the type)
    values = series.values.copy()
    values[:, axis] = np.interp(series.time - DELAY, series.time, values[:, axis])
    return replace(readings, gyroscope=replace(series, values=values))


if __name__ == "__main__":
    main()
