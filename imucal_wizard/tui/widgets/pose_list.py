"""Which poses are taken, which is asked for next, which are missing."""

from collections.abc import Collection, Sequence

from imucal_wizard.tui.text import Line, Span, signed
from imucal_wizard.tui.widgets.lines import Lines


class PoseList(Lines):
    """``●`` taken, ``◎`` asked for next, ``·`` missing: faces first, then edges, then corners."""

    def tell(
        self,
        done: Sequence[str],
        missing: Sequence[str],
        wanted: str | None,
        recognised: str | None = None,
    ) -> None:
        """Show the list; the pose the device is in now stands in brackets."""
        names = sorted(
            {*done, *missing, *([wanted] if wanted else [])},
            key=lambda name: (len(name), _place(name)),
        )
        width = self.size.width or 78
        rows: list[Line] = []
        for label, length in (("faces", 2), ("edges", 4), ("other", 6)):
            cells = [_cell(n, done, wanted, recognised) for n in names if len(n) == length]
            rows += _rows(label, cells, width)
        self.show(rows)


def _place(name: str) -> tuple[str, str]:
    return name[1::2], name[::2]


def _cell(name: str, done: Collection[str], wanted: str | None, recognised: str | None) -> Span:
    sign, style = ("●", "good") if name in done else ("·", "quiet")
    if name == wanted:
        sign, style = "◎", "accent"
    here = name == recognised
    text = f"{signed(name)} {sign}"
    return (f"[{text}]", style) if here else (f" {text} ", style)


def _rows(label: str, cells: list[Span], width: int) -> list[Line]:
    if not cells:
        return []
    wide = max(len(text) for text, _ in cells) + 1
    per_row = max(1, (width - 8) // wide)
    per_row = 6 if len(cells) == 12 and 6 <= per_row < 12 else per_row
    rows: list[Line] = []
    for start in range(0, len(cells), per_row):
        head: Span = (f" {label if start == 0 else '':<6}", "quiet")
        part = cells[start : start + per_row]
        rows.append((head, *((text.ljust(wide), style) for text, style in part)))
    return rows
