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
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.posterior import hypothesis_set
from imucal_wizard.diagnose.significance import Chances
from imucal_wizard.diagnose.suspects import rank
from imucal_wizard.diagnose.verdict import judge_misfit
from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.terms import Term
from imucal_wizard.simulate.hidden import parse_hidden
from imucal_wizard.simulate.recording import simulate_recording

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
    hypotheses = hypothesis_set(misfit)
    posterior = hypotheses.posterior(misfit.residual)
    chances = Chances(hypotheses)

    def everything() -> None:
        own = hypothesis_set(misfit)
        all_weighed = own.posterior(misfit.residual)
        found = rank(misfit, own, all_weighed, chances)
        assert found[0].p <= 1.0  # noqa: S101 (computed when asked for)
        judge_misfit(misfit, own, all_weighed)

    added = (Term(effect("second-order")),)
    pairs = 0 if hypotheses.pairs is None else len(hypotheses.pairs)
    title = (
        f"accelerometer: {len(misfit)} holds, {len(hypotheses.single)} explanations, {pairs} pairs"
    )
    return title, [
        ("explanations built", lambda: hypothesis_set(misfit)),
        ("explanations weighed", lambda: hypotheses.posterior(misfit.residual)),
        ("suspects ranked", lambda: rank(misfit, hypotheses, posterior, chances)),
        ("verdict", lambda: judge_misfit(misfit, hypotheses, posterior)),
        ("all of these (wanted: at most 50)", everything),
        ("chance simulated, once per design and noise", lambda: Chances(hypotheses).at(1.0, 0)),
        ("effect added and fitted again (wanted: at most 100)", lambda: fit(measured, added)),
    ]


def _magnetometer() -> tuple[str, list[Row]]:
    session = session_of(SESSION, 1)
    measured = record_field(session, QUIET, (), np.random.default_rng(1))
    bench = Bench("magnetometer", measured)
    misfit = bench.look().misfit
    chances = Chances(hypothesis_set(misfit))

    def everything() -> None:
        own = hypothesis_set(misfit)
        posterior = own.posterior(misfit.residual)
        assert rank(misfit, own, posterior, chances)[0].p <= 1.0  # noqa: S101 (computed when asked for)
        judge_misfit(misfit, own, posterior)

    added = (Term(effect("bias-drift")),)
    title = f"magnetometer: {len(session.motion.time)} samples as {len(measured.data)} means"
    return title, [
        ("suspects ranked and judged (wanted: at most 50)", everything),
        ("effect added and fitted again (wanted: at most 100)", lambda: fit(measured, added)),
        (
            "samples gathered to means, plain fit included",
            lambda: record_field(session, QUIET, (), np.random.default_rng(1)),
        ),
    ]


def _gyroscope() -> tuple[str, list[Row]]:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "recording.csv"
        simulate_recording(path, poses="26+repeats", seed=7, rotations=TURNS)
        readings = read_files([path])
    bench = Benches(fit_readings(readings), readings).bench("gyroscope")
    if bench is None:
        raise SystemExit("the simulated recording has no gyroscope")
    measured, added = bench.measured, (Term(effect("g-sensitivity")),)
    table = bench.fit.rows
    if table is None:
        raise SystemExit("a published method has no residual table")
    usable = len(np.unique(table.index[table.kind == "rotation"]))
    title = f"gyroscope: {usable} rotations among {len(table)} rows at 100 Hz"
    return title, [
        ("first look: suspects, chance and verdict", lambda: Bench("gyroscope", measured).look()),
        ("effect added and fitted again (wanted: at most 500)", lambda: fit(measured, added)),
    ]


if __name__ == "__main__":
    main()
