"""The steps of the wizard in one row: which are done, which is now; and the time."""

from collections.abc import Collection

from imucal_wizard.tui.text import Span, clock
from imucal_wizard.tui.widgets.lines import Lines

STEPS: tuple[tuple[str, str], ...] = (
    ("source", "Source"),
    ("settle", "Settle"),
    ("up-down", "Up/down"),
    ("poses", "18 poses"),
    ("rotations", "Rotations"),
    ("result", "Result"),
    ("validate", "Validate"),
    ("save", "Save"),
)
"""Steps as the machine names them, and as a person reads them, in their order."""
MORE = ("more", "More poses")
"""Stands where the result stands, while more is measured for it."""
_TITLE = "imucal-wizard"


class StepHeader(Lines):
    """``✓`` done, ``▸`` and capitals now, ``–`` skipped, plain still to come."""

    DEFAULT_CSS = "StepHeader { height: 1; background: $panel; }"

    def tell(self, step: str, elapsed: float = 0.0, skipped: Collection[str] = ()) -> None:
        """Show that the wizard is in ``step`` after ``elapsed`` seconds of samples."""
        spans = self._steps(step, skipped)
        used = sum(len(text) for text, _ in spans)
        time = clock(elapsed)
        width = self.size.width or 80
        if used + len(time) + len(_TITLE) + 4 <= width:
            spans.insert(0, (f" {_TITLE} ", "quiet"))
            used += len(_TITLE) + 2
        spans.append((" " * max(1, width - used - len(time) - 1) + time, "quiet"))
        self.show([tuple(spans)])

    @staticmethod
    def _steps(step: str, skipped: Collection[str]) -> list[Span]:
        steps = [(MORE if step == MORE[0] and kind == "result" else (kind, name))
                 for kind, name in STEPS]  # fmt: skip
        now = [kind for kind, _ in steps].index(step)
        spans: list[Span] = []
        for i, (kind, name) in enumerate(steps):
            if i == now:
                spans.append((f"▸{name.upper()} ", "accent"))
            elif kind in skipped:
                spans.append((f"–{name} ", "quiet"))
            else:
                spans.append((f"{'✓' if i < now else ' '}{name} ", "quiet" if i > now else ""))
        return spans
