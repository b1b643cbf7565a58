"""Rows left out because a needed column holds no number: how many, and which column it is."""

import numpy as np

from imucal_wizard.devices.formats.base import Column
from imucal_wizard.readings import BoolArray, FloatArray

_BARREN = 50
"""So many rows without a number in a row are no accident."""
_SENSOR = {"a": "accelerometer", "g": "gyroscope"}
_HELP = "check the sensor's wiring and the sketch"


class Blanks:
    """Counts rows that are left out.

    Args:
        columns: the columns of the stream.
        needed: places of those that every sample must have.

    Attributes:
        count: how many rows were left out.
    """

    def __init__(self, columns: tuple[Column, ...], needed: list[int]) -> None:
        self._columns = [columns[place] for place in needed]
        self._needed = needed
        self._each = np.zeros(len(needed), np.int64)
        self._running = 0
        self.count = 0

    def sift(self, values: FloatArray) -> BoolArray:
        """Which rows have all they need, shape (n,)."""
        there = np.isfinite(values[:, self._needed])
        good = np.asarray(there.all(axis=1), np.bool_)
        if good.all():
            self._running = 0
            return good
        self.count += int((~good).sum())
        self._each += (~there).sum(axis=0)
        numbered = np.flatnonzero(good)
        before = self._running if not len(numbered) else -1 - int(numbered[-1])
        self._running = before + len(good)
        return good

    @property
    def where(self) -> str:
        """The columns that are to blame for most of it: "the accelerometer's x axis"."""
        worst = self._each >= 0.5 * max(int(self._each.max(initial=0)), 1)
        return _named([c for c, bad in zip(self._columns, worst, strict=True) if bad])

    @property
    def note(self) -> str:
        """What to say of single rows."""
        return f"Some samples have no number (NaN, or nothing) for {self.where}: {_HELP}."

    @property
    def problem(self) -> str:
        """What to say when no row has all it needs any more; "" while some have."""
        if self._running < _BARREN:
            return ""
        return (
            f"No number (NaN, or nothing) comes for {self.where}, and without it nothing is "
            f"measured: {_HELP}, or say in the source step that it is another column."
        )


def _named(columns: list[Column]) -> str:
    parts = []
    for letter, sensor in _SENSOR.items():
        axes = [c.channel[1] for c in columns if len(c.channel) == 2 and c.channel[0] == letter]
        if axes:
            word = "axis" if len(axes) == 1 else "axes"
            parts.append(f"the {sensor}'s {' and '.join(axes)} {word}")
    parts += [f"column {c.name or c.channel}" for c in columns if c.channel[:1] not in _SENSOR]
    return " and ".join(parts)
