"""A step that the machine in the domain carries out while the screen follows it."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.widgets import Static

from imucal_wizard.live.snapshot import Snapshot
from imucal_wizard.procedure.poses import NAMED
from imucal_wizard.procedure.state import Status
from imucal_wizard.tui.cube import IDENTITY, Matrix, Vector, matrix_of, tilted
from imucal_wizard.tui.screens.keyed_screen import KeyedScreen
from imucal_wizard.tui.text import Line, bar, line, number, wrapped
from imucal_wizard.tui.widgets.big_text import BigText
from imucal_wizard.tui.widgets.device_drawing import DeviceDrawing
from imucal_wizard.tui.widgets.lines import Lines
from imucal_wizard.tui.widgets.notice import Notice
from imucal_wizard.tui.widgets.still_bars import StillBars, reason
from imucal_wizard.tui.widgets.stream_line import StreamLine
from imucal_wizard.tui.widgets.traces import Traces


class StepScreen(KeyedScreen):
    """Instruction, drawing, stillness, progress, traces; ends with the step the machine goes to."""

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

    def take(self, snapshot: Snapshot) -> None:
        """Show a snapshot."""
        super().take(snapshot)
        status = snapshot.status
        self.query_one(BigText).say(*self.announced(snapshot))
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
        return super().headline(status)

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
        if status.wanted not in NAMED:
            return None, ""
        x, y, z = (float(value) for value in NAMED[status.wanted])
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
