"""What needs a word now: a problem, the ways out, or what happened last."""

from collections.abc import Sequence

from imucal_wizard.procedure.state import Event, EventKind, Offer
from imucal_wizard.tui.text import Line, Span, width_of, wrapped
from imucal_wizard.tui.widgets.lines import Lines

_SIGNS: dict[str, tuple[str, str]] = {
    EventKind.HOLD_TAKEN: ("✓", "good"),
    EventKind.ROTATION_TAKEN: ("✓", "good"),
    EventKind.STEP_DONE: ("✓", "good"),
    EventKind.FINISHED: ("✓", "good"),
    EventKind.LINK_BACK: ("✓", "good"),
    EventKind.WRITTEN_AGAIN: ("✓", "good"),
    EventKind.FLOWING: ("✓", "good"),
    EventKind.FIELD_BACK: ("✓", "good"),
    EventKind.STALLED: ("▲", "bad"),
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
        choices = offer_rows(offers, width)
        room = height - len(rows) - len(choices)
        if event is not None and room > 0 and not problem:
            rows += event_rows(event, width)[:room]
        self.show((rows + choices)[:height])


def offer_rows(offers: Sequence[Offer], width: int) -> list[Line]:
    """The ways out with their keys, as many in a row as fit."""
    rows: list[list[Span]] = []
    for offer in offers:
        spans: list[Span] = [(f" {offer.key} ", "key"), (f" {offer.text}  ", "")]
        if rows and width_of((*rows[-1], *spans)) <= width + 2:
            rows[-1] += spans
        else:
            rows.append(spans)
    return [tuple(row) for row in rows]


def event_rows(event: Event, width: int) -> list[Line]:
    """An event with its sign, wrapped."""
    sign, style = _SIGNS.get(event.kind, ("·", "quiet"))
    return wrapped(f" {sign} {event.text}", width, style, indent="   ")
