"""The bench on 60 holds, 40 rotations, a tumbling hand: ``python -m benchmarks.bench_speed``."""

import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.hidden.designs import REPEATED
from benchmarks.hidden.fitted import left_over, measured_of
from benchmarks.hidden.noise import CONSUMER
from benchmarks.hidden.recording import record
from benchmarks.hidden_field.recording import CONSUMER as QUIET
from benchmarks.hidden_field.recording import record as record_field
from benchmarks.hidden_field.sessions import REPEATED as SESSION
from benchmarks.hidden_field.sessions import session_of
from benchmarks.measure import machine, own_cpu
from imucal_wizard.bench.benches import Benches
from imucal_wizard.bench.chance import Chances, best_by_chance
from imucal_wizard.bench.evidence import make_jury
from imucal_wizard.bench.session import Bench
from imucal_wizard.bench.suspects import rank
from imucal_wizard.bench.verdict import judge
from imucal_wizard.devices.virtual.hidden import parse_hidden
from imucal_wizard.devices.virtual.simulate import simulate_recording
from imucal_wizard.effects.catalogue import effect
from imucal_wizard.fitting import fit_readings
from imucal_wizard.recordings import read
from imucal_wizard.solver.extended.fit import fit_with
from imucal_wizard.solver.extended.terms import Term

HOLDS, POSES = 60, 26
TURNS = 14
"""About each axis: 42 rotations."""

Row = tuple[str, Callable[[], object]]


def main() -> None:
    """Print what each step costs, warm."""
    print(machine())
    _print(*_accelerometer())
    _print(*_gyroscope())
    _print(*_magnetometer())


def _print(title: str, rows: list[Row]) -> None:
    print(f"\n{title:<62}{'CPU, ms':>10}{'wall, ms':>10}")
    for name, work in rows:
        cpu, wall = _milliseconds(work)
        print(f"{name:<62}{cpu:10.1f}{wall:10.1f}")


def _milliseconds(work: Callable[[], object], runs: int = 9) -> tuple[float, float]:
    """Medians of CPU and wall time, after one run that is not counted."""
    work()
    spent = []
    for _ in range(runs):
        cpu, wall = own_cpu(), time.perf_counter()
        work()
        spent.append((own_cpu() - cpu, time.perf_counter() - wall))
    cpus, walls = zip(*spent, strict=True)
    return 1e3 * statistics.median(cpus), 1e3 * statistics.median(walls)


def _accelerometer() -> tuple[str, list[Row]]:
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
    title = (
        f"accelerometer: {len(misfit)} holds, {len(jury.hypotheses)} explanations, {pairs} pairs"
    )
    return title, [
        ("explanations built", lambda: make_jury(misfit)),
        ("explanations weighed", lambda: jury.weigh(misfit.residual)),
        ("suspects ranked", lambda: rank(misfit, jury, weighed, chances)),
        ("verdict", lambda: judge(misfit, jury, weighed, 0.0)),
        ("all of these (wanted: at most 50)", everything),
        ("chance simulated, once per design and noise", lambda: best_by_chance(jury)),
        ("effect added and fitted again (wanted: at most 100)", lambda: fit_with(measured, added)),
    ]


def _magnetometer() -> tuple[str, list[Row]]:
    session = session_of(SESSION, 1)
    measured = record_field(session, QUIET, (), np.random.default_rng(1))
    bench = Bench("magnetometer", measured)
    misfit = bench.look().misfit
    chances = Chances(make_jury(misfit))

    def everything() -> None:
        own = make_jury(misfit)
        weighed = own.weigh(misfit.residual)
        judge(misfit, own, weighed, rank(misfit, own, weighed, chances)[0].p)

    added = (Term(effect("bias-drift")),)
    title = (
        f"magnetometer: {len(session.motion.time)} samples as {len(measured)} means, "
        f"{len(measured.dips)} dips"
    )
    return title, [
        ("suspects ranked and judged (wanted: at most 50)", everything),
        ("effect added and fitted again (wanted: at most 100)", lambda: fit_with(measured, added)),
        (
            "samples gathered to means, plain fit included",
            lambda: record_field(session, QUIET, (), np.random.default_rng(1)),
        ),
    ]


def _gyroscope() -> tuple[str, list[Row]]:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "recording.csv"
        simulate_recording(path, poses="26+repeats", seed=7, rotations=TURNS)
        readings = read([path])
    bench = Benches(fit_readings(readings), readings).gyroscope
    if bench is None:
        raise SystemExit("the simulated recording has no gyroscope")
    measured, added = bench.measured, (Term(effect("g-sensitivity")),)
    usable = len(np.unique(bench.fit.linear.groups[bench.fit.linear.visits < 0]))
    title = f"gyroscope: {usable} rotations among {len(bench.fit.linear.order)} rows at 100 Hz"
    return title, [
        ("first look: suspects, chance and verdict", lambda: Bench("gyroscope", measured).look()),
        ("effect added and fitted again (wanted: at most 500)", lambda: fit_with(measured, added)),
    ]


if __name__ == "__main__":
    main()
