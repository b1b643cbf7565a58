"""The steps result and save."""

import math
import time
from contextlib import suppress
from typing import TYPE_CHECKING, ClassVar, cast

from textual import work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.events import Key
from textual.widgets import Static

from imucal_wizard.core.errors import ImucalError
from imucal_wizard.diagnose.grade import Grade
from imucal_wizard.estimate.second_stage.heading import compass_of
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.measurement.requests import MeasurementRequest
from imucal_wizard.tui.panels.preview import interrupted
from imucal_wizard.tui.panels.report import bench_rows, fit_summary, parameter_table, way_on
from imucal_wizard.tui.screens.base import Failed, LiveScreen
from imucal_wizard.tui.screens.bench import BenchScreen
from imucal_wizard.tui.screens.export import ExportScreen
from imucal_wizard.tui.screens.heading import HeadingScreen, no_heading_rows
from imucal_wizard.tui.screens.methods import MethodsScreen
from imucal_wizard.tui.screens.page import PageScreen
from imucal_wizard.tui.state import WizardState
from imucal_wizard.tui.text import Line, line, wrapped
from imucal_wizard.tui.threads import being_left, in_thread
from imucal_wizard.tui.widgets.big_text import BigText
from imucal_wizard.tui.widgets.lines import Lines
from imucal_wizard.tui.widgets.rendered import Rendered

if TYPE_CHECKING:  # the app imports this module while its first screen is shown
    from imucal_wizard.run.snapshot import Snapshot
    from imucal_wizard.tui.app import BaseApp

_DIAGNOSING = "Looking for what the models lack …"


class FitScreen(LiveScreen):
    """A fit on a page that scrolls, with keys for further pages and screens."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("m", "app.mute", "sound", show=False, tooltip="switches the sounds off or on"),
        Binding(
            "f", "bench", "find missing",
            tooltip="opens the bench, which finds what the model lacks",
        ),
        Binding(
            "h", "heading", "north",
            tooltip="shows the live heading before and after calibration",
        ),
        Binding("h", "no_heading", show=False, tooltip="says what the heading needs"),
        Binding("c", "compare", "compare", tooltip="compares all methods side by side"),
        Binding("t", "table", "table", tooltip="shows every parameter with its standard error"),
        Binding("b", "order('back')", "back", tooltip="goes back one step, to measure more"),
    ]  # fmt: skip

    def __init__(self, state: WizardState) -> None:
        super().__init__(state)
        self.problem = ""
        """Why there is no fit, or nothing is saved."""
        self._shown: tuple[object, object] = None, None

    def on_mount(self) -> None:
        """Show the page, which the arrows scroll."""
        super().on_mount()
        if not being_left(self):
            self.query_one(VerticalScroll).focus()
            self.refresh_page()

    def on_screen_resume(self) -> None:
        """Refresh after a screen above, such as the bench, was closed."""
        if self.is_mounted and not being_left(self):
            self.refresh_page()

    def page(self) -> ComposeResult:
        """Rows with the present state, then the fit."""
        with VerticalScroll(classes="page"):
            yield Lines(id="news")
            yield Static(id="fit")

    def refresh_page(self) -> None:
        """Show the newest state."""
        report = self.state.result
        self.lines("news").draw(lambda width, _: self.news(width))
        shown, self._shown = self._shown, (report, self.state.diagnoses)
        if shown[0] is not report or shown[1] is not self.state.diagnoses:
            state = self.state
            parts = None if report is None else fit_summary(report, state.diagnoses, state.grades)
            self.query_one("#fit", Static).update("" if parts is None else Rendered(parts))
        self.refresh_bindings()

    @work(exclusive=True, group="diagnose")
    async def diagnose(self) -> None:
        """Fit and diagnose the models in a thread; not in an exercise that has no bench yet."""
        if self.state.services.exercise and self.state.models.benches is None:
            return
        with suppress(ImucalError):  # the bench shows the reason
            self.state.judged(*await in_thread(self.state.judge))
            self.refresh_page()
            self.verdict_known()

    def verdict_known(self) -> None:
        """Tell the verdict by its sound."""
        good = self.state.good
        if good is not None:
            self.state.sounds.verdict(good=good)

    def news(self, width: int) -> list[Line]:
        """The present state."""
        without = self.state.saved.without if self.state.saved is not None else ()
        rows = bench_rows(self.state.result, width, self.state.models.unsaved, without)
        if self.state.report is not None and not self.state.diagnoses:
            exercise = self.state.services.exercise
            words = "An exercise: find out what the model lacks." if exercise else _DIAGNOSING
            rows.append(line(words, "accent"))
        return rows

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:  # noqa: ARG002 (Textual's signature)
        """Disable keys that need a fit or a calibrated magnetometer."""
        report = self.state.report
        if action in ("bench", "compare", "table", "validate", "save", "export"):
            return report is not None and not (action == "validate" and self.state.ended)
        if action == "leave_it":
            return bool(self.problem)
        found = report is not None and report.magnetic is not None
        return {"heading": found, "no_heading": report is not None and not found}.get(action, True)

    def action_order(self, name: str) -> None:
        """Pass a command to the procedure."""
        self.state.order(name)

    def action_bench(self) -> None:
        """Open the bench, first on a sensor whose model lacks something."""
        state = self.state
        if state.report is not None:
            lacking = (name for name, one in state.diagnoses.items() if not one.settled)
            sensor = state.sensor or next(lacking, "")
            screen = BenchScreen(state.bench, sensor, live=state.live, predict=state.hides_answer)

            def leave(asked: tuple[MeasurementRequest, ...] | None) -> None:
                state.leave_bench(screen.sensor, asked, answered=not screen.selection.hidden)
                if not asked:
                    self.diagnose()

            self.app.push_screen(screen, leave)

    def action_table(self) -> None:
        """Show every parameter with its standard error."""
        report = self.state.result
        if report is not None:
            title = "parameters ± one standard error (? says what they are)"
            page = PageScreen(title, parameter_table(report), "t", about="parameters")
            self.app.push_screen(page)

    def action_export(self) -> None:
        """Show the export targets."""
        self.app.push_screen(ExportScreen(self.state))

    def action_heading(self) -> None:
        """Show the live heading, or why there is none."""
        report = self.state.report
        compass = None if report is None else compass_of(report)
        if report is None or compass is None:
            self.action_no_heading()
        else:
            self.app.push_screen(HeadingScreen(self.state, report, compass, self.step))

    def action_no_heading(self) -> None:
        """Show why there is no heading, and what it needs."""
        report = self.state.report
        if report is not None:
            page = PageScreen("heading", lambda width, _: no_heading_rows(report, width), "h")
            self.app.push_screen(page)

    def action_compare(self) -> None:
        """Show all methods side by side."""
        if self.state.report is not None:
            self.app.push_screen(MethodsScreen(self.state, self.step))


class ResultScreen(FitScreen):
    """Fits in a thread and shows the result; then the validation begins."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("v", "validate", "validate", tooltip="measures a few new orientations"),
        Binding("s", "save", "save", tooltip="saves the calibration at once"),
        Binding("s", "leave_it", "end", tooltip="ends without a calibration"),
        Binding("u", "order('undo')", "undo", show=False),
        Binding("x", "export", "export", tooltip="saves it and writes it for another program"),
    ]
    step = StepKind.RESULT

    def __init__(self, state: WizardState) -> None:
        super().__init__(state)
        self._leaves = False
        """The next step begins by itself if the verdict allows it."""
        self._deadline: float | None = None

    def body(self) -> ComposeResult:
        """The page, and a row about the next step."""
        yield from self.page()
        yield Lines(id="next")

    def on_mount(self) -> None:
        """Fit at once."""
        super().on_mount()
        if self.state.report is None:
            self.fit()

    @work(exclusive=True)
    async def fit(self) -> None:
        """Fit the measurements in a thread."""
        try:
            self.state.fitted(await in_thread(self.state.fit))
        except ImucalError as error:
            self.problem = str(error)
            self.state.sounds.verdict(good=False)
            self.post_message(Failed(error))
        else:
            if self.state.opens_bench():
                self.action_bench()
            else:
                self._leaves = True
                self._go_on()
            self.diagnose()
        self.refresh_page()

    def verdict_known(self) -> None:
        """Go on by itself where every sensor is good."""
        super().verdict_known()
        self._go_on()

    def _go_on(self) -> None:
        """Start the countdown to the next step, once.

        It waits for a verdict where one comes, and does not start if a sensor is not good or the
        bench has added effects: the operator decides then. A run without an operator goes on.
        """
        settings = self.state.settings
        alone = settings.auto or settings.quit_after or self.state.services.exercise
        result = self.state.result
        # effects that an earlier bench has left in the model are for the operator to judge
        plain = result is not None and not any(fit.terms for fit in result.sensors.values())
        if self._leaves and (alone or (self.state.good and plain)):
            self._leaves = False
            self._deadline = time.monotonic() + settings.countdown
            self.set_interval(0.5, self._count_down)

    def on_key(self, _event: Key) -> None:
        """Stop the countdown at any key: it must not follow what the key has ordered."""
        self._leaves, self._deadline = False, None
        self._tell_next()

    def action_order(self, name: str) -> None:
        """Pass a command to the procedure, also one that was clicked."""
        self._leaves, self._deadline = False, None
        super().action_order(name)

    def action_save(self) -> None:
        """Go to the last step."""
        self.action_order("save")

    def action_leave_it(self) -> None:
        """Go to the last step without a fit."""
        self.action_order("save")

    def action_validate(self) -> None:
        """Go to the validation."""
        self.action_order("validate")

    def refresh_page(self) -> None:
        """Show the newest state."""
        super().refresh_page()
        self._tell_next()

    def news(self, width: int) -> list[Line]:
        """Why there is no fit, that the fit is running, or what the bench has added."""
        if self.problem:
            way = "Go back to measure more; nothing is lost."
            if self.state.ended:
                way = "The recording has ended: record again, with these rests."
            return [
                *wrapped(f"▲ {self.problem}", width, "bad", indent="  "),
                line(""),
                *wrapped(way, width),
            ]
        if self.state.report is None:
            status = self.state.snapshot.status if self.state.snapshot else None
            count = f"{status.holds} holds and {status.rotations} rotations" if status else ""
            return [line(""), line(f"Fitting {count} …", "accent")]
        return super().news(width)

    def _count_down(self) -> None:
        if self._deadline is None or self.app.screen is not self:
            return
        if time.monotonic() >= self._deadline and not self._missing:
            self._deadline = None
            self.state.order("save" if self.state.ended else "validate")
        self._tell_next()

    def take(self, snapshot: "Snapshot") -> None:
        """Tell that the device is missing, which the validation needs."""
        super().take(snapshot)
        if snapshot.status.step == self.step:
            self._tell_next()

    @property
    def _missing(self) -> str:
        """Why no samples arrive from a device, or ""."""
        snapshot = self.state.snapshot
        if snapshot is None or self.state.ended or not self.state.live:
            return ""
        return interrupted(snapshot.stream)

    def _tell_next(self) -> None:
        text = self._next()
        self.lines("next").show([line(f" {text}", "bad" if text.startswith("▲") else "accent")])

    def _next(self) -> str:
        """What to do next, or what follows by itself; "" while that is not known."""
        state, ended = self.state, self.state.ended
        if state.report is None:
            return ""
        if self._deadline is not None and not self._missing:
            left = max(0, math.ceil(self._deadline - time.monotonic()))
            what = "saving" if ended else "validation with a few new poses"
            return f"{what} begins by itself in {left} s; any key stops it"
        if state.hides_answer:
            return "f: open the bench"
        if not (state.grades or state.services.exercise):
            return ""  # the page says what is awaited
        if words := way_on(state.grades, ended=ended):
            return words
        if ended or state.validated:
            if state.in_file:
                return "The calibration is saved. q: quit"
            return "The recording has ended. s: save" if ended else "s: save"
        save = "" if state.in_file else "   s: save without validation"
        if self._missing:
            return f"▲ {self._missing}: validation needs the device{save}"
        return f"v: validate with a few new poses{save}"


class SaveScreen(FitScreen):
    """Fits again with the validation and saves."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("s", "save_again", "save", tooltip="saves the model as it is now"),
        Binding("x", "export", "export", tooltip="writes the calibration for another program"),
        Binding("d", "describe", "device", tooltip="names device, place and operator in the file"),
    ]
    step = StepKind.SAVE

    def __init__(self, state: WizardState) -> None:
        super().__init__(state)
        self._writing = 0
        """Files that are being written, or wait for their turn."""

    def body(self) -> ComposeResult:
        """The outcome in large letters, the place, and the result."""
        yield BigText(id="instruction")
        yield from self.page()

    def on_mount(self) -> None:
        """Start saving."""
        super().on_mount()
        self.save()

    @work
    async def save(self) -> None:
        """Fit again with the validation and write the file, in a thread; one after the other."""
        state, app = self.state, cast("BaseApp", self.app)
        self._writing += 1
        self.query_one(BigText).say("SAVING")
        self.refresh_page()
        try:
            with app.unfinished():
                state.fitted(await in_thread(state.fit))
                await app.save_model()
        except ImucalError as error:
            self.problem = str(error)
            self.post_message(Failed(error))
        else:
            self.problem = ""
        self._writing -= 1
        if being_left(self):
            return
        in_part = state.saved is not None and bool(state.saved.without)
        word = ("SAVED", "warn") if in_part else ("SAVED", "good")
        word = ("NOT SAVED", "bad") if self.problem else word
        self.query_one(BigText).say(*word)
        self.refresh_page()
        if self.without_result and state.snapshot is not None:
            self.take(state.snapshot)  # the row of steps; a source that has ended gives no other
        if state.settings.quit_after and not self.problem:
            await self.run_action("app.quit")
        elif state.report is not None:
            self.diagnose()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Enable saving again only for another model, or after a failure."""
        if action in ("export", "describe"):
            return self.state.saved is not None and not self.problem
        if action == "save_again":
            again = (
                bool(self.problem) and self.state.report is not None and not self._nothing_usable
            )
            return self.state.unsaved or again
        return super().check_action(action, parameters)

    @property
    def _nothing_usable(self) -> bool:
        """Whether no sensor has a calibration that is better than none: none is written then."""
        grades = self.state.grades.values()
        return bool(grades) and all(one.grade == Grade.NOT_USABLE for one in grades)

    @property
    def without_result(self) -> bool:
        """Whether there is no fit to save; not while the fit is made."""
        return self.state.report is None and bool(self.problem)

    def action_save_again(self) -> None:
        """Write a new file with the model of the bench."""
        self.save()

    def described(self) -> None:
        """Write the file with another description."""
        self.save()

    def news(self, width: int) -> list[Line]:
        """The place or the error; whether the bench has another model now."""
        saved = self.state.saved
        rows = [line("Writing the calibration …", "accent")]
        if self.problem and not self._writing:
            rows = wrapped(f"▲ not saved: {self.problem}", width, "bad", indent="  ")
            if self._nothing_usable:
                words = way_on(self.state.grades, ended=self.state.ended)
                rows += wrapped(f"▸ {words}", width, "accent", indent="  ")
        elif saved is not None and not self._writing:
            rows = wrapped(f"✓ {saved.path}", width, "good", indent="  ")
            for name in saved.without:
                words = f"▲ The {name} is not in this file: it has no usable calibration."
                rows += wrapped(words, width, "bad", indent="  ")
            device = self.state.services.description.named
            known = (
                f"device: {device}" if device else "no device name; d: give one, for its history"
            )
            rows += wrapped(f"  {known}", width, "quiet", indent="  ")
            if self.state.unsaved:
                words = "▲ The model of the bench differs from this file: s saves it."
                rows += wrapped(words, width, "warn", indent="  ")
            elif words := way_on(self.state.grades, ended=self.state.ended):
                rows += wrapped(f"▸ {words}", width, "accent", indent="  ")
        return [*rows, *super().news(width), line("")]
