"""One row for each moment of the step, so that every one can be judged again when more is known."""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.procedure.field.growing import Growing
from imucal_wizard.readings import BoolArray, FloatArray

APART = 1.0
"""Moments farther apart than this, s, are not of one stretch."""
MIDDLE = 3
"""Samples from the middle of a moment whose mean is judged: more would cut a corner in a turn."""


@dataclass(frozen=True, eq=False)
class Passed:
    """A moment in which the magnetometer said something.

    Attributes:
        start: s.
        end: s.
        values: new readings in it, shape (n, 3).
        circle: number of the circle it belongs to.
        down: whether that circle's face lies on the table.
        before: angle about the vertical at its beginning, degrees; NaN where unknown.
        after: the same at its end.
        up: up direction in the body frame, shape (3,); NaN where unknown.
    """

    start: float
    end: float
    values: FloatArray
    circle: int
    down: bool
    before: float
    after: float
    up: FloatArray


class Log:
    """The moments in the order of time."""

    def __init__(self) -> None:
        self._rows = Growing(14)

    def __len__(self) -> int:
        return len(self._rows)

    def add(self, passed: Passed) -> None:
        """Take the next moment."""
        count = len(passed.values)
        spare = max(count - MIDDLE, 0) // 2
        middle = passed.values[spare : spare + MIDDLE]
        row = [passed.start, passed.end, passed.circle, passed.down, passed.before, passed.after]
        numbers = [*row, count, len(middle), *middle.mean(axis=0), *passed.up]
        self._rows.add(np.array([numbers]))

    @property
    def start(self) -> FloatArray:
        """When each began, s, shape (n,)."""
        return self._rows.rows[:, 0]

    @property
    def end(self) -> FloatArray:
        """When each ended, s."""
        return self._rows.rows[:, 1]

    @property
    def circle(self) -> FloatArray:
        """Number of the circle each belongs to."""
        return self._rows.rows[:, 2]

    @property
    def down(self) -> BoolArray:
        """Whether the circle's face lay on the table."""
        return self._rows.rows[:, 3] > 0.0

    @property
    def angles(self) -> tuple[FloatArray, FloatArray]:
        """Angle about the vertical at the beginning and at the end of each, degrees."""
        return self._rows.rows[:, 4], self._rows.rows[:, 5]

    @property
    def count(self) -> FloatArray:
        """New samples in each."""
        return self._rows.rows[:, 6]

    @property
    def averaged(self) -> FloatArray:
        """How many samples ``reading`` is the mean of."""
        return self._rows.rows[:, 7]

    @property
    def reading(self) -> FloatArray:
        """Reading in the middle of each, shape (n, 3)."""
        return self._rows.rows[:, 8:11]

    @property
    def up(self) -> FloatArray:
        """Up direction in the body frame, shape (n, 3)."""
        return self._rows.rows[:, 11:14]

    def stretches(self, rows: BoolArray) -> list[slice]:
        """Chosen moments that follow one another, as stretches of indices."""
        chosen = np.flatnonzero(rows)
        if not len(chosen):
            return []
        breaks = (np.diff(chosen) > 1) | (self.start[chosen[1:]] - self.end[chosen[:-1]] > APART)
        edges = np.flatnonzero(breaks) + 1
        parts = np.split(chosen, edges)
        return [slice(int(part[0]), int(part[-1]) + 1) for part in parts]
