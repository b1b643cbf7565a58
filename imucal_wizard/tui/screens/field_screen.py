"""The magnetometer's step: circles on the table, and the sphere of directions filling up."""

import math
from typing import ClassVar

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical

from imucal_wizard.live.snapshot import Snapshot
from imucal_wizard.procedure.field_status import FieldStatus
from imucal_wizard.procedure.poses import DIRECTIONS
from imucal_wizard.procedure.state import Status, StepKind
from imucal_wizard.tui.cube import IDENTITY, Matrix, about, product, tilted
from imucal_wizard.tui.field_rows import notice_rows, quality_rows, turned_rows
from imucal_wizard.tui.screens.keyed_screen import KeyedScreen
from imucal_wizard.tui.screens.step_screen import attitude_of
from imucal_wizard.tui.widgets.big_text import BigText
from imucal_wizard.tui.widgets.device_drawing import DeviceDrawing
from imucal_wizard.tui.widgets.key_footer import Keys
from imucal_wizard.tui.widgets.lines import Lines
from imucal_wizard.tui.widgets.pose_list import PoseList
from imucal_wizard.tui.widgets.sphere import Sphere
from imucal_wizard.tui.widgets.stream_line import StreamLine

DISTURBED = "DISTURBED"
"""What is read from two metres while the field is not the place's own."""
_ROUND_SECONDS = 6.0
"""One turn of the drawing that shows what to do."""


class FieldScreen(KeyedScreen):
    """A circle with each face on the table, or free tumbling, until the sphere is covered."""

    step = StepKind.FIELD
    keys: ClassVar[Keys] = (
        ("?", "help"),
        ("u", "undo circle"),
        ("s", "skip step"),
        ("r", "repeat step"),
        ("b", "back"),
        ("m", "sound"),
        ("q", "quit"),
    )
    hand_keys: ClassVar[Keys] = (
        ("space", "lay it down, then turn it round"),
        ("S", "steel passes"),
        ("H", "hand does it"),
        ("←→", "turn about z"),
        ("↑↓", "about y"),
        ("a d", "about x"),
    )

    def body(self) -> ComposeResult:
        """Words to the left, the sphere to the right, the device below the words if it is tall."""
        yield BigText(id="instruction")
        with Horizontal(id="middle"):
            with Vertical(id="field-words"):
                yield Lines(id="turned")
                yield PoseList()
                yield Lines(id="quality")
                with Horizontal(id="field-drawings"):
                    yield DeviceDrawing("now", id="now")
                    yield DeviceDrawing("do this", id="wanted")
            yield Sphere()
        yield Lines(id="field-notice")
        yield StreamLine()

    def take(self, snapshot: Snapshot) -> None:
        """Show a snapshot."""
        super().take(snapshot)
        status, stream = snapshot.status, snapshot.stream
        field = status.field
        if field is None:
            return
        self.query_one(BigText).say(*self.announced(snapshot))
        place = self.query_one("#turned", Lines)
        place.show(turned_rows(field, place.size.width or 28))
        self.query_one(PoseList).tell(field.done, field.missing, field.face, field.face_down)
        place = self.query_one("#quality", Lines)
        place.show(quality_rows(field, place.size.width or 28))
        self.query_one(Sphere).tell(field.counts, field.here)
        place = self.query_one("#field-notice", Lines)
        place.show(
            notice_rows(status, stream.problem, place.size.width or 80, place.size.height or 3)
        )
        self.query_one(StreamLine).tell(
            stream, status.noise, status.still.loosened, self.wizard.sounds.muted
        )
        self._draw(snapshot, field)

    def headline(self, status: Status) -> tuple[str, str]:
        """The instruction, unless what is measured at this moment does not count."""
        if status.field is not None and status.field.disturbed:
            return DISTURBED, "warn"
        return super().headline(status)

    def _draw(self, snapshot: Snapshot, field: FieldStatus) -> None:
        if not self.query_one("#field-drawings").size.height:
            return  # no room for it
        now = attitude_of(snapshot)
        self.query_one("#now", DeviceDrawing).place(now)
        wanted = self.query_one("#wanted", DeviceDrawing)
        wanted.place(circling(field, now or IDENTITY, snapshot.status.elapsed))


def circling(field: FieldStatus, now: Matrix, elapsed: float) -> Matrix | None:
    """The wanted face on the table, the device turning about the vertical."""
    if field.face not in DIRECTIONS:
        return None
    x, y, z = (-float(value) for value in DIRECTIONS[field.face])
    turn = about((0.0, 0.0, 1.0), 2.0 * math.pi * elapsed / _ROUND_SECONDS)
    return product(turn, tilted(now, (x, y, z)))
