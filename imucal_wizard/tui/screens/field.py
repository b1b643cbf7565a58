"""The magnetometer's step: circles on the table, and the sphere of directions filling up."""

import math
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical

from imucal_wizard.guide.kinds import Act, StepKind
from imucal_wizard.guide.operator_view import IDENTITY, Matrix, about, product
from imucal_wizard.guide.state import Status
from imucal_wizard.run.snapshot import Snapshot
from imucal_wizard.tui.panels.field import field_notice_rows, quality_rows, turned_rows
from imucal_wizard.tui.panels.sphere import sphere_rows
from imucal_wizard.tui.panels.step import pose_rows
from imucal_wizard.tui.screens.steps import StepScreen, attitude_of, draw_device, drawings
from imucal_wizard.tui.widgets.big_text import BigText
from imucal_wizard.tui.widgets.lines import Lines

PRESSED_CIRCLE_DEG = 372.0
"""Angle of a circle by the virtual hand: a full turn and a margin."""
_ROUND_SECONDS = 6.0
"""Duration of a full turn in the drawing."""


class FieldScreen(StepScreen):
    """A circle with each face on the table, or free tumbling, until the sphere is covered."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(
            "u", "order('undo')", "undo circle", tooltip="takes back the last circle; nothing else"
        ),
        Binding(
            "space", "hand_do", "lay down, turn round",
            tooltip="brings the virtual device onto the face asked for, or turns it round there",
        ),
    ]  # fmt: skip
    step = StepKind.FIELD

    def body(self) -> ComposeResult:
        """Text on the left, the sphere on the right; in a tall terminal drawings of the device."""
        yield BigText(id="instruction")
        with Horizontal(id="middle"):
            with Vertical(id="field-words"):
                for name in ("turned", "faces", "quality"):
                    yield Lines(id=name)
                with Horizontal(id="field-drawings"):
                    yield from drawings("do this")
            yield Lines(id="sphere")
        yield Lines(id="field-notice")
        yield Lines(id="stream")

    def show(self, snapshot: Snapshot) -> None:
        """Show the step."""
        status, stream, field = snapshot.status, snapshot.stream, snapshot.status.field
        if field is None:
            return
        self.show_stream(snapshot)
        self.lines("turned").draw(lambda width, _: turned_rows(field, width))
        self.lines("faces").draw(
            lambda width, height: pose_rows(
                field.done, field.missing, field.face, field.face_down, width, height
            )
        )
        self.lines("quality").draw(lambda width, _: quality_rows(field, width))
        self.lines("sphere").draw(
            lambda width, height: sphere_rows(field.counts, field.here, width, height),
            (field.here, field.counts.tobytes()),
        )
        self.lines("field-notice").draw(
            lambda width, height: field_notice_rows(status, stream.problem, width, height)
        )
        if self.query_one("#field-drawings").size.height:  # in a tall terminal
            now = attitude_of(snapshot)
            draw_device(self.lines("now"), now, turn=status.turn)
            wanted = circling(status, now or IDENTITY)
            draw_device(self.lines("wanted"), wanted)

    def action_hand_do(self) -> None:
        """Lay the wanted face on the table, or turn the device once round on it."""
        hand, snapshot = self.state.hand, self.state.snapshot
        if hand is None or snapshot is None or snapshot.status.field is None:
            return
        face = snapshot.status.field.face
        if snapshot.status.wanted:
            hand.snap_to(snapshot.status.wanted)
        elif face is not None:
            hand.turn(face[1], PRESSED_CIRCLE_DEG)
        self.refresh_bindings()


def circling(status: Status, now: Matrix) -> Matrix | None:
    """The device on the face asked for; turning about the vertical once it lies there."""
    if status.act is Act.POSE and status.turn is not None:
        return status.turn.of(now)
    if status.act is not Act.CIRCLE:
        return None
    turn = about((0.0, 0.0, 1.0), 2.0 * math.pi * status.elapsed / _ROUND_SECONDS)
    return product(turn, now)
