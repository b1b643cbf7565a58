"""Samples that are there twice: a block that is followed by an exact copy of itself.

A buffer that was sent or saved twice makes one. The device then seems to go back to where it was,
and the angle across the copy is not known. Noise makes such a copy by chance only where a sensor
hardly flickers: with n samples, and c of them in the block that differ from the one before, each of
which equals another with the probability q, some block is its own copy with less than ``n² qᶜ``.
"""

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.quantities import plural
from imucal_wizard.core.readings import FloatArray, IntArray
from imucal_wizard.core.records import dataclass

MAX_CHANCE = 1e-6
"""Probability, for a whole recording, below which a copy is no chance."""
WINDOW = 16
"""Changing samples that are compared at a time: fewer are chance at any rate."""
MAX_EQUAL_WINDOWS = 1000
"""Equal windows that are looked at: a machine that repeats its motion without noise makes as many
as there are samples."""


@dataclass(frozen=True)
class Copy:
    """A copied block: samples ``first`` to ``first + size`` are those before them once more."""

    first: int
    size: int


def copies(values: FloatArray) -> list[Copy]:
    """The blocks of samples that are exact copies of the block before them, in order.

    None where a block follows more than twice: a device without noise sends the same again.

    Args:
        values: of all sensors that are read together, shape (n, k).
    """
    rows = np.ascontiguousarray(values)
    number = np.unique(_hashed(rows), return_inverse=True)[1].reshape(-1)
    changes = np.flatnonzero(np.diff(number, prepend=-1))
    found: list[Copy] = []
    for before, after in _equal_windows(number[changes]):
        start, lag = int(changes[before]), int(changes[after] - changes[before])
        if found and start + lag < found[-1].first + found[-1].size:
            continue
        block = _block(rows, start, lag)
        if block is not None and _chance(number, block) < np.log(MAX_CHANCE):
            found.append(block)
    ends = ((one.first + one.size, two.first) for one, two in itertools.pairwise(found))
    sent = any(begin <= end for end, begin in ends)
    return [] if sent else found


def _factors(count: int) -> NDArray[np.uint64]:
    """Odd numbers without a pattern, by repeated products of one (Knuth's generator)."""
    step, found = 6364136223846793005, [1442695040888963407]
    while len(found) < count:
        found.append((found[-1] * step + 1442695040888963407) % 2**64)
    return np.array(found, np.uint64) | np.uint64(1)


def _hashed(rows: FloatArray) -> IntArray:
    """A number of each row, the same for equal rows."""
    bits = rows.view(np.int64).astype(np.uint64)
    mixed = (bits ^ (bits >> np.uint64(29))) * _factors(rows.shape[1])
    return np.asarray((mixed ^ (mixed >> np.uint64(32))).sum(axis=1).view(np.int64))


def _equal_windows(number: IntArray) -> list[tuple[int, int]]:
    """Pairs of equal stretches of ``WINDOW`` numbers, the first in time first."""
    count = len(number) - WINDOW + 1
    if count < 2:
        return []
    whole = np.zeros(count, np.uint64)
    for place, factor in enumerate(_factors(WINDOW)):
        whole += (number[place : place + count].astype(np.uint64) + np.uint64(1)) * factor
    order = np.argsort(whole, kind="stable")
    same = np.flatnonzero(whole[order][1:] == whole[order][:-1])
    pairs = np.stack([order[same], order[same + 1]], axis=1)
    # of a block that is there twice, the first of its windows
    pairs = pairs[np.lexsort((pairs[:, 0], pairs[:, 1]))][:MAX_EQUAL_WINDOWS]
    return [(int(one), int(two)) for one, two in pairs]


def _block(rows: FloatArray, start: int, lag: int) -> Copy | None:
    """The copy that begins ``lag`` samples after its original, if it is as long as that.

    Args:
        rows: of all samples, shape (n, k).
        start: a sample that occurs again ``lag`` samples later.
        lag: see above.
    """
    low, high = max(start - lag, 0), min(start + lag, len(rows) - lag)
    same = (rows[low:high] == rows[low + lag : high + lag]).all(axis=1)
    different = np.flatnonzero(~same)
    here = start - low
    if not same[here]:
        return None
    first = int(different[different < here].max(initial=-1)) + 1
    past = int(different[different > here].min(initial=len(same)))
    return Copy(low + first + lag, lag) if past - first >= lag else None


def _chance(number: IntArray, block: Copy) -> float:
    """Logarithm of the probability that noise makes the copy, for all blocks of a recording."""
    own = number[block.first : block.first + block.size]
    changed = own[np.diff(own, prepend=-1) != 0]
    count = len(changed)
    times = np.unique(changed, return_counts=True)[1]
    equal = float((times * (times - 1)).sum()) / max(count * (count - 1), 1)
    return float(2.0 * np.log(len(number)) + count * np.log(max(equal, 1.0 / max(count, 1))))


def copies_note(time: FloatArray, blocks: Sequence[Copy]) -> str:
    """What is said of copies.

    Args:
        time: of all samples, s, shape (n,).
        blocks: the copies.
    """
    first = blocks[0]
    begin, end = time[first.first] - time[0], time[first.first + first.size - 1] - time[0]
    more = f", and {plural(len(blocks) - 1, 'other block')}" if len(blocks) > 1 else ""
    count = plural(first.size, "sample")
    return (
        f"{count} from {begin:.1f} to {end:.1f} s after the beginning are an exact copy of the "
        f"{count} before{more}: the copy is left out, and the angle of a rotation across it is "
        "not known. Check what sends or saves them: a buffer came twice"
    )
