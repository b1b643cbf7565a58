"""Recordings, streams, sessions, calibrations, answers, TOML and formulas, mutated."""

import resource
import tempfile
import time
from pathlib import Path

from benchmarks.attacks import CLOCK, Outcome
from tests.mutations import KINDS, corpus, mutated_case

NUMBER = 9
ATTACK = "mutated recordings, streams, sessions, files and formulas"

FULL_TRIES, FEW_TRIES = 100_000, 1_000
SHARES = {"recording": 40, "stream": 30, "session": 8, "calibration": 6, "answer": 1}
"""Cases of a kind in a hundred; the others share the rest. An answer derives a key each time."""
MEMORY_MIB = 300.0
"""By which the process may grow over all cases."""


def run(full: bool) -> Outcome:
    """Read every mutated input: rows or one sentence, in bounded time and memory."""
    outcome, tries = Outcome(), FULL_TRIES if full else FEW_TRIES
    rest = [kind for kind in KINDS if kind not in SHARES]
    left = (100 - sum(SHARES.values())) // len(rest)
    cycle = [kind for kind in KINDS for _ in range(SHARES.get(kind, left))]
    for kind in KINDS:
        corpus(kind)
    before, slowest, refused = _memory(), 0.0, 0
    with tempfile.TemporaryDirectory() as folder:
        for number in CLOCK.attempts(tries):
            begin = time.process_time()
            kind = cycle[37 * number % len(cycle)]
            problem, refusal = mutated_case(kind, number, Path(folder))
            refused += refusal
            outcome.count(problem)
            slowest = max(slowest, time.process_time() - begin)
    grown = _memory() - before
    if grown > MEMORY_MIB:
        outcome.lost.append(f"the process grew by {grown:.0f} MiB")
    outcome.notes.append(
        f"{outcome.tries - refused:,} read, {refused:,} refused; slowest case {slowest:.1f} s of "
        f"CPU, memory grown by {grown:.0f} MiB"
    )
    return outcome


def _memory() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
