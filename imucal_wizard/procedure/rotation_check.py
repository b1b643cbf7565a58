"""Whether a rotation can be trusted: missing samples, clipping, the axis it was about."""

import numpy as np

from imucal_wizard.procedure.ledger import KeptRotation
from imucal_wizard.procedure.poses import AXES
from imucal_wizard.procedure.turns import integral
from imucal_wizard.readings import FloatArray

AT_RANGE = 0.995
"""Share of the full scale from which a reading is taken as clipped."""
PLATEAU = 4
"""So many equal samples at the extreme of a fast turn are a clipped peak."""
STEEP = 5.0
"""A clipped peak is entered this many resolution steps at once; a smooth one is not."""
LONG_PLATEAU = 8
LONG_STEEP = 3.0
"""So many equal samples leave no room for noise; a smooth peak as flat falls by a single step."""
MOSTLY = 0.75
"""Share of the squared rate that must be about the axis (30° off it)."""


def clipped(rate: FloatArray, rest: FloatArray, full_scale: float | None) -> str | None:
    """The axis that reached the end of its range during a rotation, or None.

    Where the full scale is not known, a clipped peak is told by equal samples at the extreme that
    are entered with a jump.

    Args:
        rate: readings, shape (n, 3).
        rest: the reading at rest, shape (3,).
        full_scale: largest rate the gyroscope shows, in the reading's unit, or None.
    """
    for index, axis in enumerate(AXES):
        if full_scale is not None and np.abs(rate[:, index]).max(initial=0.0) >= (
            AT_RANGE * full_scale
        ):
            return axis
        turned = rate[:, index] - rest[index]
        if _flat_top(turned) or _flat_top(-turned):
            return axis
    return None


def _flat_top(values: FloatArray) -> bool:
    if len(values) <= PLATEAU or not float(values.max()) > 0.0:
        return False
    steps = np.abs(np.diff(values))
    resolution = float(steps[steps > 0.0].min(initial=np.inf))
    at_top = np.flatnonzero(values == values.max())
    if len(at_top) < PLATEAU or at_top[0] == 0:
        return False
    together = np.split(at_top, np.flatnonzero(np.diff(at_top) > 1) + 1)
    for plateau in together:
        entry = steps[plateau[0] - 1] / resolution
        if len(plateau) >= PLATEAU and entry >= STEEP:
            return True
        if len(plateau) >= LONG_PLATEAU and entry >= LONG_STEEP:
            return True
    return False


def shares(rate: FloatArray, rest: FloatArray) -> FloatArray:
    """Each axis' share of the squared rate of a motion, shape (3,)."""
    energy = ((rate - rest) ** 2).sum(axis=0)
    total = float(energy.sum())
    return energy / total if total > 0.0 else np.zeros(3)


def speeds(peaks: list[float]) -> int:
    """How many clearly different speeds there are: each 1.4 times the one before, at most 3."""
    count, last = 0, 0.0
    for peak in sorted(peaks):
        if peak >= 1.4 * last and peak > 0.0:
            count, last = count + 1, peak
    return min(count, 3)


def resting(motion: KeptRotation) -> FloatArray:
    """The gyroscope's reading at rest, from the holds on either side, shape (3,)."""
    known = [
        hold.gyroscope
        for hold in (motion.before.hold, motion.after.hold)
        if hold.gyroscope is not None
    ]
    return np.asarray(np.mean(known, axis=0), float) if known else np.zeros(3)


def turned(motion: KeptRotation) -> FloatArray:
    """The integrated rate of a motion without its bias, shape (3,), rad or counts·s."""
    return integral(motion.time, motion.rate - resting(motion))


def fault_of(motion: KeptRotation, full_scale: float | None, *, missing: bool) -> str | None:
    """What is wrong with the samples of any motion: a gap or clipping; None when nothing is."""
    if missing:
        return "samples are missing in it: turn again"
    axis = clipped(motion.rate, resting(motion), full_scale)
    return None if axis is None else f"{axis} was clipped at the end of its range: turn slower"
