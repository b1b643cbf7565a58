"""How often the accelerometer's intervals hold the truth, and how far its parameters scatter.

``python -m benchmarks.hold_intervals [coverage|scatter|held-out] [sessions] [seed] [poses]
[noise]``; the last two words choose rows of the table, the noise by a part of its name. Coverage:
the share of sessions in which the 95 % interval of each parameter by Student's t holds the truth,
in per cent; the bias is its mean over the session. Scatter: the rms error of each parameter over
the least that any unbiased estimator has when it knows the noise of every hold (Cramér and Rao).
Held out: the share of sessions in which the 90 % interval of the error held out holds the rms error
of 400 new holds.
"""

import sys
from itertools import product

import numpy as np

from benchmarks.hold_sessions import DESIGNS, GRAVITY, MG, NAMES, Noise, session
from benchmarks.measure import Wanted
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.distributions import quantile
from imucal_wizard.estimate.recording import fit_accelerometer

NOISES = {
    "white": Noise(),
    "z twice as noisy": Noise(across_chip=2.0),
    "uneven, 0.7": Noise(uneven=0.7),
    "0.3 mg from hold to hold": Noise(scatter=0.3 * MG),
    "flicker 0.03 mg": Noise(flicker=0.03 * MG),
    "flicker 0.12 mg": Noise(flicker=0.12 * MG),
    "random walk 0.01 mg/√s": Noise(walk=0.01 * MG),
}
"""A consumer sensor's white noise, 0.15 mg/√Hz, alone and with more."""
NEW = 400
"""New holds by which an error held out is judged."""


def coverage(
    design: FloatArray, noise: Noise, sessions: int, seed: int, rest: float = 0.0
) -> FloatArray:
    """Share of sessions in which each interval holds the truth, shape (9,)."""
    rng = np.random.default_rng(seed)
    inside = np.zeros(9)
    for _ in range(sessions):
        one = session(design, noise, rng, rest=rest)
        fit = fit_accelerometer(one.holds, GRAVITY, "m/s^2", readings=one.readings)
        reach = quantile(0.95, fit.degrees_of_freedom)
        found = {parameter.name: parameter for parameter in fit.parameters}
        for k, name in enumerate(NAMES):
            off = abs(found[name].value - one.truth[k])
            inside[k] += off < reach * (found[name].standard_error or 0.0)
    return inside / sessions


def new_holds(
    design: FloatArray, noise: Noise, sessions: int, seed: int, rate: float
) -> tuple[float, float]:
    """Share of sessions whose interval holds the rms of new holds; error held out over it, rms."""
    rng = np.random.default_rng(seed)
    inside, ratio = 0, np.empty(sessions)
    for k in range(sessions):
        one = session(design, noise, rng, rate=rate)
        fit = fit_accelerometer(one.holds, GRAVITY, "m/s^2", readings=one.readings)
        true = (one.new_readings(NEW, rng) - fit.bias) @ fit.matrix.T
        rms = np.sqrt(np.mean((np.linalg.norm(true, axis=1) - GRAVITY) ** 2))
        low, high = fit.held_out_interval or (np.inf, -np.inf)
        inside += low <= rms <= high
        ratio[k] = (fit.rms_held_out or np.nan) / rms
    return inside / sessions, float(np.sqrt(np.nanmean(ratio**2)))


def scatter(
    design: FloatArray, noise: Noise, sessions: int, seed: int, rate: float = 50.0
) -> FloatArray:
    """Rms error of each parameter over the bound, shape (9,)."""
    rng = np.random.default_rng(seed)
    off = np.empty((sessions, 9))
    for row in off:
        one = session(design, noise, rng, rate=rate)
        fit = fit_accelerometer(one.holds, GRAVITY, "m/s^2")
        found = {parameter.name: parameter.value for parameter in fit.parameters}
        row[:] = (np.array([found[name] for name in NAMES]) - one.truth) / one.bound()
    return np.asarray(np.sqrt((off**2).mean(axis=0)))


def main(
    what: str = "coverage", sessions: str = "4000", seed: str = "1", poses: str = "", only: str = ""
) -> None:
    """Print the table."""
    count = int(sessions)
    designs = {name: design for name, design in DESIGNS.items() if poses in ("", name)}
    print(f"{count} sessions each, seed {seed}")
    wanted = Wanted()
    names = "".join(f"{name.replace('sensitivity', 'scale'):>9}" for name in NAMES)
    if what == "scatter":
        print(f"rms error over the bound, each ± {1.0 / np.sqrt(2.0 * count):.3f}\n{'':54}{names}")
        for name, design in designs.items():
            kinds = {f"uneven by {one}": Noise(uneven=one) for one in (0.0, 0.4, 0.7, 1.0)}
            kinds["z twice as noisy"] = NOISES["z twice as noisy"]
            for (samples, rate), kind in product(((150, 50.0), (12, 4.0)), kinds):
                label = f"{name} poses of {samples} samples, {kind}"
                if only not in label:
                    continue
                found = scatter(design, kinds[kind], count, int(seed), rate)
                print(f"{label:54}" + "".join(f"{x:9.3f}" for x in found), flush=True)
                most, doubt = 1.05 if samples >= 20 else 1.12, 1.0 / np.sqrt(2.0 * count)
                for parameter, ratio in zip(NAMES, found, strict=True):
                    wanted.figure(f"{label}: {parameter}", float(ratio), 0.0, most, doubt)
        print(wanted)
        return
    if what == "held-out":
        doubt = 100.0 * np.sqrt(0.9 * 0.1 / count)
        print(f"{'':54}{'inside, %':>12}{'held out over rms':>20}   (each ± {doubt:.1f} %)")
        for name, design in designs.items():
            steady = [kind for kind, noise in NOISES.items() if not (noise.flicker or noise.walk)]
            for (samples, rate), kind in product(((150, 50.0), (12, 4.0)), steady):
                label = f"{name} poses of {samples} samples, {kind}"
                if only not in label:
                    continue
                share, ratio = new_holds(design, NOISES[kind], count, int(seed), rate)
                print(f"{label:54}{100.0 * share:12.1f}{ratio:20.3f}", flush=True)
                wanted.figure(label, 100.0 * share, 87.0, 93.0, doubt)
        print(wanted)
        return
    doubt = 100.0 * np.sqrt(0.95 * 0.05 / count)
    print(f"per cent of intervals that hold the truth, each ± {doubt:.1f}\n{'':54}{names}")
    for name, design in designs.items():
        for kind, noise in NOISES.items():
            if only not in kind:
                continue
            for rest in (0.0, 90.0) if noise.flicker or noise.walk else (0.0,):
                found = coverage(design, noise, count, int(seed), rest)
                label = f"{name} poses{', a rest of 90 s' * bool(rest)}, {kind}"
                print(f"{label:54}" + "".join(f"{100.0 * x:9.1f}" for x in found), flush=True)
                # slow noise without repeats or a long rest is not measured
                slow = bool(noise.flicker or noise.walk) and not rest and name == "18"
                for parameter, share in zip(NAMES, found, strict=True):
                    inside = 100.0 * float(share)
                    limits = (90.0, 99.0) if slow else (93.0, 97.0)
                    wanted.figure(f"{label}: {parameter}", inside, *limits, doubt)
    print(wanted)


if __name__ == "__main__":
    main(*sys.argv[1:])
