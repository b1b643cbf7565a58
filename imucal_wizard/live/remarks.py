"""What is said besides the procedure's events: each warning once, and the session's troubles."""

from collections.abc import Iterator, Sequence

from imucal_wizard.procedure.state import EventKind

Remark = tuple[EventKind, str]


class Remarks:
    """Remembers what has been said."""

    def __init__(self) -> None:
        self._warned: set[str] = set()
        self._unwritten = ""

    def of_stream(self, warnings: Sequence[str]) -> list[Remark]:
        """The warnings of the stream's reader that are new."""
        if len(warnings) == len(self._warned):
            return []
        new = [text for text in warnings if text not in self._warned]
        self._warned.update(new)
        return [(EventKind.WARNING, text) for text in new]

    def of_session(self, unwritten: str) -> Iterator[Remark]:
        """That what arrives can no longer be written down, or that it can again."""
        before, self._unwritten = self._unwritten, unwritten
        if unwritten and not before:
            yield EventKind.WARNING, f"The session is {unwritten}."
        elif before and not unwritten:
            yield EventKind.WRITTEN_AGAIN, "The session is written down again, without a gap."
