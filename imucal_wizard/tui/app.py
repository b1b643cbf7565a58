"""The app: takes snapshots of the source and shows the screen of the present step."""

import asyncio
import sys
import time
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar, cast

from rich.text import Text
from textual import work
from textual.app import App
from textual.binding import Binding, BindingType
from textual.screen import Screen

from imucal_wizard.core.errors import DataError
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.run.faults import fault_text, write_traceback
from imucal_wizard.tui.options import FRAMES_PER_SECOND, AppSettings
from imucal_wizard.tui.screens.base import HORIZONTAL, VERTICAL, Failed, LiveScreen, StepOver
from imucal_wizard.tui.screens.source import SourceScreen
from imucal_wizard.tui.services import Saved, Services
from imucal_wizard.tui.sounds import Sounds
from imucal_wizard.tui.sources import SourceChoice
from imucal_wizard.tui.state import WizardState

if TYPE_CHECKING:  # numpy waits until after the first paint
    from imucal_wizard.run.snapshot import Snapshot

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
}
"""Screen of each step but the first; imported while the first one is shown."""
Result = TypeVar("Result")


class BaseApp(App[Result], Generic[Result]):
    """Style and sizes of the screens, keys to quit, report of an unexpected fault."""

    CSS_PATH = "wizard.tcss"
    HORIZONTAL_BREAKPOINTS = HORIZONTAL
    VERTICAL_BREAKPOINTS = VERTICAL
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+q,ctrl+c", "quit", "quit", show=False, priority=True),
    ]

    def action_explain(self, about: str = "") -> None:
        """Show help for the present screen: a text and its keys."""
        from imucal_wizard.tui.screens.help import HelpScreen

        self.push_screen(HelpScreen(about, self.screen))

    def _fatal_error(self) -> None:
        """Write the traceback of an unexpected fault to a file, and one line for the user.

        Textual calls this; its own method would print the traceback with all values in it.
        """
        error = self._exception or sys.exception() or RuntimeError("unknown")
        error = getattr(error, "error", error)  # a worker's failure wraps what was raised in it
        self.panic(Text(fault_text(error, write_traceback(error))))


class WizardApp(BaseApp[Saved]):
    """The wizard. It returns the saved calibration's place, or None.

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
        sounds = Sounds(self.bell, self.set_timer, time.monotonic, muted=settings.muted)
        self.state = WizardState(services, settings, choice, sounds)
        self._shown: tuple[object, int] = (None, -1)
        self._ended_in = ""
        self._loaded = asyncio.Event()

    def on_mount(self) -> None:
        """Begin to take snapshots."""
        self.set_interval(1.0 / FRAMES_PER_SECOND, self._tick)

    def on_unmount(self) -> None:
        """Stop the source's thread."""
        self.state.drop()

    def on_failed(self, message: Failed) -> None:
        """End an unattended run with the reason; an attended one shows it."""
        if message.always or self.state.settings.quit_after:
            self.state.fail(message.error)
            self.leave()

    def leave(self) -> None:
        """End the app; everything measured is on disk already."""
        self.state.drop()
        self.exit(self.state.saved)

    async def action_quit(self) -> None:
        """Quit without a question."""
        self.leave()

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
        """Tell the procedure once per step that the recording has ended."""
        step = str(snapshot.status.step)
        if step == self._ended_in:
            return
        self._ended_in = step
        if snapshot.stream.samples:
            self.state.order("end")
        else:
            error = DataError("nothing could be read before the recording ended")
            self.post_message(Failed(error))


def _class_of(step: str) -> type[LiveScreen]:
    module, name = _SCREENS[step].split(".")
    found = getattr(import_module(f"imucal_wizard.tui.screens.{module}"), name)
    return cast("type[LiveScreen]", found)


def screen_for(step: str, state: WizardState) -> LiveScreen:
    """The screen of a step of the procedure."""
    return _class_of(step)(state) if step in _SCREENS else SourceScreen(state)
