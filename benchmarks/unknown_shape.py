"""How well a free curve finds what no effect makes: ``python -m benchmarks.unknown_shape``.

A virtual sensor (see ``benchmarks.shaped_sensors``) is held in the poses of a plan, and a gyroscope
or a magnetometer turned between them. In some recordings nothing is hidden, in others an effect of
the catalogue of usual size, in others a shape that no effect makes: a bump, a missing code, a
ripple or a knee of one axis over what it measures, over a force or a current, or a bias of one axis
that swings in time. The program fits, adds what it finds by itself, and judges. Told are, with 95 %
intervals (Clopper and Pearson):

- how often a free curve is offered;
- of the offered ones, how often the first is of the right axis and over the right influence;
- what adding it does to the true error of fresh readings without noise: rms before and after;
- of the shapes, how often one is offered where the true error is more than ``CLEAR`` times that of
  sensors with nothing hidden: a bump, a jump or a dead zone between the poses of a plan, or small,
  moves no reading by more than the noise.

    --sensor       accelerometer, gyroscope or magnetometer; all of them when not given
    --recordings   of each row
    --group        nothing, effects or shapes; all of them when not given
    --seed         the limits of ``diagnose.free_curves`` were looked at with seeds 1 and 2; the
                   stored tables are of seeds 11, 2621, 2622 and 2625
"""

import argparse
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np

from benchmarks.measure import Wanted, interval, machine
from benchmarks.shaped_sensors import SUBJECTS, Fresh
from imucal_wizard.core.errors import DataError
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.survey import add_by_itself
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.model.unknown_shape import NAME

GROUPS = ("nothing", "effects", "shapes")
"""What is hidden."""
CLEAR = 3.0
"""Times the true error with nothing hidden."""
MAX_OFFERED = 1.0
"""Share of recordings with nothing hidden in which a curve may be offered."""


@dataclass(frozen=True)
class Judged:
    """What came of one recording.

    Attributes:
        verdict: of the model without the curve; None where the program refuses the recording.
        offered: names of the curves offered, the likeliest first.
        right: the name of the right one, or "".
        before: true error of fresh readings without the curve, SI.
        after: with the first one; None where none is offered.
    """

    verdict: Verdict | None
    offered: tuple[str, ...]
    right: str
    before: float
    after: float | None


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sensor", action="append", choices=sorted(SUBJECTS))
    parser.add_argument("--recordings", type=int, default=40)
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--plan", action="append")
    parser.add_argument("--group", action="append", choices=GROUPS)
    asked = parser.parse_args()
    print(machine())
    with ProcessPoolExecutor(asked.jobs) as pool:
        for sensor in asked.sensor or SUBJECTS:
            for plan in SUBJECTS[sensor].plans:
                if asked.plan is None or plan in asked.plan:
                    for row in table(pool, sensor, plan, asked.recordings, asked.seed, asked.group):
                        print(row, flush=True)


def table(
    pool: Executor,
    sensor: str,
    plan: str,
    recordings: int,
    seed: int,
    groups: Sequence[str] | None = None,
) -> Iterator[str]:
    """The lines of one plan."""
    subject = SUBJECTS[sensor]
    yield f"\n{sensor}, {plan} poses, {recordings} recordings of each row, seed {seed}"
    head = f"  {'':<40}{'curve offered':<26}{'right axis and influence':<27}"
    yield f"{head}true error, after / before"
    usual = subject.honest[0]
    rows = {
        "nothing": [("", noise) for noise in subject.honest],
        "effects": [(term, usual) for term in subject.effects],
        "shapes": [(name, usual) for name in subject.shapes],
    }
    wanted, clear = Wanted(), np.inf
    for group in groups or GROUPS:
        every: list[Judged] = []
        for what, noise in rows[group]:
            trial = partial(judged, sensor, plan, noise, what, seed)
            found = list(pool.map(trial, range(recordings)))
            yield from _row(what or noise, found)
            every += found
        yield next(_row(f"all {group}", every))
        offered = sum(bool(one.offered) for one in every)
        if group == "nothing":
            clear = CLEAR * float(np.nanmedian([one.before for one in every[:recordings]]))
        if group == "shapes" and np.isfinite(clear):
            yield next(_row("those clearly wrong", [one for one in every if one.before > clear]))
        elif group != "shapes":
            wanted.share(f"{group} offered a curve", offered, len(every), 0.0, MAX_OFFERED)
    yield str(wanted)


def hidden_in(
    sensor: str, plan: str, what: str, seed: int, number: int, noise: str = ""
) -> tuple[Bench, Fresh, str]:
    """One recording, new readings of its sensor, and the right curve; see ``judged``."""
    subject = SUBJECTS[sensor]
    noise = noise or subject.honest[0]
    rng = np.random.default_rng([seed, number, sum(map(ord, f"{sensor} {plan} {noise} {what}"))])
    hiding = subject.hiding(what, rng)
    bench, fresh = subject.recorded(plan, noise, hiding, rng)
    return bench, fresh, subject.right(hiding)


def judged(sensor: str, plan: str, noise: str, what: str, seed: int, number: int) -> Judged:
    """One recording; ``what`` is an effect, a shape, or "" for nothing."""
    try:
        bench, fresh, right = hidden_in(sensor, plan, what, seed, number, noise)
    except DataError:
        return Judged(None, (), "", np.nan, None)
    add_by_itself(bench)
    found = bench.look()
    offered = tuple(one.term for one in found.suspects if one.term.startswith(NAME))
    before, after = fresh.error(bench), None
    if offered:
        bench.add(offered[0])
        after = fresh.error(bench)
    return Judged(found.opinion.verdict, offered, right, before, after)


def _row(name: str, found: list[Judged]) -> Iterator[str]:
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
    yield f"  {name:<40}{share:<26}{true:<27}{error}".rstrip()
    verdicts = Counter(str(one.verdict) for one in found)
    wrong = Counter(one.offered[0] for one in offered if one.offered[0] != one.right)
    said = ", ".join(f"{n} {word}" for word, n in verdicts.most_common())
    others = ", ".join(f"{n} {word}" for word, n in wrong.most_common())
    yield f"      {said}" + (f"; other curves: {others}" if others else "")


def _interval(good: int, of: int) -> str:
    low, high = interval(good, of)
    return f"[{low:.1f}, {high:.1f}] %"


if __name__ == "__main__":
    main()
