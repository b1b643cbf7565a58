"""The start values of the up/down step, live: one row per axis."""

from collections.abc import Sequence

from imucal_wizard.procedure.state import AxisStart
from imucal_wizard.tui.text import Line, Span, number, unit_sign
from imucal_wizard.tui.widgets.lines import Lines


class StartTable(Lines):
    """Both faces of an axis, and once both are known the bias and sensitivity they give."""

    DEFAULT_CSS = "StartTable { height: 3; }"

    def tell(
        self, done: Sequence[str], wanted: str | None, start_values: Sequence[AxisStart]
    ) -> None:
        """Show the rows of x, y and z."""
        known = {start.axis: start for start in start_values}
        self.show([_row(axis, done, wanted, known.get(axis)) for axis in "xyz"])


def _row(axis: str, done: Sequence[str], wanted: str | None, start: AxisStart | None) -> Line:
    spans: list[Span] = []
    for name, text in ((f"+{axis}", f"+{axis}"), (f"-{axis}", f"−{axis}")):
        sign, style = ("●", "good") if name in done else ("·", "quiet")
        sign, style = ("◎", "accent") if name == wanted else (sign, style)
        spans.append((f"  {text} {sign}", style))
        value = None if start is None else start.up if name[0] == "+" else start.down
        spans.append((f" {number(value, 4):<8}" if value is not None else " " * 9, "quiet"))
    if start is not None and start.bias is not None and start.sensitivity is not None:
        unit = unit_sign(start.unit)
        bias, gain = number(start.bias), number(start.sensitivity, 4)
        spans.append((f" bias {bias} {unit}  sensitivity {gain} {unit} per g", ""))
    return tuple(spans)
