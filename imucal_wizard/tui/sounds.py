"""What each event sounds like: a rhythm of the terminal's bell."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # numpy waits until after the first paint
    from imucal_wizard.guide.state import Event

QUICK = 0.15
"""Seconds between the bells of a good pattern."""
SLOW = 0.4
"""Seconds between the bells of a warning."""

PATTERNS: dict[str, tuple[int, float]] = {
    "moved": (1, QUICK),
    "still": (1, QUICK),
    "hold-taken": (2, QUICK),
    "rotation-taken": (2, QUICK),
    "undone": (2, SLOW),
    "hold-broken": (2, SLOW),
    "already-done": (2, SLOW),
    "wrong-pose": (2, SLOW),
    "link-back": (2, QUICK),
    "written-again": (2, QUICK),
    "flowing": (2, QUICK),
    "field-back": (2, QUICK),
    "step-skipped": (3, QUICK),
    "step-done": (3, QUICK),
    "rotation-rejected": (3, SLOW),
    "warning": (3, SLOW),
    "stuck": (4, SLOW),
    "stalled": (5, SLOW),
    "link-lost": (5, SLOW),
    "finished": (6, QUICK),
}
"""How many bells and how far apart, least important first: quick is good, slow asks for a look."""
_RANK = {kind: i for i, kind in enumerate(PATTERNS)}
_STATE_CHANGES_APART = 0.5
"""Still and moved may alternate ten times a second; they are heard at most twice."""


class Sounds:
    """Plays the patterns of new events; a more important one ends the one before.

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
        """Play the most important of these events, unless a more important one still plays."""
        if self.muted or not events:
            return
        kind = str(max(events, key=lambda event: _RANK.get(str(event.kind), -1)).kind)
        count, apart = PATTERNS.get(kind, (1, QUICK))
        rank, now = _RANK.get(kind, -1), self._now()
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
