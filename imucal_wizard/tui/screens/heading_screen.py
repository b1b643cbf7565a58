"""The heading, live: before and after calibration side by side."""

import math
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical

from imucal_wizard.fitting.compass import Compass
from imucal_wizard.live.snapshot import Snapshot
from imucal_wizard.solver.result import FitReport
from imucal_wizard.tui.heading_rows import Course, course, course_rows, large
from imucal_wizard.tui.rose import rose
from imucal_wizard.tui.screens.live_screen import LiveScreen
from imucal_wizard.tui.text import Line, line, wrapped
from imucal_wizard.tui.widgets.big_text import BigText
from imucal_wizard.tui.widgets.key_footer import Keys
from imucal_wizard.tui.widgets.lines import Lines


class HeadingScreen(LiveScreen):
    """Above the result; it follows the device as it is turned.

    Args:
        report: the fit.
        compass: made of it.
        step: the step of the machine below.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("question_mark", "app.explain('heading')", "help"),
        Binding("escape,enter,h,b", "close", "back"),
    ]
    keys: ClassVar[Keys] = (("h", "back to the result"), ("?", "help"), ("q", "quit"))

    def __init__(self, report: FitReport, compass: Compass, step: str) -> None:
        super().__init__()
        self.step = step
        self._report = report
        self._compass = compass
        self._readings: object = None
        self._course: Course | None = None

    def body(self) -> ComposeResult:
        """Two cards with numbers to be read from afar, and what they are worth."""
        with Horizontal(id="headings"):
            for name in ("before", "after"):
                with Vertical(classes="heading") as half:
                    half.border_title = f"{name} calibration"
                    yield Lines(id=f"rose-{name}", classes="rose")
                    yield BigText(id=f"heading-{name}")
        yield Lines(id="course")

    def take(self, snapshot: Snapshot) -> None:
        """Show the newest readings."""
        super().take(snapshot)
        stream = snapshot.stream
        readings = stream.accelerometer, stream.magnetometer
        if readings != self._readings:
            self._readings = readings
            self._course = course(self._compass, stream)
        self._show(snapshot)

    def _show(self, snapshot: Snapshot) -> None:
        now = self._course
        values = (math.nan, math.nan) if now is None else (now.before, now.after)
        for name, value in zip(("before", "after"), values, strict=True):
            place = self.query_one(f"#rose-{name}", Lines)
            width, height = place.size
            if width and height:
                seen = value if math.isfinite(value) else None
                place.show([line(row) for row in rose(seen, width, height)])
            self.query_one(f"#heading-{name}", BigText).say(large(value))
        place = self.query_one("#course", Lines)
        width = (place.size.width or 78) - 2
        place.show([*_stale(snapshot, width), *course_rows(now, self._report, width)])

    def action_close(self) -> None:
        """Back to what is below."""
        self.end(self.step)


def _stale(snapshot: Snapshot, width: int) -> list[Line]:
    """Why the readings are no news any more; or nothing."""
    if snapshot.finished:
        return [line("The recording has ended: this is its last reading.", "quiet")]
    problem = snapshot.stream.problem
    return wrapped(f"▲ {problem}", width, "bad", indent="  ") if problem else []
