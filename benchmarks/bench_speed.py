"""The bench on sixty holds: ``python -m benchmarks.bench_speed``."""

import statistics
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from benchmarks.hidden.designs import REPEATED
from benchmarks.hidden.fitted import left_over, measured_of
from benchmarks.hidden.noise import CONSUMER
from benchmarks.hidden.recording import record
from benchmarks.measure import machine
from imucal_wizard.bench.chance import Chances, best_by_chance
from imucal_wizard.bench.evidence import make_jury
from imucal_wizard.bench.suspects import rank
from imucal_wizard.bench.verdict import judge
from imucal_wizard.devices.virtual.hidden import parse_hidden
from imucal_wizard.effects.catalogue import effect
from imucal_wizard.solver.extended.fit import fit_with
from imucal_wizard.solver.extended.terms import Term

HOLDS, POSES = 60, 26


def milliseconds(work: Callable[[], object], runs: int = 15) -> float:
    """Median wall time, after one run that is not counted."""
    work()
    spent = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        spent.append(time.perf_counter() - start)
    return 1e3 * statistics.median(spent)


def main() -> None:
    """Print what each step costs, warm."""
    plan = replace(REPEATED, repeats=HOLDS - POSES)
    rng = np.random.default_rng(1)
    recorded = record(plan, CONSUMER, (parse_hidden("second-order:2:x"),), rng)
    measured = measured_of(recorded)
    misfit = left_over(measured)
    jury = make_jury(misfit)
    weighed = jury.weigh(misfit.residual)
    chances = Chances(jury)

    def everything() -> None:
        own = make_jury(misfit)
        all_weighed = own.weigh(misfit.residual)
        found = rank(misfit, own, all_weighed, chances)
        judge(misfit, own, all_weighed, found[0].p)

    added = (Term(effect("second-order")),)
    pairs = 0 if jury.pairs is None else len(jury.pairs)
    rows = [
        ("explanations built", lambda: make_jury(misfit)),
        ("explanations weighed", lambda: jury.weigh(misfit.residual)),
        ("suspects ranked", lambda: rank(misfit, jury, weighed, chances)),
        ("verdict", lambda: judge(misfit, jury, weighed, 0.0)),
        ("all of these (wanted: at most 50)", everything),
        ("chance simulated, once per design and noise", lambda: best_by_chance(jury)),
        ("effect added and fitted again (wanted: at most 100)", lambda: fit_with(measured, added)),
    ]
    print(machine())
    print(f"{len(misfit)} holds, {len(jury.hypotheses)} explanations and {pairs} pairs")
    for name, work in rows:
        print(f"{name:<55}{milliseconds(work):8.1f} ms")


if __name__ == "__main__":
    main()
