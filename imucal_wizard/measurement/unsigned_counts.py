"""Negative counts that were written as unsigned numbers, like 65404 for −132."""

import numpy as np

from imucal_wizard.core.gravity import are_whole_numbers
from imucal_wizard.core.quantities import fixed
from imucal_wizard.core.readings import FloatArray, IntArray

WORD_BITS = (16, 24, 32)
"""Lengths of the whole numbers that sensors send."""
_MIN_GAIN = 0.75
"""Share of the range by which all changes together are smaller as signed numbers. A step of an
eighth of the range through zero gives this. One wrong reading of counts with an offset gives less,
as long as it is off by less than 0.69 of the range."""


class SignWatch:
    """Tells of the samples so far whether their negative numbers were written as unsigned ones.

    A reading that passes through zero then jumps by the whole range of the number. Of the two
    meanings that one is right which changes less from sample to sample: counts with an offset pass
    through the middle of the range, and would jump there if they were read as signed.

    Attributes:
        largest: of the numbers so far.
        possible: whether they may be unsigned numbers.
    """

    def __init__(self) -> None:
        self._last: FloatArray | None = None
        self.largest = 0.0
        self._read = 0.0
        self._meant = dict.fromkeys(WORD_BITS, 0.0)
        self.possible = True

    def holds(self, bits: int) -> bool:
        """Whether all samples so far may be unsigned numbers of so many bits."""
        return self.possible and self.largest < 2.0**bits

    def add(self, values: FloatArray) -> IntArray:
        """Bits of the unsigned numbers by the samples up to each new one; 0 where none show.

        Args:
            values: counts, shape (n, 3).
        """
        found = np.zeros(len(values), np.int64)
        if not self.possible or not len(values):
            return found
        if values.min() < 0 or not are_whole_numbers(values):
            self.possible = False
            return found
        before = values[:1] if self._last is None else self._last
        changes = _changes(values, before)
        read = self._read + changes
        largest = np.maximum.accumulate(np.maximum(values.max(axis=1), self.largest))
        for bits in reversed(WORD_BITS):
            meant = self._meant[bits] + changes
            if largest[-1] >= 2.0 ** (bits - 1):
                meant = self._meant[bits] + _changes(
                    twos_complement(values, bits), twos_complement(before, bits)
                )
            self._meant[bits] = float(meant[-1])
            found[largest < 2.0**bits] = 0  # the shortest numbers that hold all
            found[(largest < 2.0**bits) & (read - meant >= _MIN_GAIN * 2.0**bits)] = bits
        self._last, self._read, self.largest = values[-1:], float(read[-1]), float(largest[-1])
        return found


def _changes(values: FloatArray, before: FloatArray) -> FloatArray:
    """Running sum of the changes from sample to sample, all axes together, shape (n,)."""
    return np.asarray(np.cumsum(np.abs(np.diff(values, axis=0, prepend=before)).sum(axis=1)))


def twos_complement(values: FloatArray, bits: int) -> FloatArray:
    """Unsigned numbers of so many bits as signed ones; signed ones stay as they are."""
    return np.asarray(np.where(values >= 2.0 ** (bits - 1), values - 2.0**bits, values))


def as_signed(values: FloatArray) -> FloatArray | None:
    """The readings with negative numbers if those were written as unsigned ones, otherwise None.

    Args:
        values: counts, shape (n, 3).
    """
    bits = int(SignWatch().add(values)[-1]) if len(values) else 0
    return twos_complement(values, bits) if bits else None


def changed_sign(read: FloatArray, meant: FloatArray) -> tuple[float, float] | None:
    """The first number that was written as an unsigned one, and what it means; None without any.

    Args:
        read: counts, shape (n, 3).
        meant: the same with their signs.
    """
    places = np.argwhere(meant != read)
    return (float(read[tuple(places[0])]), float(meant[tuple(places[0])])) if len(places) else None


def signs_note(sensor: str, read: float, meant: float) -> str:
    """The message about negative counts that are read as such.

    Args:
        sensor: its name.
        read: one of the numbers.
        meant: what it means.
    """
    return (
        f"negative readings of the {sensor} were written as unsigned numbers, like {read:.0f} for "
        f"{fixed(meant, 0)}: they are read as negative"
    )
