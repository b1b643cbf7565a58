"""The motion since the last hold: its samples, kept only as long as they may be needed."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from imucal_wizard.procedure.holds import GUARD_BLOCKS, MOST_TRIMMED
from imucal_wizard.procedure.ledger import KeptHold
from imucal_wizard.procedure.moments import Moment
from imucal_wizard.readings import FloatArray

LONGEST_SECONDS = 60.0
"""A motion longer than this tells a gyroscope's drift and little else."""
REACH_BLOCKS = 4
"""Blocks by which a motion reaches into the hold that ends it."""


@dataclass(frozen=True, eq=False)
class Motion:
    """The samples of one motion.

    Attributes:
        time: sample times, s, shape (n,).
        rate: gyroscope readings, shape (n, 3).
        acceleration: accelerometer readings, shape (n, 3).
        missing: samples are missing among them, or are no numbers.
    """

    time: FloatArray
    rate: FloatArray
    acceleration: FloatArray
    missing: bool


class Passage:
    """The samples from inside the last kept hold to now; bounded, so that memory stays flat."""

    def __init__(self) -> None:
        self._parts: deque[Moment] = deque()
        self._seconds = 0.0
        self.before: KeptHold | None = None
        self.moved = False
        """Whether the device has moved since."""
        self.lost = ""
        """Why there is no hold to start from, or ""."""

    def rest(self, kept: KeptHold) -> None:
        """The device rests in a kept hold: only what may be taken off the hold's end is needed."""
        self.before, self.lost, self.moved = kept, "", False
        while len(self._parts) > GUARD_BLOCKS + MOST_TRIMMED + 1:
            self._seconds -= self._parts.popleft().seconds

    def add(self, moment: Moment, *, still: bool) -> None:
        """Take the next moment."""
        self.moved |= not still
        self._parts.append(moment)
        self._seconds += moment.seconds
        while self._seconds > LONGEST_SECONDS:
            self._seconds -= self._parts.popleft().seconds
            if self.before is not None:
                self.before = None
                self.lost = f"it took longer than {LONGEST_SECONDS:.0f} s"

    def samples(self, after: KeptHold) -> Motion | None:
        """What was read from inside ``before`` to inside ``after``; None without a gyroscope."""
        parts = self._between(after)
        rates = [part.rate for part in parts if part.rate is not None]
        if not rates:
            return None
        rate = np.concatenate(rates)
        # The gap flag of the first part tells of what lies before it.
        broken = any(bool(part.block.gap[0]) for part in parts[1:])
        return Motion(
            np.concatenate([part.time for part in parts]),
            rate,
            np.concatenate([part.acceleration for part in parts]),
            broken or not bool(np.isfinite(rate).all()),
        )

    def _between(self, after: KeptHold) -> list[Moment]:
        """The moments from the last one in ``before`` to some within ``after``.

        The beginning of ``after`` may yet be taken off, so the motion reaches a little into it.
        """
        begin = -np.inf if self.before is None else self.before.hold.end
        parts = [part for part in self._parts if float(part.block.start[0]) < begin]
        parts = parts[-1:] + [part for part in self._parts if float(part.block.start[0]) >= begin]
        past = sum(float(part.block.start[0]) <= after.hold.start for part in parts)
        return parts[: past + REACH_BLOCKS]
