"""A step that the machine in the domain carries out while the screen follows it."""

from typing import TYPE_CHECKING, ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.events import Key
from textual.widgets import Static

from imucal_wizard.live.snapshot import Snapshot
from imucal_wizard.procedure.plan import standard
from imucal_wizard.procedure.poses import DIRECTIONS
from imucal_wizard.procedure.state import Status, StepKind
from imucal_wizard.procedure.wording import TITLES
from imucal_wizard.tui.cube import IDENTITY, Matrix, Vector, matrix_of, tilted
from imucal_wizard.tui.screens.live_screen import LiveScreen
from imucal_wizard.tui.screens.skip_screen import SkipScreen
from imucal_wizard.tui.text import Line, bar, line, number, wrapped
from imucal_wizard.tui.widgets.big_text import BigText
from imucal_wizard.tui.widgets.device_drawing import DeviceDrawing
from imucal_wizard.tui.widgets.key_footer import KeyFooter, Keys
from imucal_wizard.tui.widgets.lines import Lines
from imucal_wizard.tui.widgets.notice import Notice
from imucal_wizard.tui.widgets.still_bars import StillBars, reason
from imucal_wizard.tui.widgets.stream_line import StreamLine
from imucal_wizard.tui.widgets.traces import Traces

if TYPE_CHECKING:
    from imucal_wizard.tui.hand_keys import HandKeys

HAND_KEYS: Keys = (
    ("←→", "turn about z"),
    ("↑↓", "about y"),
    ("a d", "about x"),
    ("space", "snap"),
    ("T", "tremble"),
    ("H", "hand does it"),
)


class StepScreen(LiveScreen):
    """Instruction, drawing, stillness, progress, traces; ends with the step the machine goes to."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("u", "order('undo')", "undo"),
        Binding("s", "skip", "skip"),
        Binding("r", "order('repeat')", "repeat"),
        Binding("b", "order('back')", "back"),
    ]
    keys: ClassVar[Keys] = (
        ("?", "help"),
        ("u", "undo last"),
        ("s", "skip step"),
        ("r", "repeat step"),
        ("b", "back"),
        ("m", "sound"),
        ("q", "quit"),
    )
    wanted_title: ClassVar[str] = "wanted"

    def body(self) -> ComposeResult:
        """The same places on every step, so that the eye finds them."""
        yield BigText(id="instruction")
        with Horizontal(id="middle"):
            with Vertical(id="words"):
                yield Lines(id="say")
                yield Lines(id="still")
                yield StillBars()
                yield Lines(id="hold")
            with Horizontal(id="drawings"):
                yield DeviceDrawing("now", id="now")
                yield DeviceDrawing(self.wanted_title, id="wanted")
        yield Notice()
        yield from self.below()
        yield Traces()
        yield StreamLine()

    def below(self) -> ComposeResult:
        """What this step alone shows."""
        yield Static(id="nothing")

    def footer(self) -> None:
        """The keys, and those of the virtual hand where there is one."""
        self.query_one(KeyFooter).offer(self.keys, HAND_KEYS if self.wizard.hand_keys else ())

    def action_order(self, name: str, argument: str = "") -> None:
        """Hand a command to the machine."""
        self.wizard.order(name, argument)

    def action_skip(self) -> None:
        """State what skipping costs; skip when that is accepted."""
        step = standard().step(StepKind(self.step))

        def answered(skip: bool | None) -> None:
            if skip:
                self.wizard.order("skip")

        self.wizard.push_screen(SkipScreen(TITLES[step.kind], step.skipped), answered)

    def on_key(self, event: Key) -> None:
        """Ways out that are open now have keys of their own; so has the virtual hand."""
        snapshot = self.wizard.snapshot
        for offer in snapshot.status.offers if snapshot else ():
            if offer.key == (event.character or event.key):
                self.wizard.order(offer.command)
                event.stop()
                return
        hand: HandKeys | None = self.wizard.hand_keys
        if hand is not None and hand.press(event.key, snapshot.status if snapshot else None):
            event.stop()

    def take(self, snapshot: Snapshot) -> None:
        """Show a snapshot."""
        super().take(snapshot)
        status = snapshot.status
        lost = not snapshot.stream.connected and not snapshot.finished
        words = ("NOT CONNECTED", "bad") if lost else self.headline(status)
        self.query_one(BigText).say(*words)
        self._say(status)
        self.query_one("#still", Lines).show([reason(status.still)])
        self.query_one(StillBars).tell(status.still)
        self.query_one("#hold", Lines).show([self.hold_row(status)])
        self._draw(snapshot)
        self.query_one(Notice).tell(snapshot.stream.problem, status.offers, status.last_event)
        stream = snapshot.stream
        units = stream.accelerometer_unit, stream.gyroscope_unit
        self.query_one(Traces).feed(snapshot.traces, units)
        self.query_one(StreamLine).tell(
            stream, status.noise, status.still.loosened, self.wizard.sounds.muted
        )

    def headline(self, status: Status) -> tuple[str, str]:
        """What is read from two metres, and its style: HOLD STILL once it is where it should be."""
        still = status.still
        growing = still.still and not still.spent and still.held < still.needed
        if growing and self.in_place(status):
            return "HOLD STILL", "good"
        return status.instruction or self.wizard.waiting_words, "strong"

    def in_place(self, status: Status) -> bool:  # noqa: ARG002 (each step has its own answer)
        """Whether a hold that is begun here will count."""
        return False

    def progress_words(self, status: Status) -> str:
        """How much of the step is done."""
        done, wanted = status.progress
        return f"{done:.0f} of {wanted:.0f} done"

    def hold_row(self, status: Status) -> Line:
        """How long the device has been still, of how long it should be."""
        still = status.still
        width = self.query_one("#hold", Lines).size.width or 46
        share = still.held / still.needed if still.needed > 0 else 0.0
        words = f" {still.held:.1f} of {number(still.needed, 2)} s"
        return (
            ("HOLD    ", "strong"),
            (bar(share, max(10, width - 9 - len(words))), "good" if still.still else ""),
            (words, ""),
        )

    def wanted_attitude(self, status: Status, now: Matrix) -> tuple[Matrix | None, str]:
        """How the device should lie, and the body axis to draw through it."""
        if status.wanted_up is not None:
            return tilted(now, status.wanted_up), ""
        if status.wanted not in DIRECTIONS:
            return None, ""
        x, y, z = (float(value) for value in DIRECTIONS[status.wanted])
        return tilted(now, (x, y, z)), ""

    def say_rows(self, status: Status, width: int) -> list[Line]:
        """How much is done, what to do, and how to get there."""
        rows = [line(self.progress_words(status), "accent")]
        rows += wrapped(status.detail, width) if status.detail else []
        return rows + (wrapped(status.guidance, width, "strong") if status.guidance else [])

    def _say(self, status: Status) -> None:
        place = self.query_one("#say", Lines)
        rows = self.say_rows(status, place.size.width or 46)
        height = place.size.height or 3
        place.show((rows + [line("")] * height)[:height])

    def _draw(self, snapshot: Snapshot) -> None:
        now = attitude_of(snapshot)
        drawing = self.query_one("#now", DeviceDrawing)
        wanted, axis = self.wanted_attitude(snapshot.status, now or IDENTITY)
        drawing.place(now, axis)
        other = self.query_one("#wanted", DeviceDrawing)
        other.display = wanted is not None
        if wanted is not None:
            other.place(wanted, axis)


def attitude_of(snapshot: Snapshot) -> Matrix | None:
    """The device's attitude, from the stream or at least from which way is up."""
    if snapshot.attitude is not None:
        return matrix_of(snapshot.attitude.tolist())
    if snapshot.status.up is None:
        return None
    up: Vector = snapshot.status.up
    return tilted(IDENTITY, up)
