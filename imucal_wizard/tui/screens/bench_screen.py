"""The bench: compare model and measurement, see where it fails, add what is missing."""

import asyncio
from collections.abc import Callable
from typing import ClassVar

from textual import work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container, Vertical
from textual.screen import Screen
from textual.widgets import Static

from imucal_wizard.bench.session import Bench
from imucal_wizard.errors import ImucalError
from imucal_wizard.tui.bench.added import added_view
from imucal_wizard.tui.bench.entries import Entry
from imucal_wizard.tui.bench.help_rows import help_rows
from imucal_wizard.tui.bench.ladder_rows import ladder_rows
from imucal_wizard.tui.bench.lesson_rows import lesson_rows, plain_rows
from imucal_wizard.tui.bench.model_rows import equation_rows, parts_of_model, rows_of_model
from imucal_wizard.tui.bench.next_rows import next_rows
from imucal_wizard.tui.bench.point_rows import point_row
from imucal_wizard.tui.bench.scatter import scatter
from imucal_wizard.tui.bench.sight import Sight, look
from imucal_wizard.tui.bench.source import Benches
from imucal_wizard.tui.bench.suspect_rows import order, table_rows
from imucal_wizard.tui.bench.views import View
from imucal_wizard.tui.bench.words import says
from imucal_wizard.tui.screens.formula_screen import FormulaScreen
from imucal_wizard.tui.screens.guess_screen import GuessScreen
from imucal_wizard.tui.screens.live_screen import SMALLEST
from imucal_wizard.tui.screens.page_screen import PageScreen
from imucal_wizard.tui.text import Line, Span, line, number, wrapped
from imucal_wizard.tui.widgets.key_footer import KeyFooter, Keys
from imucal_wizard.tui.widgets.lines import Lines

PANELS = ("suspects", "model", "ladder")
_TITLES = {"suspects": "SUSPECTS", "model": "MODEL", "ladder": "LADDER"}


class BenchScreen(Screen[None]):
    """One sensor at a time: residuals, suspects, model, ladder.

    Args:
        make: makes the benches; called in a thread.
        back: what leaving leads to, in words.
    """

    HORIZONTAL_BREAKPOINTS = [  # noqa: RUF012 (Textual declares it without ClassVar)
        (0, "-too-narrow"),
        (SMALLEST[0], "-normal"),
        (130, "-wide"),
    ]
    VERTICAL_BREAKPOINTS = [  # noqa: RUF012 (Textual declares it without ClassVar)
        (0, "-too-short"),
        (SMALLEST[1], "-usual"),
        (38, "-tall"),
    ]
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "choose(-1)", "previous"),
        Binding("down", "choose(1)", "next"),
        Binding("left", "point(-1)", "previous point"),
        Binding("right", "point(1)", "next point"),
        Binding("tab", "turn_view(1)", "look at …", priority=True),
        Binding("shift+tab", "turn_view(-1)", "look at …", priority=True),
        Binding("v", "added", "what it would explain"),
        Binding("a", "part", "other part of the data"),
        Binding("1", "panel('suspects')", "suspects"),
        Binding("2", "panel('model')", "model"),
        Binding("3", "panel('ladder')", "ladder"),
        Binding("enter", "enter", "add"),
        Binding("l", "lesson", "lesson"),
        Binding("p", "predict", "predict first"),
        Binding("n", "next_poses", "next poses"),
        Binding("u", "undo", "undo"),
        Binding("r,delete", "remove", "remove"),
        Binding("e", "formula", "own formula"),
        Binding("g", "sensor", "other sensor"),
        Binding("question_mark", "explain", "help"),
        Binding("escape,b", "back", "back"),
        Binding("q", "app.leave", "quit"),
    ]
    keys: ClassVar[tuple[Keys, Keys]] = (
        (
            ("enter", "add it"), ("l", "lesson"), ("p", "predict first"), ("n", "next poses"),
            ("u", "undo"), ("?", "help"), ("q", "quit"),
        ),
        (
            ("tab", "look at …"), ("v", "explained"), ("←→", "point"), ("1 2 3", "panels"),
            ("r", "remove"), ("e", "formula"), ("esc", "back"),
        ),
    )  # fmt: skip

    def __init__(self, make: Callable[[], Benches], back: str = "back") -> None:
        super().__init__()
        self._make = make
        self._back = back
        self._benches: Benches | None = None
        self._sensor = ""
        self._sights: dict[str, Sight] = {}
        self._busy = "Opening the bench …"
        self._note: tuple[str, str] = ("", "")
        self._panel = "suspects"
        self._suspect = self._term = self._view = 0
        self._part = ""
        self._cursor: int | None = None
        self._added = False
        self._lesson_mode = False

    # ---- laying out

    def compose(self) -> ComposeResult:
        """Head, verdict, four panels, keys."""
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
        yield Static(id="too-small", markup=False)

    def on_mount(self) -> None:
        """Make the benches."""
        self.add_class("panel-suspects")
        self.redraw()
        self.open()

    def on_resize(self) -> None:
        """Rows and columns decide how much is shown."""
        columns, rows = self.app.size
        self.query_one("#too-small", Static).update(
            f"This terminal has {columns}×{rows} characters. Make it at least "
            f"{SMALLEST[0]}×{SMALLEST[1]}, or the letters smaller."
        )
        self.call_after_refresh(self.redraw)

    @property
    def sight(self) -> Sight | None:
        """What is shown now; None before the first look."""
        return self._sights.get(self._sensor)

    @property
    def hidden(self) -> bool:
        """Whether the answer is hidden until a guess is made."""
        return self._lesson_mode

    # ---- work in a thread

    @work
    async def open(self) -> None:
        """Make the benches and look at the first."""
        try:
            self._benches = await asyncio.to_thread(self._make)
        except ImucalError as error:
            self._busy, self._note = "", (str(error), "bad")
            self.redraw()
            return
        self._sensor = self._benches.sensors[0]
        self._busy = ""
        self.do(f"Looking for what the {self._sensor} lacks …", lambda _bench: None)

    def do(self, words: str, act: Callable[[Bench], object]) -> None:
        """Change the model in a thread, then look again."""
        if self._busy or self._benches is None:
            return
        self._busy, self._note = words, ("", "")
        self.redraw()
        self._work(self._benches, self._sensor, act)

    @work
    async def _work(self, benches: Benches, sensor: str, act: Callable[[Bench], object]) -> None:
        def job() -> Sight | None:
            bench = benches.bench(sensor)
            if bench is None:
                return None
            act(bench)
            return look(bench)

        try:
            sight = await asyncio.to_thread(job)
        except ImucalError as error:
            self._note = (str(error), "bad")
        else:
            if sight is not None:
                self._sights[sensor] = sight
                self._after(sight)
        self._busy = ""
        self.redraw()

    def _after(self, sight: Sight) -> None:
        """The newest model is on the bench."""
        self._suspect, self._added, self._cursor = 0, False, None
        self._term = min(self._term, len(parts_of_model(sight)) - 1)
        if self._part not in sight.parts:
            self._part, self._view, self._cursor = sight.parts[0], 0, None
        if sight.rose(len(sight.ladder) - 1):
            self._note = (
                "▲ The held-out error did not fall: only the fitted one did. u takes it back.",
                "warn",
            )

    # ---- what is chosen

    def entries(self) -> tuple[Entry, ...]:
        """The suspects in the order shown."""
        return () if self.sight is None else order(self.sight, hidden=self.hidden)

    @property
    def entry(self) -> Entry | None:
        """The suspect chosen."""
        entries = self.entries()
        return entries[min(self._suspect, len(entries) - 1)] if entries else None

    def view(self) -> View | None:
        """The picture shown."""
        sight = self.sight
        if sight is None:
            return None
        if self._added and self.entry is not None and not self.hidden:
            added = added_view(sight.findings.misfit, self.entry)
            if added is not None:
                return added
        views = [view for view in sight.views if view.part == self._part]
        return views[self._view % len(views)] if views else None

    # ---- keys

    def action_choose(self, by: int) -> None:
        """Another suspect, or another term of the model."""
        if self.sight is None:
            return
        if self._panel == "model":
            self._term = (self._term + by) % len(parts_of_model(self.sight))
        else:
            self._suspect = (self._suspect + by) % max(1, len(self.entries()))
        self._note = ("", "")
        self.redraw()

    def action_point(self, by: int) -> None:
        """Another point of the picture."""
        view = self.view()
        if view is not None:
            here = self._cursor
            self._cursor = (0 if by > 0 else -1) if here is None else here + by
            self._cursor %= len(view.x)
            self.redraw()

    def action_turn_view(self, by: int) -> None:
        """The residuals against something else."""
        self._view += 0 if self._added else by
        self._added, self._cursor = False, None
        self.redraw()

    def action_added(self) -> None:
        """What the chosen suspect would explain, and back."""
        if self.hidden:
            self._note = ("Guess first: enter.", "accent")
        self._added, self._cursor = not self._added, None
        self.redraw()

    def action_part(self) -> None:
        """Another part of the data: turns, or an axis at rest."""
        if self.sight is not None:
            parts = self.sight.parts
            self._part = parts[(parts.index(self._part) + 1) % len(parts)]
            self._cursor, self._added = None, False
            self.redraw()

    def action_panel(self, name: str) -> None:
        """Show this panel; the arrows choose in it."""
        for panel in PANELS:
            self.set_class(panel == name, f"panel-{panel}")
        self._panel = name
        self.call_after_refresh(self.redraw)

    def action_enter(self) -> None:
        """Add the suspect, or put a part of the base back; in lesson mode guess first."""
        if self.sight is None:
            return
        if self._panel == "model":
            part = parts_of_model(self.sight)[self._term]
            if not part.there:
                self._add(part.term)
            return
        entry = self.entry
        if entry is None:
            return
        if self.hidden:
            self.app.push_screen(GuessScreen(self.sight, entry), self._guessed)
        else:
            self._add_entry(entry)

    def _guessed(self, term: str | None) -> None:
        """The guess is made and judged; ``term`` is what is to be added now."""
        if term is None:
            return
        self._lesson_mode = False
        if term:
            self._add(term)
        self.redraw()

    def _add_entry(self, entry: Entry) -> None:
        if entry.addable:
            self._add(entry.term)
            return
        why = entry.lacking or "there is nothing to add: measure that pose again"
        self._note = (f"{entry.term}: {why}", "warn")
        self.redraw()

    def _add(self, term: str) -> None:
        self.do(f"Adding {term} and fitting again …", lambda bench: bench.add(term))

    def action_remove(self) -> None:
        """Take the chosen term out of the model; the newest one when none is chosen."""
        if self.sight is None:
            return
        parts = parts_of_model(self.sight)
        there = [part.term for part in parts if part.there]
        term = parts[self._term].term if self._panel == "model" else (there or [""])[-1]
        if term in there:
            self.do(f"Fitting again without {term} …", lambda bench: bench.remove(term))

    def action_undo(self) -> None:
        """Back to the model before."""
        if self.sight is not None and len(self.sight.ladder) > 1:
            self.do("Back to the model before …", Bench.undo)

    def action_lesson(self) -> None:
        """The lesson of the chosen suspect or term."""
        sight = self.sight
        if sight is None:
            return
        term = self.entry.term if self.entry is not None else ""
        if self._panel == "model":
            term = parts_of_model(sight)[self._term].term
        known = {effect.name: effect for effect in sight.catalogue}

        def rows(width: int) -> list[Line]:
            if term in known:
                return lesson_rows(known[term], sight.sensor, width)
            return plain_rows(term, width)

        self.app.push_screen(PageScreen(f"lesson: {term}", rows, "l"))

    def action_predict(self) -> None:
        """Hide the answer until a guess is made, or show it again."""
        self._lesson_mode = not self._lesson_mode
        self._suspect, self._added = 0, False
        self.action_panel("suspects")

    def action_next_poses(self) -> None:
        """What to measure next."""
        sight = self.sight
        if sight is not None:
            self.app.push_screen(
                PageScreen("next poses", lambda width: next_rows(sight, width), "n")
            )

    def action_formula(self) -> None:
        """An effect of one's own."""
        if self.sight is not None:
            taken = {effect.name for effect in self.sight.catalogue}
            self.app.push_screen(FormulaScreen(self.sight.sensor, taken), self._typed)

    def _typed(self, effect: object) -> None:
        from imucal_wizard.effects.formula import FormulaEffect

        if isinstance(effect, FormulaEffect):
            self.do("Testing your formula …", lambda bench: bench.offer(effect))

    def action_sensor(self) -> None:
        """The other sensor."""
        if self._benches is None or self._busy:
            return
        sensors = self._benches.sensors
        if len(sensors) < 2:
            self._note = (f"only the {self._sensor} was measured", "warn")
            self.redraw()
            return
        self._sensor = sensors[(sensors.index(self._sensor) + 1) % len(sensors)]
        self._part, self._added = "", False
        self.do(f"Looking for what the {self._sensor} lacks …", lambda _bench: None)

    def action_explain(self) -> None:
        """Help."""
        self.app.push_screen(PageScreen("help: the bench", help_rows, "question_mark"))

    def action_back(self) -> None:
        """Leave the bench."""
        self.dismiss(None)

    # ---- drawing

    def redraw(self) -> None:
        """Show everything for the size there is."""
        if not self.is_mounted:
            return
        self.query_one(KeyFooter).offer(*self.keys)
        self.query_one("#bench-head", Lines).show([self._head()])
        self._say()
        sight = self.sight
        if sight is None:
            return
        self._draw_compare(sight)
        self._draw("suspects", self._suspect_rows(sight))
        self._draw("model", self._model_rows(sight))
        self._draw("ladder", ladder_rows(sight, *self._room("ladder")))

    def _head(self) -> Line:
        spans: list[Span] = [(f" BENCH  {self._sensor}  ", "strong")]
        for k, panel in enumerate(PANELS):
            here = panel == self._panel
            spans.append((f" {k + 1} ", "key"))
            spans.append((f"▸{_TITLES[panel]} " if here else panel, "accent" if here else "quiet"))
        others = [s for s in (self._benches.sensors if self._benches else ()) if s != self._sensor]
        spans += [("   g ", "key"), (others[0], "quiet")] if others else []
        return tuple(spans)

    def _say(self) -> None:
        place = self.query_one("#bench-says", Lines)
        width = max(40, self.app.size.width - 2)
        text, style = self._note
        rows: list[Line] = []
        if self._busy:
            rows = [line(f" {self._busy}", "accent")]
        elif text:
            rows = wrapped(f" {text}", width, style, indent=" ")
        if self.sight is not None and self.hidden:
            rows += wrapped(
                " Predict first: look at what is left (tab), choose what you think is missing, "
                "commit with enter. p shows the answer at once.", width, "accent", indent=" ",
            )  # fmt: skip
        elif self.sight is not None:
            sign, words = says(self.sight)
            mark = {"good": "✓", "warn": "▲"}.get(sign, "▸")
            rows += wrapped(f" {mark} {words}", width, sign, indent="   ")
        place.show((rows + [line("")] * 3)[:3])

    def _room(self, name: str) -> tuple[int, int]:
        """Columns and rows of a panel, inside."""
        size = self.query_one(f"#{name}", Lines).size
        return max(60, size.width), max(6, size.height)

    def _draw(self, name: str, rows: list[Line]) -> None:
        self.query_one(f"#{name}", Lines).show(rows)

    def _suspect_rows(self, sight: Sight) -> list[Line]:
        width, height = self._room("suspects")
        chosen = min(self._suspect, len(self.entries()) - 1) if self.entries() else None
        return table_rows(sight, width, height, chosen, hidden=self.hidden)

    def _model_rows(self, sight: Sight) -> list[Line]:
        width, height = self._room("model")
        chosen = self._term if self._panel == "model" else None
        head = len(equation_rows(sight, width))
        rows = rows_of_model(sight, width, chosen)
        first = max(0, head + 2 + 2 * (chosen or 0) - height)
        return rows[:head] + rows[head + first :]

    def _draw_compare(self, sight: Sight) -> None:
        view = self.view()
        if view is None:
            return
        width, height = self._room("compare")
        place = None if self._cursor is None else min(self._cursor, len(view.x) - 1)
        plot = scatter(view, width, height - 2, place)
        last: Line = line("  ←→ picks a point and says which one it is", "quiet")
        if place is not None:
            last = point_row(sight, view, place)
        self._draw("compare", [self._compare_head(view), *plot, last])

    def _compare_head(self, view: View) -> Line:
        noise = "" if view.floor is None else f"  ┈ noise ±{number(view.floor, 2)}"
        title = f"{view.title}, {view.unit}" if view.slope is None else view.title
        return ((f"{view.part}: ", "strong"), (title, ""), (noise, "quiet"))
