"""How well a magnetometer's hidden effects are found: ``python -m benchmarks.hidden_magnetometer``.

A virtual magnetometer (field, iron, noise, rounding, the hand and the equations are those of
``simulate``, which shares nothing with the effects that are fitted) is turned in circles on
its faces and held still in many poses, while the chip warms and motors run and stop. An effect is
hidden in its samples at 0.5, 1 and 2 times the size from which the program itself says that it
would name it in that very session; the program fits, looks and judges as in the bench.

    --plan         standard (18 poses, then the circles) or repeated (circles, 26 + 12 poses,
                   circles); both when not given
    --recordings   of each row, shared among the seeds
    --seeds        other seeds give other recordings; what was to be chosen was chosen with 1 to 4
    --raw          raw recordings through the whole program, with ``bench --auto``, instead
"""

import argparse
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from functools import partial

from benchmarks.hidden.table import judge
from benchmarks.hidden_field.scenarios import rows
from benchmarks.hidden_field.sessions import PLANS
from benchmarks.hidden_field.table import heading, line
from benchmarks.hidden_field.trialled import Trialled, quiet, try_out
from benchmarks.hidden_field.whole import whole_table
from benchmarks.measure import Wanted, machine


def table(pool: Executor, plan: str, seeds: Sequence[int]) -> Iterator[str]:
    """The lines of one plan's table."""
    yield heading(PLANS[plan].name, len(seeds))
    columns = list(pool.map(partial(_session, plan), seeds))
    answered = {}
    for place, scenario in enumerate(rows()):
        own = [column[place] for column in columns]
        yield line(scenario, own)
        answered[scenario.name] = [one for one in own if one is not None]
    wanted = Wanted()
    judge(wanted, PLANS[plan].name, answered)
    yield str(wanted)


def _session(plan: str, seed: int) -> list[Trialled | None]:
    """All rows on the session of one seed."""
    known = quiet(PLANS[plan], seed)
    return [try_out(PLANS[plan], scenario, known, seed) for scenario in rows()]


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plan", choices=tuple(PLANS))
    parser.add_argument("--recordings", type=int, default=102)
    parser.add_argument("--seeds", type=int, nargs="+", default=[11, 12, 13])
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--raw", action="store_true")
    chosen = parser.parse_args()
    each = -(-chosen.recordings // len(chosen.seeds))
    seeds = [1000 * seed + number for seed in chosen.seeds for number in range(each)]
    print(machine())
    with ProcessPoolExecutor(chosen.workers) as pool:
        if chosen.raw:
            lines = whole_table(pool, seeds)
        else:
            plans = [chosen.plan] if chosen.plan else list(PLANS)
            lines = (one for plan in plans for one in table(pool, plan, seeds))
        for one in lines:
            print(one, flush=True)


if __name__ == "__main__":
    main()
