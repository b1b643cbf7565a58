"""The bench's panels: where they are and what they show."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.containers import Container, Vertical

from imucal_wizard.procedure.asked import Asked
from imucal_wizard.tui.bench.desk import PANELS, Desk
from imucal_wizard.tui.bench.ladder_rows import ladder_rows
from imucal_wizard.tui.bench.model_rows import model_rows
from imucal_wizard.tui.bench.point_rows import point_row
from imucal_wizard.tui.bench.scatter import scatter
from imucal_wizard.tui.bench.sight import Sight
from imucal_wizard.tui.bench.suspect_rows import table_rows
from imucal_wizard.tui.bench.views import View
from imucal_wizard.tui.bench.words import says
from imucal_wizard.tui.leaving import being_left
from imucal_wizard.tui.screens.sized_screen import SizedScreen
from imucal_wizard.tui.text import Line, Span, line, number, wrapped
from imucal_wizard.tui.widgets.key_footer import KeyFooter, Keys
from imucal_wizard.tui.widgets.lines import Lines

SAID = 3
"""Rows for the verdict; the rest of it stands on the page of the next poses."""
_PREDICT = (
    "Predict first: look at what is left (tab turns the plot), choose what you think is missing "
    "(↑↓), commit with enter. p shows the answer at once."
)
PREDICTING: tuple[Keys, ...] = (
    (
        ("enter", "commit to it"), ("l", "lesson"), ("p", "show the answer"), ("↑↓", "choose"),
        ("?", "help"), ("q", "quit"),
    ),
    (
        ("tab", "look at …"), ("←→", "point"), ("t", "trace"), ("a", "other data"),
        ("g", "next sensor"), ("esc", "back"),
    ),
)  # fmt: skip
"""The keys while a guess is asked for."""
_MARKS = {"good": "✓", "warn": "▲", "accent": "▸"}


class BenchLayout(SizedScreen[tuple[Asked, ...]]):
    """Head, verdict, plot, three panels of which a small terminal shows one."""

    keys: ClassVar[tuple[Keys, ...]] = ()
    """What the footer shows, row by row."""

    def __init__(self) -> None:
        super().__init__()
        self.desk = Desk()
        self.sensors: tuple[str, ...] = ()
        self.sensor = ""
        self.busy = ""
        self.note: tuple[str, str] = ("", "")

    def compose(self) -> ComposeResult:
        """Head, verdict, panels, keys, and a word for terminals that are too small."""
        yield Lines(id="bench-head")
        yield Lines(id="bench-says")
        with Container(id="bench-body"):
            with Vertical(id="bench-left"):
                yield Lines(id="compare")
                yield Lines(id="suspects")
            with Vertical(id="bench-right"):
                yield Lines(id="model")
                yield Lines(id="ladder")
        yield KeyFooter()
        yield from self.too_small()

    def begin(self) -> None:
        """Show what there is to show."""
        self.query_one("#compare", Lines).border_title = "what the model leaves"
        for k, name in enumerate(PANELS):
            self.query_one(f"#{name}", Lines).border_title = f"{k + 1} {name}"
        self.redraw()

    def redraw(self) -> None:
        """Show everything for the size there is."""
        if not self.is_mounted or being_left(self):
            return
        for panel in PANELS:
            self.set_class(panel == self.desk.panel, f"panel-{panel}")
        self.query_one(KeyFooter).offer(*(PREDICTING if self.desk.hidden else self.keys))
        self._show("bench-head", [self._head()])
        self._show("bench-says", self._said())
        if self.desk.sight is not None:
            self._draw(self.desk.sight)

    def _draw(self, sight: Sight) -> None:
        desk = self.desk
        self._show("suspects", table_rows(sight, *self._room("suspects"), desk.place,
                                          hidden=desk.hidden))  # fmt: skip
        self._show("model", model_rows(sight, *self._room("model"), desk.term_place))
        self._show("ladder", ladder_rows(sight, *self._room("ladder")))
        view = desk.view()
        if view is not None:
            self._show("compare", self._compare(sight, view))

    def _compare(self, sight: Sight, view: View) -> list[Line]:
        width, height = self._room("compare")
        place = None if self.desk.cursor is None else min(self.desk.cursor, len(view.x) - 1)
        last: Line = line("  ←→ picks a point: which one it is; t: its raw trace", "quiet")
        if place is not None:
            last = point_row(sight, view, place)
        return [_head_of(view), *scatter(view, width, height - 2, place), last]

    def _head(self) -> Line:
        spans: list[Span] = [(f" BENCH  {self.sensor}  ", "strong")]
        for k, panel in enumerate(PANELS):
            here = panel == self.desk.panel
            name = f"▸{panel.upper()}" if here else panel
            spans += [(f" {k + 1} ", "key"), (f"{name} ", "accent" if here else "quiet")]
        return (*spans, *self._others())

    def _others(self) -> list[Span]:
        """The sensor that ``g`` leads to, and that it is not the only other one."""
        place = self.sensors.index(self.sensor) if self.sensor in self.sensors else 0
        others = [*self.sensors[place + 1 :], *self.sensors[:place]]
        if not others:
            return []
        return [("  g ", "key"), (others[0] + (", …" if len(others) > 1 else ""), "quiet")]

    def _said(self) -> list[Line]:
        """What is being done, what went wrong, the verdict: the most pressing first."""
        width, sight, (note, style) = max(40, self.app.size.width - 2), self.desk.sight, self.note
        rows: list[Line] = []
        if self.busy:
            rows += [line(f" {self.busy}", "accent")]
        elif note:
            rows += wrapped(f" {note}", width, style, indent=" ")
        if self.desk.hidden:
            rows += wrapped(f" {_PREDICT}", width, "accent", indent=" ")
        elif sight is not None:
            sign, words = says(sight)
            rows += wrapped(f" {_MARKS.get(sign, '▸')} {words}", width, sign, indent="   ")
        if len(rows) > SAID:
            told = "".join(text for text, _ in rows[SAID - 1])
            more = "  … n: all of it"
            cut = told[: width - len(more)].rsplit(" ", 1)[0]
            rows[SAID - 1] = ((cut, rows[SAID - 1][0][1]), (more, "key"))
        return (rows + [line("")] * SAID)[:SAID]

    def _room(self, name: str) -> tuple[int, int]:
        """Columns and rows inside a panel."""
        size = self.query_one(f"#{name}", Lines).size
        return max(60, size.width), max(6, size.height)

    def _show(self, name: str, rows: list[Line]) -> None:
        self.query_one(f"#{name}", Lines).show(rows)


def _head_of(view: View) -> Line:
    """What is drawn, and how large the noise is."""
    title = f"{view.title}, {view.unit}" if view.slope is None else view.title
    noise = "" if view.floor is None else f"  ┈ noise ±{number(view.floor, 2)}"
    return ((f"{view.part}: ", "strong"), (title, ""), (noise, "quiet"))
