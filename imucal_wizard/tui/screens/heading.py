"""The live heading before and after calibration, side by side."""

import math
from typing import ClassVar

import numpy as np
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical

from imucal_wizard.core.notices import NoticeKind
from imucal_wizard.core.quantities import listed, number, true_minus, unit_sign
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.estimate.second_stage.heading import Compass
from imucal_wizard.estimate.second_stage.live_heading import LiveHeading, live_heading
from imucal_wizard.report.text import heading_summary
from imucal_wizard.run.snapshot import Snapshot
from imucal_wizard.tui.drawing import rose
from imucal_wizard.tui.screens.base import LiveScreen
from imucal_wizard.tui.state import WizardState
from imucal_wizard.tui.text import Line, Span, line, wrapped
from imucal_wizard.tui.widgets.big_text import BigText
from imucal_wizard.tui.widgets.lines import Build, Lines

_TAKES = (
    "It needs the circles of the step Field, and still positions while the magnetometer records, "
    "so that the dip of the field aligns both sensors."
)


class HeadingScreen(LiveScreen):
    """Lies above the result; it follows the device.

    Args:
        state: the wizard's state.
        report: the fit.
        compass: of this fit.
        step: the step of the screen below.
    """

    CSS_PATH = "heading.tcss"
    above = True
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("m", "app.mute", "sound", show=False, tooltip="switches the sounds off or on"),
        Binding("question_mark", "app.explain('heading')", "help", tooltip="explains this screen"),
        Binding(
            "h,escape,enter,b", "close", "back to the result", tooltip="goes back to the result"
        ),
    ]  # fmt: skip

    def __init__(self, state: WizardState, report: FitReport, compass: Compass, step: str) -> None:
        super().__init__(state)
        self.step = step
        self._report = report
        self._compass = compass
        self._left_out = effects_of(state.result, "accelerometer", "magnetometer")
        self._of_field = effects_of(state.result, "magnetometer")
        self._readings: object = None
        self._course: LiveHeading | None = None

    def body(self) -> ComposeResult:
        """Two compass cards with large numbers, and their accuracy."""
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
            self._course = None
            if stream.accelerometer is not None and stream.magnetometer is not None:
                self._course = live_heading(
                    self._report, self._compass, stream.accelerometer, stream.magnetometer
                )
        self._show(snapshot)

    def _show(self, snapshot: Snapshot) -> None:
        now = self._course
        before, after = (math.nan, math.nan) if now is None else (now.before, now.after)
        for name, value in (("before", before), ("after", after)):
            seen = value if math.isfinite(value) else None
            self.lines(f"rose-{name}").draw(_card(seen), seen)
            self.query_one(f"#heading-{name}", BigText).say(large(value))
        self.lines("course").draw(
            lambda width, _: [
                *_stale(snapshot, width - 2),
                *course_rows(now, self._report, width - 2, self._left_out, self._of_field),
            ]
        )  # fmt: skip


def _card(heading: float | None) -> Build:
    """Rows of a compass card for any size."""
    return lambda width, height: [line(row) for row in rose(heading, width, height)]


def _stale(snapshot: Snapshot, width: int) -> list[Line]:
    """Why the readings are no longer live; empty if they are."""
    if snapshot.finished:
        return [line("The recording has ended: this is its last reading.", "quiet")]
    problem = snapshot.stream.problem
    return wrapped(f"▲ {problem}", width, "bad", indent="  ") if problem else []


def large(degrees: float) -> str:
    """The text of a heading in large letters."""
    return f"{degrees % 360.0:.1f}°" if math.isfinite(degrees) else "–"


def effects_of(result: FitReport | None, *sensors: str) -> str:
    """The effects in the models of some sensors, in words; "" for none."""
    fits = {} if result is None else result.sensors
    known = [fits[name] for name in sensors if name in fits]
    names = list(dict.fromkeys(term.name for fit in known for term in fit.terms))
    return listed(names) if names else ""


def course_rows(
    now: LiveHeading | None, report: FitReport, width: int, left_out: str = "", of_field: str = ""
) -> list[Line]:
    """The heading with its error; whether field and dip are those of the calibration.

    Args:
        now: the heading.
        report: the fit that makes it.
        width: columns there are.
        left_out: effects of the model that the heading is not corrected for, in words.
        of_field: those of the magnetometer, which change the size of the field.
    """
    if now is None:
        return [line("no reading of the magnetometer yet", "quiet")]
    rows = [_after(now), _change(now), _field(now, report, of_field), _dip(now, left_out)]
    if left_out:
        words = f"▲ This heading is not corrected for {left_out}."
        rows = [*wrapped(words, width, "warn", indent="  "), *rows]
    if report.second_stage is None:
        return rows
    change, left = np.degrees(heading_summary(report.second_stage.headings))
    if math.isfinite(change):
        says = f"In the holds the heading changes by {change:.1f}° rms; "
        rows += wrapped(f"{says}the error left is {left:.2f}°.", width, "quiet")
    return rows


def no_heading_rows(report: FitReport, width: int) -> list[Line]:
    """Why there is no heading, and what it needs."""
    if report.magnetic is None:
        rows = wrapped("There is no heading without a calibrated magnetometer.", width, "warn")
    else:
        rows = wrapped("The magnetometer is not aligned with the device yet.", width, "warn")
    kinds = NoticeKind.NOT_CALIBRATED, NoticeKind.NOT_ALIGNED
    for text in report.warned("magnetometer", *kinds):
        rows += wrapped(f"▲ {text}", width, "", indent="  ")
    return [*rows, line(""), *wrapped(_TAKES, width)]


def _after(now: LiveHeading) -> Line:
    """The heading with the calibration's uncertainty, and the noise of one reading."""
    if not math.isfinite(now.after):
        return (("▲ no heading: x is upright. Lay it flatter", "warn"),)
    adds = "" if now.noise is None else f"; noise of one reading ±{now.noise:.1f}°"
    error = f", ±{now.error:.2f}° from the calibration{adds}"
    return ("after ", "quiet"), (f"{now.after:.1f}°", "good"), (error, "quiet")


def _change(now: LiveHeading) -> Line:
    turns = true_minus(f"the heading changes by {now.change:+.1f}°; ")
    rise, where = round(abs(now.rise)), "above" if now.rise >= 0 else "below"
    lies = f"{rise}° {where} the horizon" if rise else "level"
    return (turns if math.isfinite(now.change) else "", "strong"), (
        f"the x axis is {lies}",
        "quiet",
    )


def _field(now: LiveHeading, report: FitReport, effects: str) -> Line:
    if report.magnetic is None or now.size_then is None:
        return ()
    unit = unit_sign(report.magnetic.fit.unit)
    text = f"field {number(now.size)} {unit}, {number(now.size_then)} when calibrated "
    return (text, ""), _trust(
        now.same_field, _or_else(effects, "iron is near it, or another place")
    )


def _dip(now: LiveHeading, effects: str) -> Line:
    if now.dip_then is None:
        return ()
    text = true_minus(f"dip {now.dip:.1f}°, {now.dip_then:.1f}° when calibrated ")
    return (text, ""), _trust(
        now.same_dip, _or_else(effects, "it is being moved, or iron is near it")
    )


def _or_else(effects: str, otherwise: str) -> str:
    return f"{effects}; else {otherwise}" if effects else otherwise


def _trust(same: bool, otherwise: str) -> Span:
    return ("✓", "good") if same else (f"▲ {otherwise}", "warn")
