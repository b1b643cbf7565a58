"""The magnetometer's step as rows: the present circle, the four figures, what to do."""

from imucal_wizard.core.notices import same_matter
from imucal_wizard.core.quantities import number, true_minus
from imucal_wizard.guide.state import GOOD, FieldStatus, Status
from imucal_wizard.tui.panels.step import event_rows, offer_rows
from imucal_wizard.tui.text import Line, Span, bar, line, wrapped

_FIGURES = {
    "gaps": ("gaps", "not seen yet"),
    "variance": ("variance", "size differs"),
    "wobble": ("wobble", "off centre"),
    "fit_error": ("fit error", "unexplained"),
}
"""The name of each figure, as in MotionCal, and its meaning."""
_ENOUGH: Span = (f"  want {GOOD['gaps']:<3g}", "quiet")
EXPLAINED = 41
"""Columns from which the meaning of the figures is shown."""


def turned_rows(field: FieldStatus, width: int) -> list[Line]:
    """The angle turned with the wanted face on the table."""
    if field.face is None:
        return [line("all faces are done:", "accent"), line("any motion counts now")]
    down = "" if field.face_down is None else f"  {true_minus(field.face_down)} down"
    return [
        (
            ("turned ", "quiet"),
            (f"{field.turned:.0f}°", "strong"),
            (" of 360°", "quiet"),
            (down, "good" if field.face_down == field.face else "quiet"),
        ),
        line(bar(field.turned / 360.0, width), "good" if field.face_down == field.face else ""),
    ]


def quality_rows(field: FieldStatus, width: int) -> list[Line]:
    """The four figures with their limits, the field's magnitude, the number of samples."""
    rows = [_figure(name, field, width) for name in _FIGURES]
    size = "–" if field.magnitude is None else f"{number(field.magnitude)} µT"
    rows.append((("field     ", "quiet"), (f"{size}", "strong")))
    left = f", {field.left_out} left out" if field.left_out else ""
    rows.append(((f"{field.samples} samples", ""), (left, "warn")))
    return rows


def _figure(name: str, field: FieldStatus, width: int) -> Line:
    label, meaning = _FIGURES[name]
    value: float | None = getattr(field, name)
    shown = ("   – % ", "quiet") if value is None else (f"{number(value, 2):>4} % ", "strong")
    tail = f"  {meaning}" if width >= EXPLAINED else ""
    return (f"{label:<10}", "quiet"), shown, _verdict(name, value, field), (tail, "quiet")


def _verdict(name: str, value: float | None, field: FieldStatus) -> Span:
    """Good, or the wanted value, in ten columns. Six circles need no small gaps."""
    if value is not None and value < GOOD[name]:
        return "✓ good    ", "good"
    if name == "gaps":
        return ("✓ 6 faces ", "good") if field.done and not field.missing else _ENOUGH
    wanted = f"want {GOOD[name]:<3g}"
    return (f"  {wanted}", "quiet") if value is None else (f"▲ {wanted}", "warn")


def field_notice_rows(status: Status, problem: str, width: int, height: int) -> list[Line]:
    """The most important messages in the rows available.

    The order is: broken stream, disturbed field, fault of the samples, way to the next face. Offers
    are always shown; the last event and the details are shown if there is room.
    """
    field = status.field or FieldStatus()
    width -= 2
    choices = offer_rows(status.offers, width)
    if problem:
        rows = wrapped(f" ▲ {problem}", width, "bad", indent="   ")
        return (rows[: max(0, height - len(choices))] + choices)[:height]
    wrong, way = field.disturbed or field.trouble, status.guidance
    rows = wrapped(f" ▲ {wrong}", width, "warn", indent="   ") if wrong else []
    if way:
        room = max(1, height - len(choices) - 1)
        rows = rows[:room] + wrapped(f" ▸ {way}", width, "accent", indent="   ")
    event = status.last_event
    if event is not None and not same_matter(event.text, wrong):
        rows += event_rows(event, width)
    rows += wrapped(f"   {status.detail}", width, "quiet", indent="   ") if status.detail else []
    return (rows[: max(0, height - len(choices))] + choices)[:height]
