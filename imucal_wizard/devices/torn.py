"""Lines of which the middle was lost, seen by a time that does not fit its neighbours.

Where a buffer overflows, the beginning of one line meets the end of another. Mostly the number of
columns is wrong then; within the first column it is right, and ``21`` + ``21.345`` is the 2121st
second.
"""

import numpy as np

from imucal_wizard.readings import FloatArray


class TornTimes:
    """Leaves out single samples whose time is not between those beside them.

    A sample after an odd step waits until the next one shows which of the two is odd: what comes
    out does not depend on how the rows were cut.

    Args:
        place: the column of the time.
        limit: the largest step that is none of note, in ticks.

    Attributes:
        count: how many have been left out.
    """

    def __init__(self, place: int, limit: float) -> None:
        self._place = place
        self._limit = limit
        self._last: float | None = None
        self._held: FloatArray | None = None
        self.count = 0

    def feed(self, values: FloatArray) -> FloatArray:
        """The rows that are whole.

        Args:
            values: shape (n, columns), finite in the column of the time.
        """
        if self._held is not None:
            values, self._held = np.concatenate((self._held, values)), None
        ticks = values[:, self._place]
        if not len(ticks):
            return values
        steps = np.diff(ticks, prepend=ticks[0] if self._last is None else self._last)
        odd = np.flatnonzero((steps < 0) | (steps > self._limit))
        if len(odd) and odd[-1] == len(values) - 1:
            self._held, values, odd = values[-1:], values[:-1], odd[:-1]
        whole = np.ones(len(values), bool)
        for i in odd.tolist():
            earlier = ticks[:i][whole[:i]]
            before = float(earlier[-1]) if len(earlier) else self._last
            whole[i] = before is None or not self._alone(before, *ticks[i : i + 2].tolist())
        self.count += int(np.sum(~whole))
        values = values[whole]
        if len(values):
            self._last = float(values[-1, self._place])
        return values

    def flush(self) -> FloatArray | None:
        """The row that still waits, at the end of the stream."""
        held, self._held = self._held, None
        return held

    def _alone(self, before: float, tick: float, after: float) -> bool:
        """Whether the next sample goes on from the one before, and not from this one."""
        goes_on = 0.0 <= after - tick <= self._limit
        return not goes_on and 0.0 < after - before < abs(tick - before)
