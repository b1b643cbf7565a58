"""The ladder: every model so far, with its errors as bars and numbers."""

from imucal_wizard.bench.ladder import noise_of
from imucal_wizard.tui.bench.sight import Sight
from imucal_wizard.tui.report_rows import SHOWN
from imucal_wizard.tui.text import Line, Span, line, number

_EIGHTHS = " ▏▎▍▌▋▊▉"
REACH = 12.0
"""The longest bar is so many times the present error; longer ones are cut, with an arrow."""
_NAME = 22


def ladder_rows(sight: Sight, width: int, height: int | None = None) -> list[Line]:
    """One row per model, the newest last but for the floor.

    Args:
        sight: what to show.
        width: columns there are.
        height: rows there are; the oldest models are left out.
    """
    unit = sight.fit.fit.unit
    factor, shown = SHOWN[unit]
    rungs, floor = sight.ladder, noise_of(sight.ladder)
    errors = [e for rung in rungs for e in (rung.rms_fitted, rung.rms_held_out) if e is not None]
    present = max(rungs[-1].rms_fitted, rungs[-1].rms_held_out or 0.0, floor)
    top = min(max(errors), REACH * present) or 1.0
    room = max(4, (width - _NAME - 2 - 2 * 9) // 2)
    rows: list[Line] = []
    for place in range(len(rungs)):
        rows.append(_rung(sight, place, factor, top, room))
        if sight.rose(place):
            rows.append(line("    ▲ only the fitted error fell: u takes it back", "warn"))
    if height is not None:
        rows = rows[-max(1, height - 2) :]
    head = f"  {'error, ' + shown:<{_NAME}}{'fitted':>8} {'':<{room}}{'held out':>8}"
    foot: Line = (
        (f"  {'noise alone':<{_NAME}}", "quiet"),
        (f"{number(floor * factor, 3):>8} ", "quiet"),
        (f"{blocks(floor, top, room):<{room}}", "quiet"),
    )
    return [line(head[:width], "quiet"), *rows, foot]


def _rung(sight: Sight, place: int, factor: float, top: float, room: int) -> Line:
    """One model with both its errors, as numbers and as bars of at most ``room`` columns."""
    rung, last = sight.ladder[place], place == len(sight.ladder) - 1
    spans: list[Span] = [
        ("▸ " if last else "  ", "accent"),
        (f"{step_name(sight, place):<{_NAME}.{_NAME}}", "strong" if last else ""),
    ]
    for error, style in ((rung.rms_fitted, "quiet"), (rung.rms_held_out, "accent")):
        text = "–" if error is None else number(error * factor, 3)
        spans.append((f"{text:>8} ", "strong" if last else ""))
        spans.append((f"{blocks(error or 0.0, top, room):<{room}}", style))
    return tuple(spans)


def step_name(sight: Sight, place: int) -> str:
    """What a rung did: ``+ second-order``, ``− scale``, or the model it began with."""
    rung = sight.ladder[place]
    if place == 0:
        full = len(rung.model) == 3
        return "bias scale angles" if full else " ".join(rung.model) or "nothing"
    if rung.added is not None:
        return f"+ {rung.added}"
    gone = [term for term in sight.ladder[place - 1].model if term not in rung.model]
    return f"− {', '.join(gone)}"


def blocks(value: float, top: float, width: int) -> str:
    """A bar of ``value`` where ``top`` fills ``width``; an arrow where it is cut."""
    if value > 1.001 * top:
        return "█" * (width - 1) + "»"
    eighths = round(8.0 * width * value / top)
    return ("█" * (eighths // 8) + _EIGHTHS[eighths % 8]).rstrip() or "▏"
