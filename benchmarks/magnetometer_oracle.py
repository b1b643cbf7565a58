"""What 18 adjoining poses of a magnetometer can tell of slow errors: ``[RUNS [SEED [SIZE]]]``.

The exact answer by Bayes' rule where everything but the parameters is known: the noise of the
samples, and each kind of slow error up to its size (any of a grid, alike in its logarithm). Each
pose is given by six parts of half a second, so that what changes within a pose counts too. The
errors are of a random walk of ``SIZE`` µT/√s (0.02). Printed for the kinds that the program
supposes with its probabilities, for the same kinds alike, for what a place does against the walk,
and for the walk known: the share of 95 % intervals that hold the truth, the rms error over the
standard deviation, and the probability of a walk that the readings leave. No formula is shared with
the program: slow errors are sums of steps and of sine waves.
"""

import sys

import numpy as np
from scipy.special import ndtr

from benchmarks.hold_sessions import DESIGNS
from benchmarks.magnetometer import TRUE, linear, poses, told
from benchmarks.measure import machine
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.slow_noise import (
    ALL_WHITE_OF_FIELD,
    FIELD_DRIFT,
    FIELD_FLICKER,
    FIELD_PLACE,
    FIELD_WALK,
)
from tests.estimate.field_truth import NOISE, RATE

SECONDS, PARTS = 3.0, 6
"""Of a pose, and parts of it."""
MOMENTS = 10
"""Of a part, at which slow errors are drawn."""
SIZES = np.geomspace(0.03, 30.0, 19)
"""Of slow errors, rms of a pose's mean over that of its white noise."""
OF_SLOW = {"place": FIELD_PLACE, "flicker": FIELD_FLICKER, "walk": FIELD_WALK, "drift": FIELD_DRIFT}
SUPPOSED = {"white": ALL_WHITE_OF_FIELD} | {
    kind: (1.0 - ALL_WHITE_OF_FIELD) * chance for kind, chance in OF_SLOW.items()
}
CHANCES = {
    "kinds as supposed": SUPPOSED,
    "kinds alike": dict.fromkeys(SUPPOSED, 0.2),
    "place or walk alike": {"place": 0.5, "walk": 0.5},
    "walk known": {"walk": 1.0},
}


def covariances() -> dict[str, FloatArray]:
    """Of the parts by slow errors of size one of one axis or of the field, about their mean."""
    count = len(DESIGNS["18"]) * PARTS
    moments = count * MOMENTS
    steps = np.tril(np.ones((moments, moments)))
    frequencies = np.arange(1, 2 * moments) / (4.0 * moments)
    phase = 2.0 * np.pi * np.outer(np.arange(moments), frequencies)
    waves = np.concatenate([np.cos(phase), np.sin(phase)], axis=1) / np.sqrt(
        np.tile(frequencies, 2)
    )
    places = np.repeat(np.eye(len(DESIGNS["18"])), PARTS * MOMENTS, axis=0)
    out = {"white": np.zeros((count, count))}
    for name, cause in (("place", places), ("flicker", waves), ("walk", steps)):
        about = cause if name == "place" else cause - cause.mean(axis=0)
        mean = about.reshape(count, MOMENTS, -1).mean(axis=1)
        of_pose = mean.reshape(-1, PARTS, mean.shape[1]).mean(axis=1)
        out[name] = mean @ mean.T / np.mean((of_pose**2).sum(axis=1))
    return out | {"drift": out["walk"]}


def study(runs: int, seed: int, size: float) -> dict[str, tuple[FloatArray, float, float]]:
    """Of each set of chances: shares that hold the truth, rms over sigma, probability of a walk."""
    rng = np.random.default_rng(seed)
    field = poses(rng, nominal=DESIGNS["18"])[:: round(SECONDS * RATE)]
    design, inward = (np.repeat(one, PARTS, axis=0) for one in linear(field))
    slow, change = covariances(), told()
    alike = inward @ inward.T
    white = NOISE**2 * PARTS / (SECONDS * RATE) * np.diag(np.diag(alike))
    walk = np.cumsum(rng.standard_normal((runs, len(design) * MOMENTS, 3)), axis=1)
    walk *= 10.0 * size * np.sqrt(SECONDS / PARTS / MOMENTS)  # ten counts are a µT
    walk -= walk.mean(axis=1, keepdims=True)
    walk = walk.reshape(runs, len(design), MOMENTS, 3).mean(axis=2)
    errors = np.einsum("rni,ni->rn", walk, inward)
    errors += rng.standard_normal(errors.shape) * np.sqrt(np.diag(white))
    left = np.linalg.svd(design)[0][:, design.shape[1] :]
    found = []
    for kind, shape in slow.items():
        for level in SIZES if kind != "white" else SIZES[:1]:
            by_axis = shape if kind == "drift" else shape * alike
            sigma = white + (level * NOISE) ** 2 / (SECONDS * RATE) * by_axis
            weighed = np.linalg.solve(sigma, design)
            whole = change.T @ np.linalg.inv(design.T @ weighed) @ change
            pull = np.linalg.solve(design.T @ weighed, weighed.T)
            shown = left.T @ sigma @ left
            seen = errors @ left
            log = -0.5 * (seen * np.linalg.solve(shown, seen.T).T).sum(axis=1)
            log -= 0.5 * np.linalg.slogdet(shown)[1] + np.log(1 if kind == "white" else len(SIZES))
            found.append((kind, log, errors @ pull.T @ change, np.sqrt(np.diag(whole))))
    kinds = np.array([kind for kind, *_ in found])
    logs, off = np.array([one[1] for one in found]), np.array([one[2] for one in found])
    sigma = np.array([one[3] for one in found])
    out = {}
    for name, chances in CHANCES.items():
        prior = np.array([chances.get(kind, 0.0) for kind in kinds])
        weight = prior[:, None] * np.exp(logs - logs.max(axis=0))
        weight /= weight.sum(axis=0)
        inside = [_holds(weight[:, r], off[:, r], sigma) for r in range(runs)]
        mean = np.einsum("kr,krp->rp", weight, off)
        spread = np.einsum("kr,krp->rp", weight, sigma[:, None] ** 2 + (off - mean) ** 2)
        rms = float(np.sqrt(np.mean(mean**2 / spread)))
        out[name] = np.mean(inside, axis=0), rms, float(weight[kinds == "walk"].sum(axis=0).mean())
    return out


def _holds(weight: FloatArray, mean: FloatArray, sigma: FloatArray) -> FloatArray:
    """Whether zero lies between the 2.5 and the 97.5 % quantile of each mixture, shape (p,)."""
    below = weight @ ndtr(-mean / sigma)
    return np.asarray((below > 0.025) & (below < 0.975))


def main(runs: int = 2000, seed: int = 1, size: float = 0.02) -> None:
    """Print the table."""
    print(machine())
    print(f"\n{runs} recordings of 18 poses of 3 s, seed {seed}, random walk {size:g} µT/√s")
    print("per cent of exact 95 % intervals that hold the truth")
    names = "".join(f"{name.replace('soft_iron', 'iron'):>9}" for name in TRUE)
    print(f"{'':22}{names}{'rms':>8}{'walk':>8}")
    for name, (inside, rms, walk) in study(runs, seed, size).items():
        cells = "".join(f"{100.0 * one:9.1f}" for one in inside)
        print(f"{name:22}{cells}{rms:8.2f}{walk:8.2f}", flush=True)


if __name__ == "__main__":
    words = sys.argv[1:]
    main(*(int(word) for word in words[:2]), *(float(word) for word in words[2:3]))
