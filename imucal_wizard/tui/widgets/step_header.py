"""The steps of the wizard in one row: which are done, which is now; and the time."""

from collections.abc import Collection

from imucal_wizard.tui.text import Span, clock, width_of
from imucal_wizard.tui.widgets.lines import Lines

STEPS: tuple[tuple[str, str], ...] = (
    ("source", "Source"),
    ("settle", "Settle"),
    ("up-down", "Up/down"),
    ("poses", "18 poses"),
    ("rotations", "Rotations"),
    ("field", "Field"),
    ("result", "Result"),
    ("validate", "Validate"),
    ("save", "Save"),
)
"""Steps as the machine names them, and as a person reads them, in their order."""
MORE = ("more", "More poses")
"""Stands where the result stands, while more is measured for it."""
_TITLE = "imucal-wizard"
_OVER = "✓–"


class StepHeader(Lines):
    """``✓`` done, ``▸`` and capitals now, ``–`` skipped, plain still to come.

    Where not all fit, the first ones that are over are no more than their sign, and those to come
    stand closer.
    """

    DEFAULT_CSS = "StepHeader { height: 1; background: $panel; }"

    def tell(
        self,
        step: str,
        elapsed: float = 0.0,
        skipped: Collection[str] = (),
        *,
        absent: Collection[str] = (),
        poses: int = 18,
    ) -> None:
        """Show that the wizard is in ``step`` after ``elapsed`` seconds of samples.

        Args:
            step: as the machine names it.
            elapsed: seconds of samples since the first one.
            skipped: steps that were left out.
            absent: steps that there are not for this stream or in this procedure.
            poses: how many poses the step of the poses asks for.
        """
        spans = _steps(step, skipped, absent, poses)
        time = clock(elapsed)
        room = (self.size.width or 80) - len(time) - 2
        for i, (text, style) in enumerate(spans):
            if width_of(tuple(spans)) <= room:
                break
            over = text[0] in _OVER
            spans[i] = (text[0] if over else text.lstrip(" "), style)
        if width_of(tuple(spans)) + len(_TITLE) + 2 <= room:
            spans.insert(0, (f" {_TITLE} ", "quiet"))
        spans.append((" " * (room + 1 - width_of(tuple(spans))) + time, "quiet"))
        self.show([tuple(spans)])


def _steps(step: str, skipped: Collection[str], absent: Collection[str], poses: int) -> list[Span]:
    named = dict(STEPS) | {"poses": f"{poses} poses"}
    steps = [
        MORE if step == MORE[0] and kind == "result" else (kind, name)
        for kind, name in named.items()
        if kind == step or kind not in absent
    ]
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
