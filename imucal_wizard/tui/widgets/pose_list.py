"""Which poses are taken, which is asked for next, which are missing."""

from collections.abc import Mapping, Sequence

from imucal_wizard.tui.text import Line, Span, signed
from imucal_wizard.tui.widgets.lines import Lines


class PoseList(Lines):
    """``●`` taken, ``◎`` asked for next, ``·`` missing: faces, edges, tilts, corners."""

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
        signs = {name: _signs(name, done, missing, wanted) for name in names}
        rows = self._laid(names, signs, recognised)
        if 0 < self.size.height < len(rows):  # what is left matters more than what is done
            rows = self._laid([n for n in names if set(signs[n]) != {"●"}], signs, recognised)
        self.show(rows)

    def _laid(
        self, names: Sequence[str], signs: Mapping[str, str], recognised: str | None
    ) -> list[Line]:
        width = self.size.width or 78
        rows: list[Line] = []
        for label, length in (("faces", 2), ("edges", 4), ("tilts", 5), ("other", 6)):
            cells = [_cell(n, signs[n], recognised) for n in names if len(n) == length]
            rows += _rows(label, cells, width)
        return rows


def _place(name: str) -> tuple[str, str]:
    return name[1::2], name[::2]


def _signs(name: str, done: Sequence[str], missing: Sequence[str], wanted: str | None) -> str:
    """One sign for each time that a pose is asked for."""
    left = max(0, missing.count(name) - (name == wanted))
    return "●" * done.count(name) + "◎" * (name == wanted) + "·" * left


def _cell(name: str, signs: str, recognised: str | None) -> Span:
    style = "accent" if "◎" in signs else "quiet" if "·" in signs else "good"
    text = f"{signed(name)} {signs}"
    return (f"[{text}]", style) if name == recognised else (f" {text} ", style)


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
