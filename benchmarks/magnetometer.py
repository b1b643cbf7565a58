"""The magnetometer against a known truth: ``python -m benchmarks.magnetometer [runs]``.

N's figure 7 is the truth of a simulated sensor (the tests' own simulator, which shares no formula
with the fit): the six circles of N's VI-A by hand, the MAG3110's noise at 80 samples a second, its
0.1 µT counts or ten to fourteen bits over ±1000 µT. ``intervals [runs [seed [rows]]]`` prints the
first table alone: the share of recordings in which the 95 % interval of each parameter holds the
truth, of circles, tumbling and 18 to 52 still poses, with turns between them and without, and of
poses with circles after them, under white noise, noise that differs from one second of five to the
next, an offset of each pose (of each five seconds in motion) such as a room makes, which goes over
into the next one in a turn, a field whose strength drifts, and a bias that wanders (its truth is
its mean over the session); the rms error over the Cramér–Rao bound of all samples with known
variances (wanted: at most 1.05, with turns, whose rows are of 16 samples, 1.12); the share of 90 %
intervals of the error held out that hold the rms error of six new recordings of the same motion
(wanted: 87 to 93 %), which ``-`` in place of them leaves out; and the share of reports that say
that slow noise was not measured. ``rows`` selects those whose name contains it.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise, product

import numpy as np

from benchmarks.hold_sessions import DESIGNS, STEP, wander
from benchmarks.hold_sessions import Noise as Wandering
from benchmarks.measure import Wanted, machine
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray, Series
from imucal_wizard.core.statistics import root_mean_square
from imucal_wizard.estimate.distributions import quantile
from imucal_wizard.estimate.magnetometer.experiment import MagnetometerExperiment
from imucal_wizard.estimate.magnetometer.field_data import field_data, rescaled
from imucal_wizard.estimate.magnetometer.fit import MagnetometerFit, fit_magnetometer
from imucal_wizard.estimate.methods import MethodNames
from imucal_wizard.model.rows.source import Parameters
from imucal_wizard.model.terms import Terms
from tests.estimate.field_truth import (
    CORRECTION,
    MAGNITUDE,
    NOISE,
    OFFSET,
    RATE,
    TEN_BITS,
    all_over,
    recorded,
    six_circles,
    true_parameters,
    tumbling,
)

METHODS = tuple(MethodNames("magnetometer"))

Make = Callable[[np.random.Generator], FloatArray]
TRUE = true_parameters()
PAIRS = [(i, j) for i in range(3) for j in range(i, 3)]
SAMPLES = 50_000
NEW = 6
"""New recordings by which an error held out is judged."""


ALL_POSES = np.array([one for one in product((-1.0, 0.0, 1.0), repeat=3) if any(one)])
"""26 poses, the field from one side of x to the other: a drift acts like a bias of x."""


def poses(
    rng: np.random.Generator,
    seconds: float = 3.0,
    uneven: bool = False,
    nominal: FloatArray = ALL_POSES,
) -> FloatArray:
    """Unit field in the body's axes in still poses; a hand misses each by a few degrees.

    Args:
        rng: chance.
        seconds: of each pose.
        uneven: whether a pose takes from one to nine times as long.
        nominal: the poses in their order, shape (n, 3).
    """
    placed = nominal / np.linalg.norm(nominal, axis=1)[:, None]
    placed = placed + np.radians(3.0) * rng.standard_normal(placed.shape)
    placed /= np.linalg.norm(placed, axis=1)[:, None]
    longer = 9.0 ** rng.uniform(size=len(placed)) if uneven else np.ones(len(placed))
    return np.repeat(placed, np.round(seconds * longer * RATE).astype(int), axis=0)


def turned(rng: np.random.Generator, nominal: FloatArray, turn: float = 2.0) -> FloatArray:
    """Still poses of 3 s, from each of which a hand turns the device to the next, shape (n, 3).

    Args:
        rng: chance.
        nominal: the poses in their order, shape (k, 3).
        turn: seconds of a turn.
    """
    held = round(3.0 * RATE)
    placed = poses(rng, nominal=nominal)[::held]
    share = 0.5 - 0.5 * np.cos(np.pi * (np.arange(round(turn * RATE)) + 0.5) / round(turn * RATE))
    parts = []
    for one, other in pairwise(placed):
        across = np.cross(one, other)
        across /= np.linalg.norm(across)
        angle = np.arccos(one @ other) * share
        path = np.outer(np.cos(angle), one) + np.outer(np.sin(angle), np.cross(across, one))
        parts += [np.tile(one, (held, 1)), path]
    return np.concatenate([*parts, np.tile(placed[-1], (held, 1))])


def session(rng: np.random.Generator) -> FloatArray:
    """18 poses with turns, and six circles of 12 s after them, shape (n, 3)."""
    parts = turned(rng, DESIGNS["18"]), six_circles(rng, seconds=12.0)
    return np.concatenate(parts)


def sampled(make: Make, rate: float) -> Make:
    """The same motion at another sampling rate, samples a second."""

    def made(rng: np.random.Generator) -> FloatArray:
        field = make(rng)
        time = np.arange(len(field)) / RATE
        other = np.arange(round(len(field) * rate / RATE)) / rate
        moved = np.stack([np.interp(other, time, axis) for axis in field.T], axis=1)
        return np.asarray(moved / np.linalg.norm(moved, axis=1)[:, None])

    return made


@dataclass(frozen=True)
class Noise:
    """What is added to the readings.

    Attributes:
        white: noise of single samples over that of the MAG3110.
        uneven: standard deviation of the logarithm of the noise from stretch to stretch.
        offset: of each stretch and axis, counts.
        drift: of the field's strength over the session, a random walk, counts.
        flicker: Allan deviation of each axis's bias at 10 s, of power 1/f, counts.
        walk: of each axis's bias, which walks at random, counts per root of a second.
    """

    white: float = 1.0
    uneven: float = 0.0
    offset: float = 0.0
    drift: float = 0.0
    flicker: float = 0.0
    walk: float = 0.0

    @property
    def bounded(self) -> bool:
        """Whether ``bound`` knows of all of it."""
        return not (self.drift or self.flicker or self.walk)

    def levels(self, stretch: IntArray, rng: np.random.Generator) -> FloatArray:
        """Standard deviation of each sample's white noise, counts, shape (n,)."""
        number = int(stretch[-1]) + 1
        sizes = self.white * NOISE * np.exp(self.uneven * rng.standard_normal(number))
        return np.asarray(sizes[stretch])

    def shared(
        self, field: FloatArray, stretch: IntArray, rate: float, rng: np.random.Generator
    ) -> tuple[FloatArray, FloatArray]:
        """What samples have in common, by offsets of the readings and of the field, (n, 3) each."""
        offset = (self.offset * rng.standard_normal((int(stretch[-1]) + 1, 3)))[stretch]
        resting = _resting(field)
        if resting.any() and not resting.all():  # in a turn it goes over into that of the next pose
            number = np.arange(len(field))
            turns = number[: number[resting][-1]]
            for axis in offset.T:
                axis[turns] = np.interp(turns, number[resting], axis[resting])
        walk = np.cumsum(rng.standard_normal(len(field))) / np.sqrt(len(field))
        if self.flicker or self.walk:
            bias = Wandering(flicker=self.flicker, walk=self.walk)
            moments = (np.arange(len(field)) / rate / STEP).astype(int)
            offset = offset + wander(bias, int(moments[-1]) + 1, rng)[moments]
            offset -= offset.mean(axis=0)  # the truth is the mean over the session
        return offset, self.drift * field * (walk - walk.mean())[:, None]


NOISES = {
    "white": Noise(),
    "a tenth of white": Noise(white=0.1),
    "uneven, 0.4": Noise(uneven=0.4),
    "uneven, 0.7": Noise(uneven=0.7),
    "uneven, 1.0": Noise(uneven=1.0),
    "0.05 µT from pose to pose": Noise(offset=0.5),
    "field drifts by 0.2 µT": Noise(drift=2.0),
    "flicker 0.03 µT": Noise(flicker=0.3),
    "flicker 0.1 µT": Noise(flicker=1.0),
    "random walk 0.005 µT/√s": Noise(walk=0.05),
    "random walk 0.01 µT/√s": Noise(walk=0.1),
    "random walk 0.02 µT/√s": Noise(walk=0.2),
}
STEPS = {
    "": 1.0,
    ", 10 bits": TEN_BITS,
    ", 12 bits": TEN_BITS / 4.0,
    ", 14 bits": TEN_BITS / 16.0,
}
"""Counts of a step; where the noise of a rest is less than half of it, means are off by rounding.
In every recording it is another one by up to 5 %, with zero anywhere in it: no interval that does
not know of a shift holds the truth 95 times in a hundred where the shift is always the same."""
MOTIONS: dict[str, tuple[Make, float, float]] = {
    "six circles of 20 s": (partial(six_circles, seconds=20.0), RATE, 5.0),
    "six circles of 20 s twice": (
        lambda rng: np.concatenate([six_circles(rng), six_circles(rng)]),
        RATE,
        5.0,
    ),
    "six circles at 25 Hz": (sampled(partial(six_circles, seconds=20.0), 25.0), 25.0, 5.0),
    "six circles at 200 Hz": (sampled(partial(six_circles, seconds=20.0), 200.0), 200.0, 5.0),
    "tumbling for 50 s": (partial(tumbling, samples=4000), RATE, 5.0),
    "18 poses of 3 s": (partial(poses, nominal=DESIGNS["18"]), RATE, 0.0),
    "26 + 12 poses of 3 s": (partial(poses, nominal=DESIGNS["26 + 12"]), RATE, 0.0),
    "18 poses of 3 s, turns of 2 s": (partial(turned, nominal=DESIGNS["18"]), RATE, 0.0),
    "26 + 12 poses of 3 s, turns of 2 s": (partial(turned, nominal=DESIGNS["26 + 12"]), RATE, 0.0),
    "18 poses with turns, six circles of 12 s": (session, RATE, 0.0),
    "26 poses of 3 s": (poses, RATE, 0.0),
    "26 poses of 3 s twice": (lambda rng: np.concatenate([poses(rng), poses(rng)]), RATE, 0.0),
    "26 poses of 3 to 27 s": (partial(poses, uneven=True), RATE, 0.0),
}
"""How the field turns, samples a second, and the seconds of a stretch; 0 where it is a pose."""


def stretches(field: FloatArray, samples: int) -> IntArray:
    """Number of the stretch that each sample is of, shape (n,): so many samples, or a pose.

    A turn to the next pose belongs to the pose before it, and what follows the last pose is cut
    like a motion without poses.
    """
    number = np.arange(len(field))
    if samples:
        return number // samples
    resting = _resting(field)
    begins = np.append(True, (np.diff(field, axis=0) != 0.0).any(axis=1)) & resting
    beyond = number - number[resting][-1] - 1
    return np.cumsum(begins) - 1 + np.where(beyond >= 0, 1 + beyond // round(5.0 * RATE), 0)


def _resting(field: FloatArray) -> BoolArray:
    """Which samples have the direction of one beside them, shape (n,)."""
    same = (np.diff(field, axis=0) == 0.0).all(axis=1)
    return np.asarray(np.append(same, False) | np.append(False, same))


def bound(
    field: FloatArray, level: FloatArray, stretch: IntArray, offset: float
) -> dict[str, float]:
    """Least standard deviation of each parameter if all variances are known.

    Every sample tells the length ``|M (y − b)|``; an offset of each stretch is in all of its
    samples.

    Args:
        field: true direction, shape (n, 3).
        level: standard deviation of each sample, shape (n,).
        stretch: of each sample, shape (n,).
        offset: standard deviation of that of a stretch.
    """
    design, inward = linear(field)
    root = level * np.linalg.norm(inward, axis=1)
    white, common = design / root[:, None], offset * inward / root[:, None]
    starts = np.flatnonzero(np.diff(stretch, prepend=-1))
    information = white.T @ white
    if offset:

        def sums(a: FloatArray, b: FloatArray) -> FloatArray:
            return np.add.reduceat(a[:, :, None] * b[:, None, :], starts, axis=0)

        inner, across = sums(common, common) + np.eye(3), sums(common, white)
        information -= np.einsum("kia,kij,kjb->ab", across, np.linalg.inv(inner), across)
    whole = np.linalg.inv(information)
    change = told()
    return dict(zip(TRUE, np.sqrt(np.diag(change.T @ whole @ change)), strict=True))


def linear(field: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How the length moves with b and M's entries, (n, 9), and with an offset, (n, 3)."""
    reading = MAGNITUDE * field @ np.linalg.inv(CORRECTION).T
    inward = field @ CORRECTION
    columns = [
        field[:, i] * reading[:, j] + (i != j) * field[:, j] * reading[:, i] for i, j in PAIRS
    ]
    return np.column_stack([-inward, *columns]), inward


def told() -> FloatArray:
    """How the parameters that are told, in the gauge det M = 1, move with b and M, (9, 10)."""
    out, at = [], np.concatenate([OFFSET, [CORRECTION[one] for one in PAIRS]])
    for place, step in enumerate(np.diag([1e-3] * 3 + [1e-6] * 6)):
        ahead, behind = (_named(at + sign * step) for sign in (1.0, -1.0))
        out.append((ahead - behind) / (2.0 * step[place]))
    return np.array(out)


def _named(theta: FloatArray) -> FloatArray:
    matrix = np.zeros((3, 3))
    for (i, j), value in zip(PAIRS, theta[3:], strict=True):
        matrix[i, j] = matrix[j, i] = value
    size = np.cbrt(np.linalg.det(matrix))
    return np.array([*theta[:3], *(theta[3:] / size), MAGNITUDE / size])


def intervals(
    motion: tuple[Make, float, float],
    noise: Noise,
    coarse: float,
    runs: int,
    seed: int,
    fresh: bool = False,
) -> tuple[FloatArray, float, float, float, float]:
    """Share of 95 % intervals that hold the truth, per parameter, shape (10,).

    A recording that is refused has none. And the rms error over the standard error, over the least
    possible one, the share of 90 % intervals of the error held out that hold the rms error of a new
    recording, if asked for, and the share of reports that say that slow noise was not measured.
    """
    make, rate, seconds = motion
    off, over, inside, foretold, unknown = [], [], [], [], []
    for run in range(runs):
        rng = np.random.default_rng([seed, run])
        field, stretch, level, steps, series = recording(motion, noise, coarse, rng)
        try:
            calibrated = fit_magnetometer(series)
        except DataError:  # no interval holds anything then
            inside.append(np.zeros(len(TRUE), bool))
            continue
        fit = calibrated.fit
        if fresh and fit.held_out_interval is not None:
            left = []
            for _ in range(NEW):  # in new places, with the same noise
                other = make(rng)
                again = stretches(other, round(seconds * rate))
                each = level[np.flatnonzero(np.diff(stretch, prepend=-1))]
                same = each[np.minimum(again, len(each) - 1)]
                series = _measured(other, same, noise, again, steps, rate, rng)
                left.append(_errors(calibrated, series))
            low, high = fit.held_out_interval
            foretold.append(low <= root_mean_square(np.concatenate(left)) <= high)
        found = {p.name: p for p in fit.parameters}
        least = bound(field, np.hypot(level, steps[0] / np.sqrt(12.0)), stretch, noise.offset)
        away = np.array([found[name].value - TRUE[name] for name in TRUE])
        errors = np.array([found[name].standard_error or np.nan for name in TRUE])
        unknown.append(bool(fit.slow_noise_note))
        off.append(away / errors)
        over.append(away / np.array(list(least.values())))
        inside.append(np.abs(away / errors) < quantile(0.95, fit.degrees_of_freedom))
    rms, ratio = (float(np.sqrt(np.mean(np.square(one)))) for one in (off, over))
    new = float(np.mean(foretold)) if foretold else np.nan
    return np.mean(inside, axis=0), rms, ratio, new, float(np.mean(unknown))


def recording(
    motion: tuple[Make, float, float], noise: Noise, coarse: float, rng: np.random.Generator
) -> tuple[FloatArray, IntArray, FloatArray, tuple[float, FloatArray], Series]:
    """What one sensor reads in one motion; the arguments are those of ``intervals``.

    Returns:
        Directions, stretches, noise of each sample, the converter's step with the reading that ends
        one, and the readings.
    """
    make, rate, seconds = motion
    field = make(rng)
    stretch = stretches(field, round(seconds * rate))
    level = noise.levels(stretch, rng)
    step = coarse * rng.uniform(0.95, 1.05)
    steps = step, step * rng.uniform(size=3)
    return field, stretch, level, steps, _measured(field, level, noise, stretch, steps, rate, rng)


def _measured(
    field: FloatArray,
    level: FloatArray,
    noise: Noise,
    stretch: IntArray,
    steps: tuple[float, FloatArray],
    rate: float,
    rng: np.random.Generator,
) -> Series:
    """One recording; arguments as in ``Noise``, and the step with the reading that ends one."""
    step, zero = steps
    offset, drift = noise.shared(field, stretch, rate, rng)
    white = level[:, None] * rng.standard_normal(field.shape) + offset - zero
    extra = white @ CORRECTION.T + drift
    series = recorded(field, rng, noise=0.0, step=step, extra=extra, rate=rate).series
    return replace(series, values=series.values + zero)


def _errors(found: MagnetometerFit, series: Series) -> FloatArray:
    """Errors of the magnitude in the rows of another recording, shape (k,)."""
    start = replace(found.start, series=series, kept=np.ones(len(series), bool), left_out=())
    data = field_data(start)
    data = rescaled(data, *data.start)
    rows = MagnetometerExperiment(replace(data, field=found.magnitude)).magnitude
    fit = found.fit
    return rows.at(Parameters(fit.matrix, fit.bias), Terms(fit.sensor, ())).residual


def coverage(runs: int, seed: int, only: str = "", fresh: str = "") -> None:
    """Print the table of intervals."""
    doubt = 100.0 * np.sqrt(0.95 * 0.05 / runs)
    print(f"\n{runs} recordings each, seed {seed}, truth: N's figure 7")
    print(f"per cent of 95 % intervals that hold the truth, each ± {doubt:.1f}; wanted: 93 to 97")
    names = "".join(f"{name.replace('soft_iron', 'iron'):>9}" for name in TRUE)
    wanted = Wanted()
    print(f"{'':64}{names}{'rms':>8}{'bound':>8}{'held out':>9}{'unknown':>8}")
    for name, motion in MOTIONS.items():
        for kind, noise in NOISES.items():
            for bits, step in STEPS.items():
                if bits and (noise.offset or noise.uneven or not noise.bounded):
                    continue
                label = f"{name}, {kind}{bits}"
                if only in label:
                    found = intervals(motion, noise, step, runs, seed, fresh=fresh != "-")
                    shares, rms, ratio, foretold, unknown = found
                    told = noise.bounded and not bits and not (noise.offset and "turns" in name)
                    known = f"{ratio:8.2f}" if told else f"{'–':>8}"
                    cells = "".join(f"{100.0 * one:9.1f}" for one in shares)
                    said = f"{rms:8.2f}{known}{100.0 * foretold:9.1f}{100.0 * unknown:8.1f}"
                    print(f"{label:64}{cells}{said}", flush=True)
                    # most reports say that slow noise was not measured
                    limits = (93.0, 97.0) if noise.bounded or unknown < 0.5 else (90.0, 99.0)
                    if told:
                        # rows of a turn are of 16 samples
                        most = 1.12 if "turns" in name else 1.05
                        slack = ratio / np.sqrt(2.0 * runs)
                        wanted.figure(f"{label}: rms over the bound", ratio, 0.0, most, slack)
                    for parameter, share in zip(TRUE, shares, strict=True):
                        inside = 100.0 * float(share)
                        wanted.figure(f"{label}: {parameter}", inside, *limits, doubt)
    print(wanted)


def timing() -> str:
    """Median wall and CPU time of twenty warm fits of 50,000 samples, clean and disturbed."""
    rng = np.random.default_rng(0)
    directions = six_circles(rng, SAMPLES / 480.0 + 1.0)[:SAMPLES]
    cells = []
    for extra in (np.zeros((SAMPLES, 3)), _outliers(rng, SAMPLES)):
        series = recorded(directions, rng, extra=extra).series
        fit_magnetometer(series)
        took = []
        for _ in range(20):
            start = time.perf_counter(), time.process_time()
            fit_magnetometer(series)
            took.append((time.perf_counter() - start[0], time.process_time() - start[1]))
        wall, processor = 1e3 * np.median(took, axis=0)
        cells.append(f"{wall:.0f} ms (CPU {processor:.0f})")
    return f"clean {cells[0]}, with outliers {cells[1]}; wanted 50 ms"


def _outliers(rng: np.random.Generator, count: int) -> FloatArray:
    """Two per cent wild samples, and three seconds of a passing steel object of 10 µT."""
    extra = np.zeros((count, 3))
    wild = rng.random(count) < 0.02
    extra[wild] = 300.0 * rng.standard_normal((int(wild.sum()), 3))
    when = (np.arange(count) - rng.uniform(0.2, 0.8) * count) / 80.0
    extra += (100.0 * np.exp(-((when / 1.5) ** 2)))[:, None] * np.array([0.6, -0.6, 0.5])
    return extra


def _even(rng: np.random.Generator) -> FloatArray:
    return tumbling(rng, 6000)


def _uneven(rng: np.random.Generator) -> FloatArray:
    """Half a minute of tumbling, and four times as long on one face."""
    return np.concatenate([tumbling(rng, 2400), six_circles(rng, 120.0, faces=(0,))])


def comparison(make: Make, disturbed: bool, runs: int) -> list[str]:
    """Error of each method in directions of all kinds, in per mille of the field.

    The readings lack something of the model too, as real ones do: 0.5 % of third order along x,
    so that the methods differ in what they do with it.
    """
    grid = all_over(np.random.default_rng(1), 2000)
    rest: dict[str, list[float]] = {name: [] for name in METHODS}
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        directions = make(rng)
        extra = _bent(directions) + (_outliers(rng, len(directions)) if disturbed else 0.0)
        series = recorded(directions, rng, extra=extra).series
        clean = recorded(grid, rng, noise=0.0, step=0.0, extra=_bent(grid)).series
        for name in METHODS:
            rest[name].append(_error(series, clean, name))
    return [f"{np.nanmedian(v):9.2f} ({_worst(v)})" for v in rest.values()]


def _worst(errors: list[float]) -> str:
    """The largest error; ``none`` where the method found no ellipsoid in some recording."""
    return f"{np.max(errors):.1f}" if np.isfinite(errors).all() else "none"


def _bent(directions: FloatArray) -> FloatArray:
    """A third-order error along x, counts, shape (n, 3)."""
    out = np.zeros_like(directions)
    out[:, 0] = 0.005 * MAGNITUDE * directions[:, 0] ** 3
    return out


def _error(series: Series, clean: Series, method: str) -> float:
    """Relative rms error of the magnitude on clean readings from everywhere, per mille."""
    try:
        found = fit_magnetometer(series, method=method)
    except DataError:
        return float("nan")
    corrected = (clean.values - found.fit.bias) @ found.fit.matrix.T
    sizes = np.linalg.norm(corrected, axis=1) / found.magnitude
    return 1e3 * float(np.sqrt(np.mean((sizes - 1.0) ** 2)))


def main(runs: int = 200) -> None:
    """Print the tables."""
    print(machine())
    coverage(runs, 0)
    print(f"\n{SAMPLES} samples, warm: {timing()}")
    few = max(runs // 5, 5)
    print(
        f"\nerror everywhere, per mille of the field: median of {few} recordings (worst;"
        " none: no ellipsoid found in one of them)"
    )
    print(f"{'coverage, outliers':28}" + "".join(f"{name:>16}" for name in METHODS))
    for coverage_name, make in (("even", _even), ("uneven", _uneven)):
        for disturbed in (False, True):
            cells = comparison(make, disturbed, few)
            label = f"{coverage_name}, {'with' if disturbed else 'none'}"
            print(f"{label:28}" + "".join(f"{cell:>16}" for cell in cells), flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["intervals"]:
        coverage(
            int((sys.argv[2:3] or ["4000"])[0]), int((sys.argv[3:4] or ["1"])[0]), *sys.argv[4:6]
        )
    else:
        main(*(int(word) for word in sys.argv[1:]))
