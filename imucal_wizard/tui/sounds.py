"""The sound of each event: a rhythm of the terminal's bell."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from imucal_wizard.guide.kinds import EventKind

if TYPE_CHECKING:  # numpy waits until after the first paint
    from imucal_wizard.guide.state import Event

QUICK = 0.15
"""Seconds between the bells of a good pattern."""
SLOW = 0.4
"""Seconds between the bells of a warning."""

PATTERNS: dict[EventKind, tuple[int, float]] = {
    EventKind.MOVED: (1, QUICK),
    EventKind.STILL: (1, QUICK),
    EventKind.HOLD_TAKEN: (2, QUICK),
    EventKind.ROTATION_TAKEN: (2, QUICK),
    EventKind.UNDONE: (2, SLOW),
    EventKind.HOLD_BROKEN: (2, SLOW),
    EventKind.ALREADY_DONE: (2, SLOW),
    EventKind.WRONG_POSE: (2, SLOW),
    EventKind.LINK_BACK: (2, QUICK),
    EventKind.FLOWING: (2, QUICK),
    EventKind.FIELD_BACK: (2, QUICK),
    EventKind.STEP_SKIPPED: (3, QUICK),
    EventKind.STEP_DONE: (3, QUICK),
    EventKind.ROTATION_REJECTED: (3, SLOW),
    EventKind.WARNING: (3, SLOW),
    EventKind.STUCK: (4, SLOW),
    EventKind.STALLED: (5, SLOW),
    EventKind.LINK_LOST: (5, SLOW),
    EventKind.FINISHED: (6, QUICK),
}
"""Number of bells and their distance, least important first: quick for good, slow for warnings."""
_RANK = {kind: i for i, kind in enumerate(PATTERNS)}
_STATE_CHANGES_APART = 0.5
"""Least time between two sounds for still and moved, which may alternate ten times a second."""


_VERDICT = {True: (6, QUICK), False: (4, SLOW)}
"""The pattern of a verdict: quick where every sensor is good."""


class Sounds:
    """Plays the patterns of new events; a more important event interrupts the present pattern.

    Args:
        bell: rings once.
        later: calls back after some seconds.
        now: a clock in seconds.
        muted: begin without a sound.
    """

    def __init__(
        self,
        bell: Callable[[], None],
        later: Callable[[float, Callable[[], None]], object],
        now: Callable[[], float],
        *,
        muted: bool = False,
    ) -> None:
        self._bell = bell
        self._later = later
        self._now = now
        self._playing = 0
        self._until = 0.0
        self._rank = -1
        self.muted = muted

    def hear(self, events: "Sequence[Event]") -> None:
        """Play the most important event, unless a more important one is still playing."""
        if self.muted or not events:
            return
        kind = max((event.kind for event in events), key=_RANK.__getitem__)
        self._play(*PATTERNS[kind], _RANK[kind])

    def verdict(self, *, good: bool) -> None:
        """Tell the verdict on a calibration; nothing interrupts it."""
        if not self.muted:
            self._play(*_VERDICT[good], len(_RANK))

    def _play(self, count: int, apart: float, rank: int) -> None:
        now = self._now()
        if now < self._until and rank <= self._rank:
            return
        least = _STATE_CHANGES_APART if count == 1 else apart
        self._rank, self._until = rank, now + count * apart + least
        self._playing += 1
        self._ring(self._playing, count, apart)

    def _ring(self, which: int, left: int, apart: float) -> None:
        if which != self._playing or self.muted:
            return
        self._bell()
        if left > 1:
            self._later(apart, lambda: self._ring(which, left - 1, apart))
