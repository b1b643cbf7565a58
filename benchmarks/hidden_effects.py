"""How well hidden effects are found: ``python -m benchmarks.hidden_effects``.

A virtual accelerometer (its equations, coloured noise, rounding, tremor and warming are those of
``simulate``, which shares nothing with the effects that are fitted) is held still in many
poses; an effect is hidden in it at 0.5, 1 and 2 times the size from which the program itself
says that it would name it in that very session; the program fits, looks and judges as in the bench.

    --set usual    the rows that thresholds and priors were chosen with
    --set fresh    rows that nothing was chosen with (other waves, fields, sizes, noises)
    --faint        recordings of the rows at 0.5 times, where they are to be fewer
    --plain        raw recordings of both sensors with nothing hidden through the whole program
    --raw          the same with each effect of the accelerometer; fewer are enough (--recordings 4)
    --gyroscope    the same with each effect of the gyroscope
    --limits       how often any rule at all would name what is outside the catalogue
    --seed         another seed gives other recordings; the thresholds were chosen with seeds 1 to 4
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import cache, partial

import numpy as np

from benchmarks.hidden.designs import PLANS
from benchmarks.hidden.limits import LOST, limits
from benchmarks.hidden.noise import COLOURS
from benchmarks.hidden.scenarios import Scenario, fresh, nameable_at_all, usual
from benchmarks.hidden.table import heading, judge, line
from benchmarks.hidden.trialled import Trialled, chances_of, try_out
from benchmarks.hidden.whole_table import nothing_hidden, whole_table
from benchmarks.measure import Wanted, machine
from imucal_wizard.diagnose.significance import Chances
from imucal_wizard.model.effect import ACCELEROMETER, GYROSCOPE

SETS = {"usual": usual, "fresh": fresh}


def main() -> None:
    """Print the table of each design asked for."""
    asked = _arguments()
    print(machine())
    with ProcessPoolExecutor(asked.jobs) as pool:
        if asked.plain or asked.raw or asked.gyroscope:
            _whole(pool, asked)
            return
        if asked.limits:
            _limits(asked)
            return
        wanted = Wanted()
        for design in asked.design or ["26+12", "18"]:
            print(heading(design, asked.colour, asked.recordings))
            sure, rows = [], {}
            for scenario in _scenarios(asked.set, asked.only):
                work = partial(_one, asked.set, scenario.name, design, asked.colour, asked.seed)
                count = asked.faint if scenario.name.endswith(" 0.5x") else asked.recordings
                trials = list(pool.map(work, range(count), chunksize=5))
                print(line(scenario, trials), flush=True)
                rows[scenario.name] = trials
                sure += [one.sure for one in trials if one.sure is not None]
            if sure:
                inside = 100.0 * np.mean(np.abs(np.array(sure)) < 1.0)
                print(f"size ± its 95 % interval holds the truth in {inside:.1f} % of {len(sure)}")
            judge(wanted, f"{design} poses", rows, lambda one: nameable_at_all(one.hidden[0]))
        print(wanted)


def _whole(pool: ProcessPoolExecutor, asked: argparse.Namespace) -> None:
    """Print the tables of the whole program."""
    if asked.plain:
        for row in nothing_hidden(pool, asked.recordings, asked.seed):
            print(row, flush=True)
    sensors = [ACCELEROMETER] * asked.raw + [GYROSCOPE] * asked.gyroscope
    for sensor in sensors:
        for row in whole_table(pool, sensor, asked.recordings, asked.seed):
            print(row, flush=True)


def _limits(asked: argparse.Namespace) -> None:
    """Print how often an all-knowing rule names each stranger."""
    for design in asked.design or ["26+12"]:
        print(f"\n{design} poses; an all-knowing rule that calls {LOST:.0%} of effects strange")
        print(f"{'stranger':<40}{'named, %':>9}{'strong enough, %':>18}{'of its own, squares':>21}")
        for scenario in _scenarios(asked.set, asked.only):
            if scenario.extra is None or scenario.disturbed:
                continue
            plan, colour = PLANS[design], COLOURS[asked.colour]
            found = list(limits(plan, colour, scenario, asked.recordings, asked.seed))
            named = 100.0 * np.mean([one.mistaken for one in found])
            strong = 100.0 * np.mean([one.shared > one.needed for one in found])
            own = np.median([one.own for one in found])
            print(f"{scenario.name:<40}{named:>9.1f}{strong:>18.0f}{own:>21.0f}", flush=True)


def _one(which: str, name: str, design: str, colour: str, seed: int, number: int) -> Trialled:
    scenario = next(one for one in _scenarios(which, []) if one.name == name)
    own = [seed, number, sum(map(ord, name))]
    return try_out(PLANS[design], COLOURS[colour], scenario, _chances(design, colour), own)


@cache
def _chances(design: str, colour: str) -> Chances:
    return chances_of(PLANS[design], COLOURS[colour])


def _scenarios(which: str, only: list[str]) -> list[Scenario]:
    return [one for one in SETS[which]() if not only or any(word in one.name for word in only)]


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--recordings", type=int, default=100)
    parser.add_argument("--design", action="append", choices=sorted(PLANS))
    parser.add_argument("--colour", default="consumer", choices=sorted(COLOURS))
    parser.add_argument("--set", default="usual", choices=sorted(SETS))
    parser.add_argument("--plain", action="store_true", help="nothing hidden, whole program")
    parser.add_argument("--raw", action="store_true", help="through the whole program")
    parser.add_argument("--gyroscope", action="store_true", help="the same, of the gyroscope")
    parser.add_argument("--limits", action="store_true", help="of any rule at all")
    parser.add_argument("--only", action="append", default=[], help="part of a row's name")
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--faint", type=int, help="recordings of each row at 0.5 times")
    asked = parser.parse_args()
    asked.faint = asked.recordings if asked.faint is None else asked.faint
    return asked


if __name__ == "__main__":
    main()
