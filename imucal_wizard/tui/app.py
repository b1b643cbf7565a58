"""The app: takes snapshots of the source and shows the screen of the present step."""

import _thread
import asyncio
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn, cast

from rich.text import Text
from textual import constants, work
from textual.app import App
from textual.binding import Binding, BindingType
from textual.events import Event, InputEvent
from textual.screen import Screen

from imucal_wizard.core.errors import DataError, ImucalError, PlaceError
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.run.faults import fault_text, write_report
from imucal_wizard.tui.options import FRAMES_PER_SECOND, AppSettings
from imucal_wizard.tui.screens.base import HORIZONTAL, VERTICAL, Failed, LiveScreen, StepOver
from imucal_wizard.tui.screens.source import SourceScreen
from imucal_wizard.tui.services import Saved, Services
from imucal_wizard.tui.sounds import Sounds
from imucal_wizard.tui.sources import SourceChoice
from imucal_wizard.tui.state import BuiltModels, WizardState
from imucal_wizard.tui.threads import in_thread

if TYPE_CHECKING:  # numpy waits until after the first paint
    from textual.driver import Driver

    from imucal_wizard.run.snapshot import Snapshot

HANGUP = getattr(signal, "SIGHUP", 0)
HANGUP_SECONDS = 0.7
"""Seconds in which the app closes everything once its terminal is gone."""
SIGNAL_SECONDS = 5.0
"""The same after another signal: a slow disk may take a while to write the end of the session."""
SIGNALLED = 128
"""Exit status of a process that a signal ended, less the number of the signal."""

_SCREENS: dict[str, str] = {
    StepKind.SETTLE: "steps.SettleScreen",
    StepKind.UP_DOWN: "steps.UpDownScreen",
    StepKind.POSES: "steps.PoseScreen",
    StepKind.VALIDATE: "steps.ValidateScreen",
    StepKind.ROTATIONS: "steps.RotationScreen",
    StepKind.MORE: "steps.MoreScreen",
    StepKind.FIELD: "field.FieldScreen",
    StepKind.RESULT: "result.ResultScreen",
    StepKind.SAVE: "result.SaveScreen",
    StepKind.RECHECK: "steps.RecheckScreen",
    StepKind.VERDICT: "verdict.VerdictScreen",
}
"""Screen of each step but the first; imported while the first one is shown."""


class BaseApp(App[Saved]):
    """Style and sizes of the screens, the way out, report of an unexpected fault.

    It returns the saved calibration, or None. A model that is in no file is not given up without a
    question, and what is being written is written before the app ends.
    """

    CSS_PATH = "wizard.tcss"
    HORIZONTAL_BREAKPOINTS = HORIZONTAL
    VERTICAL_BREAKPOINTS = VERTICAL
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+q,ctrl+c", "quit", "quit", show=False, priority=True),
        Binding("ctrl+z", "suspend_process", show=False, priority=True),
    ]

    def __init__(self) -> None:
        super().__init__()
        self._unfinished = 0
        self._writing = asyncio.Lock()
        self.models = BuiltModels()
        """The models of the bench."""
        self.attended = True
        """Somebody answers questions."""
        self.unkept: PlaceError | None = None
        """Why a calibration or session could not be written, and where there is room."""
        self.ended_by = 0
        """Number of the signal that ended the app, or 0."""

    def get_driver_class(self) -> "type[Driver]":
        """The driver that leaves the terminal as it was, where there is one for this system."""
        if sys.platform == "win32" or constants.DRIVER is not None:
            return super().get_driver_class()
        from imucal_wizard.tui.driver import TerminalDriver

        return TerminalDriver

    async def on_event(self, event: Event) -> None:
        """Drop a key that arrives once the screens are gone: the app is ending."""
        if self.screen_stack or not isinstance(event, InputEvent):
            await super().on_event(event)

    def action_suspend_process(self) -> None:
        """Stop the whole job, as Ctrl-Z does where the terminal handles it."""
        if isinstance(self._driver, self.driver_class) and self._driver.can_suspend:
            os.killpg(os.getpgrp(), signal.SIGTSTP)

    def end(self, signal_number: int) -> None:
        """Leave without a question because of a signal, and at once if that takes too long."""
        if self._loop is None:
            self.end_at_once(signal_number)
        if not self.ended_by:
            self.ended_by = signal_number
            self._loop.call_soon_threadsafe(self.leave)

        def watch() -> None:
            try:
                self.release()  # whatever keeps the app from leaving, port and session are closed
            finally:  # also after a fault
                time.sleep(HANGUP_SECONDS if signal_number == HANGUP else SIGNAL_SECONDS)
                self.end_at_once(signal_number)

        _thread.start_new_thread(watch, ())  # a Thread takes a lock that may be interrupted here

    def release(self) -> None:
        """Close what the app has open; called in any thread."""

    def end_at_once(self, signal_number: int) -> NoReturn:
        """Give the terminal back, close the session and end the process."""
        from imucal_wizard.run.journal import close_journals  # imported when it is needed

        leave = getattr(self._driver, "leave_at_once", None)
        if leave is not None:
            leave()
        close_journals()  # of a source that is still being opened, too
        os._exit(SIGNALLED + signal_number)

    def unsaved_model(self) -> str:
        """The models that were built and are in no file, in words; "" if there are none."""
        return self.models.unsaved

    def write_model(self, place: Path | None) -> Saved:
        """Write the present models to a file. Slow: called in a thread.

        Args:
            place: the file; None for the usual one.

        Raises:
            ImucalError: it cannot be written.
        """
        raise NotImplementedError

    def wrote(self, saved: Saved) -> None:
        """Note that the models are in a file."""
        self.unkept = None
        self.models.saved(saved.path)

    def leave(self) -> None:
        """End the app without a question."""
        raise NotImplementedError

    @contextmanager
    def unfinished(self) -> Iterator[None]:
        """While a model is fitted or written: leaving waits until it is done."""
        done = False
        self._unfinished += 1
        try:
            yield
            done = True
        finally:
            self._unfinished -= 1
            self._finish_waiting(done=done)

    def _finish_waiting(self, *, done: bool) -> None:
        """Leave as asked; after a failure stay, where its reason is shown."""
        from imucal_wizard.tui.screens.dialogs import WaitDialog

        above = self.screen_stack[-1] if self.is_running and self.screen_stack else None
        if isinstance(above, WaitDialog) and not self._unfinished:
            above.dismiss("again" if done else "")

    async def save_model(self) -> Saved:
        """Write the present models to a file, in a worker; ask for another place if need be.

        Raises:
            ImucalError: it cannot be written, and no other place was given.
        """
        async with self._writing:  # a second key waits for the first file
            place: Path | None = None
            while True:
                try:
                    with self.unfinished():
                        saved = await asyncio.to_thread(self.write_model, place)
                        self.wrote(saved)
                except PlaceError as error:
                    place = await self.ask_place("save the calibration", error, "does not save it")
                    if place is None:
                        self.unkept = error
                        raise
                else:
                    return saved

    async def ask_place(self, title: str, error: ImucalError, otherwise: str) -> Path | None:
        """A place that the operator gives for what could not be written, or None.

        Args:
            title: what is to be written.
            error: why it could not be written.
            otherwise: what happens without a place.
        """
        from imucal_wizard.tui.screens.dialogs import PlaceDialog

        if not self.attended:
            return None
        problem, other = str(error), getattr(error, "other", None)
        while typed := await self.push_screen_wait(PlaceDialog(title, problem, other, otherwise)):
            other = Path(typed).expanduser()
            if not other.exists():
                return other
            problem = f"{other} exists already; give another name"
        return None

    async def action_quit(self) -> None:
        """Leave; wait for a model that is being written, ask about one that is in no file."""
        self.ask_to_leave()

    def ask_to_leave(self, problem: str = "") -> None:
        """Leave once every model is in a file or given up.

        Args:
            problem: why the model could not be saved, or "".
        """
        from imucal_wizard.tui.screens.dialogs import LeaveDialog, PlaceDialog, WaitDialog

        if isinstance(self.screen, LeaveDialog | WaitDialog | PlaceDialog):
            return
        if self._unfinished:
            self.push_screen(WaitDialog(), self._answered)
        elif model := self.unsaved_model():
            self.push_screen(LeaveDialog(model, problem), self._answered)
        else:
            self.leave()

    def _answered(self, answer: str | None) -> None:
        """Carry out the answer to a question about leaving."""
        if answer == "give up":
            self.models.give_up()
            self.leave()
        elif answer == "leave":
            self.leave()
        elif answer == "save":
            self._save_and_leave()
        elif answer == "again":
            self.ask_to_leave()

    @work
    async def _save_and_leave(self) -> None:
        try:
            await self.save_model()
        except ImucalError as error:
            self.ask_to_leave(str(error))
        else:
            self.leave()

    def action_explain(self, about: str = "") -> None:
        """Show help for the present screen: a text and its keys."""
        from imucal_wizard.tui.screens.help import HelpScreen

        self.push_screen(HelpScreen(about, self.screen))

    def _fatal_error(self) -> None:
        """Write the report of an unexpected fault to a file, and one line for the user.

        Textual calls this; its own method would print the traceback with all values in it.
        """
        self.release()  # port and session first
        error = self._exception or sys.exception() or RuntimeError("unknown")
        error = getattr(error, "error", error)  # a worker's failure wraps what was raised in it
        self.panic(Text(fault_text(error, write_report(error))))


class WizardApp(BaseApp):
    """The wizard.

    Args:
        services: the functions below the app.
        settings: behaviour of the app.
        choice: the source to open, or None if the operator chooses.
    """

    TITLE = "imucal-wizard"

    def __init__(
        self,
        services: Services,
        settings: AppSettings | None = None,
        choice: SourceChoice | None = None,
    ) -> None:
        super().__init__()
        settings = settings or AppSettings()
        self.attended = not settings.quit_after
        sounds = Sounds(self.bell, self.set_timer, time.monotonic, muted=settings.muted)
        self.state = WizardState(services, settings, choice, sounds)
        self.models = self.state.models
        self._shown: tuple[object, int] = (None, -1)
        self._ended_in: tuple[object, str] = (None, "")
        self._loaded = asyncio.Event()
        self._switching = asyncio.Lock()
        self._disk_lost = False

    def on_mount(self) -> None:
        """Begin to take snapshots."""
        self.set_interval(1.0 / FRAMES_PER_SECOND, self._tick)

    def on_unmount(self) -> None:
        """Stop the source's thread."""
        self.release()

    def on_failed(self, message: Failed) -> None:
        """End an unattended run with the reason; an attended one shows it."""
        if message.always or self.state.settings.quit_after:
            self.state.fail(message.error)
            self.leave()

    def leave(self) -> None:
        """End the app; everything measured is on disk already."""
        self.release()
        self.exit(self.state.saved)

    def release(self) -> None:
        """Close port and session."""
        self.state.drop()

    def unsaved_model(self) -> str:
        """What the bench has added and no file has, or a calibration that could not be written."""
        return super().unsaved_model() or ("the calibration" if self.unkept else "")

    def write_model(self, place: Path | None) -> Saved:
        """Write the calibration with the bench's effects."""
        return self.state.save(place)

    def wrote(self, saved: Saved) -> None:
        """Note the file."""
        super().wrote(saved)
        self.state.wrote(saved)

    def action_explain(self, about: str = "") -> None:
        """Show help for the step, also from a dialog above it."""
        below = self._step_screen()
        super().action_explain(about or (below.step if below is not None else ""))

    def action_mute(self) -> None:
        """Switch the sounds off or on."""
        self.state.sounds.muted = not self.state.sounds.muted
        self._shown = (None, -1)

    def get_default_screen(self) -> Screen[Any]:
        """The first step; no empty screen is painted before it."""
        return SourceScreen(self.state)

    @work
    async def on_step_over(self, message: StepOver) -> None:
        """Show the screen of the step that the procedure has entered."""
        await self._loaded.wait()
        async with self._switching:
            if self._disk_lost:
                return
            self.state.enter(message.step)
            screen = screen_for(message.step, self.state)
            if len(self.screen_stack) == 1:  # Textual cannot replace the default screen
                await self.push_screen(screen)
            else:
                await self.switch_screen(screen)

    @work
    async def on_source_screen_seen(self) -> None:
        """Import the other screens, and NumPy with them, while the first one is shown."""
        if not self._loaded.is_set():
            for step in _SCREENS:
                await asyncio.to_thread(_class_of, step)
            self._loaded.set()
            self.state.services.loaded()

    def _tick(self) -> None:
        """Take a snapshot; show it if it is new."""
        if self.state.source is None or not self.is_running or not self.screen_stack:
            return  # the app is closing: a screen's widgets are removed before the screen
        snapshot = self.state.source.snapshot()
        screen = self.screen
        self._uncover(snapshot)
        if self._shown == (screen, snapshot.serial) or not screen.is_mounted:
            return
        self.state.take(snapshot)
        if snapshot.finished:
            self._end(snapshot)
        if isinstance(screen, LiveScreen):
            self._shown = (screen, snapshot.serial)
            screen.take(snapshot)

    def _uncover(self, snapshot: "Snapshot") -> None:
        """Close help and dialogs of a step that is over."""
        below = self._step_screen()
        over = below is not None and below.step != snapshot.status.step
        if over and getattr(self.screen, "goes_with_step", False):
            self.screen.dismiss(None)

    def _step_screen(self) -> LiveScreen | None:
        """The screen of the step, which may lie below a dialog."""
        screens = reversed(self.screen_stack)
        return next((one for one in screens if isinstance(one, LiveScreen)), None)

    def _end(self, snapshot: "Snapshot") -> None:
        """Tell the procedure once per source and step that the recording has ended."""
        ended_in = self.state.source, str(snapshot.status.step)
        if ended_in == self._ended_in:
            return
        self._ended_in = ended_in
        if snapshot.stream.unwritten:
            self._disk_failed(snapshot.stream.problem)
        elif self.state.live and snapshot.stream.problem:  # its thread has ended
            self.post_message(Failed(DataError(snapshot.stream.problem)))
        elif snapshot.stream.samples:
            self.state.order("end")
        else:
            error = DataError("nothing could be read before the recording ended")
            self.post_message(Failed(error))

    @work
    async def _disk_failed(self, cause: str) -> None:
        """Write the whole session to another place, fit what there is, and leave."""
        state = self.state
        async with self._switching:
            self._disk_lost = True  # no step follows, whose screen would replace the question
        self.unkept = PlaceError(cause, state.services.session_elsewhere())
        error: ImucalError = self.unkept
        state.sounds.verdict(good=False)
        place = getattr(error, "other", None)
        while True:
            if self.attended:
                kept = "leaves; what was confirmed is in the session file"
                place = await self.ask_place("continue the session elsewhere", error, kept)
            if place is None:
                break
            try:
                await asyncio.to_thread(state.rescue, place)
                break
            except ImucalError as next_error:
                error, place = next_error, None
        with suppress(ImucalError):  # too little was measured for a calibration
            state.fitted(await in_thread(state.fit))
        self.leave()


def _class_of(step: str) -> type[LiveScreen]:
    module, name = _SCREENS[step].split(".")
    found = getattr(import_module(f"imucal_wizard.tui.screens.{module}"), name)
    return cast("type[LiveScreen]", found)


def screen_for(step: str, state: WizardState) -> LiveScreen:
    """The screen of a step of the procedure."""
    return _class_of(step)(state) if step in _SCREENS else SourceScreen(state)
