"""What is wrong with the link of a stream, and the notifications about it, each once."""

from collections.abc import Iterator, Sequence

from imucal_wizard.acquire.intake import Intake
from imucal_wizard.acquire.resolve import NEEDS_ACCELEROMETER, NO_ACCELEROMETER
from imucal_wizard.guide.kinds import EventKind, StepKind

MAX_SILENCE_SECONDS = 3.0
"""Seconds without data after which silence is a problem."""


def _advice(intake: Intake) -> str:
    """What to check where no data arrive; a stream that was read had the right speed."""
    speed = "" if intake.samples else ", and is the baud rate right"
    return f"is the device switched on and sending{speed}?"


class LinkHealth:
    """The problems of the stream, the most urgent one first.

    Attributes:
        connected: whether the port is open.
        busy: whether it is being opened.
    """

    def __init__(self) -> None:
        self.connected, self.busy = True, False
        self._link = ""
        self._last: float | None = None
        self._silent = 0.0

    def link(self, problem: str, *, busy: bool = False) -> None:
        """Set the problem of the port; ``""`` if it is open; ``busy``: it ends by itself."""
        self.connected, self.busy, self._link = not problem, busy, problem
        self._last, self._silent = None, 0.0

    def heard(self, arrival: float) -> None:
        """Data arrived."""
        self._last, self._silent = arrival, 0.0

    def silent(self, arrival: float) -> bool:
        """No data until now; True if the message about it changes."""
        if self._last is None:
            self._last = arrival
        before, self._silent = self._silent, arrival - self._last
        return self._silent >= MAX_SILENCE_SECONDS and int(self._silent) != int(before)

    def stalled(self, intake: Intake) -> str:
        """The reason why no samples arrive although the port is open, or ``""``."""
        if self._link:
            return ""
        return (
            f"No data arrive any more: {_advice(intake)}"
            if self._silent >= MAX_SILENCE_SECONDS
            else intake.problem
        )

    def problem(self, intake: Intake, journal: str) -> str:
        """The problem and what to do next, or ``""``.

        Args:
            intake: the intake of the stream.
            journal: why what was received is not on the disk yet, or ``""``.
        """
        unwritten = f"the session is {journal}" if journal else ""
        if self._link or unwritten or intake.problem:
            return self._link or unwritten or intake.problem
        if self._silent >= MAX_SILENCE_SECONDS:
            return f"no data for {int(self._silent)} s: {_advice(intake)}"
        if intake.needs == NEEDS_ACCELEROMETER:
            return NO_ACCELEROMETER
        if intake.needs:
            return f"the stream does not state its {', '.join(intake.needs)}: enter it"
        return ""


Notification = tuple[EventKind, str]
_AT_EASE = (StepKind.SOURCE, StepKind.RESULT, StepKind.SAVE)
"""Steps without measurements."""


class Notifications:
    """Notifications that are not events of the procedure, each once."""

    def __init__(self) -> None:
        self._warned: set[str] = set()
        self._stalled = False

    def new(self, step: StepKind, warnings: Sequence[str], stalled: str) -> Iterator[Notification]:
        """The new notifications.

        Args:
            step: the present step.
            warnings: all warnings of the intake so far.
            stalled: the reason why no samples arrive, or "".
        """
        noticed = self._noticed(warnings)
        if step is not StepKind.SOURCE:  # the preview shows it in that step
            yield from ((EventKind.WARNING, text) for text in noticed)
        if step not in _AT_EASE:
            yield from self._flow(stalled)

    def _noticed(self, warnings: Sequence[str]) -> list[str]:
        new = [text for text in warnings if text not in self._warned]
        self._warned.update(new)
        return new

    def _flow(self, stalled: str) -> Iterator[Notification]:
        before, self._stalled = self._stalled, bool(stalled)
        if stalled and not before:
            yield EventKind.STALLED, stalled
        elif before and not stalled:
            yield EventKind.FLOWING, "Samples arrive again."
