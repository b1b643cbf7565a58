"""Coefficients of noise at rest: ``python -m benchmarks.noise_coefficients RECORDINGS SEED``.

Each recording has three independent axes and lasts over an hour at 10 samples/s; its noise is made
from the spectrum (IEEE 952, annex B). The rows show for each coefficient the share of axes that
determine it, whose 95 % interval holds the truth, and whose upper limit, which holds in 95 of 100,
lies above it. A coefficient that is not there may be determined in 2.5 % by chance.
"""

import sys

import numpy as np

from benchmarks.measure import Wanted
from imucal_wizard.estimate.noise_coefficients import COEFFICIENTS, Coefficient, fit_noise
from imucal_wizard.measurement.allan_variance import AllanSums
from tests.noise.at_rest import three_axes

RATE, COUNT = 10.0, 40_000
WORLDS = {
    "white noise": {"white": 0.01},
    "white noise, random walk": {"white": 0.01, "walk": 4e-4},
    "white noise, weak random walk": {"white": 0.01, "walk": 1e-4},
    "white noise, flicker": {"white": 0.01, "flicker": 2e-3},
    "white noise, flicker, random walk": {"white": 0.01, "flicker": 2e-3, "walk": 4e-4},
}
PARTS = dict(zip(COEFFICIENTS, ("white", "flicker", "walk"), strict=False))


def found_in(seed: int, parts: dict[str, float]) -> list[dict[str, Coefficient]]:
    """The coefficients of the axes of one recording."""
    sums = AllanSums(3)
    sums.feed(three_axes(seed, COUNT, RATE, **parts))
    return [fit.coefficients for fit in fit_noise(sums.result(), 1.0 / RATE)]


def main(recordings: int, seed: int) -> None:
    """Print the table."""
    wanted = Wanted()
    print(
        f"{recordings} recordings of three axes and {COUNT / RATE / 60.0:.0f} min each, seed {seed}"
    )
    print(f"{'noise':36}{'coefficient':20}{'true':>8}  determined  inside 95 %  below 95 %")
    for place, (world, parts) in enumerate(WORLDS.items()):
        begin = seed + place * recordings
        axes = [one for s in range(begin, begin + recordings) for one in found_in(s, parts)]
        for name, part in PARTS.items():
            true = parts.get(part, 0.0)
            each = [axis[name] for axis in axes]
            known = sum(one.determined for one in each)
            inside = sum(abs(one.value - true) <= 1.96 * one.standard_error for one in each)
            below = sum(true <= one.below for one in each)
            shares = [100.0 * good / len(each) for good in (known, inside, below)]
            print(
                f"{world:36}{name.replace('_', ' '):20}{true:8.4f}"
                f"{shares[0]:9.1f} %{shares[1]:11.1f} %{shares[2]:10.1f} %"
            )
            label = f"{world}, {name.replace('_', ' ')}"
            if not true:
                wanted.share(f"{label}: determined", known, len(each), 0.0, 2.5)
            doubt = 100.0 * float(np.sqrt(0.05 * 0.95 / len(each)))
            for what, share in (("inside", shares[1]), ("below", shares[2])):
                wanted.figure(f"{label}: {what}", share, 93.0, 100.0, doubt)
    print(wanted)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
