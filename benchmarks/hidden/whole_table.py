"""The table of raw recordings through the whole program."""

from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from functools import partial

import numpy as np

from benchmarks.hidden.table import COLUMNS, judge, outcome
from benchmarks.hidden.whole import (
    POSES,
    Judged,
    benches_of,
    hidden_in,
    judged,
    nameable_size,
    terms_of,
)
from benchmarks.measure import Wanted
from imucal_wizard.diagnose.survey import add_by_itself
from imucal_wizard.diagnose.verdict import Opinion
from imucal_wizard.model.effect import ACCELEROMETER, GYROSCOPE
from imucal_wizard.teach.draw import GRADE_NOISE, virtual_sensor

TIMES = 1.0
"""Hidden at so many times what the program calls nameable in the same session without it."""
GRADE = "consumer"


def whole_table(pool: Executor, sensor: str, recordings: int, seed: int) -> Iterator[str]:
    """The lines of the table, one after the other.

    Args:
        pool: where the recordings are made.
        sensor: which one the effects are hidden in.
        recordings: of each row.
        seed: of the first; each recording has one of its own.
    """
    unit = "mg" if sensor == ACCELEROMETER else "deg per rotation"
    yield (
        f"\nraw recordings, {POSES} and rotations, bench --auto, {sensor}; "
        f"{recordings} each; per cent of them"
    )
    columns = "".join(f"{name:>9}" for name in COLUMNS)
    yield f"{'hidden':<40}{'size':>20}{columns}{'added':>7}   held out: before → after, {unit}"
    rows: dict[str, list[Judged]] = {}
    for term in terms_of(sensor):
        work = partial(_with_effect, sensor, term, seed)
        own = [one for one in pool.map(work, range(recordings)) if one is not None]
        if not own:
            yield f"{term:<40}{'':>20}   in none of these recordings could it be seen at any size"
            continue
        rows[f"{term} {TIMES:g}x"] = own
        size = np.median([abs(one.hidden[0].size) for one in own])
        yield _line(f"{term} {TIMES:g}x", f"{size:.3g} {own[0].hidden[0].unit}", own)
    yield _line("all of these", "", [one for own in rows.values() for one in own])
    wanted = Wanted()
    judge(wanted, f"{sensor}, whole program", rows)
    yield str(wanted)


def nothing_hidden(pool: Executor, recordings: int, seed: int) -> Iterator[str]:
    """What is said of recordings with nothing hidden, by grade of the sensor and sensor."""
    kind = f"raw recordings with nothing hidden, {POSES} and rotations, bench --auto"
    yield f"\n{kind}; {recordings} each"
    yield f"{'sensor':<40}{'complete':>10}{'any claim':>11}{'a name':>8}   verdicts"
    for grade in GRADE_NOISE:
        both = list(pool.map(partial(_plain, grade, seed), range(recordings)))
        for place, sensor in enumerate((ACCELEROMETER, GYROSCOPE)):
            own = [one[place] for one in both]
            verdicts = Counter(str(one.verdict) for one in own)
            claims = len(own) - verdicts["complete"]
            named = sum(bool(one.families) for one in own)
            said = ", ".join(f"{word} {count}" for word, count in verdicts.most_common())
            name = f"{grade} {sensor}"
            yield f"{name:<40}{verdicts['complete']:>10}{claims:>11}{named:>8}   {said}"


def _line(name: str, size: str, trials: Sequence[Judged]) -> str:
    counts = Counter(outcome(one) for one in trials)
    counts["family"] += counts["named"]
    share = 100.0 / len(trials)
    cells = "".join(f"{share * counts[column]:9.1f}" for column in COLUMNS)
    added = share * sum(bool(one.added) for one in trials)
    errors = np.array([(one.before, one.after) for one in trials])
    before, after = np.sqrt(np.nanmean(errors**2, axis=0))
    return f"{name:<40}{size:>20}{cells}{added:7.0f}   {before:.4f} → {after:.4f}"


def _with_effect(sensor: str, term: str, seed: int, number: int) -> Judged | None:
    """None where the session cannot show the effect at any size."""
    own = seed + 1000 * sum(map(ord, sensor + term)) + number
    rng = np.random.default_rng(own)
    shaken = term == "vibration-rectification"
    told = nameable_size(own, GRADE, sensor, term, shaken)
    if told is None or not np.isfinite(told[0]).any():
        return None
    sizes, step = told
    hidden = (hidden_in(sensor, term, TIMES, sizes, rng),)
    benches = benches_of(own, virtual_sensor(own, GRADE), hidden, step=step)
    return judged(benches, sensor, hidden)


def _plain(grade: str, seed: int, number: int) -> tuple[Opinion, Opinion]:
    own = seed + number
    benches = benches_of(own, virtual_sensor(own, grade), ())
    accelerometer = judged(benches, ACCELEROMETER, ())
    gyroscope = benches.bench("gyroscope")
    if gyroscope is None:
        raise ValueError("the recording has no gyroscope")
    found = add_by_itself(gyroscope) if benches.passed else gyroscope.look()
    return accelerometer.opinion, found.opinion
