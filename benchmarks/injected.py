"""Hidden effects in real recordings: ``python -m benchmarks.injected``.

Ten effects are added to the raw samples of each real recording that carries a calibration, at
multiples of the size that the program itself calls nameable in that recording. The program reads,
fits, judges and adds as in ``bench --auto``. The formulae here are written from the definitions of
the effects (IEEE 1293, IEEE 1431) and share nothing with ``imucal_wizard.model``; specific force
and rate come from a sphere through the rests that this file finds itself. The sums are rounded to
the steps of the recording.

Per effect, with the 95 % interval of Clopper and Pearson where it is a share:

- ``right``: the family of the effect is named and no other; ``listed``: ambiguous or only probable,
  the effect among the explanations; ``none``: unexplained, not repeatable, disturbed or complete;
  ``WRONG``: a family is named that was not added. What a recording shows before anything is added
  is printed above the table.
- accelerometer: the error of holds that the fit has not seen, before and after adding what the
  program adds. Each eighth of the session is left out in turn. Gyroscope: the error of rotations
  left out one at a time.

    --draws        of axes, signs, moments and time constants for each effect and size
    --seed         seed 1 was looked at while this file was written; the stored table is of seed 7
    --recording    part of a name; all of them by default
"""

import argparse
import itertools
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
from scipy.spatial.transform import Rotation as Attitude

from benchmarks.measure import SHARED, Wanted, interval, machine
from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import BoolArray, FloatArray, Readings, Series
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.residuals import candidate_at
from imucal_wizard.diagnose.survey import diagnose_benches
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.accelerometer import accelerometer_experiment
from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.terms import Term

SIX = ("ax", "ay", "az", "gx", "gy", "gz")
MPU = RecordingOptions(SIX, 100.0, "m/s^2", "rad/s")
RECORDINGS: dict[str, tuple[tuple[str, ...], RecordingOptions]] = {
    "Xsens MTi": (
        ("imu_tk_xsens/xsens_acc.mat", "imu_tk_xsens/xsens_gyro.mat"),
        RecordingOptions(as_format="imu_tk"),
    ),
    "MPU-9150, first": (("mikoff_mpu9150/imu0.log",), MPU),
    "MPU-9150, second": (("mikoff_mpu9150/imu1.log",), MPU),
    "six faces": (
        ("imucal_example/example_ferraris_session.csv",),
        RecordingOptions(rate=102.4, accelerometer_unit="m/s^2", gyroscope_unit="deg/s"),
    ),
    "six faces, counts": (
        ("imucal_example/annotated_session.csv",),
        RecordingOptions(rate=102.4, accelerometer_unit="count", gyroscope_unit="count"),
    ),
}
TIMES = 1.0, 2.0, 3.0, 5.0
"""Sizes in units of the nameable one; nothing (0) is added once for each recording."""
PARTS = 8
"""Parts of the session that are left out one at a time, as fresh data."""
STILL = 3.0
"""A second is at rest if its standard deviation is below so many times that of the calmest tenth
of all seconds."""
SAME_REST = np.cos(np.radians(5.0))
MILLI = 1e-3
GRAVITY = 9.80665


@dataclass(frozen=True, eq=False)
class Truth:
    """What the device did, as far as this file knows it, one row per sample.

    Attributes:
        force: specific force, g, shape (n, 3).
        before: the same in the rest before the last one that began, g; 0 before the second one.
        time: since the first sample, s, shape (n,).
        counts_per_g: reading of the accelerometer per g, shape (3,).
        per_degree: reading of the gyroscope per °/s.
    """

    force: FloatArray
    before: FloatArray
    time: FloatArray
    counts_per_g: FloatArray
    per_degree: float


Formula = Callable[[Truth, Sequence[int], float], FloatArray]
"""What one unit of an effect adds on its output axis, mg or °/s, shape (n,)."""

FORMULAE: dict[str, Formula] = {
    "accelerometer/second-order": lambda c, i, _: c.force[:, i[0]] ** 2,
    "accelerometer/third-order": lambda c, i, _: c.force[:, i[0]] ** 3,
    "accelerometer/cross-product": lambda c, i, _: c.force[:, i[1]] * c.force[:, i[2]],
    "accelerometer/bias-drift": lambda c, _i, _: c.time / 60.0,
    "accelerometer/bias-step": lambda c, _i, at: (c.time >= at).astype(float),
    "accelerometer/warm-up": lambda c, _i, at: np.exp(-c.time / at),
    "accelerometer/hysteresis": lambda c, i, _: c.before[:, i[0]],
    "gyroscope/g-sensitivity": lambda c, i, _: c.force[:, i[1]],
    "gyroscope/g2-sensitivity": lambda c, i, _: c.force[:, i[1]] ** 2,
    "gyroscope/bias-drift": lambda c, _i, _: c.time / 60.0,
}


@dataclass(frozen=True)
class Judged:
    """What the program says of one recording.

    Attributes:
        outcome: the column of the table.
        said: verdict and families, in words.
        before: error of fresh data without what was added, mg or degrees.
        after: the same with it.
        size: what was added, in shown units.
        elsewhere: a family is named at the other sensor.
    """

    outcome: str
    said: str
    before: float
    after: float
    size: float
    elsewhere: bool


def main() -> None:
    """Print what each recording shows by itself, and the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--draws", type=int, default=2)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--recording", default="")
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    print(machine())
    if not SHARED.is_dir():
        print(f"skipped: the real recordings are optional, and {SHARED} is not there")
        return
    every: dict[float, list[Judged]] = {times: [] for times in TIMES}
    with ProcessPoolExecutor(asked.jobs) as pool:
        for name in (one for one in RECORDINGS if asked.recording in one):
            sensors = shown_by_itself(name)
            print(f"\n{name}, nothing added", *sensors.values(), sep="\n")
            names = [one for one in FORMULAE if one.partition("/")[0] in sensors]
            if names:
                print(_heading(asked.draws, asked.seed))
            for term in names:
                for times in TIMES:
                    work = partial(injected, name, term, times, asked.seed)
                    own = [one for one in pool.map(work, range(asked.draws)) if one is not None]
                    every[times] += own
                    print(_row(term, times, own), flush=True)
    print("\nall recordings and effects")
    wanted = Wanted()
    for times, own in every.items():
        print(*summary(times, own), sep="\n")
        wrong = sum(one.outcome == "WRONG" for one in own)
        wanted.share(f"wrong names at {times:g} x", wrong, len(own), 0.0, 0.0)
    print(wanted)


def shown_by_itself(name: str) -> dict[str, str]:
    """What the program says of a recording as it is, by sensor that can be judged."""
    try:
        found = plain(name)
    except DataError as error:
        return {"": f"  not judged: {error}"}
    if found["accelerometer"].verdict is Verdict.INSUFFICIENT:
        return {"": f"  not judged: {found['accelerometer'].says}"}
    return {sensor: f"  {sensor}: {one.verdict}. {one.says}" for sensor, one in found.items()}


@cache
def plain(name: str) -> dict[str, Diagnosis]:
    """What ``bench --auto`` says of a recording to which nothing was added."""
    return diagnosed(_readings(name))


def diagnosed(readings: Readings) -> dict[str, Diagnosis]:
    """What ``bench --auto`` says of each sensor."""
    benches = Benches(fit_readings(readings), readings)
    return {one.sensor: one for one in diagnose_benches(benches, {}, automatic=True)}


def injected(name: str, key: str, times: float, seed: int, draw: int) -> Judged | None:
    """One effect of one size in one recording; None where that is blind to it."""
    rng = np.random.default_rng([seed, draw, sum(map(ord, name + key))])
    sensor, _, term = key.partition("/")
    truth = _truth(name)
    at = float(rng.uniform(0.35, 0.65) * truth.time[-1] if "step" in term else rng.uniform(60, 200))
    names, sizes = nameable(name, sensor, term, at)
    seen = np.flatnonzero(np.isfinite(sizes))
    if not len(seen):
        return None
    place = int(rng.choice(seen))
    size = times * float(sizes[place] * rng.choice((-1.0, 1.0)))
    axes = tuple("xyz".index(letter) for letter in names[place])
    added = size * FORMULAE[key](truth, axes, at)
    scale = MILLI * truth.counts_per_g[axes[0]] if sensor == "accelerometer" else truth.per_degree
    readings = _readings(name)
    moved = _with_error(getattr(readings, sensor), axes[0], scale * added)
    readings = (
        replace(readings, accelerometer=moved)
        if sensor == "accelerometer"
        else replace(readings, gyroscope=moved)
    )
    found = diagnosed(readings)
    other = "gyroscope" if sensor == "accelerometer" else "accelerometer"
    elsewhere = bool(_named(found.get(other)) - _named(plain(name).get(other)))
    own = found[sensor]
    errors = _fresh(own, readings) if sensor == "accelerometer" else _rotations_left_out(own)
    return Judged(
        outcome(own, term, _named(plain(name)[sensor])), _said(own), *errors, size, elsewhere
    )


def outcome(found: Diagnosis, term: str, before: frozenset[str] = frozenset()) -> str:
    """The column of the table.

    Args:
        found: what the program says.
        term: the effect that was added.
        before: families that are named without it.
    """
    named, family = _named(found), _family(term)
    if named - before - {family}:
        return "WRONG"
    if family in named:
        return "right"
    said = None if found.findings is None else found.findings.opinion
    if said is None or not (said.verdict is Verdict.AMBIGUOUS or said.probable):
        return "none"
    listed = {_family(one) for terms in (*said.explanations, said.probable) for one in terms}
    return "listed" if family in listed else "none"


def _family(term: str) -> str:
    return effect(term).family or term


def _named(found: Diagnosis | None) -> frozenset[str]:
    """Families that are named, or were added to the model by the program."""
    if found is None or found.findings is None or found.bench is None:
        return frozenset()
    added = {_family(one.name) for one in found.bench.fit.terms}
    return frozenset(added | {*found.findings.opinion.families})


@cache
def nameable(name: str, sensor: str, term: str, at: float) -> tuple[tuple[str, ...], FloatArray]:
    """Names of an effect's parameters, and the size of each that the recording would name."""
    bench = plain(name)[sensor].bench
    findings = None if bench is None else bench.look()
    own = [one for one in (findings.suspects if findings else ()) if one.term == term]
    if findings is None or not own or own[0].candidate is None:
        return (), np.zeros(0)
    candidate = own[0].candidate
    if candidate.variant is not None:
        candidate = candidate_at(findings.misfit, candidate.effect, at)
    sizes = own[0].detectability
    return candidate.names, np.maximum(sizes.named(candidate), sizes.seen(candidate))


def _with_error(series: Series, axis: int, error: FloatArray) -> Series:
    """The samples with an error on one axis, rounded to the recording's steps."""
    values = series.values.copy()
    different = np.unique(values[:, axis])
    step = float(np.diff(different).min())
    if np.ptp(different) / step > 1e6:  # decimals of a converted number are no steps
        step = 0.0
    moved = values[:, axis] + error
    values[:, axis] = values[:, axis] + step * np.round(error / step) if step else moved
    return Series(series.time, values, series.unit)


def _fresh(found: Diagnosis, readings: Readings) -> tuple[float, float]:
    """Error of holds that the fit has not seen, before and after adding, mg."""
    if found.report is None or found.bench is None:
        return np.nan, np.nan
    holds, unit = found.report.holds, found.bench.fit.bias_unit
    around = found.bench.measured.circumstances
    part = np.arange(len(holds)) * PARTS // len(holds)
    means = np.array([hold.accelerometer for hold in holds])
    squares = np.zeros((2, len(holds)))
    models: tuple[tuple[Term, ...], ...] = ((), tuple(found.bench.fit.terms))
    for left in range(PARTS):
        rows = part != left
        kept = [hold for hold, own in zip(holds, rows, strict=True) if own]
        try:
            data = accelerometer_experiment(kept, GRAVITY, unit, readings)
            data.circumstances = around.select(rows)
            data.source = replace(data.source, circumstances=around.select(rows))
            data.sources = (data.source,)
            for number, terms in enumerate(models):
                fitted = fit(data, terms)
                force = fitted.correct(means[~rows], around.select(~rows))
                squares[number, ~rows] = (np.linalg.norm(force, axis=1) - GRAVITY) ** 2
        except DataError:
            return np.nan, np.nan
    before, after = np.sqrt(squares.mean(axis=1)) / (MILLI * GRAVITY)
    return float(before), float(after)


def _rotations_left_out(found: Diagnosis) -> tuple[float, float]:
    """Error of rotations left out, before and after, degrees."""
    if found.bench is None:
        return np.nan, np.nan
    ends = (found.bench.ladder[place].rms_held_out for place in (0, -1))
    before, after = (np.nan if one is None else float(np.degrees(one)) for one in ends)
    return before, after


@cache
def _readings(name: str) -> Readings:
    files, options = RECORDINGS[name]
    return read_files([SHARED / file for file in files], options)


@cache
def _truth(name: str) -> Truth:
    """Specific force by a sphere through the seconds at rest; the gyroscope's scale by gravity."""
    readings = _readings(name)
    series = readings.accelerometer
    length = round(series.rate)
    count = len(series) // length
    pieces = series.values[: count * length].reshape(count, length, 3)
    still, means = _still(pieces), pieces.mean(axis=1)
    offset, per_g = _sphere(means[still])
    force = (series.values - offset) / per_g
    rests = _rests(still, (means - offset) / per_g)
    number = np.zeros(len(series), int)
    for place, (first, _, _) in enumerate(rests):
        number[first * length :] = place + 1
    ups = np.array([np.zeros(3), np.zeros(3), *(up for _, _, up in rests)])
    per_degree = 1.0
    gyroscope = readings.gyroscope
    if gyroscope is not None:
        rate = gyroscope.values[: count * length].reshape(count, length, 3)
        rate = rate - rate[still].mean(axis=(0, 1))
        per_degree = _gyroscope_scale(rate, rests, gyroscope.rate, gyroscope.unit)
    return Truth(force, ups[number], series.time - series.time[0], per_g, per_degree)


def _still(pieces: FloatArray) -> BoolArray:
    spread = pieces.std(axis=1).max(axis=1)
    return np.asarray(spread < STILL * np.quantile(spread, 0.1))


def _sphere(means: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Offset and reading per g of each axis: an ellipsoid along the axes, by linear equations."""
    centre = means.mean(axis=0)
    reach = float(np.ptp(means, axis=0).max()) / 2.0
    scaled = (means - centre) / reach
    solved = np.linalg.lstsq(np.hstack([scaled**2, scaled]), np.ones(len(scaled)), rcond=None)[0]
    square, linear = solved[:3], solved[3:]
    offset = -0.5 * linear / square
    radius = np.sqrt((1.0 + (square * offset**2).sum()) / square)
    return centre + reach * offset, reach * radius


def _rests(still: BoolArray, force: FloatArray) -> list[tuple[int, int, FloatArray]]:
    """First and last second of each rest, and its mean force, g."""
    rests: list[tuple[int, int, FloatArray]] = []
    for second in np.flatnonzero(still):
        up = force[second] / np.linalg.norm(force[second])
        if rests and float(up @ rests[-1][2]) > SAME_REST:
            rests[-1] = rests[-1][0], int(second), rests[-1][2]
        else:
            rests.append((int(second), int(second), up))
    return rests


def _gyroscope_scale(
    rate: FloatArray, rests: Sequence[tuple[int, int, FloatArray]], hertz: float, unit: str
) -> float:
    """Reading per °/s with which the turns between the rests carry gravity along best."""
    if unit == "rad/s":
        return float(np.radians(1.0))

    turns = []
    for (_, end, up), (begin, _, then) in itertools.pairwise(rests):
        steps = np.radians(rate[end : begin + 1].reshape(-1, 3)) / hertz
        parts = np.array_split(steps, max(len(steps) // 4, 1))
        turns.append((np.array([part.sum(axis=0) for part in parts]), up, then))

    def misfit(per_degree: float) -> float:
        squares = []
        for parts, up, then in turns:
            turn = Attitude.from_rotvec(parts / per_degree)
            while len(turn) > 1:  # neighbours joined in pairs
                odd = [turn[-1:]] * (len(turn) % 2)
                whole = len(turn) - len(odd)
                turn = Attitude.concatenate([turn[:whole:2] * turn[1:whole:2], *odd])
            squares.append(float(((turn[0].inv().apply(up) - then) ** 2).sum()))
        return float(np.median(squares))

    rough = np.geomspace(5.0, 200.0, 60)
    best = rough[int(np.argmin([misfit(one) for one in rough]))]
    fine = best * np.linspace(0.94, 1.06, 25)
    return float(fine[int(np.argmin([misfit(one) for one in fine]))])


def _said(found: Diagnosis) -> str:
    if found.findings is None:
        return str(found.verdict)
    named, probable = sorted(_named(found)), "/".join(found.findings.opinion.probable)
    return " ".join([str(found.verdict), *named, *([f"(probably {probable})"] if probable else [])])


def _heading(draws: int, seed: int) -> str:
    columns = "".join(f"{name:>7}" for name in ("right", "listed", "none", "WRONG"))
    return (
        f"  {draws} draws each, seed {seed}; fresh data in mg or degrees, rms\n"
        f"  {'added':<30}{'times':>6}{'size':>8}{columns}   before → after   said"
    )


def _row(term: str, times: float, own: Sequence[Judged]) -> str:
    if not own:
        return f"  {term:<30}{times:>6g}   in the model already, or not seen at any size"
    count = Counter(one.outcome for one in own)
    cells = "".join(f"{count[name]:>7}" for name in ("right", "listed", "none", "WRONG"))
    before, after = (np.sqrt(np.mean([getattr(one, end) ** 2 for one in own])) for end in ENDS)
    size = float(np.median([abs(one.size) for one in own]))
    said = "; ".join(f"{n} {text}" for text, n in Counter(one.said for one in own).most_common())
    elsewhere = " (other sensor named)" if any(one.elsewhere for one in own) else ""
    errors = f"{before:.3f} → {after:.3f}"
    return f"  {term:<30}{times:>6g}{size:>8.2g}{cells}   {errors}   {said}{elsewhere}"


ENDS = "before", "after"


def summary(times: float, own: Sequence[Judged]) -> Iterator[str]:
    """The shares at one size."""
    count = Counter(one.outcome for one in own)
    parts = []
    for name in ("right", "listed", "none", "WRONG"):
        low, high = interval(count[name], len(own)) if own else (0.0, 100.0)
        parts.append(f"{name} {count[name]} [{low:.0f}, {high:.0f}] %")
    worse = sum(one.after > 1.05 * one.before for one in own)
    yield f"  {times:g} x nameable, {len(own)}: {', '.join(parts)}"
    yield f"     fresh data worse by more than 5 % after adding: {worse}"


if __name__ == "__main__":
    main()
