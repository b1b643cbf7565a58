"""What is said besides the procedure's events: warnings, a stream that stops, a session's troubles.

Both hands hold the device and the eyes are elsewhere: what is not an event is not heard.
"""

from collections.abc import Iterator, Sequence

from imucal_wizard.procedure.state import EventKind, StepKind

Remark = tuple[EventKind, str]
_AT_EASE = (StepKind.SOURCE, StepKind.RESULT, StepKind.SAVE)
"""Steps in which nothing is measured."""


class Remarks:
    """Remembers what has been said, so that each thing is said once."""

    def __init__(self) -> None:
        self._warned: set[str] = set()
        self._stalled = False
        self._unwritten = False

    def new(
        self, step: StepKind, warnings: Sequence[str], stalled: str, unwritten: str
    ) -> Iterator[Remark]:
        """What is to be said now.

        Args:
            step: the step at work.
            warnings: all that the stream's reader has noticed so far.
            stalled: why no samples come, or "".
            unwritten: why nothing is written down at present, or "".
        """
        noticed = self._noticed(warnings)
        if step is not StepKind.SOURCE:  # there the preview shows it
            yield from ((EventKind.WARNING, text) for text in noticed)
        if step not in _AT_EASE:
            yield from self._flow(stalled)
        yield from self._session(unwritten)

    def _noticed(self, warnings: Sequence[str]) -> list[str]:
        if len(warnings) == len(self._warned):
            return []
        new = [text for text in warnings if text not in self._warned]
        self._warned.update(new)
        return new

    def _flow(self, stalled: str) -> Iterator[Remark]:
        before, self._stalled = self._stalled, bool(stalled)
        if stalled and not before:
            yield EventKind.STALLED, stalled
        elif before and not stalled:
            yield EventKind.FLOWING, "Samples come again."

    def _session(self, unwritten: str) -> Iterator[Remark]:
        before, self._unwritten = self._unwritten, bool(unwritten)
        if unwritten and not before:
            yield EventKind.WARNING, f"The session is {unwritten}."
        elif before and not unwritten:
            yield EventKind.WRITTEN_AGAIN, "The session is written down again, without a gap."
