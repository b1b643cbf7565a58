"""The magnetometer against a known truth: ``python -m benchmarks.magnetometer [runs]``.

N's figure 7 is the truth of a simulated sensor (the tests' own simulator, which shares no formula
with the fit): the six circles of N's VI-A by hand, the MAG3110's noise at 80 samples a second, its
0.1 µT counts or ten bits over ±1000 µT. ``intervals [runs [seed]]`` prints the first table alone:
the share of recordings in which the 95 % interval of each parameter holds the truth, of circles,
tumbling and 26 still poses, under white noise, noise that differs from one second of five to the
next, and an offset of each pose (of each five seconds in motion) such as a room makes.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np

from benchmarks.measure import machine
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray, Series
from imucal_wizard.estimate.distributions import quantile
from imucal_wizard.estimate.magnetometer.fit import fit_magnetometer
from imucal_wizard.estimate.methods import MethodNames
from tests.estimate.field_truth import (
    CORRECTION,
    MAGNITUDE,
    NOISE,
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
SAMPLES = 50_000


def poses(rng: np.random.Generator, seconds: float = 3.0) -> FloatArray:
    """Unit field in the body's axes in 26 still poses; a hand misses each by a few degrees."""
    nominal = np.array([one for one in product((-1.0, 0.0, 1.0), repeat=3) if any(one)])
    placed = nominal / np.linalg.norm(nominal, axis=1)[:, None]
    placed = placed + np.radians(3.0) * rng.standard_normal(placed.shape)
    placed /= np.linalg.norm(placed, axis=1)[:, None]
    return np.repeat(placed, round(seconds * RATE), axis=0)


@dataclass(frozen=True)
class Noise:
    """What is added to the readings.

    Attributes:
        uneven: standard deviation of the logarithm of the noise from stretch to stretch.
        offset: of each stretch and axis, counts.
    """

    uneven: float = 0.0
    offset: float = 0.0

    def drawn(self, samples: int, stretch: float, rng: np.random.Generator) -> FloatArray:
        """Noise of the readings, counts, shape (samples, 3)."""
        number = (np.arange(samples) / (stretch * RATE)).astype(int)
        level = NOISE * np.exp(self.uneven * rng.standard_normal(number[-1] + 1))
        offset = self.offset * rng.standard_normal((number[-1] + 1, 3))
        return np.asarray(level[number, None] * rng.standard_normal((samples, 3)) + offset[number])


NOISES = {
    "white": Noise(),
    "uneven, 0.7": Noise(uneven=0.7),
    "0.05 µT from pose to pose": Noise(offset=0.5),
}
MOTIONS: dict[str, tuple[Make, float]] = {
    "six circles of 20 s": (partial(six_circles, seconds=20.0), 5.0),
    "tumbling for 50 s": (partial(tumbling, samples=4000), 5.0),
    "26 poses of 3 s": (poses, 3.0),
}
"""How the field turns, and the seconds of a stretch of equal noise."""


def intervals(make: Make, stretch: float, noise: Noise, step: float, runs: int, seed: int) -> str:
    """Share of 95 % intervals that hold the truth, per parameter, and rms error over s.e."""
    off, inside = [], []
    for run in range(runs):
        rng = np.random.default_rng([seed, run])
        directions = make(rng)
        extra = noise.drawn(len(directions), stretch, rng) @ CORRECTION.T
        fit = fit_magnetometer(
            recorded(directions, rng, noise=0.0, step=step, extra=extra).series
        ).fit
        found = {p.name: p for p in fit.parameters}
        away = [
            (found[name].value - TRUE[name]) / (found[name].standard_error or np.nan)
            for name in TRUE
        ]
        off.append(away)
        inside.append(np.abs(away) < quantile(0.95, fit.degrees_of_freedom))
    shares = np.mean(inside, axis=0)
    return "".join(f"{100.0 * one:9.1f}" for one in shares) + (
        f"{np.sqrt(np.mean(np.square(off))):8.2f}"
    )


def coverage(runs: int, seed: int, only: str = "") -> None:
    """Print the table of intervals."""
    doubt = 100.0 * np.sqrt(0.95 * 0.05 / runs)
    print(f"\n{runs} recordings each, seed {seed}, truth: N's figure 7")
    print(f"per cent of 95 % intervals that hold the truth, each ± {doubt:.1f}; wanted: 93 to 97")
    names = "".join(f"{name.replace('soft_iron', 'iron'):>9}" for name in TRUE)
    print(f"{'':50}{names}{'rms':>8}")
    for name, (make, stretch) in MOTIONS.items():
        for kind, noise in NOISES.items():
            for bits, step in (("", 1.0), (", 10 bits", TEN_BITS)):
                if kind != "white" and bits:
                    continue
                label = f"{name}, {kind}{bits}"
                if only in label:
                    found = intervals(make, stretch, noise, step, runs, seed)
                    print(f"{label:50}{found}", flush=True)


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
            int((sys.argv[2:3] or ["4000"])[0]), int((sys.argv[3:4] or ["1"])[0]), *sys.argv[4:5]
        )
    else:
        main(*(int(word) for word in sys.argv[1:]))
