"""Events and status for the screen, held back until they are on the disk."""

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

from imucal_wizard.core.records import dataclass
from imucal_wizard.guide.state import Event, Status
from imucal_wizard.run.journal import Journal

EVENTS_KEPT = 50
"""Newest events in a snapshot."""


@dataclass(frozen=True)
class _Decision:
    """Events and the status after them, to be announced once so many writes are committed."""

    writes: int
    events: tuple[Event, ...]
    status: Status


class Announcements:
    """Holds back what was decided until it is on the disk; the decisions themselves do not wait.

    Until then the screen keeps the status before; traces, attitude and stream continue.

    Attributes:
        events: the newest announced events, oldest first.
        count: number of announced events.
    """

    def __init__(self) -> None:
        self.events: deque[Event] = deque(maxlen=EVENTS_KEPT)
        self.count = 0
        self._waiting: deque[_Decision] = deque()
        self._announced = Status()

    def __getstate__(self) -> dict[str, Any]:
        """The state for a checkpoint: all of it is written before, so everything is announced."""
        events = [event for one in self._waiting for event in one.events]
        announced = deque([*self.events, *events], EVENTS_KEPT)
        return {
            **vars(self),
            "events": announced,
            "count": self.count + len(events),
            "_waiting": deque(),
        }

    def decided(
        self, journal: Journal, events: Sequence[Event], status: Callable[[], Status]
    ) -> None:
        """Announce a decision once everything that was passed to the journal is committed.

        Args:
            journal: of the session.
            events: the events of the decision.
            status: makes the status after it.
        """
        self.confirm(journal)
        if self._waiting or journal.written < journal.passed:
            self._waiting.append(_Decision(journal.passed, tuple(events), status()))
        else:
            self._announce(events)

    def confirm(self, journal: Journal) -> bool:
        """Announce what the journal has committed; whether there is anything."""
        before = len(self._waiting)
        while self._waiting and self._waiting[0].writes <= journal.written:
            decision = self._waiting.popleft()
            self._announce(decision.events)
            self._announced = decision.status
        return len(self._waiting) < before

    def _announce(self, events: Sequence[Event]) -> None:
        self.events.extend(events)
        self.count += len(events)

    def status(self, present: Callable[[], Status]) -> Status:
        """The newest status that may be announced.

        Args:
            present: makes the present one, which is announced if nothing is held back.
        """
        if not self._waiting:
            self._announced = present()
        return self._announced
