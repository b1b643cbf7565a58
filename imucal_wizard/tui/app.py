"""The app: it holds the source, asks it for a snapshot and gives that to the screen in front."""

import time
from typing import TYPE_CHECKING

from imucal_wizard.errors import DataError, ImucalError
from imucal_wizard.tui.bench_keeper import BenchKeeper
from imucal_wizard.tui.hand_keys import HandKeys
from imucal_wizard.tui.plain_app import PlainApp
from imucal_wizard.tui.screens.help_screen import HelpScreen
from imucal_wizard.tui.screens.live_screen import LiveScreen
from imucal_wizard.tui.screens.skip_screen import SkipScreen
from imucal_wizard.tui.settings import FRAMES_PER_SECOND, Settings
from imucal_wizard.tui.sounds import Sounds
from imucal_wizard.tui.source import Hand, Saved, Services, Source, SourceChoice
from imucal_wizard.tui.wizard import conduct

if TYPE_CHECKING:  # numpy waits until after the first paint
    from imucal_wizard.live.snapshot import Snapshot
    from imucal_wizard.procedure.asked import Asked
    from imucal_wizard.solver.result import FitReport

MEASURING = ("settle", "up-down", "poses", "rotations", "field", "more")
"""Steps that cannot go on when the source has ended."""


class WizardApp(PlainApp[Saved]):
    """The wizard in the terminal. Returns where the calibration was saved, or None.

    Args:
        services: what the app is given to work with.
        settings: how it behaves.
        choice: the source chosen already, or None to let the operator choose.
    """

    TITLE = "imucal-wizard"

    def __init__(
        self,
        services: Services,
        settings: Settings | None = None,
        choice: SourceChoice | None = None,
    ) -> None:
        super().__init__()
        self.services = services
        self.settings = settings or Settings()
        self.choice = choice
        self.source: Source | None = None
        self.hand_keys: HandKeys | None = None
        self.snapshot: Snapshot | None = None
        self.report: FitReport | None = None
        self.kept = BenchKeeper(services.benches)
        self.saved: Saved | None = None
        self.failure: ImucalError | None = None
        self.unwritten = ""
        self.sounds = Sounds(self.bell, self.set_timer, time.monotonic)
        self.sounds.muted = self.settings.muted
        self._heard = 0
        self._shown: tuple[object, int] = (None, -1)
        self._ended_in = ""

    def on_mount(self) -> None:
        """Begin to ask for snapshots and to lead through the steps."""
        self.set_interval(1.0 / FRAMES_PER_SECOND, self.tick)
        self.run_worker(conduct(self), name="wizard")

    def on_unmount(self) -> None:
        """Leave no thread behind."""
        self.drop_source()

    def use_source(self, source: Source) -> None:
        """Read from this source from now on."""
        self.drop_source()
        self.source, self.snapshot, self._heard = source, None, 0
        self.kept.forget()
        self._ended_in = ""
        hand = getattr(source, "hand", None)
        if isinstance(hand, Hand):
            self.hand_keys = HandKeys(hand)
        source.start()

    def drop_source(self) -> None:
        """Stop the source; what it has measured is on disk already."""
        source, self.source, self.hand_keys = self.source, None, None
        if source is not None:
            source.stop()
            self.unwritten = source.snapshot().stream.unwritten

    def tick(self) -> None:
        """Take one snapshot and show it where it says something new."""
        if self.source is None or not self.is_running or not self.screen_stack:
            return  # the app is closing: the parts of a screen go before it does
        snapshot = self.source.snapshot()
        screen = self.screen
        self._uncover(snapshot)
        if self._shown == (screen, snapshot.serial) or not screen.is_mounted:
            return
        self.snapshot = snapshot
        self._hear(snapshot)
        if snapshot.finished:
            self._end_early(snapshot)
        if isinstance(screen, LiveScreen):
            self._shown = (screen, snapshot.serial)
            screen.take(snapshot)

    def order(self, name: str, argument: str = "") -> None:
        """Hand a command to the procedure."""
        if self.source is not None:
            self.source.command(name, argument)

    def fail(self, error: ImucalError, *, always: bool = False) -> None:
        """An unattended run cannot go on: leave with the reason; others stay and show it."""
        if always or self.settings.quit_after:
            self.failure = error
            self.action_leave()

    def action_explain(self, about: str = "") -> None:
        """Explain what is in front, or the step, in plain words."""
        below = self._followed()
        if below is not None:
            self.push_screen(HelpScreen(about or below.step, hand=self.hand_keys is not None))

    def action_bench(self) -> None:
        """Open the bench on what was fitted."""
        report = self.report
        if report is not None:
            from imucal_wizard.tui.screens.bench_screen import BenchScreen

            live = self.source is not None and self.source.live
            predict = self.settings.predict and self.kept.benches is None
            screen = BenchScreen(
                lambda: self.kept.of(report), self.kept.sensor, live=live, predict=predict
            )
            self.push_screen(screen, lambda asked: self._ask(asked, screen.sensor))

    def _ask(self, asked: "tuple[Asked, ...] | None", sensor: str) -> None:
        """The bench has been left, perhaps to measure something for it."""
        self.kept.sensor = sensor
        if asked:
            from imucal_wizard.procedure.asked import to_text

            self.kept.again = True
            self.order("measure", to_text(asked))

    def action_mute(self) -> None:
        """Switch the sounds off or on."""
        self.sounds.muted = not self.sounds.muted
        self._shown = (None, -1)

    def action_leave(self) -> None:
        """Leave; everything measured is written down already."""
        self.drop_source()
        self.exit(self.saved)

    @property
    def waiting_words(self) -> str:
        """What to say while the procedure has not said anything yet."""
        return "ONE MOMENT"

    def _uncover(self, snapshot: "Snapshot") -> None:
        """Take away help and questions about a step that is over."""
        below = self._followed()
        over = below is not None and below.step != snapshot.status.step
        if over and isinstance(self.screen, HelpScreen | SkipScreen):
            self.screen.dismiss(None)

    def _followed(self) -> LiveScreen | None:
        """The screen of the step, perhaps below a box."""
        screens = reversed(self.screen_stack)
        return next((one for one in screens if isinstance(one, LiveScreen)), None)

    def _hear(self, snapshot: "Snapshot") -> None:
        new = snapshot.event_count - self._heard
        self._heard = snapshot.event_count
        if new > 0:
            self.sounds.hear(snapshot.events[-new:])

    def _end_early(self, snapshot: "Snapshot") -> None:
        """A recording that ends in the middle of a step is fitted with what it has."""
        step = str(snapshot.status.step)
        if step == self._ended_in:
            return
        self._ended_in = step
        if step in MEASURING:
            self.order("goto", "result")
        elif step == "validate":
            self.order("save")
        elif step == "source" and not snapshot.stream.samples:
            self.fail(DataError("nothing could be read before the recording ended"))
