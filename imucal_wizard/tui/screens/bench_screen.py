"""The bench: compare model and measurement, see where it fails, add what is missing."""

from collections.abc import Callable
from typing import ClassVar

from textual.binding import Binding, BindingType

from imucal_wizard.bench.benches import Benches
from imucal_wizard.bench.pose import asked_for
from imucal_wizard.bench.session import Bench
from imucal_wizard.effects.effect import MAGNETOMETER
from imucal_wizard.tui.bench.entries import Entry
from imucal_wizard.tui.bench.next_rows import next_rows
from imucal_wizard.tui.bench.to_measure import to_measure
from imucal_wizard.tui.screens.bench_pages import BenchPages
from imucal_wizard.tui.screens.guess_screen import GuessScreen
from imucal_wizard.tui.screens.next_screen import NextScreen
from imucal_wizard.tui.widgets.key_footer import Keys

_NO_DEVICE = (
    "This is a recording: to measure more, a device is needed (the wizard on a port, or on the "
    "virtual IMU). n lists the poses."
)
_CIRCLES = (
    "Circles are turned in the magnetometer's own step: leave the bench and repeat that step."
)


class BenchScreen(BenchPages):
    """Keys, and what they start. Ends with what is to be measured now, or with nothing.

    Args:
        make: makes the benches; called in a thread.
        sensor: whose bench to look at first; "" for the first there is.
        live: there is a device that can be asked for more poses.
        predict: tell nothing before a guess.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "choose(-1)", "previous"),
        Binding("down", "choose(1)", "next"),
        Binding("left", "point(-1)", "previous point"),
        Binding("right", "point(1)", "next point"),
        Binding("tab", "turn(1)", "look at …", priority=True),
        Binding("shift+tab", "turn(-1)", "look at …", priority=True),
        Binding("t", "trace", "raw trace"),
        Binding("v", "added", "what it would explain"),
        Binding("a", "part", "other part of the data"),
        Binding("1", "panel('suspects')", "suspects"),
        Binding("2", "panel('model')", "model"),
        Binding("3", "panel('ladder')", "ladder"),
        Binding("enter", "enter", "add"),
        Binding("l", "lesson", "lesson"),
        Binding("p", "predict", "predict first"),
        Binding("n", "next_poses", "next poses"),
        Binding("m", "measure", "measure these now"),
        Binding("u", "undo", "undo"),
        Binding("r,delete", "remove", "remove"),
        Binding("e", "formula", "own formula"),
        Binding("g", "sensor", "next sensor"),
        Binding("question_mark", "explain", "help"),
        Binding("escape,b", "dismiss", "back"),
        Binding("q", "app.leave", "quit"),
    ]
    keys: ClassVar[tuple[Keys, ...]] = (
        (
            ("enter", "add it"), ("l", "lesson"), ("p", "predict first"), ("n", "next poses"),
            ("u", "undo"), ("?", "help"), ("q", "quit"), ("g", "next sensor"),
        ),
        (
            ("tab", "look at …"), ("v", "explained"), ("←→", "point"), ("1-3", "panels"),
            ("m", "measure"), ("r", "remove"), ("esc", "back"), ("e", "formula"),
            ("a", "other data"),
        ),
    )  # fmt: skip

    def __init__(
        self,
        make: Callable[[], Benches],
        sensor: str = "",
        *,
        live: bool = False,
        predict: bool = False,
    ) -> None:
        super().__init__(make, sensor, predict=predict)
        self._live = live

    def action_choose(self, by: int) -> None:
        """Another suspect, or another term of the model."""
        self.note = ("", "")
        self.desk.choose(by)
        self.redraw()

    def action_point(self, by: int) -> None:
        """Another point of the picture."""
        self.desk.point(by)
        self.redraw()

    def action_turn(self, by: int) -> None:
        """The residuals against something else."""
        self.desk.turn(by)
        self.redraw()

    def action_added(self) -> None:
        """What the chosen suspect would explain, and back."""
        self.desk.explain()
        self.redraw()

    def action_part(self) -> None:
        """Another part of the data."""
        self.desk.other_part()
        self.redraw()

    def action_panel(self, name: str) -> None:
        """Show this panel; the arrows choose in it."""
        self.desk.panel = name
        self.redraw()
        self.call_after_refresh(self.redraw)

    def action_predict(self) -> None:
        """Hide the answer until a guess is made, or show it again."""
        self.desk.predict()
        self.action_panel(self.desk.panel)

    def action_enter(self) -> None:
        """Add the suspect, or put a part of the base back; in lesson mode guess first."""
        part, entry, sight = self.desk.part, self.desk.entry, self.desk.sight
        if part is not None:
            if not part.there:
                self._add(part.term)
        elif entry is not None and sight is not None and self.desk.hidden:
            self.app.push_screen(GuessScreen(sight, entry), self._guessed)
        elif entry is not None:
            self._add_entry(entry)

    def _guessed(self, term: str | None) -> None:
        """The guess is made and judged; ``term`` is what is to be added now."""
        if term is not None:
            self.desk.predict()
            self.redraw()
        if term:
            self._add(term)

    def _add_entry(self, entry: Entry) -> None:
        if entry.addable:
            self._add(entry.term)
            return
        why = entry.lacking or "there is nothing to add: measure that pose again (m asks for it)"
        self.note = (f"{entry.term}: {why}", "warn")
        self.redraw()

    def _add(self, term: str) -> None:
        self.do(f"Adding {term} and fitting again …", lambda bench: bench.add(term))

    def action_remove(self) -> None:
        """Take the chosen term out of the model; the last one when none is chosen."""
        there = [part.term for part in self.desk.parts() if part.there]
        chosen = self.desk.part
        term = chosen.term if chosen is not None else there[-1] if there else ""
        if chosen is not None and not chosen.there:
            self.note = (f"{term} is left out already; enter puts it back", "warn")
            self.redraw()
        if term in there:
            self.do(f"Fitting again without {term} …", lambda bench: bench.remove(term))

    def action_undo(self) -> None:
        """Back to the model before."""
        if self.desk.sight is not None and len(self.desk.sight.ladder) > 1:
            self.do("Back to the model before …", Bench.undo)

    def action_next_poses(self) -> None:
        """The whole verdict, and what to measure next."""
        sight, chosen = self.desk.sight, self.desk.entry
        if self.busy:  # it is about the model before, and what it brings about the one after
            return
        if sight is not None and not self.desk.hidden:
            page = NextScreen(
                "what the data say",
                lambda width: next_rows(sight, width, chosen=chosen, live=self._live),
                "n",
            )
            self.app.push_screen(page, lambda now: self.action_measure() if now else None)

    def action_measure(self) -> None:
        """Lead through exactly the poses that are listed, then come back."""
        sight = self.desk.sight
        if sight is None or self.busy or self.desk.hidden:
            return
        if not self._live or self.sensor == MAGNETOMETER:
            self.note = (_CIRCLES if self._live else _NO_DEVICE, "warn")
            self.redraw()
            return
        self.dismiss(asked_for(to_measure(sight, self.desk.entry)[0]))

    def action_sensor(self) -> None:
        """The next sensor."""
        if self.busy or not self.sensors:
            return
        if len(self.sensors) < 2:
            self.note = (f"Only the {self.sensor} was measured.", "warn")
            self.redraw()
            return
        self.sensor = self.sensors[(self.sensors.index(self.sensor) + 1) % len(self.sensors)]
        self.look()
