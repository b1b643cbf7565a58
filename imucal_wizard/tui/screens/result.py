"""The last steps: the result with what was found and how good it is; the saved calibration."""

import asyncio
import math
import time
from contextlib import suppress
from typing import ClassVar

from textual import work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.events import Key
from textual.widgets import Static

from imucal_wizard.core.errors import ImucalError
from imucal_wizard.estimate.second_stage.heading import compass_of
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.tui.panels.report import bench_rows, fit_summary, parameter_table
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

_DIAGNOSING = "Looking for what the models lack …"


class FitScreen(LiveScreen):
    """A fit on a page that scrolls; the pages and screens above it, each by one key."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("m", "app.mute", "sound", show=False, tooltip="switches the sounds off or on"),
        Binding(
            "f", "bench", "find missing",
            tooltip="opens the bench: what the model does not explain, and which effect would",
        ),
        Binding(
            "h", "heading", "north",
            tooltip="shows north: the heading, live, before and after calibration",
        ),
        Binding("h", "no_heading", show=False, tooltip="says what it takes to show north"),
        Binding("c", "compare", "compare", tooltip="compares all methods side by side"),
        Binding("t", "table", "table", tooltip="shows every parameter with its standard error"),
        Binding("b", "order('back')", "back", tooltip="goes back one step, to measure more"),
    ]  # fmt: skip

    def __init__(self, state: WizardState) -> None:
        super().__init__(state)
        self.problem = ""
        """Why there is no fit, or nothing is saved."""

    def on_mount(self) -> None:
        """Show the page; the arrows scroll it."""
        super().on_mount()
        self.query_one(VerticalScroll).focus()
        self.refresh_page()

    def on_screen_resume(self) -> None:
        """Back from above, perhaps with another model of the bench."""
        if self.is_mounted and not being_left(self):
            self.refresh_page()

    def page(self) -> ComposeResult:
        """Rows that say how it stands, then the fit."""
        with VerticalScroll(classes="page"):
            yield Lines(id="news")
            yield Static(id="fit")

    def refresh_page(self) -> None:
        """Show the newest state."""
        report = self.state.report
        self.lines("news").draw(lambda width, _: self.news(width))
        self.query_one("#fit", Static).update(
            "" if report is None else fit_summary(report, self.state.diagnoses)
        )
        self.refresh_bindings()

    @work(exclusive=True, group="diagnose")
    async def diagnose(self) -> None:
        """Find out what the models lack, in a thread; the errors are shown meanwhile.

        In an exercise nothing is told: the verdict would name what is to be found.
        """
        if self.state.settings.predict:
            return
        with suppress(ImucalError):  # the bench says why, where somebody asks for it
            self.state.diagnosed(await in_thread(self.state.diagnose))
            self.refresh_page()

    def news(self, width: int) -> list[Line]:
        """How it stands."""
        rows = bench_rows(self.state.benches, width)
        if self.state.report is not None and not self.state.diagnoses:
            exercise = self.state.settings.predict
            words = "What is missing is yours to find." if exercise else _DIAGNOSING
            rows.append(line(words, "accent"))
        return rows

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:  # noqa: ARG002 (Textual's signature)
        """Without a fit there is nothing to look into, and no north without a magnetometer."""
        report = self.state.report
        if action in ("bench", "compare", "table", "validate", "save"):
            return report is not None
        if action == "leave_it":
            return bool(self.problem)
        found = report is not None and report.magnetic is not None
        return {"heading": found, "no_heading": report is not None and not found}.get(action, True)

    def action_order(self, name: str) -> None:
        """Hand a command to the procedure."""
        self.state.order(name)

    def action_bench(self) -> None:
        """Open the bench on what was fitted."""
        state = self.state
        if state.report is not None:
            predict = state.settings.predict and not state.sensor
            screen = BenchScreen(state.bench, state.sensor, live=state.live, predict=predict)
            self.app.push_screen(screen, lambda asked: state.leave_bench(screen.sensor, asked))

    def action_table(self) -> None:
        """Every parameter with its standard error."""
        report = self.state.report
        if report is not None:
            title = "parameters ± one standard error (? says what they are)"
            page = PageScreen(title, parameter_table(report), "t", about="parameters")
            self.app.push_screen(page)

    def action_heading(self) -> None:
        """The heading by the device as it lies now; or why there is none."""
        report = self.state.report
        compass = None if report is None else compass_of(report)
        if report is None or compass is None:
            self.action_no_heading()
        else:
            self.app.push_screen(HeadingScreen(self.state, report, compass, self.step))

    def action_no_heading(self) -> None:
        """Why there is no heading, and what it takes."""
        report = self.state.report
        if report is not None:
            page = PageScreen("heading", lambda width, _: no_heading_rows(report, width), "h")
            self.app.push_screen(page)

    def action_compare(self) -> None:
        """Both papers' methods and our own on what was measured."""
        if self.state.report is not None:
            self.app.push_screen(MethodsScreen(self.state, self.step))


class ResultScreen(FitScreen):
    """Fits in a thread, shows the report; validation follows by a key or by itself."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("v", "validate", "validate", tooltip="measures a few new orientations"),
        Binding("s", "save", "save", tooltip="saves the calibration at once"),
        Binding("s", "leave_it", "leave it at that", tooltip="ends without a calibration"),
        Binding("u", "order('undo')", "undo", show=False),
    ]
    step = StepKind.RESULT

    def __init__(self, state: WizardState) -> None:
        super().__init__(state)
        self._deadline: float | None = None

    def body(self) -> ComposeResult:
        """The page, and a row that says what happens next."""
        yield from self.page()
        yield Lines(id="next")

    def on_mount(self) -> None:
        """Fit at once."""
        super().on_mount()
        if self.state.report is None:
            self.fit()

    @work(exclusive=True)
    async def fit(self) -> None:
        """Fit what was collected, in a thread."""
        try:
            self.state.fitted(await in_thread(self.state.fit))
        except ImucalError as error:
            self.problem = str(error)
            self.post_message(Failed(error))
        else:
            self._go_on()
            self.diagnose()
        self.refresh_page()

    def _go_on(self) -> None:
        """Fitted: back to the bench that has asked for more, or on by itself in a while."""
        if self.state.opens_bench():
            self.action_bench()
            return
        self._deadline = time.monotonic() + self.state.settings.countdown
        self.set_interval(0.5, self._count_down)

    def on_key(self, event: Key) -> None:
        """Any key stops the countdown."""
        if event.key not in ("v", "s"):
            self._deadline = None
            self._tell_next()

    def action_save(self) -> None:
        """On to the last step."""
        self.state.order("save")

    def action_leave_it(self) -> None:
        """On to the last step without a fit."""
        self.state.order("save")

    def action_validate(self) -> None:
        """On to a few new orientations."""
        self.state.order("validate")

    def refresh_page(self) -> None:
        """Show the newest state."""
        super().refresh_page()
        self._tell_next()

    def news(self, width: int) -> list[Line]:
        """Why there is no fit, that one is under way, or what the bench has added."""
        if self.problem:
            way = "Go back to measure more; nothing is lost."
            if self.state.ended:
                way = "The recording has ended: make another one, with these rests in it."
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
        if time.monotonic() >= self._deadline:
            self._deadline = None
            self.state.order("save" if self.state.ended else "validate")
        self._tell_next()

    def _tell_next(self) -> None:
        text, ended = "", self.state.ended
        if self._deadline is not None:
            left = max(0, math.ceil(self._deadline - time.monotonic()))
            what = "saving" if ended else "validation with a few new poses"
            text = f"{what} begins by itself in {left} s; any key stops that"
        elif self.state.report is not None:
            text = "v: a few new poses that the fit has not seen   s: save without"
            text = "s: save; the recording has ended" if ended else text
        self.lines("next").show([line(f" {text}", "accent")])


class SaveScreen(FitScreen):
    """Fits again with the validation, saves, says where."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("s", "save_again", "save the new model", tooltip="saves the model of the bench"),
        Binding("x", "export", "export", tooltip="writes the calibration for another program"),
        Binding("enter", "app.quit", "leave", show=False),
    ]
    step = StepKind.SAVE

    def __init__(self, state: WizardState) -> None:
        super().__init__(state)
        self._models: dict[str, tuple[str, ...]] = {}

    def body(self) -> ComposeResult:
        """A word that is read from afar, the place, and the result once more."""
        yield BigText(id="instruction")
        yield from self.page()

    def on_mount(self) -> None:
        """Save at once."""
        super().on_mount()
        self.save()

    @work(exclusive=True)
    async def save(self) -> None:
        """Fit once more, so that the validation is in it, and write the file, in a thread."""
        state = self.state
        try:
            state.fitted(await in_thread(state.fit))
            state.wrote(await asyncio.to_thread(state.save))  # a quit waits for it
        except ImucalError as error:
            self.problem = str(error)
            self.post_message(Failed(error))
        else:
            self.problem, self._models = "", state.found()
        if being_left(self):
            return
        word = ("NOT SAVED", "bad") if self.problem else ("SAVED", "good")
        self.query_one(BigText).say(*word)
        self.refresh_page()
        if state.settings.quit_after and not self.problem:
            await self.run_action("app.quit")
        elif state.report is not None:
            self.diagnose()

    @property
    def _changed(self) -> bool:
        """The bench has another model than the file."""
        return self.state.saved is not None and self.state.found() != self._models

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Only another model is worth another file."""
        if action == "export":
            return self.state.saved is not None and not self.problem
        return self._changed if action == "save_again" else super().check_action(action, parameters)

    def action_export(self) -> None:
        """Write the calibration for another program."""
        self.app.push_screen(ExportScreen(self.state))

    def action_save_again(self) -> None:
        """Write a file with the model of the bench."""
        self.save()

    def news(self, width: int) -> list[Line]:
        """Where it is saved, or why it is not; whether the bench has another model now."""
        rows = [line("Writing the calibration …", "accent")]
        if self.problem:
            rows = wrapped(f"▲ not saved: {self.problem}", width, "bad", indent="  ")
        elif self.state.saved is not None:
            rows = wrapped(f"✓ {self.state.saved.path}", width, "good", indent="  ")
            if self._changed:
                words = "▲ The bench has another model now than this file: s saves that."
                rows += wrapped(words, width, "warn", indent="  ")
        return [*rows, *super().news(width), line("")]
