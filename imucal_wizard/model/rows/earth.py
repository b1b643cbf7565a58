"""The Earth's rate Ω in the holds of a session, as parameters that its rows share.

A gyroscope at rest reads Ω, and a rotation that lasts T seconds turns by ``Ω T`` more than the body
turns against gravity. ``Ω sin φ`` is about up, which gravity shows in each hold. ``Ω cos φ`` is
about north, whose heading gravity does not show; but rotations that follow one another carry a
level direction from hold to hold, so that in an unbroken chain the level part is the sum of two
unknown rates about two level directions. Another chain begins with a heading of its own.

Neither latitude nor heading is known: each part is a parameter with its physical size for a prior.
Together they have the mean square Ω², of which the half is about up, as at a latitude of 45°.
"""

import numpy as np

from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.quaternions import cross
from imucal_wizard.core.readings import FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.model.effects.earth_rate import EARTH_RATE, EarthRate

UPWARD = EARTH_RATE / np.sqrt(2.0)
"""Usual rate about up, rad/s."""
LEVEL = EARTH_RATE / 2.0
"""The same about each of two level directions."""
ALONE = -1
"""Number of the chain of a hold that no rotation leads to or from."""


@dataclass(frozen=True, eq=False)
class EarthAxes:
    """The axes of the Earth's rate as the body sees them in each of h holds.

    Attributes:
        axes: up and two level directions at right angles, columns, shape (h, 3, 3).
        chain: number of the chain of rotations that carries these directions, shape (h,).
    """

    axes: FloatArray
    chain: IntArray

    def rates(self, holds: IntArray) -> FloatArray:
        """Rate in some holds by each part of usual size, rad/s, shape (k, 3, p).

        The level part of a hold without a chain is not among them: it is noise of that hold.
        """
        found = np.zeros((len(holds), 3, 1 + 2 * (int(self.chain.max(initial=ALONE)) + 1)))
        found[:, :, 0] = UPWARD * self.axes[holds, :, 0]
        carried = np.flatnonzero(self.chain[holds] != ALONE)
        for side in (1, 2):
            column = 2 * self.chain[holds[carried]] + side
            found[carried, :, column] = LEVEL * self.axes[holds[carried], :, side]
        return found

    @property
    def unknown(self) -> FloatArray:
        """Variance of the rate on each axis in holds without a chain, (rad/s)², shape (h, 3)."""
        level = LEVEL**2 * (self.axes[:, :, 1:] ** 2).sum(axis=2)
        return np.asarray(np.where(self.chain[:, None] == ALONE, level, 0.0))


def earth_axes(
    up: FloatArray, rest: IntArray, before: IntArray, after: IntArray, ends: FloatArray
) -> EarthAxes:
    """The level directions that rotations carry from hold to hold.

    Args:
        up: in each hold in order, unit vectors, shape (h, 3).
        rest: number of the rest of each, in which the device does not turn, shape (h,).
        before: the hold before each rotation, shape (m,).
        after: the hold after it, shape (m,).
        ends: attitude after it in the frame of the hold before, shape (m, 3, 3).
    """
    turned, chain = np.tile(np.eye(3), (len(up), 1, 1)), np.full(len(up), ALONE)
    start: list[int] = []
    again = (np.flatnonzero(np.diff(rest) == 0) + 1).tolist()
    into = {hold: (hold - 1, np.eye(3)) for hold in again}
    into |= dict(zip(after.tolist(), zip(before.tolist(), ends, strict=True), strict=True))
    begins, count = {first for first, _ in into.values()}, 0
    for hold in range(len(up)):
        first, end = into.get(hold, (hold, turned[hold]))
        turned[hold], chain[hold] = turned[first] @ end, chain[first]
        start.append(hold if first == hold else start[first])
        if first == hold and hold in begins:
            chain[hold], count = count, count + 1
    level = np.eye(3)[np.abs(up[start]).argmin(axis=1)]
    level = np.einsum("hji,hj->hi", turned, level)
    level = unit_vectors(level - up * (level * up).sum(axis=1)[:, None])
    return EarthAxes(np.stack([up, level, cross(up.T, level.T).T], axis=2), chain)


def earth_names(rates: FloatArray | None) -> tuple[str, ...]:
    """Names of the shared parameters of ``EarthAxes.rates``; the first is that of the effect."""
    if rates is None:
        return ()
    return (
        f"{EarthRate.name}_up",
        *(f"{EarthRate.name}_level-{k}" for k in range(rates.shape[2] - 1)),
    )
