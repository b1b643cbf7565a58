"""Raw recordings through the whole program: simulated, read, fitted, ``bench --auto``."""

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.hidden_field.scenarios import EFFECTS, FAMILY
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.survey import add_by_itself
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.model.effect import MAGNETOMETER
from imucal_wizard.simulate.hidden import Hidden
from imucal_wizard.simulate.recording import simulate_recording

TIMES = 1.0
"""Hidden at so many times what the program calls nameable in the same session without it."""
NO_CURRENT = Hidden(MAGNETOMETER, "current", 0.0, (0,))
"""Writes the column of the current and nothing else."""


@dataclass(frozen=True)
class Said:
    """What ``bench --auto`` says of a recording.

    Attributes:
        families: named.
        verdict: the word.
        added: the effects in the model at the end.
        before: error held out of the base model, µT.
        after: the same of the model at the end.
    """

    families: frozenset[str]
    verdict: str
    added: tuple[str, ...]
    before: float
    after: float


def bench_of(seed: int, hidden: Sequence[Hidden]) -> Bench:
    """The magnetometer's bench of one recording, as the program reads and fits it."""
    with TemporaryDirectory(dir=os.environ.get("TMPDIR")) as folder:
        path = Path(folder) / "recording.csv"
        simulate_recording(path, hidden=hidden, seed=seed, rotations=0, magnetometer=True)
        readings = read_files([path])
    bench = Benches(fit_readings(readings), readings).bench(MAGNETOMETER)
    if bench is None:
        raise ValueError("the magnetometer has no bench")
    return bench


def judged(seed: int, hidden: Sequence[Hidden]) -> Said:
    """``bench --auto`` on one recording."""
    bench = bench_of(seed, [*hidden, NO_CURRENT])
    before = bench.fit.rms_held_out
    found = add_by_itself(bench)
    return Said(
        frozenset(found.opinion.families),
        str(found.opinion.verdict),
        tuple(term.name for term in bench.fit.terms),
        np.nan if before is None else before,
        np.nan if bench.fit.rms_held_out is None else bench.fit.rms_held_out,
    )


def whole_table(pool: Executor, seeds: Sequence[int]) -> Iterator[str]:
    """Nothing hidden, then each effect at its nameable size."""
    kind = "raw recordings, 18 poses and circles, bench --auto"
    yield f"\n{kind}; {len(seeds)} each; per cent of them"
    yield (
        f"{'hidden':<24}{'family':>9}{'WRONG':>9}{'nothing':>9}{'added':>9}"
        f"{'held out: before → after, µT':>34}   verdicts"
    )
    yield _line("no effect", None, list(pool.map(partial(judged, hidden=()), seeds)))
    for term in EFFECTS:
        said = list(pool.map(partial(_with_effect, term), seeds))
        yield _line(f"{term} {TIMES:g}x", FAMILY[term], said)


def _with_effect(term: str, seed: int) -> Said:
    rng = np.random.default_rng([seed, 2])
    plain = bench_of(seed, [NO_CURRENT]).look()
    sizes = next(one.nameable for one in plain.suspects if one.term == term)
    axis, sign = int(rng.integers(3)), float(rng.choice((-1.0, 1.0)))
    return judged(seed, [Hidden(MAGNETOMETER, term, sign * TIMES * float(sizes[axis]), (axis,))])


def _line(name: str, family: str | None, said: Sequence[Said]) -> str:
    share = 100.0 / len(said)
    right = {family} if family else set()
    found = share * sum(bool(family) and one.families == right for one in said)
    wrong = share * sum(bool(one.families - right) for one in said)
    nothing = share * sum(not one.families for one in said)
    added = share * sum(bool(one.added) for one in said)
    errors = np.array([(one.before, one.after) for one in said])
    before, after = np.sqrt(np.nanmean(errors**2, axis=0))
    words = ", ".join(f"{w} {n}" for w, n in Counter(one.verdict for one in said).most_common())
    return (
        f"{name:<24}{found:9.1f}{wrong:9.1f}{nothing:9.1f}{added:9.1f}"
        f"{f'{before:.4f} → {after:.4f}':>34}   {words}"
    )
