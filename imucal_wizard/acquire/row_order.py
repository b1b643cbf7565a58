"""Puts rows in the order of their times: sorts late rows, drops copies and rows of a wrong time.

A logger with several threads writes neighbouring rows in exchanged order, or a buffer a second
time. When a buffer overflows, the beginning of one line is joined to the end of another: if the
break is within the time, ``21`` + ``21.345`` becomes 2121 s. The clock of a device that restarts
goes back, too, but the next rows go on from there.

Rows that have passed are not called back. A row that goes back by less than half a step, or by more
while those after it keep the pace of those before, as where times jitter, therefore stays behind
the later one and has the same time. With a clock coarser than the sampling, rows exchanged within
one tick cannot be told, and rows of the tick before cannot be told from a restart after one tick:
they are treated alike. A counter of the time that wraps every few rows does not tell which of them
came late: these count as rows of a wrong time. Recordings whose samples arrived in bursts do not
come here: their times say only when a burst ended, and exchanged rows cannot be told.
"""

from bisect import bisect_left, bisect_right

import numpy as np

from imucal_wizard.core.quantities import plural
from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray
from imucal_wizard.core.statistics import median

LATE_ROWS = 8
"""Rows after one of an unusual step that show what the step is: a restart, lost samples, a wrong
time, or rows in exchanged order."""
COPY_SECONDS = 5.0
"""Seconds of newest rows with which a row whose time goes back is compared: buffers hold less."""
_HELD_SECONDS = 0.5
"""s; a slow stream waits no longer after lost samples, with fewer rows than ``LATE_ROWS``."""
_PACE_ROWS = 8 * LATE_ROWS
"""Rows before a step back that show the pace at which they came."""
_USUAL_LIMIT = 1.5
"""The largest usual step, in steps, where the times are finer than the sampling."""
_SCANNED_ROWS = 256
"""Rows whose steps are looked at again after each one of an unusual step."""


class RowOrder:
    """Gives the rows in the order of their times, each once.

    Rows whose steps are usual pass at once. A row after an unusual step waits for at most
    ``LATE_ROWS``, so the result does not depend on how the rows were divided.

    Args:
        place: the column of the time.
        limit: the largest usual step, in ticks.
        compared: number of rows in ``COPY_SECONDS``.
        coarse: whether equal times are normal, because the time is coarser than the sampling.

    Attributes:
        wrong: number of rows dropped because their time does not fit those around them.
        late: number of rows that came after later ones and were sorted, or have the newest time.
        copies: number of rows dropped because they were there before.
    """

    def __init__(
        self, place: int, limit: float, compared: int = LATE_ROWS, *, coarse: bool = False
    ) -> None:
        self._place = place
        self._limit = limit
        self._coarse = coarse
        self._slight = limit if coarse else 0.5 * limit / _USUAL_LIMIT
        self._held = min(LATE_ROWS, max(1, int(compared * _HELD_SECONDS / COPY_SECONDS)))
        self._newest = _NewestRows(place, compared)
        self._copying = False
        self._before: FloatArray | None = None
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
        if not len(values):
            return values
        values = values if self._coarse else self._without_repeats(values)
        return self._ordered(values, ended=False)

    def flush(self) -> FloatArray:
        """The rows that still wait, at the end of the stream."""
        if self._before is None:
            return np.zeros((0, self._place + 1))
        return self._ordered(self._before[:0], ended=True)

    def _without_repeats(self, values: FloatArray) -> FloatArray:
        """Without the rows that equal the one before."""
        before = values[:0] if self._before is None else self._before
        bits = np.ascontiguousarray(np.concatenate((before, values))).view(np.int64)
        repeated = np.zeros(len(values), np.bool_)
        repeated[1 - len(before) :] = (bits[1:] == bits[:-1]).all(axis=1)
        self.copies += int(repeated.sum())
        return values[~repeated] if repeated.any() else values

    def _ordered(self, values: FloatArray, *, ended: bool) -> FloatArray:
        """Rows in order, until one that has to wait for more rows than came after it."""
        if len(values):
            self._before = values[-1:]
        if self._waiting is not None:
            values = np.concatenate((self._waiting, values))
            self._waiting = None
        if len(values) and self._usual(values) == len(values):
            return self._accepted(values)
        done = [values[:0]]
        head, tail = values[:_SCANNED_ROWS], values[_SCANNED_ROWS:]
        while True:
            if len(head) <= LATE_ROWS and len(tail):
                head = np.concatenate((head, tail[:_SCANNED_ROWS]))
                tail = tail[_SCANNED_ROWS:]
            usual = self._usual(head) if len(head) else 0
            if usual:
                done.append(self._accepted(head[:usual]))
                head = head[usual:]
                continue
            left = self._decided(head, done, ended=ended) if len(head) else None
            if left is None:
                break
            head = left
        self._waiting = head if len(head) else None
        return np.concatenate(done)

    def _accepted(self, rows: FloatArray) -> FloatArray:
        self._newest.add(rows)
        self._copying = False
        return rows

    def _usual(self, values: FloatArray) -> int:
        """Number of rows until one after an unusual step."""
        ticks = values[:, self._place]
        steps = np.empty(len(ticks))
        steps[0] = ticks[0] - self._newest.time if len(self._newest) else self._limit
        steps[1:] = ticks[1:] - ticks[:-1]
        odd = (steps < 0.0) | (steps > self._limit)
        if not self._coarse:
            odd |= steps == 0.0
            odd[0] &= len(self._newest) > 0
        first = int(odd.argmax())
        return first if odd[first] else len(values)

    def _decided(
        self, head: FloatArray, done: list[FloatArray], *, ended: bool
    ) -> FloatArray | None:
        """The rows after the first one is accepted or dropped, or after they are sorted.

        None if that needs more rows.
        """
        step = float(head[0, self._place]) - self._newest.time
        copied = self._copied(head)
        if copied:
            self.copies += copied
            return head[copied:]
        needed = 0 if step == 0.0 else LATE_ROWS if step < 0.0 else self._held
        if len(head) <= needed and not ended:
            return None
        near, far = head[: needed + 1], head[needed + 1 :]
        copies = self._copies(near)
        if copies.any():
            self._copying = True
            self.copies += int(copies.sum())
            return np.concatenate((near[~copies], far))
        order = self._across(near[:, self._place]) if step < 0.0 else None
        if order is not None:
            rank = np.argsort(order)
            self.late += int((rank < np.maximum.accumulate(rank)).sum())
            return np.concatenate((near[order], far))
        first, *others = near[:, self._place].tolist()
        if step < 0.0 and self._returns(first, others):
            if step < -self._limit:
                self.wrong += 1
            else:
                self.late += 1
                done.append(self._accepted(self._at_newest(head[:1])))
            return head[1:]
        late = self._late(first, others) if step > 0.0 else []
        if not late:
            done.append(self._accepted(head[:1]))
            return head[1:]
        goes_on = any(0.0 < after - first <= self._limit for after in others)
        if not goes_on and step > (len(late) + 1) * self._limit:
            self.wrong += 1  # the others go on from the row before it
            return head[1:]
        self.late += len(late)
        mixed = late[-1] + 2
        order = np.argsort(near[:mixed, self._place], kind="stable")
        return np.concatenate((near[order], near[mixed:], far))

    def _copied(self, head: FloatArray) -> int:
        """Number of rows until one that needs others to be called a copy, or is none."""
        for i, row in enumerate(head):
            step = row[self._place] - self._newest.time
            sure = (step < 0.0 and self._copying) or (step == 0.0 and not self._coarse)
            if not sure or row not in self._newest:
                return i
        return len(head)

    def _copies(self, near: FloatArray) -> BoolArray:
        """Which of these rows are copies of newest ones.

        After a restart, coarse readings may equal those of the same time before it. So rows that
        go back count as copies only together, if they are not all of the same readings.
        """
        ticks = near[:, self._place]
        back = ticks < self._newest.time if self._coarse else ticks <= self._newest.time
        copies = np.array([b and row in self._newest for b, row in zip(back, near, strict=True)])
        alone = int(back.sum()) == 1 and not back[-1]  # the next row goes on from before
        readings = np.delete(near[copies], self._place, axis=1)
        varied = len({row.tobytes() for row in readings}) > 1
        if self._copying or ((alone or varied) and (copies == back).all()):
            return copies
        return np.zeros(len(near), np.bool_)

    def _late(self, first: float, others: list[float]) -> list[int]:
        """Which of the others belong before the first one."""
        before = self._newest.time
        reset = next((i for i, after in enumerate(others) if after < before), len(others))
        return [i for i, after in enumerate(others[:reset]) if after < first]

    def _across(self, ticks: FloatArray) -> IntArray | None:
        """Order of rows that were exchanged across a wrap or restart; None if none were.

        Those after it are told by their smaller times. In order, all steps are usual.
        """
        after = ticks < self._newest.time
        order = np.lexsort((ticks, after))
        if order[-1] != len(ticks) - 1 or bool((order[1:] > order[:-1]).all()):
            return None
        if not self._coarse and self._go_on(ticks.tolist()):
            return None
        steps = np.diff(ticks[order], prepend=self._newest.time)
        steps = np.delete(steps, np.count_nonzero(~after))  # the wrap
        usual = (steps >= self._limit / 3.0) & (steps <= self._limit)
        return order if usual.all() else None

    def _at_newest(self, row: FloatArray) -> FloatArray:
        """A row with the time of the newest one."""
        moved = row.copy()
        moved[:, self._place] = self._newest.time
        return moved

    def _returns(self, first: float, others: list[float]) -> bool:
        """Whether the time went back for a few rows only, and goes on from before."""
        before = self._newest.time
        rows = next((i for i, after in enumerate(others) if after >= before), None)
        if rows is None:
            return False
        if not self._coarse and self._go_on([first, *others]):
            return True
        if before - first > self._slight and others[rows] - [first, *others][rows] <= self._limit:
            return False  # the times after a restart or a wrap have passed those before it
        usual = (rows + 1) * self._limit
        return others[rows] - before <= max(usual, 0.0 if rows else before - first)

    def _go_on(self, times: list[float]) -> bool:
        """Whether rows keep the even pace of those before, so that only single times went back.

        A clock that is set back to before the newest row leaves all rows after it late by one and a
        half steps or more. The time of one row may be wrong by as much; the median of all is not.

        Args:
            times: of the rows after the newest one.
        """
        newest, step = self._newest.times, self._limit / _USUAL_LIMIT
        apart = min(len(newest) // 4, _PACE_ROWS)
        if apart >= LATE_ROWS:  # the median of single steps is off where they jitter
            step = median(newest[apart:] - newest[:-apart]) / apart
        before = newest[-_PACE_ROWS:][::-1]
        pace = median(before + step * np.arange(len(before)))
        paces = np.array(times) - step * np.arange(1, len(times) + 1)
        return median(paces) > pace - step


class _NewestRows:
    """The newest rows since the time last went back, so their times never decrease."""

    def __init__(self, place: int, compared: int) -> None:
        self._place = place
        self._compared = max(1, compared)
        self._rows = np.zeros((0, place + 1))
        self._begin = self._end = 0
        self.time = -np.inf
        """Time of the newest row."""

    def __len__(self) -> int:
        return self._end - self._begin

    def __contains__(self, row: FloatArray) -> bool:
        time, ticks = row[self._place], self._rows[:, self._place]
        first = bisect_left(ticks, time, self._begin, self._end)
        same = self._rows[first : bisect_right(ticks, time, first, self._end)].view(np.int64)
        return bool((same == row.view(np.int64)).all(axis=1).any())

    @property
    def times(self) -> FloatArray:
        """In ticks, shape (n,)."""
        return np.asarray(self._rows[self._begin : self._end, self._place])

    def add(self, rows: FloatArray) -> None:
        """Add rows in order; those before a step back are forgotten."""
        if rows[0, self._place] < self.time:
            self._begin = self._end
        rows = rows[-self._compared :]
        if self._end + len(rows) > len(self._rows):
            kept = self._rows[max(self._begin, self._end - self._compared) : self._end]
            grown = np.empty((2 * self._compared, rows.shape[1]))
            grown[: len(kept)] = kept.reshape(-1, rows.shape[1])
            self._rows, self._begin, self._end = grown, 0, len(kept)
        self._rows[self._end : self._end + len(rows)] = rows
        self._end += len(rows)
        self._begin = max(self._begin, self._end - self._compared)
        self.time = float(rows[-1, self._place])
