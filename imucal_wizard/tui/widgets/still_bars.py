"""How much each axis moves, against its limit."""

from imucal_wizard.digits import decimals, fixed
from imucal_wizard.procedure.state import AxisMotion, StillStatus
from imucal_wizard.tui.text import Line, Span, compact, unit_sign
from imucal_wizard.tui.widgets.lines import Lines

_CELLS = 5
"""Cells of a short bar; the limit lies at the third."""
_AT_LIMIT = 3
_LETTERS = {"a": "a", "g": "ω"}
"""What a channel's first letter is called."""


def reason(still: StillStatus) -> Line:
    """Is it still; if not, which axis moves, by how much, against which limit."""
    label: Span = ("STILL?  ", "strong")
    if not still.motions:
        return label, ("listening …", "quiet")
    if still.still:
        return label, ("yes ●", "good")
    return label, (f"no ▲ {still.reason}".rstrip(), "warn")


def short_bar(motion: AxisMotion) -> Span:
    """Five cells; anything past the third is over the limit."""
    share = motion.value / motion.limit if motion.limit > 0 else 0.0
    if share != share:  # not a number: the channel is dead or garbled
        return "?" * _CELLS, "bad"
    filled = min(_CELLS, max(1, round(share * _AT_LIMIT)))
    filled = max(filled, _AT_LIMIT + 1) if motion.moving else min(filled, _AT_LIMIT)
    return "▪" * filled + "·" * (_CELLS - filled), "warn" if motion.moving else ""


class StillBars(Lines):
    """A row for each sensor, or a row for each axis where there is room."""

    DEFAULT_CSS = "StillBars { height: 2; }"

    def tell(self, still: StillStatus) -> None:
        """Show the newest decision."""
        if self.size.height >= len(still.motions) > 0:
            self.show([_full(motion, self.size.width) for motion in still.motions])
            return
        sensors = [[m for m in still.motions if m.channel[0] == s] for s in ("a", "g")]
        self.show([compact_row(motions) for motions in sensors if motions])


def compact_row(motions: list[AxisMotion]) -> Line:
    """The axes of one sensor in one row, with the decimals that its limits need."""
    name = f"{_LETTERS[motions[0].channel[0]]} {unit_sign(motions[0].unit)}"
    places = decimals(min(motion.limit for motion in motions))
    spans: list[Span] = [(f"{name:<7}", "quiet")]
    for motion in motions:
        value = compact(motion.value, places)
        sign = "▲" if motion.moving else " "
        spans += [(f" {motion.channel[-1]} ", "strong"), short_bar(motion)]
        spans.append((f"{sign}{value:<4}", "warn" if motion.moving else "quiet"))
    return tuple(spans)


def _full(motion: AxisMotion, width: int) -> Line:
    cells = max(10, min(40, width - 40))
    share = motion.value / motion.limit if motion.limit > 0 else 0.0
    at_limit = cells * 2 // 3
    filled = cells if share != share else min(cells, round(share * at_limit))
    drawn = "▪" * filled + "·" * (cells - filled)
    places = decimals(motion.limit)
    words = f" {fixed(motion.value, places)} of {fixed(motion.limit, places)}"
    words += f" {unit_sign(motion.unit)}"
    style = "warn" if motion.moving else ""
    name = f"{_LETTERS[motion.channel[0]]} {motion.channel[-1]}  "
    return (
        (name, "strong"),
        (drawn[:at_limit] + "│" + drawn[at_limit:], style),
        (words + (" ▲ moves" if motion.moving else ""), style),
    )
