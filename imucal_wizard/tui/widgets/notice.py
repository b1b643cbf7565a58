"""What needs a word now: a problem, the ways out, or what happened last."""

from collections.abc import Sequence

from imucal_wizard.procedure.state import Event, EventKind, Offer
from imucal_wizard.tui.text import Line, wrapped
from imucal_wizard.tui.widgets.lines import Lines

_SIGNS: dict[str, tuple[str, str]] = {
    EventKind.HOLD_TAKEN: ("✓", "good"),
    EventKind.ROTATION_TAKEN: ("✓", "good"),
    EventKind.STEP_DONE: ("✓", "good"),
    EventKind.FINISHED: ("✓", "good"),
    EventKind.LINK_BACK: ("✓", "good"),
    EventKind.WRITTEN_AGAIN: ("✓", "good"),
    EventKind.UNDONE: ("↶", "accent"),
    EventKind.STEP_SKIPPED: ("▲", "warn"),
    EventKind.HOLD_BROKEN: ("▲", "warn"),
    EventKind.WRONG_POSE: ("▲", "warn"),
    EventKind.ALREADY_DONE: ("▲", "warn"),
    EventKind.ROTATION_REJECTED: ("▲", "warn"),
    EventKind.STUCK: ("▲", "warn"),
    EventKind.LINK_LOST: ("▲", "bad"),
    EventKind.WARNING: ("▲", "warn"),
}


class Notice(Lines):
    """Three rows at most: problem before ways out before the newest event."""

    DEFAULT_CSS = "Notice { height: 3; }"

    def tell(self, problem: str, offers: Sequence[Offer], event: Event | None) -> None:
        """Show what matters most in the rows there are."""
        width, height = (self.size.width or 80) - 2, self.size.height or 3
        rows: list[Line] = []
        if problem:
            rows += wrapped(f" ▲ {problem}", width, "bad", indent="   ")
        choices: list[Line] = [((f" {o.key} ", "key"), (f" {o.text}", "")) for o in offers]
        room = height - len(rows) - len(choices)
        if event is not None and room > 0 and not problem:
            rows += event_rows(event, width)[:room]
        self.show((rows + choices)[:height])


def event_rows(event: Event, width: int) -> list[Line]:
    """An event with its sign, wrapped."""
    sign, style = _SIGNS.get(event.kind, ("·", "quiet"))
    return wrapped(f" {sign} {event.text}", width, style, indent="   ")
