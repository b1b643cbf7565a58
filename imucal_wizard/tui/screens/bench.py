"""The bench: compare model and measurement, find what the model lacks, add it."""

from collections.abc import Callable
from contextlib import nullcontext
from typing import TYPE_CHECKING, ClassVar, cast

from textual import work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container, Vertical
from textual.screen import Screen

from imucal_wizard.core.errors import ImucalError
from imucal_wizard.diagnose.bench import Bench, Entry
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.next_poses import Requests, to_measure
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.diagnose.views import ResidualView
from imucal_wizard.model.formula import FormulaEffect
from imucal_wizard.report.device_history import saved_text
from imucal_wizard.tui.bench.pages import MORE_DATA, next_rows, raw_trace_rows, rows_for
from imucal_wizard.tui.bench.panels import (
    ladder_lines,
    model_rows,
    picture_rows,
    point_row,
    table_rows,
    verdict_rows,
    view_head,
)
from imucal_wizard.tui.bench.selection import PANELS, Selection
from imucal_wizard.tui.bench.snapshot import BenchSnapshot, bench_snapshot
from imucal_wizard.tui.screens.base import TooSmall
from imucal_wizard.tui.screens.formula import FormulaScreen
from imucal_wizard.tui.screens.guess import GuessScreen
from imucal_wizard.tui.screens.page import PageScreen
from imucal_wizard.tui.text import Line, Span, line, wrapped
from imucal_wizard.tui.threads import being_left, in_thread
from imucal_wizard.tui.widgets.footer import KeyFooter
from imucal_wizard.tui.widgets.lines import Lines

if TYPE_CHECKING:  # the app imports this module while its first screen is shown
    from imucal_wizard.tui.app import BaseApp

SAID = 3
"""Rows for the verdict; the page of the next poses shows all of it."""
Act = Callable[[Bench], object]
"""A change of a bench, made in a thread."""
_PREDICT = (
    "Predict first: look at the residuals (tab changes the plot), choose what you think is missing "
    "(↑↓), commit with enter. p shows the answer at once."
)
_IN_MEMORY = "▲ If the program is ended now, this model is lost: {}. s saves it."
_TABLE = "On a rate table: record more steps or mountings and fit all files together."
_FIRST = "More rotations cannot help yet: complete the accelerometer's model first."
_CIRCLES = "For more circles, leave the bench and repeat the step Field."


class BenchScreen(Screen[Requests]):
    """Head, verdict, plot, three panels of which a small terminal shows one.

    Its result is the list of requested measurements, or None. Slow work runs in a thread, one task
    at a time; if a task fails, its error is shown and the model stays as it was.

    Args:
        make: makes the benches; called in a thread.
        sensor: the sensor to show first; "" for the first one.
        live: the source is a device, which can measure more.
        predict: hide the answer until a guess.
        alone: there is no screen below; leaving the bench leaves the program.
    """

    CSS_PATH = "bench.tcss"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("question_mark", "app.explain('bench')", "help", tooltip="explains the bench"),
        Binding("escape,b", "back", "back", tooltip="leaves the bench"),
        Binding("q", "app.quit", "quit", tooltip="leaves the program"),
        Binding("s", "save", "save", tooltip="saves the calibration with the present models"),
        Binding(
            "enter", "enter(False)", "add it", key_display="enter",
            tooltip="adds the suspect; puts back a term of the base that was left out",
        ),
        Binding(
            "enter", "enter(True)", "commit to it", key_display="enter",
            tooltip="commits to a guess",
        ),
        Binding(
            "l", "lesson", "lesson",
            tooltip="lesson: the cause in the sensor, the pattern of the error, the cost of "
                    "ignoring it",
        ),
        Binding(
            "p", "predict(True)", "predict first",
            tooltip="hides the answer until you have committed to a guess",
        ),
        Binding("p", "predict(False)", "show the answer", tooltip="shows the answer at once"),
        Binding(
            "n", "next_poses", "next poses",
            tooltip="the whole verdict, and the poses to measure next",
        ),
        Binding("u", "undo", "undo", tooltip="takes back the last change of the model"),
        Binding(
            "tab", "turn(1)", "look at …", priority=True,
            tooltip="plots against another quantity: force, number, time, temperature, pose before",
        ),
        Binding("shift+tab", "turn(-1)", "look at …", show=False, priority=True),
        Binding(
            "v", "added", "explained",
            tooltip="plots what the selected suspect explains; points on the line support it",
        ),
        Binding(
            "left", "point(-1)", "point", key_display="←→",
            tooltip="picks a point, and shows its pose and reading",
        ),
        Binding("right", "point(1)", "point", show=False, key_display="←→"),
        Binding(
            "t", "trace", "trace",
            tooltip="the raw trace of the picked point: every reading of its hold or rotation",
        ),
        Binding(
            "m", "measure", "measure",
            tooltip="measures the next poses now; then the bench opens again with all data",
        ),
        Binding(
            "r,delete", "remove", "remove",
            tooltip="removes the selected term of the model, otherwise the newest one",
        ),
        Binding(
            "a", "part", "other data",
            tooltip="plots another part of the data: single axes, or the rotations",
        ),
        Binding("e", "formula", "formula", tooltip="type an effect of your own as a formula"),
        Binding(
            "up", "choose(-1)", "choose", show=False, key_display="↑↓",
            tooltip="selects a suspect, or a term in the panel of the model",
        ),
        Binding("down", "choose(1)", "choose", show=False),
        Binding("1", "panel('suspects')", show=False, tooltip="shows the suspects"),
        Binding("2", "panel('model')", show=False, tooltip="shows the model"),
        Binding("3", "panel('ladder')", show=False, tooltip="shows the ladder"),
        Binding("g", "sensor", "next sensor", show=False, tooltip="shows the next sensor"),
    ]  # fmt: skip

    def __init__(
        self,
        make: Callable[[], Benches],
        sensor: str = "",
        *,
        live: bool = False,
        predict: bool = False,
        alone: bool = False,
    ) -> None:
        super().__init__()
        self.selection = Selection()
        self.selection.hidden = predict
        self.sensor = sensor
        self.busy = "Opening the bench …"
        self.note: tuple[str, str] = ("", "")
        self._make = make
        self._live = live
        self._alone = alone
        self._benches: Benches | None = None
        self._sensors: tuple[str, ...] = ()

    def compose(self) -> ComposeResult:
        """Head, verdict, panels, footer, and the message for small terminals."""
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
        yield TooSmall()

    def on_mount(self) -> None:
        """Open the benches, unless the screen was closed before it was shown."""
        if being_left(self):
            return
        self._lines("compare").border_title = "residuals"
        for k, name in enumerate(PANELS):
            self._lines(name).border_title = f"{k + 1} {name}"
        self.redraw()
        self._open()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Disable keys that would show a hidden answer."""
        hidden = self.selection.hidden
        if action == "enter":
            return parameters[0] is hidden
        if action == "predict":
            return parameters[0] is not hidden
        if action == "measure" and not self._live:
            return False
        showing = ("next_poses", "undo", "added", "measure", "remove", "formula", "save")
        return not (hidden and action in showing)

    # Display

    def redraw(self) -> None:
        """Show everything."""
        if not self.is_mounted or being_left(self):
            return
        for panel in PANELS:
            self.set_class(panel == self.selection.panel, f"panel-{panel}")
        self._lines("bench-head").show([self._head()])
        self._lines("bench-says").draw(self._said)
        self.refresh_bindings()
        selection, snapshot = self.selection, self.selection.snapshot
        if snapshot is None:
            return
        self._lines("suspects").draw(
            lambda width, height: table_rows(
                snapshot, width, height, selection.place, hidden=selection.hidden
            )
        )
        self._lines("model").draw(
            lambda width, height: model_rows(snapshot, width, height, selection.term_place)
        )
        self._lines("ladder").draw(lambda width, height: ladder_lines(snapshot, width, height))
        view = selection.view()
        if view is not None:
            self._lines("compare").draw(
                lambda width, height: self._compare(snapshot, view, width, height)
            )

    def _compare(
        self, snapshot: BenchSnapshot, view: ResidualView, width: int, height: int
    ) -> list[Line]:
        place = (
            None if self.selection.cursor is None else min(self.selection.cursor, len(view.x) - 1)
        )
        last: Line = line("  ←→ picks a point; t shows its raw trace", "quiet")
        if place is not None:
            last = point_row(snapshot, view, place)
        head = view_head(view, width)
        return [*head, *picture_rows(view, width, height - 1 - len(head), place), last]

    def _head(self) -> Line:
        # while another sensor is diagnosed, the panels still show the one before
        snapshot = self.selection.snapshot
        sensor = snapshot.fit.sensor if self.busy and snapshot is not None else self.sensor
        spans: list[Span] = [(f" BENCH  {sensor}  ", "strong")]
        for k, panel in enumerate(PANELS):
            here = panel == self.selection.panel
            name = f"▸{panel.upper()}" if here else panel
            spans += [(f" {k + 1} ", "key"), (f"{name} ", "accent" if here else "quiet")]
        place = self._sensors.index(sensor) if sensor in self._sensors else 0
        others = [*self._sensors[place + 1 :], *self._sensors[:place]]
        if others:  # the next sensor, and whether there are more
            more = ", …" if len(others) > 1 else ""
            spans += [("  g ", "key"), (others[0] + more, "quiet")]
        return tuple(spans)

    def _said(self, width: int, _height: int) -> list[Line]:
        """Present task, message and verdict, in this order."""
        width, (note, style) = width - 2, self.note
        rows: list[Line] = []
        if self.busy:
            rows += [line(f" {self.busy}", "accent")]
        elif note:
            rows += wrapped(f" {note}", width, style, indent=" ")
        if self.selection.hidden:
            rows += wrapped(f" {_PREDICT}", width, "accent", indent=" ")
        elif self.selection.snapshot is not None:
            rows += verdict_rows(self.selection.snapshot, width, SAID - len(rows))
        return (rows + [line("")] * SAID)[:SAID]

    def _lines(self, name: str) -> Lines:
        return self.query_one(f"#{name}", Lines)

    def _tell(self, note: str) -> None:
        """Show a message."""
        self.note = (note, "warn")
        self.redraw()

    # Work in threads

    @work
    async def _open(self) -> None:
        """Make the benches and show the first."""
        try:
            benches = await in_thread(self._make)
        except ImucalError as error:
            self.busy, self.note = "", (str(error), "bad")
            self.redraw()
            return
        self.busy, self._benches, self._sensors = "", benches, benches.sensors
        self.sensor = self.sensor if self.sensor in self._sensors else self._sensors[0]
        self._look()

    def _look(self) -> None:
        """Diagnose the selected sensor."""
        self._do(f"Looking for what the {self.sensor} lacks …", None)

    def _do(self, words: str, act: Act | None, choose: str = "") -> None:
        """Change the model in a thread, then take a new snapshot.

        Args:
            words: message while it runs.
            act: the change, or None.
            choose: the suspect to select afterwards.
        """
        if self._benches is not None and not self.busy:
            self.busy, self.note = words, ("", "")
            self.redraw()
            self._work(self._benches, act, choose)

    @work
    async def _work(self, benches: Benches, act: Act | None, choose: str) -> None:
        owner, sensor = self._owner, self.sensor  # the thread goes on when the screen is left

        def done() -> tuple[BenchSnapshot, str]:
            problem = ""
            with owner.models.lock:
                bench = benches.bench(sensor) or benches.accelerometer
                if act is not None:
                    act(bench)
                    problem = owner.models.keep()
                return bench_snapshot(benches, bench), problem

        try:
            with nullcontext() if act is None else owner.unfinished():
                snapshot, problem = await in_thread(done)
        except ImucalError as error:
            self.note = (str(error), "bad")
        else:
            self.selection.show(snapshot)
            self.selection.select(choose)
            if problem:
                self.note = (_IN_MEMORY.format(problem), "bad")
            elif act is None and (restored := owner.models.restored):
                self.note = (f"✓ Restored: {restored}", "good")
        self.busy = ""
        self.redraw()

    @property
    def _owner(self) -> "BaseApp":
        """The app, which saves the models."""
        return cast("BaseApp", self.app)

    @work
    async def _save(self) -> None:
        try:
            saved = await self._owner.save_model()
        except ImucalError as error:
            self.note = (f"▲ not saved: {error}", "bad")
        else:
            style = "warn" if saved.without else "good"
            self.note = (f"✓ {saved_text(saved.path, saved.without)}", style)
        self.busy = ""
        self.redraw()

    # Keys

    async def action_back(self) -> None:
        """Leave the bench; without a screen below, the program."""
        if self._alone:
            await self.run_action("app.quit")
        else:
            self.dismiss(None)

    def action_save(self) -> None:
        """Save the calibration with the present models of all sensors."""
        if self.selection.snapshot is not None and not self.busy:
            self.busy, self.note = "Saving the calibration …", ("", "")
            self.redraw()
            self._save()

    def action_choose(self, by: int) -> None:
        """Select another suspect, or another term of the model."""
        self.note = ("", "")
        self.selection.choose(by)
        self.redraw()

    def action_point(self, by: int) -> None:
        """Pick another point of the plot."""
        self.selection.point(by)
        self.redraw()

    def action_turn(self, by: int) -> None:
        """Plot the residuals against another quantity."""
        self.selection.turn(by)
        self.redraw()

    def action_added(self) -> None:
        """Plot what the selected suspect explains, and back."""
        self.selection.explain()
        self.redraw()

    def action_part(self) -> None:
        """Plot another part of the data."""
        self.selection.other_part()
        self.redraw()

    def action_panel(self, name: str) -> None:
        """Show this panel; the arrows select in it."""
        self.selection.panel = name
        self.redraw()

    def action_predict(self, _hide: bool) -> None:
        """Hide the answer until a guess is made, or show it again."""
        self.selection.predict()
        self.redraw()

    def action_enter(self, _guess: bool) -> None:
        """Add the suspect, or put a term of the base back; guess first if the answer is hidden."""
        part, entry, snapshot = self.selection.part, self.selection.entry, self.selection.snapshot
        if part is not None:
            if not part.there:
                self._add(part.term)
        elif entry is not None and snapshot is not None and self.selection.hidden:
            self.app.push_screen(GuessScreen(snapshot, entry), self._guessed)
        elif entry is not None:
            self._add_entry(entry)

    def _guessed(self, term: str | None) -> None:
        """Show the answer after a guess, and add the term."""
        if term is not None:
            self.selection.predict()
            self.redraw()
        if term:
            self._add(term)

    def _add_entry(self, entry: Entry) -> None:
        if entry.addable:
            self._add(entry.term)
            return
        key = " (m)" if self._live else ""
        why = entry.lacking or f"there is nothing to add: measure that pose again{key}"
        self._tell(f"{entry.term}: {why}")

    def _add(self, term: str) -> None:
        self._do(f"Adding {term} and fitting again …", lambda bench: bench.add(term))

    def action_remove(self) -> None:
        """Remove the selected term; the last one if none is selected."""
        there = [part.term for part in self.selection.parts() if part.there]
        chosen = self.selection.part
        term = chosen.term if chosen is not None else there[-1] if there else ""
        if chosen is not None and not chosen.there:
            self._tell(f"{term} is left out already; enter puts it back")
        if term in there:
            self._do(f"Fitting again without {term} …", lambda bench: bench.remove(term))

    def action_undo(self) -> None:
        """Return to the model before."""
        if self.selection.snapshot is not None and len(self.selection.snapshot.ladder) > 1:
            self._do("Back to the model before …", Bench.undo)

    def action_sensor(self) -> None:
        """Show the next sensor."""
        if self.busy or not self._sensors:
            return
        if len(self._sensors) < 2:
            self._tell(f"Only the {self.sensor} was measured.")
            return
        place = self._sensors.index(self.sensor) + 1
        self.sensor = self._sensors[place % len(self._sensors)]
        self._look()

    def action_lesson(self) -> None:
        """Show the lesson of the selected suspect or term."""
        snapshot, chosen = self.selection.snapshot, self.selection.part or self.selection.entry
        if snapshot is not None and chosen is not None:
            term = chosen.term
            hidden = self.selection.hidden
            page = PageScreen(
                f"lesson: {term}",
                lambda width, _: rows_for(snapshot, term, width, hidden=hidden),
                "l",
            )
            self.app.push_screen(page)

    def action_trace(self) -> None:
        """Show every reading of the picked point, or of the one with the largest residual."""
        snapshot, view = self.selection.snapshot, self.selection.view()
        if snapshot is None or view is None or not len(view.x):
            return
        if self.selection.cursor is None:
            self.selection.pick_farthest()
            self.redraw()
        place = min(self.selection.cursor or 0, len(view.x) - 1)
        page = PageScreen(
            "raw trace", lambda width, _: raw_trace_rows(snapshot, view, place, width), "t"
        )
        self.app.push_screen(page)

    def action_formula(self) -> None:
        """Ask for an effect as a formula."""
        snapshot = self.selection.snapshot
        if snapshot is not None:
            taken = {effect.name for effect in snapshot.catalogue}
            unit = snapshot.measured.circumstances.field_unit
            self.app.push_screen(FormulaScreen(self.sensor, taken, unit), self._typed)

    def _typed(self, effect: FormulaEffect | None) -> None:
        if effect is not None:
            self._do("Testing your formula …", lambda bench: bench.offer(effect), effect.name)

    def action_next_poses(self) -> None:
        """Show the whole verdict, and what to measure next."""
        snapshot, chosen, live = self.selection.snapshot, self.selection.entry, self._live
        if self.busy or snapshot is None:  # the snapshot is of the model before
            return
        page = PageScreen(
            "what the data say",
            lambda width, _: next_rows(snapshot, width, chosen=chosen, live=live),
            "n",
            measure=live and bool(self._requests(snapshot)),
        )
        self.app.push_screen(page, lambda now: self.action_measure() if now else None)

    def action_measure(self) -> None:
        """Leave the bench to measure the next poses."""
        snapshot = self.selection.snapshot
        if snapshot is None or self.busy:
            return
        if not snapshot.measured.at_rest:
            self._tell(_CIRCLES if snapshot.measured.guided else _TABLE)
            return
        requests = self._requests(snapshot)
        if requests:
            self.dismiss(requests)
        else:
            waits = snapshot.diagnosis.verdict is Verdict.WAITING
            self._tell(_FIRST if waits else f"No pose is listed to measure. {MORE_DATA}")

    def _requests(self, snapshot: BenchSnapshot) -> Requests:
        """What the page of the next poses lists."""
        entry = self.selection.entry
        return to_measure(snapshot.diagnosis, None if entry is None else entry.suspect)[0]
