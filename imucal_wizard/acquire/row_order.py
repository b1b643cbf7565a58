"""Puts rows in the order of their times: sorts late rows, drops copies and rows of a wrong time.

A logger with several threads writes neighbouring rows in exchanged order, or a buffer a second
time. When a buffer overflows, the beginning of one line is joined to the end of another: if the
break is within the time, ``21`` + ``21.345`` becomes 2121 s. The clock of a device that restarts
goes back, too, but the next rows go on from there.
"""

from collections import deque

import numpy as np

from imucal_wizard.core.quantities import plural
from imucal_wizard.core.readings import FloatArray

LATE_ROWS = 8
"""Rows after one of an unusual step that show what the step is: a restart, lost samples, a wrong
time, or rows in exchanged order."""
COPY_SECONDS = 5.0
"""Seconds of newest rows with which a row whose time goes back is compared: buffers hold less."""
_SCANNED_ROWS = 256
"""Rows whose steps are looked at again after each one of an unusual step."""


class RowOrder:
    """Gives the rows in the order of their times, each once.

    Rows whose steps are usual pass at once. A row after an unusual step waits for the next
    ``LATE_ROWS``, so the result does not depend on how the rows were divided.

    Args:
        place: the column of the time.
        limit: the largest usual step, in ticks.
        compared: number of newest rows with which a row whose time goes back is compared.
        coarse: whether equal times are normal, because the time is coarser than the sampling.

    Attributes:
        wrong: number of rows dropped because their time does not fit those around them.
        late: number of rows that came after later ones and were sorted.
        copies: number of rows dropped because they were there before.
    """

    def __init__(
        self, place: int, limit: float, compared: int = LATE_ROWS, *, coarse: bool = False
    ) -> None:
        self._place = place
        self._limit = limit
        self._coarse = coarse
        self._compared = compared
        self._newest: deque[FloatArray] = deque()
        self._kept = 0
        self._waiting: FloatArray | None = None
        self.wrong = 0
        self.late = 0
        self.copies = 0

    def notes(self, *, counted: bool) -> tuple[str, ...]:
        """What was found, for the user.

        Args:
            counted: with the numbers so far; without them, a text stays the same in a stream.
        """
        late, twice = (
            plural(count, "row") if counted else "rows" for count in (self.late, self.copies)
        )
        order = "rows are not in the order of their times" + f": {late} came late" * counted
        copies = f"{twice} came twice: the copies are left out"
        return (f"{order}; sorted",) * bool(self.late) + (copies,) * bool(self.copies)

    def feed(self, values: FloatArray) -> FloatArray:
        """The rows that are known to be right now, in order; the others wait.

        Args:
            values: shape (n, columns), finite in the column of the time.
        """
        return self._ordered(values, LATE_ROWS)

    def flush(self) -> FloatArray:
        """The rows that still wait, at the end of the stream."""
        return self._ordered(None, 0)

    def _ordered(self, values: FloatArray | None, needed: int) -> FloatArray:
        """Rows in order, until one that has to wait for more rows than came after it."""
        if self._waiting is not None:
            values = self._waiting if values is None else np.concatenate((self._waiting, values))
            self._waiting = None
        if values is None:
            return self._newest[-1][:0] if self._newest else np.zeros((0, self._place + 1))
        if not len(values):
            return values
        if self._usual(values) == len(values):
            return self._accepted(values)
        done = [values[:0]]
        while len(values):
            usual = self._usual(values[:_SCANNED_ROWS])
            if usual:
                done.append(self._accepted(values[:usual]))
                values = values[usual:]
                continue
            values = self._without_copies(values)
            if len(values) <= needed and not self._at_once(values):
                break
            values = self._decided(values, done)
        self._waiting = values if len(values) else None
        return np.concatenate(done)

    def _accepted(self, rows: FloatArray) -> FloatArray:
        newest = rows[-self._compared :]
        self._newest.append(newest)
        self._kept += len(newest)
        while self._kept - len(self._newest[0]) >= self._compared:
            self._kept -= len(self._newest.popleft())
        return rows

    def _usual(self, values: FloatArray) -> int:
        """Number of rows until one after an unusual step."""
        ticks = values[:, self._place]
        before = self._newest[-1][-1] if self._newest else None
        steps = np.diff(ticks, prepend=ticks[0] if before is None else before[self._place])
        odd = (steps < 0.0) | (steps > self._limit)
        if not self._coarse:
            odd |= (steps == 0.0) & (before is not None or np.arange(len(steps)) > 0)
        return int(odd.argmax()) if odd.any() else len(values)

    def _without_copies(self, values: FloatArray) -> FloatArray:
        """Without the next rows that are among the newest; as many others as a decision needs."""
        ticks = values[:, self._place]
        if (ticks[: LATE_ROWS + 1] > self._newest[-1][-1, self._place]).all():
            return values
        newest = np.concatenate(self._newest)
        kept, others = np.ones(len(values), np.bool_), 0
        for row in range(len(values)):
            step = ticks[row] - newest[-1, self._place]
            if (step < 0.0 or (step == 0.0 and not self._coarse)) and _contains(
                newest, values[row], self._place
            ):
                kept[row] = False
            else:
                others += 1
            if others > LATE_ROWS:
                break
        self.copies += int(np.sum(~kept))
        return values if kept.all() else values[kept]

    def _at_once(self, values: FloatArray) -> bool:
        """Whether the first row has the time of the one before and needs no others."""
        return len(values) > 0 and bool(values[0, self._place] == self._newest[-1][-1, self._place])

    def _decided(self, values: FloatArray, done: list[FloatArray]) -> FloatArray:
        """The rows after the first one is accepted or dropped, or after they are sorted."""
        before = float(self._newest[-1][-1, self._place])
        first, *_ = near = values[: LATE_ROWS + 1, self._place]
        after = near[1:]
        if first < before and self._returns(before, first, after):
            self.wrong += 1
            return values[1:]
        reset = after < before
        between = after[: reset.argmax() if reset.any() else None] < first
        late = int(between.sum())
        if first <= before or not late:
            done.append(self._accepted(values[:1]))
            return values[1:]
        steps = after - first
        goes_on = bool(((steps > 0.0) & (steps <= self._limit)).any())
        if not goes_on and first - before > (late + 1) * self._limit:
            self.wrong += 1  # the others go on from the row before it
            return values[1:]
        self.late += late
        mixed = int(np.flatnonzero(between)[-1]) + 2
        order = np.argsort(near[:mixed], kind="stable")
        return np.concatenate((values[order], values[mixed:]))

    def _returns(self, before: float, first: float, after: FloatArray) -> bool:
        """Whether the time went back for a few rows only, and goes on from before."""
        above = np.flatnonzero(after >= before)
        if not len(above):
            return False
        rows = int(above[0])
        usual = (rows + 1) * self._limit
        return bool(after[rows] - before <= max(usual, 0.0 if rows else before - first))


def _contains(rows: FloatArray, row: FloatArray, place: int) -> bool:
    same = rows[rows[:, place] == row[place]]
    return bool(((same == row) | (np.isnan(same) & np.isnan(row))).all(axis=1).any())
