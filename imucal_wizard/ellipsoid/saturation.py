"""Axes that end before the field does: their readings pile up at one value."""

from math import comb, sqrt

import numpy as np

from imucal_wizard.ellipsoid.robust import NORMAL, spread
from imucal_wizard.errors import DataError
from imucal_wizard.readings import BoolArray, FloatArray

STUCK = 0.005
"""Share of the samples at one extreme value from which an axis may be saturated."""
FEWEST = 10
"""Samples at one value that may be a pile."""
INSIDE = 3.0
"""How many standard deviations such samples must lie inside the ellipsoid of the others."""
PILE = 3.0
"""How often the extreme value must come against the usual, or against the values next to it."""
BESIDE = 3
"""Values next to the extreme one."""
AWAKE = 0.5
"""Noise, in steps of the readings, from which the extreme value is rare even at rest. Rounding
alone seems to be 0.29 of a step, the root of a twelfth."""
ORDERS = (2, 4, 6)
"""Of the differences that tell the noise: of white noise all say the same, of what moves smoothly
the higher ones say less, and of what moves by jerks the lower ones."""


def stuck_samples(readings: FloatArray) -> dict[str, BoolArray]:
    """Samples at an extreme value that comes suspiciously often, by axis and end (``+x``)."""
    out: dict[str, BoolArray] = {}
    for axis, values in zip("xyz", readings.T, strict=True):
        low, high = float(values.min()), float(values.max())
        for sign, extreme in (("+", high), ("-", low)):
            there = values == extreme
            count = int(there.sum())
            if count < max(FEWEST, STUCK * len(values)):
                continue
            near = np.abs(values - extreme) <= 0.1 * (high - low)
            levels = max(len(np.unique(values[near])) - 1, 1)
            if count > PILE * (near.sum() - count) / levels:
                out[sign + axis] = there
    return out


def check_clipping(readings: FloatArray) -> None:
    """Refuse an axis that is plainly cut off, whatever the others say.

    Where the noise is as large as a step of the readings, the largest value of all is rarer than
    those just below it, even at rest. An axis at its end has lost its noise.

    Args:
        readings: in the order of time, shape (n, 3).

    Raises:
        DataError: an axis is saturated.
    """
    for name, there in stuck_samples(readings).items():
        values = readings[:, "xyz".index(name[1])]
        levels, counts = np.unique(values, return_counts=True)
        if name[0] == "+":
            levels, counts = -levels[::-1], counts[::-1]
        beside = slice(1, 1 + BESIDE)
        if len(levels) < 2 + BESIDE or counts[0] < PILE * counts[beside].max():
            continue
        if _noise(values, there) > AWAKE * float(np.median(np.diff(levels[: 2 + BESIDE]))):
            raise saturated(name, there)


def _noise(values: FloatArray, there: BoolArray) -> float:
    """Noise of the samples between the ends: what no motion explains."""
    found = []
    for order in ORDERS:
        free = ~np.lib.stride_tricks.sliding_window_view(there, order + 1).any(axis=1)
        rough = np.abs(np.diff(values, order))[free]
        size = float(np.median(rough)) if len(rough) >= FEWEST else 0.0
        found.append(NORMAL * size / sqrt(comb(2 * order, order)))
    return min(found)


def check_saturation(stuck: dict[str, BoolArray], distance: FloatArray) -> None:
    """Refuse an axis whose extreme readings lie inside the ellipsoid of the other samples.

    Args:
        stuck: see ``stuck_samples``.
        distance: of every sample from the ellipsoid through the others, shape (n,).

    Raises:
        DataError: an axis is saturated.
    """
    others = ~np.any(list(stuck.values()), axis=0)
    sigma = spread(distance[others])
    for name, there in stuck.items():
        if float(np.median(distance[there])) < -INSIDE * sigma:
            raise saturated(name, there)


def saturated(name: str, there: BoolArray) -> DataError:
    """What to say of an axis at its end.

    Args:
        name: of the axis and the end, ``+x``.
        there: the samples at it, shape (n,).
    """
    end = "largest" if name[0] == "+" else "smallest"
    return DataError(
        f"axis {name[1]} of the magnetometer is saturated: {int(there.sum())} samples "
        f"({100.0 * there.mean():.1f} %) read its {end} value. Choose a larger range, or "
        "take away the magnet near it"
    )
